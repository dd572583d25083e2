"""Moving along a line to infinity, by the shadows of triangles: the exact answer for any closed surfaces.

Seen along the direction, the lower faces of what moves and the upper faces of what stands are patches in a plane.
Where two of them overlap, the depth of the overlap along the direction is a linear function, largest at a corner.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from neurosym.geometry.contact.surfaces import GRID, Surfaces
from neurosym.geometry.mesh.broad_phase import spans
from neurosym.support.arrays import Array, Numbers, Truths

#: So many pairs of triangles are held at a time, so many patches clipped, and so many triangles put to a tree.
_AT_A_TIME = 400_000
_PATCHES_AT_A_TIME = 20_000
_QUERIES_AT_A_TIME = 1_000


@dataclass(frozen=True, eq=False)
class Shadows:
    """The triangles of surfaces in a frame whose last axis is a direction; those seen edge-on are left out.

    Attributes:
        flat: float64 (m, 3 corners, 2).
        low, high: float64 (m, 3): bounds in the frame.
        planes: float64 (m, 3): height = p0 u + p1 v + p2.
        lower, upper: int64: numbers of the triangles that face against the direction, and along it, body by body.
        first_lower, first_upper: int64 (n_bodies + 1,): where each body's begin.
    """

    flat: Array
    low: Array
    high: Array
    planes: Array
    lower: Numbers
    first_lower: Numbers
    upper: Numbers
    first_upper: Numbers

    @staticmethod
    def of(surfaces: Surfaces, frame: Array) -> Shadows:
        """Shadows in a frame, float64 (3, 3), whose columns are two axes across the direction and the direction."""
        corners = surfaces.triangles @ frame
        normals = surfaces.normals @ frame
        flat = corners[..., :2]
        e1, e2 = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
        area = np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0])
        seen = area > 1e-6 * np.ptp(corners, axis=1).max(axis=1) ** 2
        slope = -normals[:, :2] / np.where(seen, normals[:, 2], 1.0)[:, None]
        middles = corners.mean(axis=1)
        offset = middles[:, 2] - np.einsum("md,md->m", slope, middles[:, :2])
        bodies = np.arange(len(surfaces.first))
        lower = np.flatnonzero(seen & (normals[:, 2] < 0))
        upper = np.flatnonzero(seen & (normals[:, 2] > 0))
        return Shadows(
            flat,
            corners.min(axis=1),
            corners.max(axis=1),
            np.concatenate([slope, offset[:, None]], axis=1),
            lower,
            np.searchsorted(surfaces.body[lower], bodies),
            upper,
            np.searchsorted(surfaces.body[upper], bodies),
        )

    def top(self, bodies: Numbers, points: Array) -> Array:
        """float64 (k,): height of each convex body's upper side over a point of the plane, float64 (k, 2)."""
        return self._extreme(np.minimum, self.upper, self.first_upper, bodies, points)

    def bottom(self, bodies: Numbers, points: Array) -> Array:
        """The same for the lower side."""
        return self._extreme(np.maximum, self.lower, self.first_lower, bodies, points)

    def _extreme(self, pick: np.ufunc, numbers: Numbers, first: Numbers, bodies: Numbers, points: Array) -> Array:
        counts = first[bodies + 1] - first[bodies]
        run, place = spans(counts)
        planes = self.planes[numbers[first[bodies[run]] + place]]
        heights = np.einsum("nd,nd->n", planes[:, :2], points[run]) + planes[:, 2]
        found: Array = pick.reduceat(heights, np.cumsum(counts) - counts) if len(heights) else np.zeros(0)
        return found


def shadows_hit(shadows: Shadows, pairs: Numbers, apart: Array, touch: float, tries: Array | None = None) -> Truths:
    """Whether body a, moved along the direction without end, hits body b, bool (k,).

    Args:
        pairs: int64 (k, 2): bodies a and b.
        apart: float64 (k, 3), in the frame: b is thought moved by as much.
        touch: a hit is an overlap deeper than this along the direction and wider across.
        tries: float64 (k, 2): points in the plane where a hit is likely; looked at first.
    """
    hit = np.zeros(len(pairs), dtype=bool)
    if tries is not None:
        run, i, j = _stacked_over(shadows, pairs, apart, tries)
        hit[run] = _patches(shadows, i, j, apart[run], touch)[0]
    thin: list[tuple[Numbers, Any]] = []
    for run, i, j in _meeting(shadows, pairs, np.flatnonzero(~hit), apart, touch, hit):
        wide, deep, patches = _patches(shadows, i, j, apart[run], touch)
        hit[run[wide]] = True
        narrow = np.flatnonzero(deep & ~wide)
        thin.append((run[narrow], patches[narrow]))
    if thin:
        # Slivers side by side may be wide together: surfaces cut into narrow facets.
        run, patches = (np.concatenate(x) for x in zip(*thin))
        patches, run = patches[~hit[run]], run[~hit[run]]
        area = np.bincount(run, shapely.area(patches), len(pairs))
        for k in np.flatnonzero(area > touch**2):
            hit[k] = not shapely.union_all(patches[run == k]).buffer(-touch / 2).is_empty
    return hit


