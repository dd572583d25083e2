"""Loops over contact corners, compiled: what springs do at given displacements, and the system of Newton's method.

Arrays: `Ja`, `Jb` float64 (c, 3, 6) take the scaled displacement of a part to that of a corner along (normal, tangent,
tangent); `pa`, `pb` int64 (c,) are places of its parts in the system, -1 for what cannot move there.
"""

from __future__ import annotations

import numpy as np

from neurosym.support.arrays import Array, Numbers
from neurosym.support.compiled import compiled


@compiled
def opened(Ja: Array, Jb: Array, a: Numbers, b: Numbers, u: Array) -> Array:
    """float64 (c, 3): how far the two sides of each corner move apart when parts move by `u` (n, 6)."""
    d = np.zeros((len(a), 3))
    for c in range(len(a)):
        for i in range(3):
            total = 0.0
            if a[c] >= 0:
                for j in range(6):
                    total += Ja[c, i, j] * u[a[c], j]
            if b[c] >= 0:
                for j in range(6):
                    total += Jb[c, i, j] * u[b[c], j]
            d[c, i] = total
    return d


@compiled
def pushed(d: Array, bound: Array, kn: Array, kt: Array, gap: Array) -> Array:
    """float64 (c, 3): the forces on a's side, along (normal, tangent, tangent)."""
    f = np.zeros((len(d), 3))
    for c in range(len(d)):
        x = -d[c, 0] - gap[c]
        if x > 0:
            f[c, 0] = kn[c] * x
        p, q = d[c, 1], d[c, 2]
        e = np.sqrt(p * p + q * q)
        k = kt[c] if kt[c] * e < bound[c] else bound[c] / e if e > 0 else 0.0
        f[c, 1], f[c, 2] = -k * p, -k * q
    return f


@compiled
def summed(f: Array, Ja: Array, Jb: Array, pa: Numbers, pb: Numbers, m: int) -> tuple[Array, Array]:
    """What forces at corners add up to on each part, float64 (m, 6), and the sum of their sizes, float64 (m,)."""
    total, pressed = np.zeros((m, 6)), np.zeros(m)
    for c in range(len(f)):
        size = f[c, 0] + abs(f[c, 1]) + abs(f[c, 2])
        if pa[c] >= 0:
            pressed[pa[c]] += size
        if pb[c] >= 0:
            pressed[pb[c]] += size
        for j in range(6):
            if pa[c] >= 0:
                total[pa[c], j] += Ja[c, 0, j] * f[c, 0] + Ja[c, 1, j] * f[c, 1] + Ja[c, 2, j] * f[c, 2]
            if pb[c] >= 0:
                total[pb[c], j] += Jb[c, 0, j] * f[c, 0] + Jb[c, 1, j] * f[c, 1] + Jb[c, 2, j] * f[c, 2]
    return total, pressed


@compiled
def _add(band: Array, J: Array, K: Array, L: Array, p: int, q: int, c: int) -> None:
    """Add J' K L of corner c at the blocks of parts p >= q."""
    for j in range(6):
        k0 = J[c, 0, j] * K[0, 0] + J[c, 1, j] * K[1, 0] + J[c, 2, j] * K[2, 0]
        k1 = J[c, 1, j] * K[1, 1] + J[c, 2, j] * K[2, 1]
        k2 = J[c, 1, j] * K[1, 2] + J[c, 2, j] * K[2, 2]
        for i in range(6):
            row, column = 6 * p + j, 6 * q + i
            if row >= column:
                band[column, row - column] += k0 * L[c, 0, i] + k1 * L[c, 1, i] + k2 * L[c, 2, i]


@compiled
def fill(
    band: Array,
    ground: Array,
    d: Array,
    bound: Array,
    kn: Array,
    kt: Array,
    gap: Array,
    Ja: Array,
    Jb: Array,
    pa: Numbers,
    pb: Numbers,
) -> None:
    """The Hessian of the energy, lower band: band[j, i - j] = H[i, j]. `ground`, float64 (m,): stiffness a part."""
    band[:] = 0.0
    for p in range(len(ground)):
        for j in range(6):
            band[6 * p + j, 0] = ground[p]
    K = np.zeros((3, 3))
    for c in range(len(d)):
        K[0, 0] = kn[c] if -d[c, 0] - gap[c] >= 0 else 0.0
        p, q = d[c, 1], d[c, 2]
        e = np.sqrt(p * p + q * q)
        if kt[c] * e < bound[c]:
            K[1, 1] = K[2, 2] = kt[c]
            K[1, 2] = K[2, 1] = 0.0
        else:
            k = bound[c] / (e * e * e) if e > 0 else 0.0
            K[1, 1], K[2, 2] = k * q * q, k * p * p
            K[1, 2] = K[2, 1] = -k * p * q
        if K[0, 0] == 0.0 and K[1, 1] == 0.0 and K[2, 2] == 0.0:
            continue
        if pa[c] >= 0:
            _add(band, Ja, K, Ja, pa[c], pa[c], c)
        if pb[c] >= 0:
            _add(band, Jb, K, Jb, pb[c], pb[c], c)
        if pa[c] >= 0 and pb[c] >= 0:
            if pa[c] > pb[c]:
                _add(band, Ja, K, Jb, pa[c], pb[c], c)
            else:
                _add(band, Jb, K, Ja, pb[c], pa[c], c)


@compiled
def slope(share: float, d: Array, change: Array, bound: Array, kn: Array, kt: Array, gap: Array) -> tuple[float, float]:
    """The first and second derivative of the springs' energy along `d + share * change`."""
    first, second = 0.0, 0.0
    for c in range(len(d)):
        x = -(d[c, 0] + share * change[c, 0]) - gap[c]
        if x > 0:
            first -= kn[c] * x * change[c, 0]
            second += kn[c] * change[c, 0] ** 2
        v, w = change[c, 1], change[c, 2]
        p, q = d[c, 1] + share * v, d[c, 2] + share * w
        e = np.sqrt(p * p + q * q)
        if kt[c] * e < bound[c]:
            first += kt[c] * (p * v + q * w)
            second += kt[c] * (v * v + w * w)
        elif e > 0:
            first += bound[c] / e * (p * v + q * w)
            second += bound[c] / (e * e * e) * (p * w - q * v) ** 2
    return first, second
