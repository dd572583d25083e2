"""Triangles in bulk: which are near one another, which pierce one another, what is inside, how far the surface is."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from trimesh.triangles import closest_point

from neurosym.geometry.mesh.broad_phase import CHUNK, near_pairs
from neurosym.support.arrays import Array, Numbers, Truths

#: A small fixed turn, so that rays upwards meet no edge of a mesh drawn along the axes, and bounds stay tight.
_TILT = Rotation.from_rotvec([0.0137, -0.0219, 0.0171]).as_matrix()


def bounds(triangles: Array) -> tuple[Array, Array]:
    """Lowest and highest corners, float64 (m, 3) each, of triangles (m, 3, 3)."""
    return triangles.min(axis=1), triangles.max(axis=1)


def area_vectors(triangles: Array) -> Array:
    """float64 (m, 3): normals, outward, each as long as twice the area."""
    return np.asarray(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))


def plane_axes(normals: Array) -> tuple[Array, Array]:
    """Two unit vectors, float64 (..., 3) each, that span the plane across each unit normal (..., 3)."""
    u = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=-1)])
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    return u, np.cross(normals, u)


def are_convex(vertices: Array, triangles: Array, margin: float) -> bool:
    """Whether no vertex (n, 3) lies above the plane of any triangle (m, 3, 3) by more than `margin`.

    Only asked of meshes for which that is quick; of others the answer is no.
    """
    if len(vertices) * len(triangles) > 100 * CHUNK:
        return False
    normals = _unit_normals(triangles)
    offsets = np.einsum("md,md->m", triangles[:, 0], normals)
    step = max(1, 4 * CHUNK // len(triangles))
    return all(
        bool((vertices[start : start + step] @ normals.T <= offsets + margin).all())
        for start in range(0, len(vertices), step)
    )


def _unit_normals(triangles: Array) -> Array:
    normals = area_vectors(triangles)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))


def crossing_pairs(triangles: Array, margin: float, limit: int) -> Numbers | None:
    """Pairs (k, 2), i < j, of triangles (m, 3, 3) of which an edge goes through the other, `margin` on either side.

    None when more than `limit` pairs would have to be looked at. Triangles that only touch, or lie in one plane, do
    not cross.
    """
    pairs = near_pairs(bounds(triangles), bounds(triangles), limit)
    if pairs is None:
        return None
    normals = _unit_normals(triangles)
    # Fans and flat caps have many neighbours in their own plane: known by one number, they are left out at once.
    offset = np.einsum("md,md->m", triangles[:, 0], normals) / max(margin, 1e-300)
    plane = np.unique(np.round(np.column_stack([normals * 1e6, offset])), axis=0, return_inverse=True)[1].ravel()
    pairs = pairs[(pairs[:, 0] < pairs[:, 1]) & (plane[pairs[:, 0]] != plane[pairs[:, 1]])]
    found = []
    for start in range(0, len(pairs), CHUNK):
        some = pairs[start : start + CHUNK]
        for one, other in ((0, 1), (1, 0)):
            plane_of, corners = some[:, one], triangles[some[:, other]]
            height = np.einsum("kcd,kd->kc", corners - triangles[plane_of][:, :1], normals[plane_of])
            some = some[(height.min(axis=1) < -margin) & (height.max(axis=1) > margin)]
        i, j = some.T
        hit = np.zeros(len(some), dtype=bool)
        for k in range(3):
            hit |= pierced(triangles[i][:, [k, (k + 1) % 3]], triangles[j], normals[j], margin)[0]
            hit |= pierced(triangles[j][:, [k, (k + 1) % 3]], triangles[i], normals[i], margin)[0]
        found.append(some[hit])
    return np.concatenate(found) if found else pairs


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
    """bool (n,): which points a closed surface (m, 3, 3) goes round, by counting its faces above each point."""
    if not len(points) or not len(triangles):
        return np.zeros(len(points), dtype=bool)
    tilted, asked = triangles @ _TILT, points @ _TILT
    # Seen from above: which faces lie over or under which points; heights are compared after.
    flat = np.array([1.0, 1.0, 0.0])
    low, high = bounds(tilted)
    pairs = near_pairs((asked * flat, asked * flat), (low * flat, high * flat), 20 * CHUNK)
    if pairs is None:
        half = len(points) // 2
        if not half:
            raise MemoryError(f"{len(triangles):,} faces over one point")
        return np.concatenate([are_inside(points[:half], triangles), are_inside(points[half:], triangles)])
    i, j = pairs.T
    t, p = tilted[j], asked[i]
    area = _cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    weights = [_cross(t[:, (k + 1) % 3] - t[:, k], p - t[:, k]) * np.sign(area) for k in range(3)]
    over = (np.minimum(np.minimum(weights[0], weights[1]), weights[2]) >= 0) & (area != 0)
    safe = np.where(area != 0, np.abs(area), 1.0)
    over &= (weights[1] * t[:, 0, 2] + weights[2] * t[:, 1, 2] + weights[0] * t[:, 2, 2]) / safe > p[:, 2]
    winding = np.bincount(i[over], weights=np.sign(area[over]), minlength=len(points))
    return np.asarray(np.round(winding) > 0)


def distances(points: Array, triangles: Array) -> Array:
    """float64 (n,): how far each point is from the nearest of the triangles (m, 3, 3), of which there is one."""
    # No triangle farther away than the nearest corner counts.
    reach = cKDTree(triangles.reshape(-1, 3)).query(points)[0][:, None]
    pairs = near_pairs((points - reach, points + reach), bounds(triangles), 20 * CHUNK)
    if pairs is None:
        half = len(points) // 2
        if not half:
            raise MemoryError(f"{len(triangles):,} faces near one point")
        return np.concatenate([distances(points[:half], triangles), distances(points[half:], triangles)])
    found: Array = reach[:, 0].copy()
    for start in range(0, len(pairs), CHUNK):
        i, j = pairs[start : start + CHUNK].T
        nearest = closest_point(triangles[j], points[i])  # type: ignore[no-untyped-call]
        np.minimum.at(found, i, np.linalg.norm(nearest - points[i], axis=1))
    return found


def _cross(u: Array, v: Array) -> Array:
    product: Array = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return product
