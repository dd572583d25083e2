"""Flat faces of many triangles as polygons.

A lid that is cut into a fan has as many triangles as its rim has edges, and two of them that lie on one another have up
to that many squared in common; as polygons they have one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from neurosym.geometry.mesh.broad_phase import overlapping_pairs
from neurosym.geometry.mesh.connections import planar_regions
from neurosym.support.arrays import Array, Numbers

#: Flat faces of fewer triangles than this are left as they are.
MANY = 16


@dataclass(frozen=True, eq=False)
class Flats:
    """Faces of `MANY` triangles and more in one plane, joined by edges.

    Attributes:
        of_triangle: int64 (m,): the number of the face that each triangle belongs to, or -1.
        body: int64 (n,): the body of each.
        normals: float64 (n, 3), unit, outward.
        middles: float64 (n, 3): a point in the plane of each.
        low, high: float64 (n, 3): bounds.
        rims: per face the edges about it, float64 (k, 2 ends, 3).
    """

    of_triangle: Numbers
    body: Numbers
    normals: Array
    middles: Array
    low: Array
    high: Array
    rims: list[Array]

    @staticmethod
    def of(
        t: Array, normals: Array, areas: Array, middles: Array, body: Numbers, across: Numbers, within: float
    ) -> Flats:
        """The flat faces of triangles, float64 (m, 3, 3).

        Args:
            normals, areas, middles: of the triangles, normals of unit length.
            body: int64 (m,).
            across: int64 (m, 3): the triangle across each edge, see `adjacent`.
            within: how far from their plane (length) corners may be.
        """
        by_area = np.argsort(-areas, kind="stable")
        region, largest = planar_regions(t, normals, across, by_area, within)
        many = np.flatnonzero(np.bincount(region, minlength=len(largest)) >= MANY)
        number = np.full(len(largest) + 1, -1)
        number[many] = np.arange(len(many))
        own, largest = number[region], largest[many]
        order = np.argsort(own, kind="stable")
        first = np.searchsorted(own[order], np.arange(len(many)))
        corners = t[order]
        low, high = (f(f(corners[:, 0], corners[:, 1]), corners[:, 2]) for f in (np.minimum, np.maximum))
        triangle, corner = np.nonzero((own[across] != own[:, None]) | (across < 0))
        triangle, corner = triangle[own[triangle] >= 0], corner[own[triangle] >= 0]
        edges = np.stack([t[triangle, corner], t[triangle, (corner + 1) % 3]], axis=1)
        along = np.argsort(own[triangle], kind="stable")
        splits = np.searchsorted(own[triangle][along], np.arange(len(many)))
        return Flats(
            own,
            body[largest],
            normals[largest],
            middles[largest],
            np.minimum.reduceat(low, first) if len(many) else low[:0],
            np.maximum.reduceat(high, first) if len(many) else high[:0],
            np.split(edges[along], splits)[1:],
        )

    def facing(self, pairs: Numbers, gap: float, sine: float) -> Numbers:
        """Faces of two bodies that look at one another, as `neurosym.geometry.mesh.kernels.facing_pairs` has them."""
        near = overlapping_pairs(self.low - gap / 2, self.high + gap / 2, self.body)
        i, j = near.T
        swapped = self.body[i] > self.body[j]
        i, j = np.where(swapped, j, i), np.where(swapped, i, j)
        facing = np.einsum("nd,nd->n", self.normals[i], self.normals[j]) < 0
        facing &= np.linalg.norm(np.cross(self.normals[i], self.normals[j]), axis=1) <= sine
        number = {(a, b): k for k, (a, b) in enumerate(pairs.tolist())}
        of_pair = np.array([number.get(p, -1) for p in zip(self.body[i].tolist(), self.body[j].tolist())], dtype=int)
        return np.asarray(np.stack([of_pair, i, j], axis=1)[facing & (of_pair >= 0)])

    def planes(self, within: float) -> Numbers:
        """int64 (n + 1,): faces in one plane, to `within` (length), bear one number; -1 at the end is of no face."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        count = len(self.body)
        offsets = np.einsum("nd,nd->n", self.normals, self.middles) / within
        planes = np.column_stack([1e6 * self.normals, offsets])
        # A plane has two sides: either way round it is one.
        tree = cKDTree(np.concatenate([planes, -planes]))
        one, other = tree.query_pairs(1.0, p=np.inf, output_type="ndarray").T % max(count, 1)
        links = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(count, count))
        return np.append(connected_components(links, directed=False)[1], -1) if count else np.full(1, -1)

    def polygons(self, faces: Numbers, origins: Array, axes: Array) -> NDArray[np.object_]:
        """Faces (n,) seen in planes of origins (n, 3) and two unit vectors each (n, 3, 2)."""
        lines = [shapely.multilinestrings((self.rims[f] - o) @ a) for f, o, a in zip(faces, origins, axes)]
        areas: NDArray[np.object_] = shapely.build_area(np.array(lines, dtype=object))
        return areas
