"""Parts that overlap a little at rest, where they mate: how far they have to be thought apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.surfaces import Surfaces, facet_distances
from neurosym.geometry.mesh.broad_phase import overlapping_pairs
from neurosym.support.arrays import Array, Numbers

#: Share of the smallest extent that counts as an overlap at rest, however coarse `touch` is: along an oblique joint a
#: layer thinner than `touch` may yet be deeper and wider than it.
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


def mating_overlaps(assembly: Assembly, hulls: Surfaces) -> MatingOverlaps:
    """The facet of either hull that is overlapped least shows the shortest way apart (up to edges against edges)."""
    bounds, half = assembly.body_bounds, min(assembly.touch, OVERLAP * assembly.smallest_extent) / 2
    near = overlapping_pairs(bounds[:, 0] + half, bounds[:, 1] - half, assembly.owners)
    depth = np.full(len(near), np.inf)
    ways = np.zeros((len(near), 3))
    for pairs, sign in ((near, 1.0), (near[:, ::-1], -1.0)):
        for pair, facet, distance in facet_distances(hulls, pairs):
            order = np.lexsort((distance, pair))[::-1]  # of each pair the least overlapped facet first
            first = order[np.flatnonzero(np.diff(pair[order], prepend=-1))]
            better = first[-distance[first] < depth[pair[first]]]
            depth[pair[better]] = -distance[better]
            ways[pair[better]] = sign * hulls.normals[facet[better]]
    kept = (depth > 2 * half) & (depth <= assembly.mate)
    return MatingOverlaps(near[kept], depth[kept, None] * ways[kept], len(assembly.bodies))
