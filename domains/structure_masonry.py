"""Kinds of structures in which gravity decides the order: stones and beams, weights that hold down, arches.

Each is drawn from a generator of random numbers; lengths are in blocks. Whether the whole stands and comes apart is
asked afterwards (`domains.structures`).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from domains.structure_shapes import FIXED, Bounds, part, prism
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.shapes import Part


def stack(rng: np.random.Generator) -> list[Part]:
    """Dry stone: blocks of two heights, many lengths and weights, each laid where it and all before it stand."""
    count, ground = int(rng.integers(4, 21)), rng.uniform(2.5, 6.0)
    laid: list[Bounds] = []
    parts: list[Part] = []
    for _ in range(10 * count):
        if len(laid) == count:
            break
        length, height = rng.uniform(1.0, 3.5), float(rng.choice([0.5, 1.0]))
        x = rng.uniform(0.0, ground)
        under = [b for b in laid if b[0][0] < x + length - 0.1 and b[0][1] > x + 0.1]
        z = max((b[2][1] for b in under), default=0.0)
        bounds = ((x, x + length), (0.0, 1.0), (z, z + height))
        stone = part(f"stone {len(laid)}", bounds, density=float(rng.choice([1.0, 4.0])))
        if z < 6 and _stands([*parts, stone]):
            laid.append(bounds)
            parts.append(stone)
    return parts


def corbel(rng: np.random.Generator) -> list[Part]:
    """Beams on piers, one over the other: the load on each one's tip needs most of the weights on its tail."""
    parts: list[Part] = []
    for row in range(int(rng.integers(1, 3))):
        z, half, y = 0.0, rng.uniform(0.4, 0.8), (2.0 * row, 2.0 * row + 1)
        for level in range(int(rng.integers(1, 3))):
            name = f"{row}.{level}"
            for k in range(int(rng.integers(1, 3))):
                parts.append(part(f"pier {name}.{k}", ((-half, half), y, (z, z + 1))))
                z += 1
            side, reach = int(rng.choice([-1, 1])), rng.uniform(1.5, 3.5)
            parts.append(part(f"beam {name}", ((-half - reach, half + reach), y, (z, z + 0.4))))
            z += 0.4
            parts += _balanced(rng, name, side, half, reach, y, z)
            if rng.random() < 0.5:
                break
            height = max(p.bodies[0].X_PB[2, 3] + p.bodies[0].shape.vertices[:, 2].max() for p in parts[-6:]) - z
            parts.append(part(f"core {name}", ((-half, half), y, (z, z + float(height)))))
            z += float(height)
    return parts


def _balanced(
    rng: np.random.Generator, name: str, side: int, half: float, reach: float, y: tuple[float, float], z: float
) -> list[Part]:
    """Loads near the tip of a beam that reaches beyond its pier, and as many weights on its tail as these need."""
    wide, slim, beam = rng.uniform(0.9, 1.4), rng.uniform(0.4, 0.7), 0.8 * (half + reach)
    arm, tail = reach - wide / 2, reach - slim / 2  # beyond the pier's edges
    load = rng.uniform(1.5, 4.0) * beam * half / arm  # that which alone would tip the beam, or more
    need = (load * arm - beam * half) / (tail + 2 * half)
    parts = []
    sides = (("load", side, wide, arm, load), ("weight", -side, slim, tail, need * rng.uniform(1.05, 1.3)))
    for what, at, size, out, volume in sides:
        cuts = z + volume / size * np.linspace(0, 1, int(rng.integers(2, 5)))
        middle = at * (half + out)
        for k, (low, high) in enumerate(pairwise(cuts.tolist())):
            parts.append(part(f"{what} {name}.{k}", ((middle - size / 2, middle + size / 2), y, (low, high))))
    return parts


def scale(rng: np.random.Generator) -> list[Part]:
    """Beams on narrow piers, with blocks of many weights laid on them one by one, wherever all keeps in balance."""
    parts: list[Part] = []
    for row in range(int(rng.integers(1, 3))):
        y, half, reach = (2.0 * row, 2.0 * row + 1), rng.uniform(0.3, 0.7), rng.uniform(1.5, 3.0)
        tops = dict.fromkeys(np.linspace(-reach, reach - 0.5, 6).tolist(), 1.4)
        parts.append(part(f"pier {row}", ((-half, half), y, (0, 1))))
        parts.append(part(f"beam {row}", ((-reach, reach), y, (1, 1.4))))
        for k in range(int(rng.integers(3, 30))):
            x, height = float(rng.choice(list(tops))), float(rng.choice([0.3, 0.6, 1.0]))
            bounds = ((x, x + 0.5), y, (tops[x], tops[x] + height))
            block = part(f"block {row}.{k}", bounds, density=float(rng.choice([1.0, 3.0])))
            if _stands([*parts, block]):
                parts.append(block)
                tops[x] += height
    return parts


def _stands(parts: list[Part]) -> bool:
    return AssemblyGeometry(Assembly(tuple(parts))).stability.standing((1 << len(parts)) - 1).stands


def arch(rng: np.random.Generator) -> list[Part]:
    """A round arch between two fixed springers."""
    count, inner = int(rng.integers(4, 19)), rng.uniform(2.0, 4.0)
    outer, springing = inner * rng.uniform(1.25, 1.5), np.radians(rng.uniform(10, 35))
    angles = np.array([0.0, *np.linspace(springing, np.pi - springing, count + 1), np.pi])
    names = [f"{FIXED} 0", *(f"voussoir {k}" for k in range(count)), f"{FIXED} 1"]
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    depth = rng.uniform(0.6, 1.5)
    return [
        prism(name, np.array([r * ring[i] for r in (inner, outer) for i in (k, k + 1)]), depth)
        for k, name in enumerate(names)
    ]


