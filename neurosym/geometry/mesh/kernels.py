"""Compiled loops over triangles: trees of bounds, and what is asked of pairs of triangles that are near.

Triangles lie in one array, body by body: body b has those from first[b] to first[b + 1], along a curve that fills
space (`neurosym.geometry.mesh.trees`). Its tree of n triangles has the root 1, the children 2 k and 2 k + 1 of node k,
and the leaf n + t for triangle t; the bounds of its node k are row 2 first[b] + k of `low` and `high`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.compiled import compiled, inlined


@compiled
def tree_bounds(triangles: Array, used: Truths, first: Numbers) -> tuple[Array, Array]:
    """Bounds of the nodes of all trees, float64 (2 m, 3) each; nodes without a triangle in use are empty."""
    low = np.full((2 * len(triangles), 3), np.inf)
    high = np.full((2 * len(triangles), 3), -np.inf)
    for b in range(len(first) - 1):
        n, base = first[b + 1] - first[b], 2 * first[b]
        for t in range(n):
            if used[first[b] + t]:
                corners = triangles[first[b] + t]
                for k in range(3):
                    low[base + n + t, k] = min(corners[0, k], corners[1, k], corners[2, k])
                    high[base + n + t, k] = max(corners[0, k], corners[1, k], corners[2, k])
        gather(low, high, base, n)
    return low, high


@compiled
def facing_bounds(triangles: Array, normals: Array, used: Truths, first: Numbers) -> tuple[Array, Array]:
    """The same with six columns, the bounds of normals (m, 3) in the last three."""
    low = np.full((2 * len(triangles), 6), np.inf)
    high = np.full((2 * len(triangles), 6), -np.inf)
    for b in range(len(first) - 1):
        n, base = first[b + 1] - first[b], 2 * first[b]
        for t in range(n):
            if used[first[b] + t]:
                corners = triangles[first[b] + t]
                for k in range(3):
                    low[base + n + t, k] = min(corners[0, k], corners[1, k], corners[2, k])
                    high[base + n + t, k] = max(corners[0, k], corners[1, k], corners[2, k])
                    low[base + n + t, 3 + k] = high[base + n + t, 3 + k] = normals[first[b] + t, k]
        gather(low, high, base, n)
    return low, high


@inlined
def gather(low: Array, high: Array, base: int, n: int) -> None:
    """Bounds of a tree's inner nodes from those of its leaves."""
    for node in range(base + n - 1, base, -1):
        child = 2 * node - base
        for k in range(low.shape[1]):
            low[node, k] = min(low[child, k], low[child + 1, k])
            high[node, k] = max(high[child, k], high[child + 1, k])


@inlined
def meeting(
    low: Array, high: Array, low_b: Array, high_b: Array, labels: Numbers, first: Numbers, pair: Numbers,
    shift: Array, gap: float,
) -> Iterator[tuple[int, int]]:  # fmt: skip
    """Triangles of the first body of a pair, and of the second moved by `shift`, whose bounds come within `gap`.

    Where bounds have more than three columns these are normals, and have to be opposite.

    Pairs with one label of 0 or more are left out. Of a body with itself each pair comes once.
    """
    a, b = pair[0], pair[1]
    n, m, base, base_b = first[a + 1] - first[a], first[b + 1] - first[b], 2 * first[a], 2 * first[b]
    waiting = np.empty((256, 2), dtype=np.int64)
    waiting[0, 0] = waiting[0, 1] = 1
    top = 1 if n and m else 0
    while top:
        top -= 1
        p, q = waiting[top, 0], waiting[top, 1]
        x, y = base + p, base_b + q
        size = 0.0
        for k in range(low.shape[1]):
            least, most = low_b[y, k] + shift[k], high_b[y, k] + shift[k]
            if k > 2:  # normals: those of the second body turned round
                least, most = -most, -least
            if low[x, k] - gap > most or least > high[x, k] + gap:
                break
            size += high[x, k] - low[x, k] - most + least
        else:
            if labels[x] >= 0 and labels[x] == labels[y]:
                continue
            if p >= n and q >= m:
                yield first[a] + p - n, first[b] + q - m
            elif a == b and p == q:
                waiting[top, 0], waiting[top, 1] = 2 * p, 2 * p
                waiting[top + 1, 0], waiting[top + 1, 1] = 2 * p + 1, 2 * p + 1
                waiting[top + 2, 0], waiting[top + 2, 1] = 2 * p, 2 * p + 1
                top += 3
            elif q >= m or (p < n and not size < 0):
                waiting[top, 0], waiting[top, 1] = 2 * p, q
                waiting[top + 1, 0], waiting[top + 1, 1] = 2 * p + 1, q
                top += 2
            else:
                waiting[top, 0], waiting[top, 1] = p, 2 * q
                waiting[top + 1, 0], waiting[top + 1, 1] = p, 2 * q + 1
                top += 2


