"""How deep parts overlap at rest: mating faces of real parts do a little, and that is no fault.

The depth of an overlap is the largest of two lengths: the diameter of the largest ball that lies in both bodies, and
how deep a corner of one lies in the other. Where faces mate it is the thickness of the layer that both claim. No
smaller motion than this depth can part the two bodies (each point of the ball, or the corner, has to come out), and
two bodies that only touch have depth 0, convex or not. Between the surfaces balls are looked for at the middle of each
patch where two faces look at one another the wrong way round, so that the depth is exact for flat mating faces and
never too large for others; where a body is not convex, balls then grow into corners, in which a layer has more room.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from neurosym.geometry.contact.surfaces import FACETS, BodySurfaces
from neurosym.geometry.mesh import kernels, trees
from neurosym.geometry.mesh.broad_phase import overlapping_pairs, spans
from neurosym.geometry.mesh.distances import are_inside, nearest
from neurosym.geometry.mesh.polygons import intersections
from neurosym.geometry.mesh.triangles import pierced, plane_axes
from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.deadline import portions

#: Points (n, 3), and the pair of bodies that each is meant for, int64 (n,).
Points = tuple[Array, Numbers]

#: Overlaps below this share of the smallest extent are rounding.
NOISE = 1e-6

#: For one pair of bodies, evenly spread ones where there are more: points asked whether they lie inside, and points
#: measured that do; places where edges go through faces that are joined two by two.
MAX_ASKED, MAX_MEASURED, MAX_PLACES = 4_000, 256, 40

#: Balls of one pair that grow, and those that grow to the end; moves that are tried, within a ball of radius 1.
GROWING, LARGEST = 64, 4
MOVES = np.random.default_rng(0).normal(size=(32, 3))
MOVES *= (np.linspace(0.1, 1, 32) / np.linalg.norm(MOVES, axis=1))[:, None]

#: Bodies with more pairs of faces than this are searched for overlaps up to `FAR` of the smallest extent only; deeper
#: ones show by points that far under their faces.
DENSE, FAR = 100_000, 0.1

#: So many pairs of faces are compared at a time.
_AT_A_TIME = 1_000_000

_WHAT = "overlaps at rest"


@dataclass(frozen=True)
class Overlap:
    """Two bodies, by number, of different parts, and how deep they overlap (length)."""

    a: int
    b: int
    depth: float


def overlaps(surfaces: BodySurfaces, fixed: int = 0) -> list[Overlap]:
    """All overlaps of bodies of different parts, those between two parts of the bitset `fixed` left out."""
    bodies = surfaces.bodies
    noise, far = NOISE * bodies.smallest_extent, FAR * bodies.smallest_extent
    low, high = bodies.bounds[:, 0], bodies.bounds[:, 1]
    pairs = overlapping_pairs(np.minimum(low + noise / 2, high), np.maximum(high - noise / 2, low), bodies.owners)
    rests = np.array([fixed >> o & 1 for o in bodies.owners.tolist()], dtype=bool)
    pairs = pairs[~rests[pairs].all(axis=1)]
    if not len(pairs):
        return []
    whole = float(np.ptp(bodies.bounds, axis=(0, 1)).sum())
    # Where surfaces keep apart, bodies overlap only as one lies within the other; only of bodies that overlap in some
    # point faces are compared.
    near = surfaces.exact.gaps(pairs, enough=noise, far=2 * noise) <= noise
    overlap = np.zeros(len(pairs), dtype=bool)
    touching = np.flatnonzero(near)
    for rows in portions(np.diff(surfaces.exact.first)[pairs[touching]].sum(axis=1), FACETS, _WHAT):
        overlap[touching[rows]] = _Pairs(surfaces, pairs[touching[rows]], noise).overlapping()
    overlap[~near] = _Pairs(surfaces, pairs[~near], noise).contained()
    pairs = pairs[overlap]
    count = np.diff(surfaces.exact.first)[pairs].prod(axis=1)
    depths = [np.zeros(0)]
    for rows in portions(count, _AT_A_TIME, _WHAT):
        some = _Pairs(surfaces, pairs[rows], noise)
        depths.append(some.depths(np.where(count[rows] <= DENSE, whole, far)))
    deep = zip(pairs.tolist(), np.concatenate(depths).tolist())
    return [Overlap(a, b, depth) for (a, b), depth in deep if depth > noise]


class _Pairs:
    """Pairs of bodies, int64 (k, 2)."""

    def __init__(self, surfaces: BodySurfaces, pairs: Numbers, noise: float) -> None:
        self.surfaces, self.exact, self.pairs, self.noise = surfaces, surfaces.exact, pairs, noise
        bounds = surfaces.bodies.bounds[pairs]
        self.low, self.high = bounds[:, :, 0].max(axis=1), bounds[:, :, 1].min(axis=1)

    def contained(self) -> Truths:
        """Whether a part of the surface of either body lies within the other, where surfaces do not cross."""
        within = np.zeros(len(self.pairs), dtype=bool)
        within[self._in_other(*self.exact.shells)[1]] = True
        return within

    def overlapping(self) -> Truths:
        """Whether a corner, the middle of an edge or a point just under a face lies within the other body, or an edge
        goes through a face."""
        s = self.exact
        under = s.middles - 2 * self.noise * s.normals
        t, k = np.nonzero(s.across < np.arange(len(s.across))[:, None])  # each edge once
        edges = (s.triangles[t, k] + s.triangles[t, (k + 1) % 3]) / 2
        overlap = np.zeros(len(self.pairs), dtype=bool)
        if len(self.pairs):
            overlap[self.places[1]] = True
        for probe, first in (
            (s.vertices, s.first_vertex), (under, s.first), (edges, np.searchsorted(t, s.first))
        ):  # fmt: skip
            points, pair, other = self._in_other(probe, first, ~overlap)
            # On the surface itself a point may seem to be on either side.
            overlap[pair[nearest(points, other, s.triangles, *s.trees, s.first) > self.noise / 2]] = True
        return overlap

    def depths(self, gaps: Array) -> Array:
        """How deep the bodies overlap, float64 (k,); faces are compared up to a distance of `gaps` (k,)."""
        s, depth = self.exact, np.zeros(len(self.pairs))
        corners, pair, other = self._in_other(s.vertices, s.first_vertex)
        some = _spread(pair, MAX_MEASURED)
        corners, pair, other = corners[some], pair[some], other[some]
        away = nearest(corners, other, s.triangles, *s.trees, s.first)
        np.maximum.at(depth, pair, np.where(away > self.noise, away, 0.0))
        dense = gaps == gaps.min()
        under = s.middles - gaps.min() / 2 * s.normals
        middles = [self._between(gaps), self._amid(), self._in_other(under, s.first, dense)[:2]]
        points, pair = (np.concatenate(x) for x in zip(*middles))
        kept = _spread(pair, MAX_ASKED)
        points, pair = points[kept], pair[kept]
        for side in (0, 1):
            inside = are_inside(points, self.pairs[pair, side], s.triangles, *s.trees, s.first)
            points, pair = points[inside], pair[inside]
        kept = _spread(pair, MAX_MEASURED)
        points, pair = points[kept], pair[kept]
        away = self._away(points, pair)
        np.maximum.at(depth, pair, np.where(away > self.noise / 2, 2 * away, 0.0))
        np.maximum.at(depth, *self._grown(points, pair, away, depth))
        return depth

    def _away(self, points: Array, pair: Numbers) -> Array:
        """How far points (n, 3) are from the surfaces of both bodies of a pair (n,): float64 (n,)."""
        s = self.exact
        one, other = (nearest(points, self.pairs[pair, n], s.triangles, *s.trees, s.first) for n in (0, 1))
        return np.asarray(np.minimum(one, other))

    def _grown(self, points: Array, pair: Numbers, away: Array, depth: Array) -> tuple[Numbers, Array]:
        """Pairs, and how wide balls about points grow: each moves within itself, so that it never leaves a body."""
        bodies = self.surfaces.bodies
        hollow = ~bodies.is_convex[self.pairs].all(axis=1) & (depth <= FAR * bodies.smallest_extent)
        wide = np.flatnonzero(hollow[pair] & (away > 0.4 * depth[pair]) & (away > self.noise / 2))
        wide = wide[_spread(pair[wide], GROWING)]
        points, pair, away = points[wide], pair[wide], away[wide]
        for round, share in enumerate((0.8, 0.8, 0.4, 0.2, 0.1)):
            moves = np.concatenate([np.zeros((1, 3)), MOVES[:: 1 if round else 4]])
            tried = points[:, None] + share * away[:, None, None] * moves
            room = self._away(tried.reshape(-1, 3), np.repeat(pair, len(moves))).reshape(-1, len(moves))
            best = room.argmax(axis=1)
            rows = np.arange(len(points))
            points, away = tried[rows, best], room[rows, best]
            if not round:
                order = np.lexsort((-away, pair))
                order = order[spans(np.unique(pair, return_counts=True)[1])[1] < LARGEST]
                points, pair, away = points[order], pair[order], away[order]
        return pair, 2 * away

    def _in_other(self, points: Array, first: Numbers, asked: Truths | None = None) -> tuple[Array, Numbers, Numbers]:
        """Points of either body, body b's from first[b] on, that lie within the other: points, pair, other body."""
        rows = np.arange(len(self.pairs)) if asked is None else np.flatnonzero(asked)
        pair = np.concatenate([rows, rows])
        own, other = self.pairs[rows].T.ravel(), self.pairs[rows, ::-1].T.ravel()
        run, place = spans(np.diff(first)[own])
        at, pair, other = first[own[run]] + place, pair[run], other[run]
        near = ((points[at] >= self.low[pair]) & (points[at] <= self.high[pair])).all(axis=1)
        at, pair, other = at[near], pair[near], other[near]
        s = self.exact
        inside = are_inside(points[at], other, s.triangles, *s.trees, s.first)
        return points[at[inside]], pair[inside], other[inside]

    @cached_property
    def places(self) -> Points:
        """Where edges of one body go through faces of the other."""
        s, flats, (small, flat) = self.exact, self.surfaces.flats, self.surfaces.split_trees
        # Large flat faces in one plane do not go through one another, however many triangles they have.
        planes = trees.tree_labels(flats.planes(self.noise / 2)[flats.of_triangle], s.first)
        none = np.full(len(planes), -1)
        passes = ((small, s.trees, none), (flat, small, none), (flat, flat, planes))
        crossing = [
            kernels.straddling_pairs(*one, *two, labels, s.triangles, s.normals, s.first, self.pairs, self.noise / 2)
            for one, two, labels in passes
        ]
        pair, i, j = np.concatenate(crossing).T
        found: list[Points] = [(np.zeros((0, 3)), pair[:0])]
        for one, other in ((i, j), (j, i)) if len(i) else ():
            for k in range(3):
                edges = s.triangles[one][:, [k, (k + 1) % 3]]
                through, where = pierced(edges, s.triangles[other], s.normals[other], self.noise / 2)
                found.append((where[through], pair[through]))
        where, pair = (np.concatenate(x) for x in zip(*found))
        return where, pair

    def _amid(self) -> Points:
        """Points halfway between any two places where an edge of one body goes through a face of the other.

        Where one body goes right through the other, its faces look at none of the other's; these points lie in both.
        """
        where, pair = self.places
        order = np.argsort(pair, kind="stable")
        order = order[_spread(pair[order], MAX_PLACES)]
        where, pair = where[order], pair[order]
        counts = np.bincount(pair, minlength=len(self.pairs))
        run, place = spans(counts[pair])
        other = (np.cumsum(counts) - counts)[pair[run]] + place
        once = run < other
        return (where[run[once]] + where[other[once]]) / 2, pair[run[once]]

    def _between(self, gaps: Array) -> Points:
        """Points halfway between those pairs of faces that have passed one another."""
        s, flats, (small, flat) = self.exact, self.surfaces.flats, self.surfaces.split_trees
        passes = ((small, s.trees), (flat, small))
        near = np.concatenate(
            [kernels.facing_pairs(*one, *two, s.normals, s.first, self.pairs, gaps, 1.0) for one, two in passes]
        )
        # Passed: each face has some corner beyond the other's plane.
        ta, tb, na, nb = s.triangles[near[:, 1]], s.triangles[near[:, 2]], s.normals[near[:, 1]], s.normals[near[:, 2]]
        passed = np.einsum("kcd,kd->kc", ta - tb[:, :1], nb).min(axis=1) < -self.noise / 2
        passed &= np.einsum("kcd,kd->kc", tb - ta[:, :1], na).min(axis=1) < -self.noise / 2
        near, ta, tb = near[passed], ta[passed], tb[passed]
        origin, _, axes = self._planes(near, s.normals, s.middles)
        areas, corners, _ = kernels.common_parts((ta - origin) @ axes, (tb - origin) @ axes)
        # A gap between two planes is widest at a corner, and balls have most room amid the part in common.
        spots = [corners, (corners + np.roll(corners, 1, axis=1)) / 2, corners.mean(axis=1, keepdims=True)]
        uv = np.concatenate(spots, axis=1)
        row = np.repeat(np.flatnonzero(areas > 0), uv.shape[1])
        found = [self._halfway(near[row], uv[areas > 0].reshape(-1, 2), s.normals, s.middles)]
        large = flats.facing(self.pairs, float(gaps.max(initial=0.0)), 1.0)
        if len(large):
            origin, _, axes = self._planes(large, flats.normals, flats.middles)
            one, two = (flats.polygons(f, origin[:, 0], axes) for f in large[:, 1:].T)
            common = intersections(one, two, self.noise / 10)
            pieces, row = shapely.get_parts(shapely.constrained_delaunay_triangles(common), return_index=True)
            uv = shapely.get_coordinates(shapely.centroid(pieces))
            found.append(self._halfway(large[row], uv, flats.normals, flats.middles))
        points, pair = (np.concatenate(x) for x in zip(*found))
        return points, pair

    def _planes(self, faces: Numbers, normals: Array, middles: Array) -> tuple[Array, Array, Array]:
        """Planes across the mean normal of two faces, (pair, both) int64 (n, 3): origins (n, 1, 3), normals, axes."""
        along = normals[faces[:, 1]] - normals[faces[:, 2]]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return middles[faces[:, 1], None], along, np.stack(plane_axes(along), axis=2)

    def _halfway(self, faces: Numbers, uv: Array, normals: Array, middles: Array) -> Points:
        """Points between the planes of two faces, over points (n, 2) of a plane between, where they have passed."""
        origin, along, axes = self._planes(faces, normals, middles)
        flat = origin[:, 0] + np.einsum("nda,na->nd", axes, uv)
        over_a, over_b = (
            np.einsum("nd,nd->n", middles[f] - flat, normals[f]) / np.einsum("nd,nd->n", normals[f], along)
            for f in faces[:, 1:].T
        )
        passed = over_a - over_b > self.noise
        return (flat + (over_a + over_b)[:, None] / 2 * along)[passed], faces[passed, 0]


def _spread(group: Numbers, limit: int) -> NDArray[np.int64]:
    """Rows of groups, int64 (n,), in order; evenly spread ones of groups of more than `limit`."""
    counts = np.bincount(group) if len(group) else np.zeros(0, dtype=np.int64)
    order = np.argsort(group, kind="stable")
    rank = np.empty(len(group), dtype=np.int64)
    rank[order] = np.arange(len(group)) - (np.cumsum(counts) - counts)[group[order]]
    return np.flatnonzero(rank % np.maximum(1, -(-counts // limit))[group] == 0)
