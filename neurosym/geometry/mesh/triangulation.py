"""Polygons into triangles. A fan is right for convex ones only, so any other is cut ear by ear.

Polygons of real parts are seldom quite flat, and two parts that mate share them. So a fan starts where the corners say,
not where the file begins: the same corners give the same triangles in both parts, and the two surfaces coincide.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurosym.support.arrays import Array, Numbers, Truths


def triangulate(vertices: Array, polygons: Sequence[Numbers]) -> Numbers:
    """Triangles of polygons given as numbers of vertices.

    Args:
        vertices: float64 (n, 3).
        polygons: int64 (k,) each, k >= 3, nearly flat; corners may repeat, as where a hole is joined to the rim.

    Returns:
        int64 (m, 3), the sum of k - 2 triangles, wound as the polygons are.
    """
    found: list[Numbers] = []
    sizes = np.array([len(p) for p in polygons], dtype=np.int64)
    for size in np.unique(sizes):
        same = np.array([p for p in polygons if len(p) == size], dtype=np.int64)
        if size == 3:
            found.append(same)
            continue
        convex = _are_convex(vertices[same])
        same[convex] = _turned(same[convex], vertices)
        fan = np.stack([np.zeros(size - 2, dtype=np.int64), np.arange(1, size - 1), np.arange(2, size)], axis=1)
        found.append(same[convex][:, fan].reshape(-1, 3))
        found.extend(polygon[_ears(vertices[polygon])] for polygon in same[~convex])
    return np.concatenate(found) if found else np.zeros((0, 3), dtype=np.int64)


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
    """Triangles, int64 (k - 2, 3), of one polygon (k, 3), by clipping the ear that leaves the widest angle."""
    normal = _newell(corners[None])[0]
    drop = int(np.argmax(np.abs(normal)))
    flat = np.delete(corners, drop, axis=1)
    if (normal[drop] < 0) != (drop == 1):
        flat = flat[:, ::-1]
    left = list(range(len(corners)))
    found = []
    while len(left) > 3:
        ring = flat[left]
        before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
        turn = _cross(ring - before, after - ring)
        lengths = np.linalg.norm(ring - before, axis=1) * np.linalg.norm(after - ring, axis=1)
        order = np.argsort(-turn / np.maximum(lengths, 1e-300))
        chosen = next((int(i) for i in order if turn[i] > 0 and _is_empty(ring, int(i))), int(order[0]))
        found.append([left[chosen - 1], left[chosen], left[(chosen + 1) % len(left)]])
        del left[chosen]
    return np.array([*found, left], dtype=np.int64)


def _is_empty(ring: Array, i: int) -> bool:
    """Whether no other corner lies in the triangle at corner `i`; corners in the same place do not count."""
    a, b, c = ring[i - 1], ring[i], ring[(i + 1) % len(ring)]
    within = (_cross(b - a, ring - a) >= 0) & (_cross(c - b, ring - b) >= 0) & (_cross(a - c, ring - c) >= 0)
    at_corner = (ring == a).all(axis=1) | (ring == b).all(axis=1) | (ring == c).all(axis=1)
    return not bool((within & ~at_corner).any())


def _cross(u: Array, v: Array) -> Array:
    product: Array = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return product
