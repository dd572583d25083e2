"""Kinds of structures in which parts in the way decide the order: boxes within boxes, burrs, plates with pins.

Each is drawn from a generator of random numbers, as those of `domains.structure_masonry`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise, product

import numpy as np

from domains.structure_shapes import Bounds, part
from neurosym.geometry.shapes import Part
from neurosym.support.arrays import Array


def nested(rng: np.random.Generator) -> list[Part]:
    """Boxes within boxes, each closed by a lid or a door on the same side; weights lie on the outermost."""
    count, t = int(rng.integers(1, 4)), 0.5
    parts = [part(f"bar {k}", ((2 * k / count, 2 * (k + 1) / count), (0.0, 2.0), (0.0, 2.0))) for k in range(count)]
    axis, side = ((2, 1), (2, 1), (0, -1), (0, 1), (1, -1), (1, 1))[int(rng.integers(0, 6))]
    low, high = np.zeros(3), np.full(3, 2.0)
    p, q = (other for other in range(3) if other != axis)
    for level in range(int(rng.integers(1, 4))):
        plates = []
        for a, s in ((axis, side), (axis, -side), (p, -1), (p, 1), (q, -1), (q, 1)):
            grown = np.array([other != a and other != axis and (a != q or other != p) for other in range(3)])
            near, far = low - t * grown, high + t * grown
            near[a], far[a] = (high[a], high[a] + t) if s > 0 else (low[a] - t, low[a])
            plates.append(_bounds(near, far))
        parts += [part(f"lid {level}", plates[0]), part(f"box {level}", *plates[1:])]
        low, high = low - t, high + t
    x, y = (rng.uniform(low[a], high[a] - 1) for a in range(2))
    for k in range(int(rng.integers(0, 4))):
        parts.append(part(f"weight {k}", ((x, x + 1), (y, y + 1), (float(high[2]) + k, float(high[2]) + k + 1))))
    return parts


def _bounds(low: Array, high: Array) -> Bounds:
    (x, y, z) = zip(low.tolist(), high.tolist())
    return x, y, z


def burr(rng: np.random.Generator) -> list[Part]:
    """A box of cells cut into pieces of two to five that hang together at random."""
    shape = tuple(int(n) for n in rng.integers(2, 5, 3))
    free: set[tuple[int, ...]] = set(product(*map(range, shape)))
    parts: list[Part] = []
    while free:
        cells = [min(free, key=lambda c: (sum(_near(c, free)), c))]
        free.remove(cells[0])
        for _ in range(int(rng.integers(1, 5))):
            edge = sorted({n for c in cells for n in _around(c)} & free)
            if not edge:
                break
            cells.append(edge[int(rng.integers(len(edge)))])
            free.remove(cells[-1])
        boxes = [((x, x + 1), (y, y + 1), (z, z + 1)) for x, y, z in cells]
        parts.append(part(f"piece {len(parts)}", *boxes))
    return parts


def _around(cell: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    for axis, step in product(range(3), (-1, 1)):
        yield tuple(c + step * (i == axis) for i, c in enumerate(cell))


def _near(cell: tuple[int, ...], free: set[tuple[int, ...]]) -> Iterator[bool]:
    return (n in free for n in _around(cell))


def pins(rng: np.random.Generator) -> list[Part]:
    """Plates on a base, with pins through their holes; further plates lie over some of the pins."""
    nx, ny = int(rng.integers(4, 8)), int(rng.integers(3, 5))
    parts = [part("base", ((0, nx), (0, ny), (0, 1)))]
    places = [(x, y) for x in range(1, nx - 1, 2) for y in range(1, ny - 1)]
    rng.shuffle(places)
    z, k = 1, 0
    for level in range(int(rng.integers(1, 4))):
        holes = places[: int(rng.integers(1, min(4, len(places)) + 1))]
        rng.shuffle(places)
        layers = int(rng.integers(1, 3))
        parts += [_plate(f"plate {level}.{layer}", nx, ny, z + layer, holes) for layer in range(layers)]
        proud = int(rng.integers(0, 2))
        top = z + layers + proud
        parts += [part(f"pin {k + j}", ((x, x + 1), (y, y + 1), (z, top))) for j, (x, y) in enumerate(holes)]
        k += len(holes)
        z += layers
        if proud:
            parts.append(_plate(f"cover {level}", nx, ny, z, holes))
            z += 1
    if rng.random() < 0.5:
        parts.append(part("lid", ((0, nx), (0, ny), (z, z + 1))))
    return parts


def _plate(name: str, nx: int, ny: int, z: int, holes: list[tuple[int, int]]) -> Part:
    """A plate of one layer; rows without a hole are one box."""
    boxes: list[Bounds] = []
    for y in range(ny):
        cuts = [-1, *sorted(x for x, row in holes if row == y), nx]
        boxes += [((a + 1, b), (y, y + 1), (z, z + 1)) for a, b in pairwise(cuts) if b > a + 1]
    return part(name, *boxes)
