"""Compiled loops over the faces of a mesh: equal rows, faces that share an edge, faces that lie in one plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.support.arrays import Array, Numbers
from neurosym.support.compiled import compiled


def alike(rows: NDArray[Any]) -> tuple[Numbers, Numbers]:
    """Equal rows (n, k) of numbers as groups: the group of each row (n,), and the first row of each group."""
    if not len(rows):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    # Adding 0 turns -0.0 into 0.0; then equal numbers have equal bits.
    return _alike(np.ascontiguousarray(rows + 0).view(np.int64))


@compiled
def _alike(rows: Numbers) -> tuple[Numbers, Numbers]:
    size = 4
    while size < 2 * len(rows):
        size *= 2
    table = np.full(size, -1, dtype=np.int64)
    group, first = np.empty(len(rows), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
    count = 0
    for r in range(len(rows)):
        mixed = np.uint64(0)
        for k in range(rows.shape[1]):
            mixed = (mixed ^ np.uint64(rows[r, k])) * np.uint64(0x9E3779B97F4A7C15)
            mixed ^= mixed >> np.uint64(29)
        place = np.int64(mixed & np.uint64(size - 1))
        while True:
            known = table[place]
            if known < 0:
                table[place] = group[r] = count
                first[count] = r
                count += 1
                break
            same = True
            for k in range(rows.shape[1]):
                if rows[first[known], k] != rows[r, k]:
                    same = False
                    break
            if same:
                group[r] = known
                break
            place = (place + 1) & (size - 1)
    return group, first[:count].copy()


def opposite(faces: Numbers) -> Numbers:
    """The half edge on the other side of each half edge, int64 (3 m,); -1 where there is not just one.

    Half edge 3 f + k goes from corner k of face f to the next.
    """
    start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    edge = alike(np.stack([np.minimum(start, end), np.maximum(start, end)], axis=1))[0]
    return _across(edge, np.bincount(edge))


def adjacent(faces: Numbers) -> Numbers:
    """The face across the edge from corner k of each face to the next, int64 (m, 3); -1 where there is not just one."""
    return opposite(faces).reshape(-1, 3) // 3


@compiled
def _across(edge: Numbers, count: Numbers) -> Numbers:
    across, last = np.full(len(edge), -1, dtype=np.int64), np.full(len(edge), -1, dtype=np.int64)
    for h in range(len(edge)):
        if count[edge[h]] == 2:
            other = last[edge[h]]
            last[edge[h]] = h
            if other >= 0:
                across[h], across[other] = other, h
    return across


@compiled
def connected(across: Numbers) -> Numbers:
    """The connected part of the surface that each face belongs to, int64 (m,), numbered as they come."""
    part = np.full(len(across), -1, dtype=np.int64)
    waiting = np.empty(3 * len(across) + 1, dtype=np.int64)
    count = 0
    for seed in range(len(across)):
        if part[seed] >= 0:
            continue
        part[seed], waiting[0] = count, seed
        top = 1
        while top:
            top -= 1
            face = waiting[top]
            for k in range(3):
                other = across[face, k]
                if other >= 0 and part[other] < 0:
                    part[other] = count
                    waiting[top] = other
                    top += 1
        count += 1
    return part


@compiled
def planar_regions(
    corners: Array, normals: Array, across: Numbers, order: Numbers, within: float
) -> tuple[Numbers, Numbers]:
    """Regions of triangles that are joined by edges and lie in one plane: of each (m,), and the first one of each.

    Args:
        corners: float64 (m, 3, 3), with `normals` (m, 3).
        across: int64 (m, 3), see `adjacent`.
        order: in which triangles are taken as the first of a region.
        within: how far from the plane (length) a corner may be.
    """
    region, firsts = np.full(len(corners), -1, dtype=np.int64), np.empty(len(corners), dtype=np.int64)
    waiting = np.empty(3 * len(corners) + 1, dtype=np.int64)
    count = 0
    for seed in order:
        if region[seed] >= 0:
            continue
        region[seed] = count
        firsts[count] = seed
        waiting[0] = seed
        top = 1
        while top:
            top -= 1
            t = waiting[top]
            for other in across[t]:
                if other < 0 or region[other] >= 0:
                    continue
                turn = 0.0
                for k in range(3):
                    turn += normals[other, k] * normals[seed, k]
                flat = turn >= 1 - 1e-6
                for c in range(3):
                    height = 0.0
                    for k in range(3):
                        height += (corners[other, c, k] - corners[seed, 0, k]) * normals[seed, k]
                    flat = flat and abs(height) <= within
                if flat:
                    region[other] = count
                    waiting[top] = other
                    top += 1
        count += 1
    return region, firsts[:count].copy()


@compiled
def has_valley(vertices: Array, faces: Numbers, across: Numbers, margin: float) -> bool:
    """Whether some face rises above the plane of a neighbour by more than a margin (length)."""
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        x = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
        y = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
        z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        limit = margin * np.sqrt(x * x + y * y + z * z)
        for other in across[f]:
            for corner in faces[max(other, 0)]:
                p = vertices[corner]
                if other >= 0 and x * (p[0] - a[0]) + y * (p[1] - a[1]) + z * (p[2] - a[2]) > limit:
                    return True
    return False