@inlined
def keep(points: Array, count: int, kept: Array, c: float, cx: float, cy: float) -> int:
    """Where c + cx x + cy y >= 0 in a convex polygon (Sutherland and Hodgman 1974), into `kept`: number of corners."""
    n = 0
    if count:
        x0, y0 = points[count - 1, 0], points[count - 1, 1]
        before = c + cx * x0 + cy * y0
    for k in range(count):
        x, y = points[k, 0], points[k, 1]
        here = c + cx * x + cy * y
        if (before >= 0) != (here >= 0):
            share = before / (before - here)
            kept[n, 0], kept[n, 1] = x0 + share * (x - x0), y0 + share * (y - y0)
            n += 1
        if here >= 0:
            kept[n, 0], kept[n, 1] = x, y
            n += 1
        x0, y0, before = x, y, here
    return n


@inlined
def clip(a: Array, b: Array, dx: float, dy: float, one: Array, two: Array) -> int:
    """The common part of two triangles of the plane, corners in the first two columns, the second moved: into `one`."""
    area = (a[1, 0] - a[0, 0]) * (a[2, 1] - a[0, 1]) - (a[1, 1] - a[0, 1]) * (a[2, 0] - a[0, 0])
    sign = 1.0 if area > 0 else -1.0
    for k in range(3):
        one[k, 0], one[k, 1] = b[k, 0] + dx, b[k, 1] + dy
    n = 3
    for k in range(3):
        x, y = a[k, 0], a[k, 1]
        ex, ey = sign * (a[(k + 1) % 3, 0] - x), sign * (a[(k + 1) % 3, 1] - y)
        n = keep(one, n, two, ey * x - ex * y, -ey, ex)
        one, two = two, one
    # Three turns: the last went into what came as `two`.
    for k in range(n):
        two[k, 0], two[k, 1] = one[k, 0], one[k, 1]
    return n


@inlined
def area_and_rim(points: Array, n: int) -> tuple[float, float]:
    """Area and circumference of a convex polygon, either way round."""
    area = rim = 0.0
    for k in range(n):
        x, y = points[k, 0] - points[0, 0], points[k, 1] - points[0, 1]
        x1, y1 = points[(k + 1) % n, 0] - points[0, 0], points[(k + 1) % n, 1] - points[0, 1]
        area += x * y1 - y * x1
        rim += np.sqrt((x1 - x) ** 2 + (y1 - y) ** 2)
    return abs(area) / 2, rim


@inlined
def slope(t: Array) -> tuple[float, float]:
    """How the height (third column) of a triangle changes along the first two."""
    x1, y1, h1 = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    x2, y2, h2 = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    area = x1 * y2 - y1 * x2
    return (h1 * y2 - h2 * y1) / area, (x1 * h2 - x2 * h1) / area


@compiled
def blocked(
    triangles: Array, low: Array, high: Array, low_b: Array, high_b: Array, first: Numbers, pairs: Numbers,
    shifts: Array, touch: float, most: int,
) -> tuple[Numbers, Array]:  # fmt: skip
    """Whether the first body of each pair (k, 2) hits the second, moved by its shift (k, 3), on its way up to infinity.

    Args:
        triangles: heights in the third column.
        low, high, low_b, high_b: of the trees of faces that look down, and of those that look up.
        touch: the region where the second reaches above the first, deeper than this across the two faces, has to be
            wider than this.
        most: so many narrow pieces of the region are gathered for a pair.

    Returns:
        int64 (k,): 1 for a hit, 0 for none, 2 where there are more narrow pieces than `most`; and the narrow pieces of
        pairs not hit, float64 (n, 1 + 16): number of the pair, and eight corners, the last one repeated.
    """
    answers = np.zeros(len(pairs), dtype=np.int64)
    pieces = np.empty((64, 17))
    labels = np.full(len(low), -1, dtype=np.int64)
    one, two = np.empty((12, 2)), np.empty((12, 2))
    count = 0
    for k in range(len(pairs)):
        began, shift = count, shifts[k]
        for i, j in meeting(low, high, low_b, high_b, labels, first, pairs[k], shift, 0.0):
            n = clip(triangles[i], triangles[j], shift[0], shift[1], one, two)
            if n < 3:
                continue
            ax, ay = slope(triangles[i])
            bx, by = slope(triangles[j])
            # Across the two faces: the ball between them over a point is as wide.
            scale = 2 / (np.sqrt(1 + ax * ax + ay * ay) + np.sqrt(1 + bx * bx + by * by))
            s, t = triangles[i, 0], triangles[j, 0]
            c = t[2] + shift[2] - bx * (t[0] + shift[0]) - by * (t[1] + shift[1]) - s[2] + ax * s[0] + ay * s[1]
            n = keep(one, n, two, c - touch / scale, bx - ax, by - ay)
            if n < 3:
                continue
            area, rim = area_and_rim(two, n)
            if area > touch * max(rim / 2, touch):
                answers[k], count = 1, began
                break
            if area > 0:
                if count - began == most:
                    answers[k] = 2
                    break
                pieces = room_for(pieces, count)
                pieces[count, 0] = k
                for c in range(8):
                    pieces[count, 1 + 2 * c] = two[min(c, n - 1), 0]
                    pieces[count, 2 + 2 * c] = two[min(c, n - 1), 1]
                count += 1
    return answers, pieces[:count]


