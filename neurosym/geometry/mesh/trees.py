"""Triangles in the order in which trees of bounds hold them, what is measured of each, and labels of nodes."""

from __future__ import annotations

import numpy as np

from neurosym.support.arrays import Array, Numbers
from neurosym.support.compiled import compiled


def along_curve(points: Array, group: Numbers) -> Numbers:
    """Numbers of points (m, 3) group by group (ascending, (m,)), in each along a curve that fills space (Morton)."""
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    first = np.flatnonzero(np.diff(group, prepend=group[0] - 1))
    low, high = np.minimum.reduceat(points, first), np.maximum.reduceat(points, first)
    count = np.diff(first, append=len(points))
    size = np.maximum((high - low).max(axis=1), 1e-300)
    cells = ((points - np.repeat(low, count, axis=0)) * np.repeat(1023 / size, count)[:, None]).astype(np.int64)
    # Each of ten bits is moved to every third place.
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cells = (cells | cells << shift) & mask
    key = cells[:, 0] | cells[:, 1] << 1 | cells[:, 2] << 2
    return np.argsort(key + (np.repeat(np.arange(len(first)), count) << 30), kind="stable")


@compiled
def measured(points: Array, corners: Numbers) -> tuple[Array, Array, Array, Array]:
    """Of triangles given as numbers of points, int64 (m, 3): corners (m, 3, 3), area vectors, middles, longest sides.

    Area vectors (m, 3) are normals as long as twice the area.
    """
    m = len(corners)
    triangles, vectors, middles, longest = np.empty((m, 3, 3)), np.empty((m, 3)), np.empty((m, 3)), np.empty(m)
    for t in range(m):
        for c in range(3):
            for k in range(3):
                triangles[t, c, k] = points[corners[t, c], k]
        square = 0.0
        for c in range(3):
            side = 0.0
            for k in range(3):
                apart = triangles[t, c, k] - triangles[t, (c + 1) % 3, k]
                side += apart * apart
            square = max(square, side)
        longest[t] = np.sqrt(square)
        a, b, c0 = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for k in range(3):
            p, q = (k + 1) % 3, (k + 2) % 3
            vectors[t, k] = (b[p] - a[p]) * (c0[q] - a[q]) - (b[q] - a[q]) * (c0[p] - a[p])
            middles[t, k] = (a[k] + b[k] + c0[k]) / 3
    return triangles, vectors, middles, longest


@compiled
def tree_labels(labels: Numbers, first: Numbers) -> Numbers:
    """int64 (2 m,): the label that all triangles under a node bear, -1 where they differ."""
    nodes = np.full(2 * len(labels), -1, dtype=np.int64)
    for b in range(len(first) - 1):
        n, base = first[b + 1] - first[b], 2 * first[b]
        for t in range(n):
            nodes[base + n + t] = labels[first[b] + t]
        for node in range(base + n - 1, base, -1):
            child = 2 * node - base
            if nodes[child] == nodes[child + 1]:
                nodes[node] = nodes[child]
    return nodes