def _patches(shadows: Shadows, i: Numbers, j: Numbers, apart: Array, touch: float) -> tuple[Truths, Truths, Any]:
    """Where triangles i and j overlap in the plane: deep and wide enough for a hit, deep enough, the patches."""
    first = shapely.polygons(shadows.flat[i])
    second = shapely.polygons(shadows.flat[j] + apart[:, None, :2])
    patches = shapely.intersection(first, second, grid_size=GRID * touch)
    areas = shapely.area(patches)
    wide = areas > touch * np.maximum(shapely.length(patches) / 2, touch)
    uv, patch = shapely.get_coordinates(patches, return_index=True)
    p, q = shadows.planes[i[patch]], shadows.planes[j[patch]]
    moved = uv - apart[patch, :2]
    upper = np.einsum("nd,nd->n", q[:, :2], moved) + q[:, 2] + apart[patch, 2]
    depth = upper - np.einsum("nd,nd->n", p[:, :2], uv) - p[:, 2]
    deep = np.zeros(len(i), dtype=bool)
    deep[patch[depth > touch]] = True
    deep &= areas > 0
    return wide & deep, deep, patches


def _stacked_over(shadows: Shadows, pairs: Numbers, apart: Array, at: Array) -> tuple[Numbers, Numbers, Numbers]:
    """For pairs: the lowest lower face of a, and the highest upper face of b, over a point; pairs without are left out.

    Returns the pair, the triangle of a and the triangle of b, int64 (n,) each.
    """
    found = []
    for side, sign in ((0, 1.0), (1, -1.0)):
        numbers, first = (
            (shadows.lower, shadows.first_lower) if side == 0 else (shadows.upper, shadows.first_upper)
        )
        body = pairs[:, side]
        point = at if side == 0 else at - apart[:, :2]
        run, place = spans(first[body + 1] - first[body])
        triangle = numbers[first[body[run]] + place]
        over = (shadows.low[triangle, :2] <= point[run]).all(axis=1)
        over &= (shadows.high[triangle, :2] >= point[run]).all(axis=1)
        run, triangle = run[over], triangle[over]
        d = point[run][:, None] - shadows.flat[triangle]
        e = np.roll(d, -1, axis=1)
        turns = d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0]
        inside = (turns >= 0).all(axis=1) | (turns <= 0).all(axis=1)
        run, triangle = run[inside], triangle[inside]
        plane = shadows.planes[triangle]
        height = np.einsum("nd,nd->n", plane[:, :2], point[run]) + plane[:, 2]
        order = np.lexsort((sign * height, run))
        run, triangle = run[order], triangle[order]
        best = np.full(len(pairs), -1)
        best[run[::-1]] = triangle[::-1]
        found.append(best)
    i, j = found
    run = np.flatnonzero((i >= 0) & (j >= 0))
    return run, i[run], j[run]


def _meeting(
    shadows: Shadows, pairs: Numbers, asked: Numbers, apart: Array, touch: float, hit: Truths
) -> Iterator[tuple[Numbers, Numbers, Numbers]]:
    """Triangles of the asked pairs whose bounds overlap, a batch at a time; pairs hit meanwhile are skipped."""
    for pair, i, j in _products(shadows, pairs, asked):
        shift = apart[pair]
        near = (shadows.low[i, :2] + touch < shadows.high[j, :2] + shift[:, :2]).all(axis=1)
        near &= (shadows.low[j, :2] + shift[:, :2] < shadows.high[i, :2] - touch).all(axis=1)
        near &= shadows.high[j, 2] + shift[:, 2] > shadows.low[i, 2] + touch
        for some in np.array_split(np.flatnonzero(near), np.count_nonzero(near) // _PATCHES_AT_A_TIME + 1):
            some = some[~hit[pair[some]]]
            if len(some):
                yield pair[some], i[some], j[some]


def _products(shadows: Shadows, pairs: Numbers, asked: Numbers) -> Iterator[tuple[Numbers, Numbers, Numbers]]:
    """Lower faces of a with upper faces of b: each with each where they are few, by a tree of bounds where many."""
    a, b = pairs[asked].T
    lowers = shadows.first_lower[a + 1] - shadows.first_lower[a]
    uppers = shadows.first_upper[b + 1] - shadows.first_upper[b]
    many = lowers * uppers > _AT_A_TIME
    few = np.flatnonzero(~many)
    batch = np.cumsum((lowers * uppers)[few]) // _AT_A_TIME
    for rows in np.split(few, np.flatnonzero(np.diff(batch)) + 1):
        run, place = spans((lowers * uppers)[rows])
        row = rows[run]
        i = shadows.lower[shadows.first_lower[a[row]] + place // uppers[row]]
        j = shadows.upper[shadows.first_upper[b[row]] + place % uppers[row]]
        yield asked[row], i, j
    for big in np.flatnonzero(many):
        i = shadows.lower[shadows.first_lower[a[big]] : shadows.first_lower[a[big] + 1]]
        j = shadows.upper[shadows.first_upper[b[big]] : shadows.first_upper[b[big] + 1]]
        boxes = [shapely.box(*shadows.low[t, :2].T, *shadows.high[t, :2].T) for t in (i, j)]
        tree = shapely.STRtree(boxes[1])
        for start in range(0, len(i), _QUERIES_AT_A_TIME):
            first, second = tree.query(boxes[0][start : start + _QUERIES_AT_A_TIME])
            yield np.full(len(first), asked[big]), i[start + first], j[second]
