"""The surfaces of all bodies of an assembly in one set of arrays, so that pairs can be asked about all at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from neurosym.geometry.bodies import Bodies
from neurosym.geometry.mesh import kernels, trees
from neurosym.geometry.mesh.connections import adjacent, alike, connected
from neurosym.geometry.mesh.distances import surface_gaps
from neurosym.geometry.mesh.flats import Flats
from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.deadline import portions

#: Polygons are clipped on a grid of this share of the touching tolerance.
GRID = 1e-3

#: Corners of a flat face lie in its plane to this share of the smallest extent: 32-bit numbers have steps of 1e-7.
FLAT = 1e-5

#: Pairs of bodies are put to compiled loops until they have so many facets together: some tenths of a second.
FACETS = 200_000

#: Lowest and highest corners, float64 (2 m, 3) each.
Trees = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Triangles and vertices of bodies, in the world; those without area are left out.

    Attributes:
        triangles: float64 (m, 3 corners, 3), body by body, those of a body along a curve that fills space.
        normals: float64 (m, 3), unit, outward.
        middles: float64 (m, 3): centroids.
        areas: float64 (m,).
        body: int64 (m,): the body of each triangle.
        first: int64 (n_bodies + 1,): body b has the triangles first[b] to first[b + 1].
        vertices: float64 (k, 3), body by body, with `first_vertex` likewise.
        corners: int64 (m, 3): numbers of the triangles' corners among them.
    """

    triangles: Array
    normals: Array
    middles: Array
    areas: Array
    body: Numbers
    first: Numbers
    vertices: Array
    first_vertex: Numbers
    corners: Numbers

    @staticmethod
    def of(points: Array, first_vertex: Numbers, faces: list[Numbers]) -> Surfaces:
        """The surfaces of bodies whose faces are numbers of their own vertices."""
        counts = np.array([len(f) for f in faces])
        corners = np.concatenate(faces) + np.repeat(first_vertex[:-1], counts)[:, None]
        body = np.repeat(np.arange(len(faces)), counts)
        order = trees.along_curve(points[corners[:, 0]], body)
        corners = corners[order]
        triangles, vectors, middles, longest = trees.measured(points, corners)
        areas = np.sqrt(np.einsum("md,md->m", vectors, vectors)) / 2
        # Needles and points have no normal to speak of.
        kept = 2 * areas > 1e-9 * np.maximum(longest, 1e-300) ** 2
        if not kept.all():
            triangles, vectors, middles, areas = triangles[kept], vectors[kept], middles[kept], areas[kept]
            corners, body = corners[kept], body[kept]
        first = np.searchsorted(body, np.arange(len(faces) + 1))
        normals = vectors / (2 * areas)[:, None]
        return Surfaces(triangles, normals, middles, areas, body, first, points, first_vertex, corners)

    @cached_property
    def trees(self) -> Trees:
        """Bounds of the nodes of the bodies' trees; see `neurosym.geometry.mesh.kernels`."""
        return self.trees_of(np.ones(len(self.triangles), dtype=bool))

    def trees_of(self, used: Truths) -> Trees:
        """The same, of some of the triangles, bool (m,), alone."""
        return kernels.tree_bounds(self.triangles, used, self.first)

    def facing_trees(self, used: Truths, gap: float, sine: float) -> Trees:
        """Trees of some triangles by where they are and how they look.

        Bounds have six columns, normals in the last three, on such a scale that those which are opposite, to `sine`,
        come within `gap`.
        """
        normals = gap / (1.1 * max(sine, 1e-9)) * self.normals
        return kernels.facing_bounds(self.triangles, normals, used, self.first)

    @cached_property
    def across(self) -> Numbers:
        """The triangle across each edge, int64 (m, 3); -1 where there is not just one."""
        body = np.repeat(np.arange(len(self.first) - 1), np.diff(self.first_vertex))
        return adjacent(alike(np.column_stack([self.vertices, body]))[0][self.corners])

    @cached_property
    def shells(self) -> tuple[Array, Numbers]:
        """A corner of each connected part of each surface, float64 (s, 3), body by body, with `first` likewise."""
        starts = np.unique(connected(self.across), return_index=True)[1]
        return self.triangles[starts, 0], np.searchsorted(self.body[starts], np.arange(len(self.first)))

    def gaps(self, pairs: Numbers, *, enough: float = 0.0, far: float = np.inf) -> Array:
        """float64 (k,): how far apart the surfaces of bodies (k, 2) are, 0 where they cross.

        Of those as near as `enough` it is only told that they are; of those farther than `far`, likewise.
        """
        gaps = np.zeros(len(pairs))
        for some in portions(np.diff(self.first)[pairs].sum(axis=1), FACETS):
            gaps[some] = surface_gaps(pairs[some], self.triangles, *self.trees, self.first, enough, far)
        return gaps


class BodySurfaces:
    """The surfaces of bodies, made when first asked for."""

    def __init__(self, bodies: Bodies) -> None:
        self.bodies = bodies

    @cached_property
    def vertices(self) -> tuple[Array, Numbers]:
        """Their vertices, float64 (k, 3), body by body, and where each body's begin, int64 (n + 1,)."""
        vertices = [self.bodies.vertices(b) for b in range(len(self.bodies))]
        return np.concatenate(vertices), np.concatenate([[0], np.cumsum([len(v) for v in vertices])])

    @cached_property
    def exact(self) -> Surfaces:
        """The bodies as they are."""
        return Surfaces.of(*self.vertices, [np.asarray(b.shape.faces, dtype=np.int64) for b in self.bodies])

    @cached_property
    def flats(self) -> Flats:
        """Their large flat faces."""
        s, within = self.exact, FLAT * self.bodies.smallest_extent
        return Flats.of(s.triangles, s.normals, s.areas, s.middles, s.body, s.across, within)

    @cached_property
    def split_trees(self) -> tuple[Trees, Trees]:
        """Trees of the triangles that are in no large flat face, and of those that are."""
        flat = self.flats.of_triangle >= 0
        return self.exact.trees_of(~flat), self.exact.trees_of(flat)
