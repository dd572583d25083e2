"""Parts that overlap a little at rest, where they mate: how far they have to be thought apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.surfaces import FACETS, BodySurfaces, Surfaces
from neurosym.geometry.mesh.broad_phase import overlapping_pairs
from neurosym.support.arrays import Array, Numbers
from neurosym.support.compiled import compiled
from neurosym.support.deadline import check, portions

#: Share of the smallest extent that counts as an overlap at rest, however coarse `touch` is: along an oblique joint a
#: layer thinner than `touch` may yet be deeper and wider than it. Half of `touch` where that is less: no overlap is too
#: much for touch and too little for this.
OVERLAP = 1e-3


@dataclass(frozen=True, eq=False)
class MatingOverlaps:
    """Pairs of bodies whose convex hulls overlap by more than `OVERLAP` and no more than `mate`.

    Attributes:
        pairs: int64 (k, 2), a < b, in order.
        shifts: float64 (k, 3): the shortest way, in the world, by which b is moved off a.
        count: of all bodies.
    """

    pairs: Numbers
    shifts: Array
    count: int

    def apart(self, pairs: Numbers) -> Array:
        """float64 (k, 3): by how much b is thought moved off a, for pairs (a, b) either way round; mostly 0."""
        apart = np.zeros((len(pairs), 3))
        if not len(self.pairs) or not len(pairs):
            return apart
        low, high = np.sort(pairs, axis=1).T
        known = self.pairs[:, 0] * self.count + self.pairs[:, 1]
        keys = low * self.count + high
        place = np.minimum(np.searchsorted(known, keys), len(known) - 1)
        same = known[place] == keys
        apart[same] = self.shifts[place[same]]
        apart[pairs[:, 0] > pairs[:, 1]] *= -1
        return apart


def mating_overlaps(assembly: Assembly, surfaces: BodySurfaces) -> MatingOverlaps:
    """The facet of either hull that is overlapped least shows the shortest way apart (up to edges against edges)."""
    bounds, half = assembly.body_bounds, min(assembly.touch / 2, OVERLAP * assembly.smallest_extent) / 2
    near = overlapping_pairs(bounds[:, 0] + half, bounds[:, 1] - half, assembly.owners)
    if not len(near):
        return MatingOverlaps(near, np.zeros((0, 3)), len(assembly.bodies))
    count = len(assembly.bodies)
    bodies, place = np.unique(near, return_inverse=True)
    hulls = []
    for b in bodies:
        check()
        hulls.append(_hull(assembly, surfaces.exact, int(b)))
    planes, corners = (np.concatenate([np.zeros((0, k)), *(h[i] for h in hulls)]) for i, k in ((0, 4), (1, 3)))
    first = [np.concatenate([[0], np.cumsum([len(h[i]) for h in hulls], dtype=np.int64)]) for i in (0, 1)]
    pairs = place.reshape(-1, 2).astype(np.int64)
    depth, normals = np.zeros(len(pairs)), np.zeros((len(pairs), 3))
    for some in portions(sum(np.diff(f)[pairs].sum(axis=1) for f in first), FACETS):
        depth[some], normals[some] = _least_overlaps(planes, first[0], corners, first[1], pairs[some], assembly.mate)
    kept = (depth > 2 * half) & (depth <= assembly.mate)
    return MatingOverlaps(near[kept], depth[kept, None] * normals[kept], count)


def _hull(assembly: Assembly, surfaces: Surfaces, body: int) -> tuple[Array, Array]:
    """Planes of the facets of a body's convex hull, float64 (m, 4): n . x + w <= 0 inside; and its corners, (k, 3)."""
    vertices = surfaces.vertices[surfaces.first_vertex[body] : surfaces.first_vertex[body + 1]]
    if not assembly.bodies.is_convex[body]:
        from scipy.spatial import ConvexHull

        hull = ConvexHull(vertices)
        return hull.equations, vertices[hull.vertices]
    own = slice(surfaces.first[body], surfaces.first[body + 1])
    offsets = np.einsum("md,md->m", surfaces.normals[own], surfaces.middles[own])
    return np.column_stack([surfaces.normals[own], -offsets]), vertices


@compiled
def _least_overlaps(
    planes: Array, first: Numbers, corners: Array, first_corner: Numbers, pairs: Numbers, limit: float
) -> tuple[Array, Array]:
    """How far, and which way, the second of two convex bodies has to move off the first: (k,), (k, 3), of pairs (k, 2).

    Args:
        planes: float64 (m, 4): n . x + w <= 0 inside, body by body.
        limit: depths beyond are given as infinite.
    """
    depth, direction = np.full(len(pairs), np.inf), np.zeros((len(pairs), 3))
    for k in range(len(pairs)):
        best = -limit * (1 + 1e-12)
        for side in range(2):
            a, b = pairs[k, side], pairs[k, 1 - side]
            last = first_corner[b]
            for f in range(first[a], first[a + 1]):
                x, y, z, w = planes[f]
                # A corner that lies deep under one facet does under most: it is asked first.
                least = x * corners[last, 0] + y * corners[last, 1] + z * corners[last, 2] + w
                if least <= best:
                    continue
                for c in range(first_corner[b], first_corner[b + 1]):
                    height = x * corners[c, 0] + y * corners[c, 1] + z * corners[c, 2] + w
                    if height < least:
                        least, last = height, c
                        if least <= best:
                            break
                if least > best:
                    best = least
                    depth[k] = -least
                    for axis in range(3):
                        direction[k, axis] = planes[f, axis] * (1 - 2 * side)
    return depth, direction
