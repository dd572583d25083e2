"""Compiled loops: how far points and surfaces are from surfaces, and what lies inside. Trees are those of `kernels`."""

from __future__ import annotations

from typing import Any

import numpy as np

from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.compiled import compiled, inlined

Vector = Any  # three numbers

#: Which way rays are sent: along no axis, so that they meet no edge of a mesh that is drawn along the axes.
_RAY = (0.0271828, 0.0314159, 0.9991366)


@compiled
def are_inside(points: Array, body: Numbers, triangles: Array, low: Array, high: Array, first: Numbers) -> Truths:
    """Which points (n, 3) the surface of a body (n,) goes round, by counting its faces along a ray from each."""
    inside = np.zeros(len(points), dtype=np.bool_)
    waiting = np.empty(128, dtype=np.int64)
    for k in range(len(points)):
        p, b = points[k], body[k]
        n, base = first[b + 1] - first[b], 2 * first[b]
        waiting[0] = 1
        top, winding = int(n > 0), 0
        while top:
            top -= 1
            node = waiting[top]
            enter, leave = 0.0, np.inf
            for d in range(3):
                enter = max(enter, (low[base + node, d] - p[d]) / _RAY[d])
                leave = min(leave, (high[base + node, d] - p[d]) / _RAY[d])
            if enter > leave:
                continue
            if node < n:
                waiting[top], waiting[top + 1] = 2 * node, 2 * node + 1
                top += 2
            else:
                winding += _crossed(p, triangles[first[b] + node - n])
        inside[k] = winding > 0
    return inside


@inlined
def _crossed(p: Array, t: Array) -> int:
    """1 where the ray from a point leaves through a triangle, -1 where it enters, 0 where it does neither."""
    signs = 0
    for k in range(3):
        # The same number, up to its sign, for the triangle on the other side of the edge: no ray slips through between.
        turn = _dot(_cross(_minus(t[k], p), _minus(t[(k + 1) % 3], p)), _RAY)
        signs += 1 if turn >= 0 else -1
    if abs(signs) < 3:
        return 0
    return signs // 3 if _dot(_normal(t), _minus(t[0], p)) * signs > 0 else 0


@compiled
def nearest(points: Array, body: Numbers, triangles: Array, low: Array, high: Array, first: Numbers) -> Array:
    """How far each point (n, 3) is from the surface of a body (n,): float64 (n,)."""
    distances = np.empty(len(points))
    waiting = np.empty(128, dtype=np.int64)
    for k in range(len(points)):
        p, b = points[k], body[k]
        n, base = first[b + 1] - first[b], 2 * first[b]
        waiting[0] = 1
        top, best = int(n > 0), np.inf
        while top:
            top -= 1
            node = waiting[top]
            if _box_distance(p, p, low[base + node], high[base + node]) >= best:
                continue
            if node >= n:
                best = min(best, _to_triangle(p, triangles[first[b] + node - n]))
                continue
            # The nearer one is looked at first.
            one, two = 2 * node, 2 * node + 1
            if _box_distance(p, p, low[base + one], high[base + one]) < _box_distance(
                p, p, low[base + two], high[base + two]
            ):
                one, two = two, one
            waiting[top], waiting[top + 1] = one, two
            top += 2
        distances[k] = np.sqrt(best)
    return distances


@compiled
def surface_gaps(
    pairs: Numbers, triangles: Array, low: Array, high: Array, first: Numbers, enough: float, far: float
) -> Array:
    """How far apart the surfaces of two bodies are, for pairs (k, 2): float64 (k,), 0 where they cross.

    Args:
        enough: of surfaces as near as this it is only told that they are.
        far: of surfaces farther apart than this, as well.
    """
    gaps = np.empty(len(pairs))
    waiting = np.empty((256, 2), dtype=np.int64)
    for k in range(len(pairs)):
        a, b = pairs[k]
        n, m, base, base_b = first[a + 1] - first[a], first[b + 1] - first[b], 2 * first[a], 2 * first[b]
        waiting[0] = 1
        top, best = int(n > 0 and m > 0), far * far
        while top and best > enough * enough:
            top -= 1
            p, q = waiting[top]
            x, y = base + p, base_b + q
            if _box_distance(low[x], high[x], low[y], high[y]) >= best:
                continue
            if p >= n and q >= m:
                best = min(best, _apart(triangles[first[a] + p - n], triangles[first[b] + q - m]))
                continue
            if q >= m or (p < n and _size(low[x], high[x]) >= _size(low[y], high[y])):
                one, two = (2 * p, q), (2 * p + 1, q)
            else:
                one, two = (p, 2 * q), (p, 2 * q + 1)
            x, y, z, w = base + one[0], base_b + one[1], base + two[0], base_b + two[1]
            if _box_distance(low[x], high[x], low[y], high[y]) < _box_distance(low[z], high[z], low[w], high[w]):
                one, two = two, one
            waiting[top, 0], waiting[top, 1] = one
            waiting[top + 1, 0], waiting[top + 1, 1] = two
            top += 2
        gaps[k] = np.sqrt(best)
    return gaps


