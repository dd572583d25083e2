"""Triangles in bulk: which pierce one another, what is inside, how far the surface is."""

from __future__ import annotations

import numpy as np

from neurosym.geometry.mesh import distances as points_and_trees
from neurosym.geometry.mesh import kernels, trees
from neurosym.geometry.mesh.connections import adjacent, alike, has_valley
from neurosym.geometry.mesh.flats import Flats
from neurosym.geometry.mesh.topology import in_use, signed_volume
from neurosym.support.arrays import Array, Numbers, Truths

#: So many flats of a mesh are looked at as lids.
LIDS = 16

#: Which of 997 faces are held against all vertices first: of most surfaces that are not convex one of them shows it.
_SOME = np.arange(32) * 617 % 997


def area_vectors(triangles: Array) -> Array:
    """float64 (m, 3): normals, outward, each as long as twice the area."""
    return np.asarray(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))


def plane_axes(normals: Array) -> tuple[Array, Array]:
    """Two unit vectors, float64 (..., 3) each, that span the plane across each unit normal (..., 3)."""
    u = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=-1)])
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    return u, np.cross(normals, u)


def are_convex(vertices: Array, faces: Numbers, margin: float) -> bool:
    """Whether no vertex (n, 3) of a closed mesh lies above the plane of any face (m, 3) by more than `margin`."""
    corners, some = vertices[in_use(vertices, faces)], vertices[faces[_SOME * len(faces) // 997]]
    planes = unit_normals(some)
    if (corners @ planes.T > np.einsum("md,md->m", some[:, 0], planes) + margin).any():
        return False
    # Without a valley along any edge a surface is convex, unless it has several parts, or goes round more than once.
    faces = alike(vertices)[0][faces]
    if has_valley(vertices, faces, adjacent(faces), margin):
        return False
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(corners)
    except QhullError:
        return False
    return bool(abs(hull.volume - signed_volume(vertices, faces)) <= 2 * margin * hull.area)


def unit_normals(triangles: Array) -> Array:
    """float64 (m, 3), outward; 0 for triangles without area."""
    normals = area_vectors(triangles)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))


def crossing_pairs(vertices: Array, faces: Numbers, margin: float) -> Numbers:
    """Pairs (k, 2) of faces (m, 3) of which an edge goes through the other, `margin` (length) on either side.

    Faces that only touch, or lie in one plane, do not cross.
    """
    body = np.zeros(len(faces), dtype=np.int64)
    t, vectors, middles, _ = trees.measured(vertices, faces)
    areas = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.maximum(areas, 1e-300)[:, None]
    # Fans and flat lids have many neighbours in their own plane: they come one after the other, and are left out.
    flats = Flats.of(t, normals, areas, middles, body, adjacent(faces), margin)
    label = flats.of_triangle
    order = np.argsort(label, kind="stable")
    order = order[trees.along_curve(t[order, 0], label[order])]
    order = order[~np.isin(label[order], _uncrossed(flats, t, margin))]
    if not len(order):
        return np.zeros((0, 2), dtype=np.int64)
    t, normals, first = t[order], normals[order], np.array([0, len(order)])
    nodes, labels = kernels.tree_bounds(t, body[order] == 0, first), trees.tree_labels(label[order], first)
    one = np.zeros((1, 2), dtype=np.int64)
    i, j = kernels.straddling_pairs(*nodes, *nodes, labels, t, normals, first, one, margin).T[1:]
    if not len(i):
        return np.zeros((0, 2), dtype=np.int64)
    hit = np.zeros(len(i), dtype=bool)
    for k in range(3):
        hit |= pierced(t[i][:, [k, (k + 1) % 3]], t[j], normals[j], margin)[0]
        hit |= pierced(t[j][:, [k, (k + 1) % 3]], t[i], normals[i], margin)[0]
    return np.asarray(order[np.stack([i[hit], j[hit]], axis=1)])


def _uncrossed(flats: Flats, t: Array, margin: float) -> Numbers:
    """Numbers of the largest flats, `LIDS` at the most, whose plane no triangle (m, 3, 3) reaches beyond near them.

    Triangles of a lid are long and thin: their bounds meet those of every wall about it.
    """
    size = np.bincount(flats.of_triangle + 1, minlength=len(flats.normals) + 1)[1:]
    uncrossed = []
    low, high = t.min(axis=1), t.max(axis=1)
    for flat in np.argsort(-size, kind="stable")[:LIDS]:
        near = ((low <= flats.high[flat]) & (high >= flats.low[flat])).all(axis=1)
        height = (t[near] - flats.middles[flat]) @ flats.normals[flat]
        if not ((height.min(axis=1) < -margin) & (height.max(axis=1) > margin)).any():
            uncrossed.append(int(flat))
    return np.array(uncrossed, dtype=np.int64)


def pierced(
    segments: Array, triangles: Array, normals: Array, margin: float
) -> tuple[Truths, Array]:
    """Whether segment i, (k, 2, 3), goes through triangle i, (k, 3, 3), bool (k,), and where, float64 (k, 3).

    It goes through when it ends more than `margin` away on either side. The triangle's edges belong to it: a segment
    that meets the edge between two triangles goes through both, not through neither.
    """
    start = np.einsum("kd,kd->k", segments[:, 0] - triangles[:, 0], normals)
    end = np.einsum("kd,kd->k", segments[:, 1] - triangles[:, 0], normals)
    crosses = (np.minimum(start, end) < -margin) & (np.maximum(start, end) > margin)
    share = start / np.where(crosses, start - end, 1.0)
    point = segments[:, 0] + share[:, None] * (segments[:, 1] - segments[:, 0])
    for k in range(3):
        edge = triangles[:, (k + 1) % 3] - triangles[:, k]
        height = np.einsum("kd,kd->k", point - triangles[:, k], np.cross(normals, edge))
        crosses &= height >= -1e-6 * margin * np.linalg.norm(edge, axis=1)
    return np.asarray(crosses), point


def are_inside(points: Array, triangles: Array) -> Truths:
    """bool (n,): which points a closed surface (m, 3, 3) goes round."""
    inside: Truths = points_and_trees.are_inside(*_one_tree(points, triangles))
    return inside


def distances(points: Array, triangles: Array) -> Array:
    """float64 (n,): how far each point is from the nearest of the triangles (m, 3, 3)."""
    nearest: Array = points_and_trees.nearest(*_one_tree(points, triangles))
    return nearest


def _one_tree(points: Array, triangles: Array) -> tuple[Array, Numbers, Array, Array, Array, Numbers]:
    one = np.zeros(len(triangles), dtype=np.int64)
    t = triangles[trees.along_curve(triangles[:, 0], one)]
    first = np.array([0, len(t)])
    return points, np.zeros(len(points), dtype=np.int64), t, *kernels.tree_bounds(t, one == 0, first), first
