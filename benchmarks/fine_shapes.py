"""Assemblies of fine meshes, as CAD programs export them: files of one mesh a part, and which part blocks which.

Each function writes binary STL files into a folder. What blocks what, part by part and along +-x, +-y, +-z, is known by
construction where a shape says so.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import shapely
import trimesh

DIRECTIONS = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0], [0, 0, -1.0], [-1, 0, 0], [0, -1, 0]])

Meshes = dict[str, trimesh.Trimesh]


def _ball(k: int) -> np.ndarray:
    """Where the ball number k of a row is, float64 (2,)."""
    return 13.1 * np.array([np.cos(np.pi / 8 * k), np.sin(np.pi / 8 * k)])


def _aside(apart: np.ndarray, along: np.ndarray) -> float:
    """How far a point of the plane is from the line along a unit vector."""
    return abs(float(apart[0] * along[1] - apart[1] * along[0]))


def washers(sections: int = 512) -> Meshes:
    """Three washers, one on another."""
    meshes = {}
    for k, name in enumerate("abc"):
        mesh = trimesh.creation.annulus(r_min=5, r_max=20, height=4, sections=sections)
        meshes[name] = mesh.apply_translation((0, 0, 2 + 4 * k))
    return meshes


def bearing(subdivisions: int = 3, sections: int = 256) -> Meshes:
    """A shaft in a housing, two rows of 16 balls between them that touch neither."""
    meshes = {"shaft": trimesh.creation.cylinder(radius=10, height=60, sections=sections)}
    bore = shapely.Point(0, 0).buffer(16.2, quad_segs=sections // 4)
    outer = shapely.box(-25, -25, 25, 25)
    meshes["housing"] = extruded(outer.difference(bore), -15, 15)
    for row, k in itertools.product(range(2), range(16)):
        ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=2.5)

        meshes[f"ball{16 * row + k}"] = ball.apply_translation((*_ball(k), -8 + 16 * row))
    return meshes


def plates(sections: int = 128) -> Meshes:
    """Eight bolts, 0.1 thinner than their holes, through two plates."""
    places = [(x, y) for x in (-45, -15, 15, 45) for y in (-15, 15)]
    holes = shapely.union_all([shapely.Point(p).buffer(4, quad_segs=sections // 4) for p in places])
    plan = shapely.box(-60, -30, 60, 30).difference(holes)
    meshes = {"lower": extruded(plan, 0, 8), "upper": extruded(plan, 8, 16)}
    for k, place in enumerate(places):
        profile = np.array([[0, -2], [3.9, -2], [3.9, 16], [7, 16], [7, 21], [0, 21]], dtype=float)
        bolt = trimesh.creation.revolve(profile, sections=sections)
        meshes[f"bolt{k}"] = bolt.apply_translation((*place, 0))
    return meshes


def gears(facets: int = 100_000) -> Meshes:
    """Two spur gears that mesh, each on the pin of a base."""
    teeth, module = (30, 20), 2.0
    apart = module * sum(teeth) / 2
    points = 24
    layers = max(1, round(facets / (2 * points * sum(teeth)) - 1))
    pins = [(0.0, 0.0), (apart, 0.0)]
    meshes = {}
    for name, number, place in zip(("gear", "pinion"), teeth, pins):
        profile = _gear(number, module, points)
        if name == "pinion":  # a gap, not a tooth, towards the gear
            profile = shapely.affinity.rotate(profile, 180 + 180 / number, origin=(0, 0))
        bore = shapely.Point(0, 0).buffer(5, quad_segs=64)
        mesh = extruded(profile.difference(bore), 1, 11, layers)
        meshes[name] = mesh.apply_translation((*place, 0))
    base = extruded(shapely.box(-35, -35, apart + 25, 35), -6, 1)
    meshes["base"] = base
    for k, place in enumerate(pins):
        pin = trimesh.creation.cylinder(radius=4.9, height=14, sections=256)
        meshes[f"pin{k}"] = pin.apply_translation((*place, 8))
    return meshes


def _gear(teeth: int, module: float, points: int) -> shapely.Polygon:
    """The outline of an involute gear of 20 degrees, its first tooth along +x, with a little play."""
    pressure = np.radians(20)
    pitch = module * teeth / 2
    base, tip, root = pitch * np.cos(pressure), pitch + module, pitch - 1.25 * module

    def involute(radius):
        angle = np.arccos(np.minimum(base / radius, 1.0))
        return np.tan(angle) - angle

    half = np.pi / (2 * teeth) - 0.03 * module / pitch
    radii = np.linspace(max(base, root), tip, points // 2 - 2)
    flank = half + involute(np.array(pitch)) - involute(radii)
    r = np.concatenate([[root], radii, radii[::-1], [root]])
    a = np.concatenate([[-flank[0] - 0.01], -flank, flank[::-1], [flank[0] + 0.01]])
    angles = (a[None] + 2 * np.pi * np.arange(teeth)[:, None] / teeth).ravel()
    r = np.tile(r, teeth)
    return shapely.Polygon(np.stack([r * np.cos(angles), r * np.sin(angles)], axis=1))


def extruded(plan: shapely.Polygon, low: float, high: float, layers: int = 1) -> trimesh.Trimesh:
    """A plan between two heights, its walls cut into layers."""
    caps = shapely.get_coordinates(shapely.constrained_delaunay_triangles(plan)).reshape(-1, 4, 2)[:, :3]
    one, two = caps[:, 1] - caps[:, 0], caps[:, 2] - caps[:, 0]
    turned = one[:, 0] * two[:, 1] < one[:, 1] * two[:, 0]
    caps[turned] = caps[turned, ::-1]
    triangles = []
    for z, corners in ((low, caps[:, ::-1]), (high, caps)):
        triangles.append(np.dstack([corners, np.full(corners.shape[:2], z)]))
    for k, ring in enumerate((plan.exterior, *plan.interiors)):
        rim = shapely.get_coordinates(ring)
        if ring.is_ccw != (k == 0):
            rim = rim[::-1]
        heights = np.linspace(low, high, layers + 1)
        for z0, z1 in itertools.pairwise(heights):
            a, b = rim[:-1], rim[1:]
            p, q, r, s = (np.column_stack([x, np.full(len(x), z)]) for x, z in ((a, z0), (b, z0), (b, z1), (a, z1)))
            triangles += [np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)]
    soup = np.concatenate(triangles)
    return trimesh.Trimesh(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3), process=True)


#: What blocks what: (mover, number of the direction, obstacle).
Blocked = set[tuple[str, int, str]]


def blocked_washers() -> Blocked:
    """Up and down alone: faces that touch do not block along themselves."""
    return _both_ways({(low, 0, high) for low, high in itertools.combinations("abc", 2)})


def blocked_bearing() -> Blocked:
    """Balls, a shaft and a bore as what they are cut from: no pair comes near the edge of blocking."""
    balls = {f"ball{16 * row + k}": (_ball(k), row) for row in range(2) for k in range(16)}
    blocked = {("shaft", d, "housing") for d in (1, 2, 4, 5)} | {("housing", d, "shaft") for d in (1, 2, 4, 5)}
    for name, (at, row) in balls.items():
        if row == 0:
            blocked.add((name, 0, f"ball{int(name[4:]) + 16}"))
        for d in (1, 2, 4, 5):
            along = DIRECTIONS[d][:2]
            blocked |= {(name, d, "housing"), ("housing", d, name)}
            if at @ along < 0 and _aside(at, along) < 10 + 2.5:
                blocked |= {(name, d, "shaft")}
            for other, (there, level) in balls.items():
                apart = there - at
                if level == row and apart @ along > 0 and _aside(apart, along) < 5:
                    blocked.add((name, d, other))
    return _both_ways(blocked)


def blocked_plates() -> Blocked:
    """Heads are above the upper plate, shanks in the holes of both; bolts stand in line along x and along y."""
    bolts = {f"bolt{k}": (k // 2, k % 2) for k in range(8)}
    blocked = {("lower", 0, "upper"), *((plate, 0, bolt) for plate in ("lower", "upper") for bolt in bolts)}
    for bolt, (column, row) in bolts.items():
        blocked |= {(bolt, d, plate) for plate in ("lower", "upper") for d in (1, 2, 4, 5)}
        for other, (there, beside) in bolts.items():
            blocked |= {(bolt, 1, other)} if beside == row and there > column else set()
            blocked |= {(bolt, 2, other)} if there == column and beside > row else set()
    return _both_ways(blocked)


def blocked_gears() -> Blocked:
    """All stands on the base; each gear is held sideways by its pin, and by the other gear but away from it."""
    blocked = {("base", 0, other) for other in ("gear", "pinion", "pin0", "pin1")}
    for gear, pin in (("gear", "pin0"), ("pinion", "pin1")):
        blocked |= {(gear, d, pin) for d in (1, 2, 4, 5)}
    blocked |= {("gear", d, "pinion") for d in (1, 2, 5)}
    blocked |= {("gear", 1, "pin1"), ("pin0", 1, "pinion"), ("pin0", 1, "pin1")}
    return _both_ways(blocked)


def _both_ways(blocked: Blocked) -> Blocked:
    """What is hit one way hits the other way."""
    return blocked | {(other, (d + 3) % 6, mover) for mover, d, other in blocked}


SHAPES: dict[str, Callable[[], Meshes]] = {
    "washers": washers,
    "bearing": bearing,
    "plates": plates,
    "gears": gears,
}
BLOCKED: dict[str, Callable[[], Blocked]] = {
    "washers": blocked_washers,
    "bearing": blocked_bearing,
    "plates": blocked_plates,
    "gears": blocked_gears,
}


def written(meshes: Mapping[str, trimesh.Trimesh], folder: Path) -> Path:
    """The folder, with a binary STL file a part in it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, mesh in meshes.items():
        mesh.export(folder / f"{name}.stl")
    return folder