@inlined
def room_for(rows: NDArray[Any], count: int) -> NDArray[Any]:
    """Rows of numbers in an array that has room for one more than the first `count` of them."""
    if count < len(rows):
        return rows
    larger = np.empty((2 * len(rows), rows.shape[1]), dtype=rows.dtype)
    for r in range(count):
        for k in range(rows.shape[1]):
            larger[r, k] = rows[r, k]
    return larger


@compiled
def facing_pairs(
    low: Array, high: Array, low_b: Array, high_b: Array, normals: Array, first: Numbers, pairs: Numbers, gaps: Array,
    sine: float,
) -> Numbers:  # fmt: skip
    """Triangles of two bodies that look at one another from no farther than a gap: number of the pair, both, (n, 3).

    Args:
        gaps: float64 (k,): of each pair of bodies.
        sine: of the largest angle between one normal (m, 3) and the other turned round; 1: any less than square.
    """
    near, labels = np.empty((64, 3), dtype=np.int64), np.full(len(low), -1, dtype=np.int64)
    count, still = 0, np.zeros(low.shape[1])
    for k in range(len(pairs)):
        for i, j in meeting(low, high, low_b, high_b, labels, first, pairs[k], still, gaps[k]):
            a, b = normals[i], normals[j]
            if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < -0.1:
                x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
                if x * x + y * y + z * z <= sine * sine:
                    near = room_for(near, count)
                    near[count, 0], near[count, 1], near[count, 2] = k, i, j
                    count += 1
    return near[:count]


@inlined
def straddles(corners: Array, other: Array, normal: Array, margin: float) -> bool:
    """Whether a triangle reaches beyond the plane of another one of a normal, by a margin on either side."""
    least = most = 0.0
    for c in range(3):
        height = 0.0
        for k in range(3):
            height += (corners[c, k] - other[0, k]) * normal[k]
        least, most = min(least, height), max(most, height)
    return least < -margin and most > margin


@compiled
def straddling_pairs(
    low: Array, high: Array, low_b: Array, high_b: Array, labels: Numbers, triangles: Array, normals: Array,
    first: Numbers, pairs: Numbers, margin: float,
) -> Numbers:  # fmt: skip
    """Triangles of two bodies, or of one, that reach beyond one another's planes: pair and both, int64 (n, 3)."""
    near = np.empty((64, 3), dtype=np.int64)
    count, still = 0, np.zeros(3)
    for k in range(len(pairs)):
        for i, j in meeting(low, high, low_b, high_b, labels, first, pairs[k], still, 0.0):
            crosses = i != j and straddles(triangles[i], triangles[j], normals[j], margin)
            if crosses and straddles(triangles[j], triangles[i], normals[i], margin):
                near = room_for(near, count)
                near[count, 0], near[count, 1], near[count, 2] = k, i, j
                count += 1
    return near[:count]


@compiled
def common_parts(first: Array, second: Array) -> tuple[Array, Array, Numbers]:
    """What pairs of triangles of the plane, (n, 3, 2) each, have in common.

    Returns:
        Areas (n,), corners (n, 8, 2), the last repeated, and how many corners there are (n,).
    """
    areas, parts, counts = np.zeros(len(first)), np.zeros((len(first), 8, 2)), np.zeros(len(first), dtype=np.int64)
    one, two = np.empty((12, 2)), np.empty((12, 2))
    for k in range(len(first)):
        n = clip(first[k], second[k], 0.0, 0.0, one, two)
        if n > 2:
            areas[k], counts[k] = area_and_rim(one, n)[0], min(n, 8)
            for c in range(8):
                parts[k, c, 0], parts[k, c, 1] = one[min(c, n - 1), 0], one[min(c, n - 1), 1]
    return areas, parts, counts
