"""Directions of translation to try: along axes, from contacts, sampled, or given."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.contacts import Contact, find_contacts
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.support.arrays import Array, Numbers

#: What a user may say: "axes", "contacts", a number of samples, text such as "+z,-x", vectors (k, 3), or None for axes.
Directions = str | int | ArrayLike | None

#: No more directions than this are sampled or taken from contacts: each costs a pass over all pairs.
MOST = 1_000

#: Directions closer than this angle (radians) are one.
SAME = 1e-3


def directions_for(
    assembly: Assembly, spec: Directions = None, *, from_contacts: Callable[[], Array] | None = None
) -> Array:
    """Unit vectors, float64 (k, 3), in the order in which they are to be tried.

    Args:
        spec: None or "axes" (`Assembly.axes`, the most upward first); "contacts" (`contact_directions`); a number k
            (that many, spread evenly over the sphere); "+z" or "-x"; several of these in one text, with commas
            between; or vectors of shape (k, 3) or (3,).
        from_contacts: gives `contact_directions` where they are known; None: contacts are looked for.

    Raises:
        InputError: anything else, a zero or infinite vector, or no direction at all.
    """
    if from_contacts is None:
        from_contacts = partial(_contact_directions_of, assembly)
    if spec is None:
        return assembly.axes
    if isinstance(spec, str):
        return _distinct(np.concatenate([_word(assembly, word.strip(), from_contacts) for word in spec.split(",")]))
    if isinstance(spec, (int, np.integer)) and not isinstance(spec, bool):
        return sampled_directions(int(spec))
    try:
        vectors = np.atleast_2d(np.asarray(spec, dtype=np.float64))
    except (TypeError, ValueError):
        vectors = np.zeros((0, 0))
    if vectors.ndim != 2 or vectors.shape[1:] != (3,) or not len(vectors):
        raise InputError(f"Expected directions as vectors of shape (k, 3), or as {_WORDS}; got {spec!r}.")
    lengths = np.linalg.norm(vectors, axis=1)
    if not np.isfinite(lengths).all() or not lengths.all():
        raise InputError(f"Expected directions as non-zero vectors of shape (k, 3); got {vectors.tolist()}.")
    return np.asarray(vectors / lengths[:, None])


_WORDS = '"axes", "contacts", a number, or axes such as "+z,-x"'


def _word(assembly: Assembly, word: str, from_contacts: Callable[[], Array]) -> Array:
    if word == "axes":
        return assembly.axes
    if word == "contacts":
        return from_contacts()
    if word.isdecimal():
        return sampled_directions(int(word))
    if len(word) == 2 and word[0] in "+-" and word[1] in "xyz":
        return np.eye(3)[["xyz".index(word[1])]] * (1.0 if word[0] == "+" else -1.0)
    raise InputError(f"Expected directions as {_WORDS}; got {word!r}.")


def sampled_directions(count: int) -> Array:
    """`count` unit vectors, float64 (count, 3), spread evenly over the sphere, from the top down.

    A Fibonacci lattice: equal areas by height, each turned from the last by the golden angle.
    """
    if not 1 <= count <= MOST:
        raise InputError(f"Expected a number of directions from 1 to {MOST:,}; got {count}.")
    number = np.arange(count)
    z = 1 - (2 * number + 1) / count
    turn = number * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


def contact_directions(assembly: Assembly, contacts: Iterable[Contact], most: int = 200) -> Array:
    """Directions in which contacts let some part slide or lift off, float64 (k, 3), k <= `most`.

    A contact with outward unit normal n lets its part move along d when d . n <= 0, so all contacts of a part make a
    cone. For each part these are taken, as far as the cone allows them: the rays in which two contact planes meet
    (+- n_i x n_j, among them the cone's extreme rays), straight away from each contact (-n_i), and away from all
    of them (minus their mean). A direction and its opposite are one contact seen from its two sides. The same ones
    (to `SAME`) are taken once, and those that serve most parts come first, then the most upward.

    A part that is enclosed has no cone; so that it has directions once others have left, -n_i and +- n_i x n_j of
    pairs of its contacts are kept for parts whose cone is empty.
    """
    found: list[Array] = []
    for normals in _contact_normals(assembly, contacts):
        if not len(normals):
            continue
        i, j = np.triu_indices(len(normals), 1)
        rays = np.cross(normals[i], normals[j])
        rays = rays[np.linalg.norm(rays, axis=1) > 10 * SAME]
        mean = normals.mean(axis=0)
        candidates = [rays, -rays, -normals]
        if np.linalg.norm(mean) > 10 * SAME:
            candidates.append(-mean[None])
        rays = np.concatenate(candidates)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        allowed = (rays @ normals.T <= SAME).all(axis=1)
        found.append(_distinct(rays[allowed] if allowed.any() else rays))
    if not found:
        return assembly.axes
    rays = np.concatenate(found)
    distinct, counts = _counted(rays)
    order = np.lexsort((-distinct[:, 0], -distinct[:, 1], -distinct[:, 2].round(6), -counts))
    return distinct[order[:most]]


def _contact_directions_of(assembly: Assembly) -> Array:
    return contact_directions(assembly, find_contacts(assembly, BodySurfaces(assembly.bodies)))


def _contact_normals(assembly: Assembly, contacts: Iterable[Contact]) -> list[Array]:
    """Per part, its distinct outward contact normals, float64 (k, 3)."""
    normals: list[list[Array]] = [[] for _ in assembly.parts]
    for contact in contacts:
        normals[assembly.owners[contact.a]].append(contact.normal)
        if contact.b >= 0:
            normals[assembly.owners[contact.b]].append(-contact.normal)
    return [_distinct(np.array(own).reshape(-1, 3)) for own in normals]


def _distinct(vectors: Array) -> Array:
    """Unit vectors (k, 3) with those left out that are the same, to `SAME`, as an earlier one."""
    return _counted(vectors)[0]


def _counted(vectors: Array) -> tuple[Array, Numbers]:
    """Distinct unit vectors, in order of first appearance, and how often each comes."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    count = len(vectors)
    if not count:
        return vectors.reshape(0, 3), np.zeros(0, dtype=np.int64)
    near = cKDTree(vectors).query_pairs(SAME, output_type="ndarray")
    links = coo_array((np.ones(len(near), dtype=bool), near.T.astype(np.int32)), shape=(count, count))
    labels = connected_components(links, directed=False)[1]
    _, first, counts = np.unique(labels, return_index=True, return_counts=True)
    order = np.argsort(first)
    return vectors[first[order]], counts[order]
