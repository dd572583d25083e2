"""Small structures whose fate is known by hand: what stands and what falls under gravity, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

import neurosym as ns
from neurosym.geometry.shapes import Body, Part

Mesh = tuple[np.ndarray, np.ndarray]


def hull(points) -> Mesh:
    """The convex hull of points, its faces outward."""
    points = np.asarray(points, dtype=float)
    found = ConvexHull(points)
    corners, faces = points[found.simplices], found.simplices.copy()
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("nd,nd->n", normals, found.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def prism(outline, depth: float = 1.0) -> Mesh:
    """A convex outline in x and z, as deep along y."""
    return hull([(x, y, z) for x, z in outline for y in (0.0, depth)])


def box(low, high) -> Mesh:
    return hull([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def assembly(parts: dict[str, Mesh], fixed=(), friction: float = 0.5) -> ns.Assembly:
    return ns.Assembly.from_meshes(parts, friction=friction).with_fixed(fixed)


def between_walls(friction: float) -> ns.Assembly:
    """A block that touches a wall on either side, and nothing below."""
    walls = {"left": box((-1, 0, 0), (0, 1, 3)), "right": box((1, 0, 0), (2, 1, 3))}
    return assembly({"block": box((0, 0, 1), (1, 1, 2)), **walls}, tuple(walls), friction)


def plug(degrees: float, friction: float) -> ns.Assembly:
    """A plug that fills a hole between four walls; the hole widens downward by so many degrees, or narrows."""
    slope = np.tan(np.radians(degrees))
    sides = [(half, z) for z, half in ((2, 1.0), (1, 1.0 + slope))]
    core = hull([(sx * w, sy * w, z) for w, z in sides for sx in (-1, 1) for sy in (-1, 1)])
    walls = {}
    for k, (dx, dy) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
        reach = 0.9 * (1 - abs(slope))
        walls[f"wall {k}"] = hull(
            [
                (dx * out + dy * side * reach, dy * out + dx * side * reach, z)
                for half, z in ((1.0 - slope, 3), (1.0 + 2 * slope, 0))
                for out in (half, 6.0)
                for side in (-1, 1)
            ]
        )
    return assembly({"plug": core, **walls}, tuple(walls), friction)


def wedged_beam(degrees: float, friction: float) -> ns.Assembly:
    """A beam between two inclined faces that come nearer downward by so many degrees each, or part."""
    slope = np.tan(np.radians(degrees))
    at = {z: 3 + slope * (z - 2) for z in (0, 1.5, 2.5, 4)}
    beam = prism([(-at[2.5], 2.5), (at[2.5], 2.5), (at[1.5], 1.5), (-at[1.5], 1.5)])
    right = [(at[4], 4), (at[0], 0), (8, 0), (8, 4)]
    parts = {"beam": beam, "right": prism(right), "left": prism([(-x, z) for x, z in right])}
    return assembly(parts, ("left", "right"), friction)


def arch(blocks: int, friction: float, springing: float = 30.0) -> ns.Assembly:
    """Equal blocks of a ring, radii 3 and 4, between fixed ones that end so many degrees above the horizontal."""
    angles = np.radians([0.0, *np.linspace(springing, 180 - springing, blocks + 1), 180.0])
    parts = {
        str(k): prism([(r * np.cos(t), r * np.sin(t)) for r in (3.0, 4.0) for t in angles[k : k + 2]])
        for k in range(blocks + 2)
    }
    return assembly(parts, ("0", str(blocks + 1)), friction)


def card_house(share: float) -> ns.Assembly:
    """Two slabs that lean on one another, with so much of the friction that they need.

    Each is cut level at the foot, from x = -1.3 to -1, and upright at the top, where they meet. About the inner edge of
    the foot the weight W has the arm c + 1 (c: x of the centre of mass), and the other slab's push H, at most at the
    very top h, has the arm h: H = W (c + 1) / h. The foot, which bears W, must resist H: mu = (c + 1) / h.
    """
    foot, width, low = 1.0, 0.3, 2.0
    top = low * (foot + width) / foot
    outline = np.array([(-foot - width, 0), (-foot, 0), (0, low), (0, top)])
    x, z = outline.T
    across = x * np.roll(z, -1) - np.roll(x, -1) * z
    centre = ((x + np.roll(x, -1)) * across).sum() / (3 * across.sum())
    parts = {"left": prism(outline), "right": prism(outline * [-1, 1])}
    return assembly(parts, (), share * (centre + foot) / top)


def harmonic_stack(share: float, blocks: int = 10) -> ns.Assembly:
    """Blocks of length 1, the n-th from the top so much of 1 / 2 n further in than that on it."""
    shifts = np.concatenate([[0.0], -np.cumsum(share / (2 * np.arange(1, blocks)))])
    parts = {}
    for k, x in enumerate(shifts):
        z = 0.2 * (blocks - 1 - k)
        parts[str(k)] = box((x, 0, z), (x + 1, 0.5, z + 0.2))
    return assembly(parts)


def shelf(friction: float) -> ns.Assembly:
    """A board whose ends touch two walls."""
    walls = {"left": box((-1, 0, 0), (0, 1, 4)), "right": box((4, 0, 0), (5, 1, 4))}
    return assembly({"shelf": box((0, 0, 2), (4, 1, 2.2)), **walls}, tuple(walls), friction)


def book_end(whole: bool) -> ns.Assembly:
    """A leaning book against an upright, which is one with the plate under the book, or only stands beside it."""
    slope = 3 / 1.4
    book = prism([(0, 0.1), (0.6, 0.1), (1.5, 0.1 + 0.9 * slope), (1.5, 0.1 + 1.5 * slope)])
    plate, upright = ((-1, 0, 0), (1.5, 1, 0.1)), ((1.5, 0, 0), (1.7, 1, 3.6))
    apart = ns.Assembly.from_meshes({"book": book, "plate": box(*plate), "upright": box(*upright)}, friction=0.4)
    if not whole:
        return apart
    end = Part("end", apart["plate"].bodies + _at_home(apart["upright"], apart["plate"]), apart["plate"].X_WP)
    return ns.Assembly((apart["book"], end), friction=0.4)


def _at_home(part: Part, home: Part) -> tuple[Body, ...]:
    """A part's bodies, in the frame of another."""
    X = np.linalg.inv(home.X_WP) @ part.X_WP
    return tuple(Body(b.shape, X @ b.X_PB) for b in part.bodies)


