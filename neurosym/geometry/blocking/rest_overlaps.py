"""Parts that overlap a little at rest, where they mate: how far they have to be thought apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from neurosym.geometry.contact.surfaces import Surfaces, facet_distances
from neurosym.geometry.mesh.broad_phase import Pairs, overlapping_pairs

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]

#: Share of the smallest extent that counts as an overlap at rest, however coarse `touch` is: along an oblique joint a
#: layer thinner than `touch` may yet be deeper and wider than it.
OVERLAP = 1e-3


@dataclass(frozen=True, eq=False)
class RestOverlaps:
    """Pairs of bodies whose convex hulls overlap by more than `OVERLAP` and no more than `mate`.

    Attributes:
        pairs: int64 (k, 2), a < b, in order.
        shifts: float64 (k, 3): the shortest way, in the world, by which b is moved off a.
        count: of all bodies.
    """

    pairs: Pairs
    shifts: Array
    count: int

    @staticmethod
    def of(assembly: Assembly) -> RestOverlaps:
        """Found once for an assembly."""
        return assembly.remember("rest overlaps", lambda: _overlaps(assembly))

    def apart(self, pairs: Pairs) -> Array:
        """float64 (k, 3): by how much b is thought moved off a, for pairs a < b; mostly 0."""
        found = np.zeros((len(pairs), 3))
        if not len(self.pairs) or not len(pairs):
            return found
        known = self.pairs[:, 0] * self.count + self.pairs[:, 1]
        keys = pairs[:, 0] * self.count + pairs[:, 1]
        place = np.minimum(np.searchsorted(known, keys), len(known) - 1)
        same = known[place] == keys
        found[same] = self.shifts[place[same]]
        return found


def _overlaps(assembly: Assembly) -> RestOverlaps:
    """The facet of either hull that is overlapped least shows the shortest way apart (up to edges against edges)."""
    bounds, half = assembly.body_bounds, min(assembly.touch, OVERLAP * assembly.smallest_extent) / 2
    near = overlapping_pairs(bounds[:, 0] + half, bounds[:, 1] - half, assembly.owners)
    hulls = Surfaces.of_hulls(assembly)
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
    return RestOverlaps(near[kept], depth[kept, None] * ways[kept], len(assembly.bodies))