@inlined
def _box_distance(low: Array, high: Array, low_b: Array, high_b: Array) -> float:
    """The square of the distance of two boxes."""
    square = 0.0
    for d in range(3):
        apart = max(low_b[d] - high[d], low[d] - high_b[d], 0.0)
        square += apart * apart
    return square


@inlined
def _size(low: Array, high: Array) -> float:
    size: float = high[0] - low[0] + high[1] - low[1] + high[2] - low[2]
    return size


@inlined
def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def _plus(a: Vector, share: float, u: Vector) -> Vector:
    return a[0] + share * u[0], a[1] + share * u[1], a[2] + share * u[2]


@inlined
def _dot(a: Vector, b: Vector) -> float:
    product: float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


@inlined
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def _normal(t: Array) -> Vector:
    return _cross(_minus(t[1], t[0]), _minus(t[2], t[0]))


@inlined
def _over(p: Vector, t: Array, n: Vector) -> bool:
    """Whether the foot of a point on the plane of a triangle of normal n lies in the triangle."""
    for k in range(3):
        a = t[k]
        if _dot(_cross(n, _minus(t[(k + 1) % 3], a)), _minus(p, a)) < 0:
            return False
    return True


@inlined
def _to_segment(p: Vector, a: Vector, b: Vector) -> float:
    along, away = _minus(b, a), _minus(p, a)
    share = min(max(_dot(away, along) / max(_dot(along, along), 1e-300), 0.0), 1.0)
    off = _plus(away, -share, along)
    return _dot(off, off)


@inlined
def _to_triangle(p: Vector, t: Array) -> float:
    """The square of the distance of a point from a triangle."""
    n = _normal(t)
    if _over(p, t, n):
        height = _dot(n, _minus(p, t[0]))
        return height * height / max(_dot(n, n), 1e-300)
    return min(_to_segment(p, t[0], t[1]), _to_segment(p, t[1], t[2]), _to_segment(p, t[2], t[0]))


@inlined
def _between_segments(a: Vector, b: Vector, c: Vector, d: Vector) -> float:
    """The square of the distance of two segments (Ericson, "Real-time collision detection", 2005, 5.1.9)."""
    u, v, w = _minus(b, a), _minus(d, c), _minus(a, c)
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    area = uu * vv - uv * uv
    s = min(max((uv * vw - vv * uw) / area, 0.0), 1.0) if area > 1e-14 * uu * vv else 0.0
    t = min(max((uv * s + vw) / max(vv, 1e-300), 0.0), 1.0)
    s = min(max((uv * t - uw) / max(uu, 1e-300), 0.0), 1.0)
    off = _plus(_plus(w, s, u), -t, v)
    return _dot(off, off)


@inlined
def _pierces(a: Vector, b: Vector, t: Array, n: Vector) -> bool:
    """Whether a segment goes through a triangle of normal n."""
    start, end = _dot(n, _minus(a, t[0])), _dot(n, _minus(b, t[0]))
    if start * end > 0 or start == end:
        return False
    return _over(_plus(a, start / (start - end), _minus(b, a)), t, n)


@inlined
def _apart(s: Array, t: Array) -> float:
    """The square of the distance of two triangles."""
    best, n, m = np.inf, _normal(s), _normal(t)
    for k in range(3):
        a, b = s[k], s[(k + 1) % 3]
        if _pierces(a, b, t, m) or _pierces(t[k], t[(k + 1) % 3], s, n):
            return 0.0
        best = min(best, _to_triangle(a, t), _to_triangle(t[k], s))
        for e in range(3):
            best = min(best, _between_segments(a, b, t[e], t[(e + 1) % 3]))
    return best
