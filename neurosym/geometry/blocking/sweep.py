"""Translation to infinity, exactly: what a body hits on its way along a direction, for all pairs of bodies at once.

Moving a along d hits b exactly when some line along d meets a before it meets b. A hit counts when the overlap is
deeper than the touching tolerance along d AND wider than it across: parts that merely touch do not block one another,
and parts that overlap a little at rest, where they mate, are thought apart first. From the cheapest test to the last
resort:

* bounds across the direction;
* two boxes with an axis along the direction: intervals;
* convex hulls: their shadows clipped against one another, then a facet that separates them;
* the shadows of triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.mating_overlaps import MatingOverlaps, mating_overlaps
from neurosym.geometry.blocking.shadows import Shadows, shadows_hit
from neurosym.geometry.contact.surfaces import GRID, BodySurfaces, facet_distances
from neurosym.geometry.mesh.broad_phase import overlapping_pairs, spans
from neurosym.geometry.mesh.triangles import plane_axes
from neurosym.support.arrays import Array, Numbers, Truths


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
        return mating_overlaps(self.assembly, self.surfaces.hulls)

    def along(self, direction: Array) -> Hits:
        """All pairs of bodies of different parts."""
        return _Sweep(self, direction).hits()

    def triangles_hit(self, pairs: Numbers, direction: Array) -> Truths:
        """The same for ordered pairs of bodies, int64 (k, 2), by triangles alone: bool (k,)."""
        frame = np.stack([*plane_axes(direction), direction], axis=1)
        key = tuple(direction.tolist())
        if key not in self._shadows:
            self._shadows[key] = Shadows.of(self.surfaces.exact, frame)
        return shadows_hit(self._shadows[key], pairs, self.mating.apart(pairs) @ frame, self.assembly.touch)


class _Sweep:
    """All bodies seen along one direction."""

    def __init__(self, sweeps: Sweeps, direction: Array) -> None:
        self.assembly, self.surfaces, self.mating = sweeps.assembly, sweeps.surfaces, sweeps.mating
        self.frame = sweep_frame(self.assembly, direction)
        hulls = self.surfaces.hulls
        self.points = hulls.vertices @ self.frame
        starts = hulls.first_vertex[:-1]
        self.low = np.minimum.reduceat(self.points, starts)
        self.high = np.maximum.reduceat(self.points, starts)

    def hits(self) -> Hits:
        touch, low, high = self.assembly.touch, self.low, self.high
        pairs = overlapping_pairs(low[:, :2] + touch / 2, high[:, :2] - touch / 2, self.assembly.owners)
        apart = self.mating.apart(pairs) @ self.frame
        # Both ways round: the first of a pair is what moves.
        pairs, apart = np.concatenate([pairs, pairs[:, ::-1]]), np.concatenate([apart, -apart])
        a, b = pairs.T
        ahead = high[b, 2] + apart[:, 2] > low[a, 2] + touch
        for k in range(2):
            ahead &= (low[a, k] + touch < high[b, k] + apart[:, k]) & (high[a, k] - touch > low[b, k] + apart[:, k])
        pairs, apart = pairs[ahead], apart[ahead]
        hit = _aligned(self.assembly, self.frame)[pairs].all(axis=1)
        hit[~hit] = self._by_hulls(pairs[~hit], apart[~hit])
        return Hits(pairs[hit], len(pairs))

    def _by_hulls(self, pairs: Numbers, apart: Array) -> Truths:
        """Whether the first of each pair hits the second: convex hulls decide what they can, triangles the rest."""
        hit = np.zeros(len(pairs), dtype=bool)
        if not len(pairs):
            return hit
        touch = self.assembly.touch
        hulls = self.surfaces.hulls
        bodies = np.unique(pairs)
        number = np.zeros(len(self.assembly.bodies), dtype=np.int64)
        number[bodies] = np.arange(len(bodies))
        run, place = spans(np.diff(hulls.first_vertex)[bodies])
        flat = self.points[hulls.first_vertex[bodies[run]] + place, :2]
        shadows = shapely.convex_hull(shapely.multipoints(flat, indices=run))
        others = _moved(shadows[number[pairs[:, 1]]], apart[:, :2])
        # On a grid: with floating coordinates GEOS may take neighbours along one edge for one and the same.
        both = shapely.intersection(shadows[number[pairs[:, 0]]], others, grid_size=GRID * touch)
        open_ = np.flatnonzero(shapely.area(both) > touch * np.maximum(shapely.length(both) / 2, touch))
        middle = shapely.get_coordinates(shapely.centroid(both[open_]))
        seen = Shadows.of(hulls, self.frame)
        depth = seen.top(pairs[open_, 1], middle - apart[open_, :2]) + apart[open_, 2]
        depth -= seen.bottom(pairs[open_, 0], middle)
        deep = depth > touch
        convex = self.assembly.bodies.is_convex[pairs[open_]].all(axis=1)
        hit[open_[deep & convex]] = True
        # A facet between the two of which a moves away.
        shallow = open_[~deep]
        between = np.zeros(len(pairs), dtype=bool)
        between[shallow[self._separated(pairs[shallow], apart[shallow])]] = True
        left = ~hit[open_] & ~between[open_]
        asked = open_[left]
        if len(asked):
            exact = self.surfaces.exact
            shadows = seen if exact is hulls else Shadows.of(exact, self.frame)
            hit[asked] = shadows_hit(shadows, pairs[asked], apart[asked], touch, middle[left])
        return hit

    def _separated(self, pairs: Numbers, apart: Array) -> Truths:
        """Whether a facet of either hull has the other on its outer side, and the first of the pair moves off it."""
        hulls = self.surfaces.hulls
        along = hulls.normals @ self.frame[:, 2]
        world = apart @ self.frame.T
        found = np.zeros(len(pairs), dtype=bool)
        for ways, sign in ((pairs, 1.0), (pairs[:, ::-1], -1.0)):
            for pair, facet, distance in facet_distances(hulls, ways):
                shift = sign * np.einsum("nd,nd->n", hulls.normals[facet], world[pair])
                off = (distance + shift >= -self.assembly.touch) & (sign * along[facet] <= 0)
                found[pair[off]] = True
        return found


def _moved(shapes: NDArray[np.object_], offsets: Array) -> NDArray[np.object_]:
    """Shapes in the plane moved by offsets (k, 2)."""
    moving = np.flatnonzero(offsets.any(axis=1))
    if not len(moving):
        return shapes
    found = shapes.copy()
    points, shape = shapely.get_coordinates(shapes[moving], return_index=True)
    found[moving] = shapely.set_coordinates(shapes[moving], points + offsets[moving][shape])
    return found


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
