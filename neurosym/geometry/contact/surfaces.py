"""The surfaces of all bodies of an assembly in one set of arrays, so that pairs can be asked about all at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull

from neurosym.geometry.bodies import Bodies
from neurosym.geometry.mesh.broad_phase import spans
from neurosym.geometry.mesh.triangles import area_vectors
from neurosym.support.arrays import Array, Numbers

#: So many pairs of a facet and a vertex are held at a time.
_AT_A_TIME = 2_000_000

#: Faces and shadows are clipped on a grid of this share of the touching tolerance: with floating numbers GEOS may take
#: two neighbours that share an edge for one and the same (seen with shapely 2 at coordinates of 1e-3).
GRID = 1e-3


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Triangles and vertices of bodies, in the world; those without area are left out.

    Attributes:
        triangles: float64 (m, 3 corners, 3), body by body.
        normals: float64 (m, 3), unit, outward.
        body: int64 (m,): the body of each triangle.
        first: int64 (n_bodies + 1,): body b has the triangles first[b] to first[b + 1].
        vertices: float64 (k, 3), body by body, with `first_vertex` likewise.
    """

    triangles: Array
    normals: Array
    body: Numbers
    first: Numbers
    vertices: Array
    first_vertex: Numbers

    @cached_property
    def middles(self) -> Array:
        """float64 (m, 3): centroids of the triangles."""
        middles: Array = self.triangles.mean(axis=1)
        return middles


class BodySurfaces:
    """The surfaces of bodies, each kind made when first asked for."""

    def __init__(self, bodies: Bodies) -> None:
        self.bodies = bodies

    @cached_property
    def exact(self) -> Surfaces:
        """The bodies as they are."""
        return _surfaces(*self._meshes())

    @cached_property
    def hulls(self) -> Surfaces:
        """Their convex hulls."""
        if self.bodies.is_convex.all():
            return self.exact
        vertices, faces = self._meshes()
        for b in np.flatnonzero(~self.bodies.is_convex):
            # The corners of a hull's facets come in either order: its planes say which is outward.
            hull = ConvexHull(vertices[b])
            kept = hull.vertices
            number = np.zeros(len(vertices[b]), dtype=np.int64)
            number[kept] = np.arange(len(kept))
            t = vertices[b][hull.simplices]
            outward = np.einsum("nd,nd->n", area_vectors(t), hull.equations[:, :3]) > 0
            faces[b] = np.where(outward[:, None], number[hull.simplices], number[hull.simplices[:, ::-1]])
            vertices[b] = vertices[b][kept]
        return _surfaces(vertices, faces)

    def _meshes(self) -> tuple[list[Array], list[Numbers]]:
        vertices = [self.bodies.vertices(b) for b in range(len(self.bodies))]
        return vertices, [np.asarray(b.shape.faces) for b in self.bodies]


def _surfaces(vertices: list[Array], faces: list[Numbers]) -> Surfaces:
    counts = np.array([len(f) for f in faces])
    first_vertex = np.concatenate([[0], np.cumsum([len(v) for v in vertices])])
    points = np.concatenate(vertices)
    corners = np.concatenate(faces) + np.repeat(first_vertex[:-1], counts)[:, None]
    triangles = points[corners]
    normals = area_vectors(triangles)
    sizes = np.linalg.norm(normals, axis=1)
    body = np.repeat(np.arange(len(faces)), counts)
    # Needles and points have no normal to speak of.
    longest = np.ptp(triangles, axis=1).max(axis=1)
    kept = sizes > 1e-9 * np.maximum(longest, 1e-300) ** 2
    normals = normals[kept] / sizes[kept, None]
    body = body[kept]
    first = np.searchsorted(body, np.arange(len(faces) + 1))
    return Surfaces(triangles[kept], normals, body, first, points, first_vertex)


def facet_distances(hulls: Surfaces, pairs: Numbers) -> Iterator[tuple[Numbers, Numbers, Array]]:
    """How far the vertices of b lie outside each facet of a, at the least, for pairs of bodies int64 (k, 2).

    Yields, a batch of pairs at a time, the pair, the facet and the distance (length, below 0 where b reaches inside).
    """
    facets = np.diff(hulls.first)[pairs[:, 0]]
    vertices = np.diff(hulls.first_vertex)[pairs[:, 1]]
    batch = np.cumsum(facets * vertices) // _AT_A_TIME
    for rows in np.split(np.arange(len(pairs)), np.flatnonzero(np.diff(batch)) + 1):
        if not len(rows):
            continue
        run, place = spans(facets[rows])
        pair = rows[run]
        facet = hulls.first[pairs[pair, 0]] + place
        run, place = spans(vertices[pair])
        vertex = hulls.first_vertex[pairs[pair[run], 1]] + place
        along = np.einsum("nd,nd->n", hulls.normals[facet[run]], hulls.vertices[vertex])
        starts = np.cumsum(vertices[pair]) - vertices[pair]
        least = np.minimum.reduceat(along, starts)
        yield pair, facet, least - np.einsum("nd,nd->n", hulls.normals[facet], hulls.middles[facet])