def flat_arch(rng: np.random.Generator) -> list[Part]:
    """A lintel of wedges between two fixed abutments, with bricks on it."""
    count, half, height = int(rng.integers(3, 12)), rng.uniform(1.5, 3.0), rng.uniform(0.8, 1.4)
    splay = rng.uniform(0.06, 0.2)
    low = np.linspace(-half, half, count + 1)
    high = low * (1 + splay)
    edge = float(high[-1])
    parts = []
    for name, at in ((f"{FIXED} 0", -1), (f"{FIXED} 1", 1)):
        far = at * (edge + 1)
        parts.append(prism(name, np.array([(at * half, 0), (at * edge, height), (far, height), (far, -1)]), 1.0))
    for k in range(count):
        outline = np.array([(low[k], 0), (low[k + 1], 0), (high[k + 1], height), (high[k], height)])
        parts.append(prism(f"wedge {k}", outline, 1.0))
    for course in range(int(rng.integers(0, 3))):
        cuts = np.linspace(-edge, edge, int(rng.integers(2, 5)))
        for k, (a, b) in enumerate(pairwise(cuts.tolist())):
            z = height + 0.5 * course
            parts.append(part(f"brick {course}.{k}", ((a, b), (0, 1), (z, z + 0.5))))
    return parts


def lean(rng: np.random.Generator) -> list[Part]:
    """Slabs that lean on one another, the last on a fixed post."""
    count, thick, height = int(rng.integers(3, 16)), rng.uniform(0.2, 0.4), rng.uniform(2.0, 3.0)
    leans, parts = rng.uniform(0.15, 0.4) * height, []
    for k, foot in enumerate(np.arange(count + 1) * thick):
        far = foot + (thick if k < count else leans + 1)
        outline = [(foot, 0), (far, 0), (far + leans * (k < count), height), (foot + leans, height)]
        parts.append(prism(f"slab {k}" if k < count else f"{FIXED} 0", np.array(outline), 1.0))
    return parts


def bridge(rng: np.random.Generator) -> list[Part]:
    """Piers with an arm each way, anchored by weights at the shores; spans with heavy loads lie between the tips."""
    parts: list[Part] = []
    arm, top = rng.uniform(1.5, 2.5), int(rng.integers(1, 3))
    middles = np.arange(int(rng.integers(2, 5))) * (2 * arm + rng.uniform(1.2, 2.0))
    deck, half, density = top + 0.5, rng.uniform(0.25, 0.4), rng.uniform(2.0, 5.0)
    for i, x in enumerate(middles):
        parts += [part(f"pier {i}.{k}", ((x - half, x + half), (0, 1), (k, k + 1))) for k in range(top)]
        parts.append(part(f"arm {i}", ((x - arm, x + arm), (0, 1), (top, deck))))
    weights = []
    for i, (a, b) in enumerate(pairwise(middles)):
        low, high = a + arm - 0.4, b - arm + 0.4
        parts.append(part(f"span {i}", ((low, high), (0, 1), (deck, deck + 0.3))))
        z, count = deck + 0.3, int(rng.integers(0, 3))
        for k in range(count):
            parts.append(part(f"load {i}.{k}", ((low + 0.1, high - 0.1), (0, 1), (z, z + 0.2)), density=density))
            z += 0.2
        weights.append((high - low) * (0.3 + 0.2 * density * count))
    ends = (("left", middles[0] - arm, 1, weights[0]), ("right", middles[-1] + arm, -1, weights[-1]))
    for end, x, inward, hung in ends:
        need = max(0.2, (hung / 2 * (arm - half) - arm * half) / (arm - 0.2 + half) / 0.4)
        low, high = sorted((x, x + inward * 0.4))
        cuts = deck + need * rng.uniform(1.05, 1.3) * np.linspace(0, 1, int(rng.integers(2, 5)))
        for k, (a, b) in enumerate(pairwise(cuts.tolist())):
            parts.append(part(f"anchor {end}.{k}", ((low, high), (0, 1), (a, b))))
    return parts


def wall(rng: np.random.Generator) -> list[Part]:
    """Courses of bricks of many lengths and weights with an opening, closed by a lintel or by bricks that overhang."""
    length, courses = rng.uniform(4.0, 8.0), int(rng.integers(2, 6))
    left = rng.uniform(1.0, length / 2 - 0.5)
    right, sill, head = left + rng.uniform(0.8, 1.6), int(rng.integers(0, 2)), int(rng.integers(1, courses + 1))
    parts = []
    for course in range(courses):
        opening = (left, right) if sill <= course < head else None
        spans = [(0.0, length)] if opening is None else [(0.0, opening[0]), (opening[1], length)]
        if course == head and rng.random() < 0.7:
            lintel = (left - rng.uniform(0.3, 0.8), right + rng.uniform(0.3, 0.8))
            parts.append(part(f"lintel {course}", (lintel, (0, 1), (course, course + 1))))
            spans = [(0.0, lintel[0]), (lintel[1], length)]
        for s, (low, high) in enumerate(spans):
            pieces = max(1, round((high - low) / rng.uniform(0.9, 1.9)))
            cuts = np.linspace(low, high, pieces + 1)
            cuts[1:-1] += rng.uniform(-0.25, 0.25, pieces - 1) * (high - low) / pieces
            for k, (a, b) in enumerate(pairwise(cuts.tolist())):
                density = float(rng.choice([1.0, 3.0]))
                parts.append(part(f"brick {course}.{s}.{k}", ((a, b), (0, 1), (course, course + 1)), density=density))
    return parts
