"""Contacts and blocking kept on disk, by shapes, poses, tolerances and this code, so that a model is asked once.

Replays that share no table with what they check do not come here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.sweep import Hits
from neurosym.geometry.contact.contacts import Contact
from neurosym.support import disk_cache
from neurosym.support.arrays import Array

#: Facets from which on a table is worth a file.
WORTH = 2_000


def place_of(assembly: Assembly, what: str, directions: Array | None = None) -> Path | None:
    """Where a table of an assembly is kept; None: it is too small for that."""
    shapes = [body.shape for body in assembly.bodies]
    if sum(len(shape.faces) for shape in shapes) < WORTH or not disk_cache.keeps_geometry():
        return None
    data = repr((assembly.tolerances, assembly.table, assembly.owners.tolist())).encode()
    arrays = [assembly.X_WB, *(array for shape in shapes for array in (shape.vertices, shape.faces))]
    arrays += [] if directions is None else [directions]
    return disk_cache.place(what, data, *(repr(a.shape).encode() + np.ascontiguousarray(a).tobytes() for a in arrays))


def contacts(assembly: Assembly, find: Callable[[], tuple[Contact, ...]]) -> tuple[Contact, ...]:
    """An assembly's contacts, from disk if they are there, else found and kept."""
    place = place_of(assembly, "contacts")
    known = None if place is None else disk_cache.load_all(place)
    if known is not None:
        rows = zip(*(known[k].tolist() for k in ("a", "b", "area", "gap")))
        points = np.split(known["points"], np.cumsum(known["counts"])[:-1])
        return tuple(Contact(a, b, p, n, area, gap) for (a, b, area, gap), p, n in zip(rows, points, known["normal"]))
    found = find()
    if place is not None and found:
        table = {k: np.array([getattr(c, k) for c in found]) for k in ("a", "b", "area", "gap", "normal")}
        table |= {"points": np.concatenate([c.points for c in found])}
        disk_cache.store_all(place, {**table, "counts": np.array([len(c.points) for c in found])})
    return found


def blocking(assembly: Assembly, directions: Array, find: Callable[[], Sequence[Hits]]) -> Sequence[Hits]:
    """What hits what along each of the directions, float64 (k, 3), likewise."""
    place = place_of(assembly, "blocking", directions)
    known = None if place is None else disk_cache.load_all(place)
    if known is not None and len(known["counts"]) == len(directions):
        pairs = np.split(known["pairs"], np.cumsum(known["counts"])[:-1])
        return [Hits(own, queries) for own, queries in zip(pairs, known["queries"].tolist())]
    found = find()
    if place is not None and len(found):
        counts, queries = np.array([len(hits.pairs) for hits in found]), np.array([hits.queries for hits in found])
        both = np.concatenate([hits.pairs for hits in found])
        disk_cache.store_all(place, {"counts": counts, "queries": queries, "pairs": both})
    return found
