"""Meshes with every face moved inward: FCL reports meshes that merely touch as hits, and cannot be told otherwise."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from neurosym.geometry.mesh.triangles import area_vectors
from neurosym.support.arrays import Array, Numbers
from neurosym.support.deadline import check

#: Corners nearer than this share of the mesh's extent are one corner.
WELD = 1e-9

#: A corner moves by at most so many times the depth: needles would lose their tips.
FARTHEST = 50.0


def inset_vertices(vertices: Array, faces: Numbers, depth: float) -> Array:
    """Vertices, float64 (n, 3), moved so that every face lies `depth` (length) farther in, with the same faces.

    Each vertex goes the shortest way that brings it `depth` behind the planes of all faces about it; faces back to
    back, inside a mesh put together from others, are left out. Where no way does that (two tips that meet in one
    point), it goes behind their mean, and touch may count as a hit there.

    Args:
        vertices: float64 (n, 3) of a closed mesh.
        faces: int64 (m, 3), outward.
    """
    extent = float(np.ptp(vertices, axis=0).max())
    _, corner_of = np.unique(np.round(vertices / (WELD * extent)), axis=0, return_inverse=True)
    corner_of = corner_of.reshape(-1)
    t = vertices[faces]
    normals = area_vectors(t)
    area = np.linalg.norm(normals, axis=1)
    real = area > 1e-12 * extent**2
    normals = np.repeat(normals[real] / area[real, None], 3, axis=0)
    corners = corner_of[faces[real]].ravel()
    order = np.argsort(corners, kind="stable")
    corners, normals = corners[order], normals[order]
    ends = np.flatnonzero(np.diff(corners, append=-1)) + 1
    moved = np.zeros((corner_of.max() + 1, 3))
    for start, end in zip(np.concatenate([[0], ends[:-1]]), ends):
        check()
        moved[corners[start]] = _way_in(normals[start:end])
    found: Array = vertices + depth * moved[corner_of]
    return found


def _way_in(normals: Array) -> Array:
    """The shortest d (3,) with n . d <= -1 for all unit normals (k, 3), or the best there is."""
    first: Array = normals[0]
    if np.abs(normals - first).max() < 1e-6:
        return np.negative(first)
    n = np.unique(np.round(normals, 9), axis=0)
    way = _least_distance(n)
    if way is None:
        way = _least_distance(n[(n @ n.T).min(axis=1) > -1 + 1e-9])
    if way is None:
        way = -n.mean(axis=0)
    return np.multiply(way, min(1.0, FARTHEST / max(float(np.linalg.norm(way)), 1e-300)))


def _least_distance(n: Array) -> Array | None:
    """The shortest d (3,) with n . d <= -1 for all rows of n (k, 3), by non-negative least squares; None: none does.

    Lawson and Hanson's least distance problem ("Solving least squares problems", 1974, chapter 23).
    """
    if not len(n):
        return None
    weights, residual = nnls(np.concatenate([-n.T, np.ones((1, len(n)))]), np.array([0.0, 0.0, 0.0, 1.0]))
    rest = np.concatenate([-n.T @ weights, [weights.sum() - 1.0]])
    if residual < 1e-6 or -rest[3] < 1e-9:
        return None
    way: Array = rest[:3] / -rest[3]
    return way
