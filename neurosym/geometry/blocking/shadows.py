"""Moving along a line to infinity, by the shadows of triangles: the exact answer for any closed surfaces.

Only faces of what moves that look back matter, and faces of what stands that look along the direction: walls parallel
to it fall out. Where two of them lie over one another, the depth of the overlap is a linear function. It is measured
across the two, as the ball that fits between them: faces that mate obliquely, or end at an edge, and overlap by a
little, block no more than those that mate squarely.
"""

from __future__ import annotations

import numpy as np
import shapely

from neurosym.geometry.contact.surfaces import FACETS, GRID, Surfaces
from neurosym.geometry.mesh import kernels, trees
from neurosym.geometry.mesh.broad_phase import MOST, near_pairs
from neurosym.geometry.mesh.polygons import union
from neurosym.support.arrays import Array, Numbers, Truths, bounds
from neurosym.support.deadline import check, portions

#: So many narrow pieces of an overlap are put together before the rest of them are looked for.
_FEW = 1_000


class Shadows:
    """The triangles of surfaces in a frame, float64 (3, 3), whose last column is a direction."""

    def __init__(self, surfaces: Surfaces, frame: Array, touch: float) -> None:
        points = (surfaces.vertices - np.mean(bounds(surfaces.vertices), axis=0)) @ frame
        self.triangles, vectors, _, longest = trees.measured(points, surfaces.corners)
        self.first, self.touch = surfaces.first, touch
        # Seen edge-on a triangle has no height to speak of.
        seen, area = 1e-6 * longest**2, vectors[:, 2]
        down, up = (kernels.tree_bounds(self.triangles, used, self.first) for used in (area < -seen, area > seen))
        # Of the heights only those that face one another count: what moves passes all that is not above it.
        height = np.abs(points[:, 2]).max(initial=0.0)
        down[0][:, 2] += touch
        down[1][:, 2] = 2 * height
        up[0][:, 2] = -2 * height
        self._trees = (*down, *up)

    def hit(self, pairs: Numbers, shifts: Array) -> Truths:
        """Whether body a, moved along the direction without end, hits body b, bool (k,).

        Args:
            pairs: int64 (k, 2): bodies a and b.
            shifts: float64 (k, 3), in the frame: b is thought moved by as much.

        A hit is an overlap deeper than `touch` and wider across.
        """
        hit = np.zeros(len(pairs), dtype=bool)
        asked, most = np.arange(len(pairs)), _FEW
        while len(asked):
            left = [asked[:0]]
            for some in portions(np.diff(self.first)[pairs[asked]].sum(axis=1), FACETS):
                answers, pieces = self._blocked(pairs[asked[some]], shifts[asked[some]], most)
                wide = answers == 1
                # Slivers side by side may be wide together: surfaces cut into narrow facets.
                of_pair, corners = pieces[:, 0].astype(np.int64), pieces[:, 1:].reshape(-1, 8, 2)
                for k in np.unique(of_pair):
                    check()
                    wide[k] = _are_wide(corners[of_pair == k], self.touch)
                hit[asked[some]] = wide
                left.append(asked[some][(answers == 2) & ~wide])
            asked, most = np.concatenate(left), np.iinfo(np.int64).max
        return hit

    def _blocked(self, pairs: Numbers, shifts: Array, most: int) -> tuple[Numbers, Array]:
        return kernels.blocked(self.triangles, *self._trees, self.first, pairs, shifts, self.touch, most)


def _are_wide(pieces: Array, touch: float) -> bool:
    """Whether convex polygons, corners (n, 8, 2), hold a disc of diameter `touch` together."""
    pieces = (pieces - pieces[0, 0]) / touch
    low, high = pieces.min(axis=1), pieces.max(axis=1)
    x, y = np.moveaxis(pieces - pieces[:, :1], 2, 0)
    area = np.abs((x[:, :-1] * y[:, 1:] - y[:, :-1] * x[:, 1:]).sum(axis=1)) / 2
    # A disc is covered by pieces that come near one another; no piece covers more of it than a stripe of its width.
    width = 2 * area / np.maximum((high - low).max(axis=1), 1e-300)
    chosen = width > GRID
    near = near_pairs((low - 1, high + 1), (low, high), MOST)
    if near is not None:
        one, other = near.T
        crowded = np.bincount(one, width[other], len(pieces)) >= np.pi / 4
        chosen[np.setdiff1d(np.arange(len(pieces)), other[crowded[one]])] = False
    # A little larger, so that neighbours overlap: what shares an edge to the last digit is where GEOS goes wrong.
    larger = shapely.buffer(shapely.polygons(pieces[chosen]), GRID, join_style="mitre")
    return not union(larger, GRID / 16).buffer(-0.5 - GRID).is_empty
