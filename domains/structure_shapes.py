"""Parts of boxes and prisms, of which structures are made."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from neurosym.geometry.shapes import Body, Box, Convex, Part
from neurosym.support.arrays import Array

#: Parts of these names stay: springers, abutments, posts.
FIXED = "post"

#: A box: its least and greatest x, y and z.
Bounds = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


def part(name: str, *boxes: Bounds, density: float = 1.0) -> Part:
    """A part of boxes."""
    bodies = []
    for bounds in boxes:
        low, high = np.array(bounds, dtype=np.float64).T
        X = np.eye(4)
        X[:3, 3] = (low + high) / 2
        bodies.append(Body(Box(high - low), X))
    return Part(name, tuple(bodies), np.eye(4), density)


def prism(name: str, outline: Array, depth: float) -> Part:
    """A convex outline (k, 2) in x and z, as deep along y."""
    points = np.array([(x, y, z) for x, z in outline for y in (0.0, depth)])
    hull = ConvexHull(points)
    corners, faces = points[hull.simplices], hull.simplices.copy()
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("nd,nd->n", normals, hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return Part(name, (Body(Convex(points, faces.astype(np.int64)), np.eye(4)),), np.eye(4))
