"""Parts as triangles and outlines to draw, in the world, at rest in the work."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.shapes import Box
from neurosym.support.arrays import Array, Numbers, Truths

#: Edges at which the surface bends by less than this (degrees) are not outlined: facets of something round.
SHARP = 30.0
#: Corners nearer than this, as a share of the smallest extent of any body, are one.
SAME = 1e-4


@dataclass(frozen=True, eq=False)
class Solid:
    """A part in the world: float64 (n, 3) vertices, int64 (m, 3) outward faces, float64 (k, 2, 3) sharp edges."""

    vertices: Array
    faces: Numbers
    outline: Array


def solids(assembly: Assembly) -> tuple[Solid, ...]:
    """One solid a part. What two bodies of a part hide from view where they meet is left out."""
    return tuple(_solid(assembly, i) for i in range(len(assembly)))


def _solid(assembly: Assembly, part: int) -> Solid:
    vertices, faces, squares, offset = [], [], [], 0
    for body in np.flatnonzero(assembly.owners == part):
        shape, corners = assembly.bodies[int(body)].shape, assembly.bodies.vertices(int(body))
        vertices.append(corners)
        faces.append(shape.faces + offset)
        squares.append(np.full(len(shape.faces), isinstance(shape, Box)))
        offset += len(corners)
    grid = SAME * assembly.smallest_extent
    v, f = _merged(np.concatenate(vertices), np.concatenate(faces), np.concatenate(squares), grid)
    return Solid(v, f, _outline(v, f))


def _merged(vertices: Array, faces: Numbers, of_box: Truths, grid: float) -> tuple[Array, Numbers]:
    """The same triangles with corners shared, and without the faces of boxes that cover one another."""
    _, first, which = np.unique(np.round(vertices / grid), axis=0, return_index=True, return_inverse=True)
    f = which.ravel()[faces]
    sides = f[of_box].reshape(-1, 6)
    # Two triangles of a face have four corners between them: six numbers, two of them twice.
    corners = [tuple(sorted(set(side))) for side in sides.tolist()]
    count = Counter(corners)
    seen = np.array([count[c] == 1 for c in corners], dtype=bool)
    kept = np.concatenate([sides[seen].reshape(-1, 3), f[~of_box]])
    solid = (kept[:, 0] != kept[:, 1]) & (kept[:, 1] != kept[:, 2]) & (kept[:, 2] != kept[:, 0])
    return vertices[first], kept[solid]


def _outline(vertices: Array, faces: Numbers) -> Array:
    """float64 (k, 2, 3): edges of one face, of more than two, or of two that meet at an angle."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    start = np.flatnonzero(np.r_[True, (edges[1:] != edges[:-1]).any(axis=1)])
    count = np.diff(np.r_[start, len(edges)])
    smooth = np.zeros(len(start), dtype=bool)
    pairs = count == 2
    first, second = owner[start[pairs]], owner[start[pairs] + 1]
    smooth[pairs] = np.einsum("nd,nd->n", normal[first], normal[second]) > np.cos(np.radians(SHARP))
    return np.asarray(vertices[edges[start[~smooth]]])
