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
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from neurosym.geometry.assembly import Box
from neurosym.geometry.blocking.rest_overlaps import RestOverlaps
from neurosym.geometry.blocking.shadows import Shadows, shadows_hit
from neurosym.geometry.contact import collision
from neurosym.geometry.contact.contacts import plane_axes
from neurosym.geometry.contact.surfaces import GRID, Surfaces, facet_distances
from neurosym.geometry.mesh.broad_phase import Pairs, overlapping_pairs, spans

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
Truths = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Sweep:
    """What hits what along one direction.

    Attributes:
        hits: int64 (k, 2): ordered pairs of bodies; the first, moved along the direction, hits the second.
        queries: how many ordered pairs the filter by bounds has left to the closer tests.
    """

    hits: Pairs
    queries: int

    @staticmethod
    def along(assembly: Assembly, direction: Array) -> Sweep:
        """All pairs of bodies of different parts, along a unit vector (3,)."""
        return _Sweeper(assembly, direction).sweep()

    def reversed(self) -> Sweep:
        """The opposite direction, for nothing: what is hit one way hits the other way."""
        return Sweep(self.hits[:, ::-1], self.queries)


class _Sweeper:
    """All bodies seen along one direction."""

    def __init__(self, assembly: Assembly, direction: Array) -> None:
        self.assembly = assembly
        self.frame = sweep_frame(assembly, direction)
        hulls = Surfaces.of_hulls(assembly)
        self.points = hulls.vertices @ self.frame
        starts = hulls.first_vertex[:-1]
        self.low = np.minimum.reduceat(self.points, starts)
        self.high = np.maximum.reduceat(self.points, starts)

    def sweep(self) -> Sweep:
        touch, low, high = self.assembly.touch, self.low, self.high
        pairs = overlapping_pairs(low[:, :2] + touch / 2, high[:, :2] - touch / 2, self.assembly.owners)
        apart = RestOverlaps.of(self.assembly).apart(pairs) @ self.frame
        # Both ways round: the first of a pair is what moves.
        pairs, apart = np.concatenate([pairs, pairs[:, ::-1]]), np.concatenate([apart, -apart])
        a, b = pairs.T
        ahead = high[b, 2] + apart[:, 2] > low[a, 2] + touch
        for k in range(2):
            ahead &= (low[a, k] + touch < high[b, k] + apart[:, k]) & (high[a, k] - touch > low[b, k] + apart[:, k])
        pairs, apart = pairs[ahead], apart[ahead]
        hit = _aligned(self.assembly, self.frame)[pairs].all(axis=1)
        hit[~hit] = self._by_hulls(pairs[~hit], apart[~hit])
        return Sweep(pairs[hit], len(pairs))

    def _by_hulls(self, pairs: Pairs, apart: Array) -> Truths:
        """Whether the first of each pair hits the second: convex hulls decide what they can, triangles the rest."""
        hit = np.zeros(len(pairs), dtype=bool)
        if not len(pairs):
            return hit
        touch = self.assembly.touch
        hulls = Surfaces.of_hulls(self.assembly)
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
        convex = self.assembly.is_convex[pairs[open_]].all(axis=1)
        hit[open_[deep & convex]] = True
        # A facet between the two of which a moves away.
        shallow = open_[~deep]
        between = np.zeros(len(pairs), dtype=bool)
        between[shallow[self._separated(pairs[shallow], apart[shallow])]] = True
        left = ~hit[open_] & ~between[open_]
        asked = open_[left]
        if len(asked):
            surfaces = seen if self.assembly.is_convex.all() else Shadows.of(Surfaces.of(self.assembly), self.frame)
            hit[asked] = shadows_hit(surfaces, pairs[asked], apart[asked], touch, middle[left])
        return hit

    def _separated(self, pairs: Pairs, apart: Array) -> Truths:
        """Whether a facet of either hull has the other on its outer side, and the first of the pair moves off it."""
        hulls = Surfaces.of_hulls(self.assembly)
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
    axes = np.swapaxes(assembly.X_WB[assembly.is_box, :3, :3], 1, 2).reshape(-1, 3)
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
    found: Truths = assembly.is_box & (np.linalg.norm(sines, axis=2).max(axis=1) <= assembly.tolerances.parallel)
    return found


def triangles_block(assembly: Assembly, a: int, b: int, direction: Array) -> bool:
    """Whether body `a`, moved along a unit vector (3,) without end, hits body `b`, by triangles alone."""
    return bool(triangles_hit(assembly, np.array([[a, b]]), direction)[0])


