"""Polygons into triangles. A fan is right for convex ones only, so any other is cut ear by ear.

Polygons of real parts are seldom quite flat, and two parts that mate share them. So cutting starts where the corners
say, not where the file begins: the same corners give the same triangles in both parts, and the two surfaces coincide.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from mapbox_earcut import triangulate_float64

from neurosym.support.arrays import Array, Numbers, Truths


def triangulate(vertices: Array, polygons: Iterable[Sequence[int] | Numbers]) -> Numbers:
    """Triangles of polygons given as numbers of vertices.

    Args:
        vertices: float64 (n, 3).
        polygons: k >= 3 numbers each, nearly flat; corners may repeat, as where a hole is joined to the rim.

    Returns:
        int64 (m, 3), the sum of k - 2 triangles, wound as the polygons are.
    """
    triangles: list[Numbers] = []
    by_size: dict[int, list[Sequence[int] | Numbers]] = {}
    for polygon in polygons:
        by_size.setdefault(len(polygon), []).append(polygon)
    for size, alike in sorted(by_size.items()):
        same = np.array(alike, dtype=np.int64)
        if size == 3:
            triangles.append(same)
            continue
        same = _turned(same, vertices)
        convex = _are_convex(vertices[same])
        fan = np.stack([np.zeros(size - 2, dtype=np.int64), np.arange(1, size - 1), np.arange(2, size)], axis=1)
        triangles.append(same[convex][:, fan].reshape(-1, 3))
        triangles.extend(polygon[_ears(vertices[polygon])] for polygon in same[~convex])
    return np.concatenate(triangles) if triangles else np.zeros((0, 3), dtype=np.int64)


def _turned(polygons: Numbers, vertices: Array) -> Numbers:
    """Polygons (n, k) that start, of four corners, on the shorter diagonal, else at the least corner (x, y, z).

    The least corner decides, too, between diagonals of one length.
    """
    corners = vertices[polygons]
    rows = np.arange(len(polygons))
    lowest = np.ones(polygons.shape, dtype=bool)
    for axis in range(3):
        lowest &= corners[..., axis] == np.where(lowest, corners[..., axis], np.inf).min(axis=1, keepdims=True)
    least = lowest.argmax(axis=1)
    if polygons.shape[1] == 4:
        one, other = (np.linalg.norm(corners[:, k] - corners[:, k + 2], axis=1) for k in (0, 1))
        tie = np.abs(one - other) <= 1e-9 * np.maximum(one, other)
        least = np.where(tie, least % 2, (other < one).astype(np.int64))
    start = (least[:, None] + np.arange(polygons.shape[1])) % polygons.shape[1]
    return np.asarray(polygons[rows[:, None], start])


def _are_convex(corners: Array) -> Truths:
    """bool (n,): which of the polygons, float64 (n, k, 3), turn one way only, and once."""
    with np.errstate(all="ignore"):
        normal = _newell(corners)
        edges = np.roll(corners, -1, axis=1) - corners
        turns = np.einsum("nkd,nd->nk", np.cross(edges, np.roll(edges, -1, axis=1)), normal)
        size = np.einsum("nd,nd->n", normal, normal)
        # A star turns one way, too, but more than once: then some fan triangle is turned over.
        spokes = corners[:, 1:] - corners[:, :1]
        fans = np.einsum("nkd,nd->nk", np.cross(spokes[:, :-1], spokes[:, 1:]), normal)
        limit = -1e-9 * size[:, None]
        return np.asarray((turns >= limit).all(axis=1) & (fans >= limit).all(axis=1))


def _newell(corners: Array) -> Array:
    """Twice the area vectors, float64 (n, 3), of polygons (n, k, 3)."""
    local = corners - corners[:, :1]
    vectors: Array = np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1)
    return vectors


def _ears(corners: Array) -> Numbers:
    """Triangles, int64 (k - 2, 3), of one polygon (k, 3), cut the same way from either side of it."""
    normal = _newell(corners[None])[0]
    drop = int(np.argmax(np.abs(normal)))
    order = np.arange(len(corners))
    front = bool((normal[drop] > 0) != (drop == 1))
    if not front:
        order[1:] = order[:0:-1]
    flat = np.delete(corners, drop, axis=1)[order]
    cut = order[triangulate_float64(flat, np.array([len(flat)], dtype=np.uint32)).reshape(-1, 3)]
    return cut if front else cut[:, ::-1]
