"""Translation to infinity, exactly: what a body hits on its way along a direction, for all pairs of bodies at once.

Moving a along d hits b exactly when some line along d meets a before it meets b. A hit counts when the overlap is
deeper than the touching tolerance along d AND wider than it across: parts that merely touch do not block one another,
and parts that overlap a little at rest, where they mate, are thought apart first. From the cheapest test to the last
resort:

* bounds across the direction;
* two boxes with an axis along the direction: intervals;
* the shadows of triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.mating_overlaps import MatingOverlaps, mating_overlaps
from neurosym.geometry.blocking.shadows import Shadows
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.mesh.broad_phase import overlapping_pairs
from neurosym.geometry.mesh.triangles import plane_axes
from neurosym.support.arrays import Array, Numbers, Truths

#: Directions whose shadows are kept for questions about single pairs.
_KEPT = 8


@dataclass(frozen=True, eq=False)
class Hits:
    """What hits what along one direction.

    Attributes:
        pairs: int64 (k, 2): ordered pairs of bodies; the first, moved along the direction, hits the second.
        queries: how many ordered pairs the filter by bounds has left to the closer tests.
    """

    pairs: Numbers
    queries: int

    def reversed(self) -> Hits:
        """The opposite direction, for nothing: what is hit one way hits the other way."""
        return Hits(self.pairs[:, ::-1], self.queries)


class Sweeps:
    """The bodies of an assembly moved along directions, given as unit vectors (3,)."""

    def __init__(self, assembly: Assembly, surfaces: BodySurfaces) -> None:
        self.assembly, self.surfaces = assembly, surfaces
        self._shadows: dict[tuple[float, ...], Shadows] = {}

    @cached_property
    def mating(self) -> MatingOverlaps:
        """Pairs that overlap a little where they mate."""
        return mating_overlaps(self.assembly, self.surfaces)

    def along(self, direction: Array) -> Hits:
        """All pairs of bodies of different parts."""
        touch, frame = self.assembly.touch, sweep_frame(self.assembly, direction)
        points, first = self.surfaces.vertices
        points = points @ frame
        low, high = np.minimum.reduceat(points, first[:-1]), np.maximum.reduceat(points, first[:-1])
        pairs = overlapping_pairs(low[:, :2] + touch / 2, high[:, :2] - touch / 2, self.assembly.owners)
        # Both ways round: the first of a pair is what moves.
        pairs = np.concatenate([pairs, pairs[:, ::-1]])
        apart = self.mating.apart(pairs) @ frame
        a, b = pairs.T
        ahead = high[b, 2] + apart[:, 2] > low[a, 2] + touch
        for k in range(2):
            ahead &= (low[a, k] + touch < high[b, k] + apart[:, k]) & (high[a, k] - touch > low[b, k] + apart[:, k])
        pairs, apart = pairs[ahead], apart[ahead]
        hit = _aligned(self.assembly, frame)[pairs].all(axis=1)
        if not hit.all():
            hit[~hit] = Shadows(self.surfaces.exact, frame, touch).hit(pairs[~hit], apart[~hit])
        return Hits(pairs[hit], len(pairs))

    def triangles_hit(self, pairs: Numbers, direction: Array) -> Truths:
        """The same for ordered pairs of bodies, int64 (k, 2), by triangles alone: bool (k,)."""
        if not len(pairs):
            return np.zeros(0, dtype=bool)
        frame = np.stack([*plane_axes(direction), direction], axis=1)
        key = tuple(direction.tolist())
        if key not in self._shadows:
            if len(self._shadows) == _KEPT:
                self._shadows.clear()
            self._shadows[key] = Shadows(self.surfaces.exact, frame, self.assembly.touch)
        return self._shadows[key].hit(pairs, self.mating.apart(pairs) @ frame)


def sweep_frame(assembly: Assembly, direction: Array) -> Array:
    """A rotation (3, 3) with the direction last; the others along the axes of most boxes that have one along it."""
    axes = np.swapaxes(assembly.X_WB[assembly.bodies.is_box, :3, :3], 1, 2).reshape(-1, 3)
    along = axes @ direction
    turned = np.abs(along) >= np.sqrt(1 - assembly.tolerances.parallel**2)
    boxes, place = np.divmod(np.flatnonzero(turned), 3)
    if not len(boxes):
        u, v = plane_axes(direction)
        return np.stack([u, v, direction], axis=1)
    sides = axes[3 * boxes + (place + 1) % 3]
    rounded = np.abs(np.round(sides, 6))
    _, first, counts = np.unique(rounded, axis=0, return_index=True, return_counts=True)
    u = sides[first[counts.argmax()]]
    u = u - (u @ direction) * direction
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(direction, u), direction], axis=1)


def _aligned(assembly: Assembly, frame: Array) -> Truths:
    """Which bodies are boxes along the axes of a frame, bool (n_bodies,)."""
    sines = np.sort(np.abs(np.swapaxes(assembly.X_WB[:, :3, :3], 1, 2) @ frame), axis=2)[:, :, :2]
    found: Truths = assembly.bodies.is_box & (np.linalg.norm(sines, axis=2).max(axis=1) <= assembly.tolerances.parallel)
    return found