def triangles_hit(assembly: Assembly, pairs: Pairs, direction: Array) -> Truths:
    """The same for ordered pairs of bodies, int64 (k, 2): bool (k,)."""
    frame = np.stack([*plane_axes(direction), direction], axis=1)
    shadows = assembly.remember(
        f"shadows {direction.tobytes().hex()}", lambda: Shadows.of(Surfaces.of(assembly), frame)
    )
    return shadows_hit(shadows, pairs, _apart(assembly, pairs) @ frame, assembly.touch)


def _apart(assembly: Assembly, pairs: Pairs) -> Array:
    """By how much the second of each ordered pair is thought moved off the first, float64 (k, 3)."""
    apart = RestOverlaps.of(assembly).apart(np.sort(pairs, axis=1))
    apart[pairs[:, 0] > pairs[:, 1]] *= -1
    return apart


def drops_onto(assembly: Assembly, body: int, other: int, X_WO: Array) -> bool:
    """Whether an upright box, falling, would land on box `other` at pose X_WO (4, 4)."""
    shape, target = assembly.bodies[body].shape, assembly.bodies[other].shape
    assert isinstance(shape, Box)
    assert isinstance(target, Box)
    pose = assembly.X_WB[body].copy()
    size = shape.size - 2 * assembly.touch
    axis = int(np.argmax(np.abs(pose[2, :3])))
    drop = float(pose[2, 3] - X_WO[2, 3]) + assembly.smallest_extent
    if drop <= 0:
        return False
    size[axis] += drop
    pose[2, 3] -= drop / 2
    return collision.collide(collision.box_object(size, pose), collision.box_object(target.size, X_WO))


def exits_along(assembly: Assembly, part: int, direction: Array, others: list[int]) -> list[int]:
    """Which of `others` (numbers of parts) a part hits on its way out along a direction, asked afresh.

    Boxes are moved in steps and put to FCL one by one, shrunk by the touching tolerance: a second way to the
    answer that shares nothing with swept bounds. For other shapes triangles answer alone, without hulls.
    """
    bodies = np.flatnonzero(assembly.owners == part)
    targets = np.flatnonzero(np.isin(assembly.owners, others))
    # What is behind, or beside the way, needs no closer look.
    centre, reach = _spheres(assembly)
    way = centre[targets][None] - centre[bodies][:, None]
    forward = way @ direction
    near = reach[bodies][:, None] + reach[targets][None]
    ahead = (forward > -near) & (np.linalg.norm(way - forward[..., None] * direction, axis=2) < near)
    i, j = np.nonzero(ahead)
    pairs = np.stack([bodies[i], targets[j]], axis=1)
    boxes = assembly.is_box[pairs].all(axis=1)
    hits = {int(assembly.owners[b]) for a, b in pairs[~boxes][triangles_hit(assembly, pairs[~boxes], direction)]}
    for (a, b), apart in zip(pairs[boxes], _apart(assembly, pairs[boxes])):
        owner = int(assembly.owners[b])
        if owner not in hits and _meets(assembly, int(a), int(b), direction, apart):
            hits.add(owner)
    return sorted(hits)


def _spheres(assembly: Assembly) -> tuple[Array, Array]:
    """A sphere about each body: centres (n_bodies, 3) and radii (n_bodies,)."""
    low, high = assembly.body_bounds[:, 0], assembly.body_bounds[:, 1]
    return (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2


def _meets(assembly: Assembly, a: int, b: int, direction: Array, apart: Array) -> bool:
    """Whether box `a`, moved in steps along a direction, meets box `b`, thought moved by `apart` (3,)."""
    shape_a, shape_b = assembly.bodies[a].shape, assembly.bodies[b].shape
    assert isinstance(shape_a, Box)
    assert isinstance(shape_b, Box)
    first, second = assembly.body_vertices(a) @ direction, assembly.body_vertices(b) @ direction
    distance = float(second.max() - first.min())
    if distance <= assembly.touch:
        return False
    other = assembly.X_WB[b].copy()
    other[:3, 3] += apart
    target = collision.box_object(shape_b.size, other)
    pose = assembly.X_WB[a].copy()
    # Half the thinner of the two: no step can jump over the other box. No earlier than where the other begins.
    step = 0.5 * float(min(shape_a.size.min(), shape_b.size.min()))
    begin = max(0.0, float(second.min() - first.max()))
    for travelled in np.arange(begin, distance + step, step):
        pose[:3, 3] = assembly.X_WB[a][:3, 3] + travelled * direction
        if collision.collide(collision.box_object(shape_a.size - 2 * assembly.touch, pose), target):
            return True
    return False