@dataclass(frozen=True)
class Case:
    name: str
    make: Callable[[], ns.Assembly]
    stands: bool


CASES = [
    *(Case(f"between walls, {m}", lambda m=m: between_walls(m), False) for m in (0.1, 0.5, 5.0, 1e3, 1e6)),
    *(Case(f"plug, widening by {d}", lambda d=d: plug(d, 0.5), False) for d in (2, 5, 10, 20)),
    *(
        Case(f"plug, narrowing by {d}, {m}", lambda d=d, m=m: plug(-d, m), True)
        for d in (2, 3, 5)
        for m in (0.0, 0.02, 0.1, 0.3, 0.5)
    ),
    *(
        Case(f"wedged beam, {d}, {m}", lambda d=d, m=m: wedged_beam(d, m), d > 0)
        for d in (10, 3, -3, -10)
        for m in (0.0, 0.2, 0.5)
    ),
    Case("arch of three", lambda: arch(3, 0.5), True),
    Case("arch of three, smooth", lambda: arch(3, 0.02), False),
    *(Case(f"card house, {s}", lambda s=s: card_house(s), s > 1) for s in (0.8, 0.95, 1.05, 1.2, 2.0)),
    *(Case(f"harmonic stack, {s}", lambda s=s: harmonic_stack(s), s < 1) for s in (0.8, 0.95, 1.05, 1.2)),
    *(Case(f"shelf, {m}", lambda m=m: shelf(m), False) for m in (0.5, 5.0)),
    Case("book-end", lambda: book_end(True), True),
    Case("book-end in two", lambda: book_end(False), False),
]
