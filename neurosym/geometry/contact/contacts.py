"""Where parts touch: points, normals and areas.

Bounds say which bodies are near. Two boxes with the same axes are compared as intervals; of all other pairs the
triangles that lie in one plane, with opposite normals, are clipped against one another. Pairs that have none such,
and of which FCL says that they touch all the same, touch where their faces nearly lie in one plane. All pairs are
handled at once.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import ConvexHull, QhullError

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.collision import Gaps
from neurosym.geometry.contact.surfaces import GRID, BodySurfaces, Surfaces
from neurosym.geometry.mesh.broad_phase import overlapping_pairs, spans
from neurosym.geometry.mesh.triangles import plane_axes
from neurosym.support.arrays import Array, Numbers, Truths

#: Stands for the table where a body is expected.
TABLE = -1


@dataclass(frozen=True, eq=False)
class Contact:
    """A flat patch in which body `a` touches body `b` of another part, or the table.

    Attributes:
        a, b: numbers of bodies; `b` is `TABLE` for the table.
        points: float64 (k, 3), k >= 3: the corners of the patch's convex hull, in the world.
        normal: float64 (3,): unit normal of the patch, from a to b.
        area: of the patch (length squared).
        gap: how far apart the two faces are (length); 0 where they overlap.
    """

    a: int
    b: int
    points: Array
    normal: Array
    area: float
    gap: float = 0.0


def find_contacts(assembly: Assembly, surfaces: BodySurfaces) -> tuple[Contact, ...]:
    """All contacts of an assembly, the table's first, then by bodies."""
    bounds, touch = assembly.body_bounds, assembly.touch
    near = overlapping_pairs(bounds[:, 0] - touch, bounds[:, 1] + touch, assembly.owners)
    aligned = _same_axes(assembly, near)
    contacts = _box_contacts(assembly, near[aligned])
    others = near[~aligned]
    if len(others):
        contacts += _facet_contacts(assembly, surfaces.exact, others, assembly.tolerances.parallel, touch)
        done = {(c.a, c.b) for c in contacts}
        gaps = Gaps(assembly.bodies)
        left = [(int(a), int(b)) for a, b in others if (a, b) not in done]
        rounded = np.array([pair for pair in left if gaps.between(*pair) <= touch])
        if len(rounded):
            angle = assembly.tolerances.mate_angle
            contacts += _facet_contacts(assembly, surfaces.exact, rounded, angle, assembly.mate)
    return tuple(_table_contacts(assembly) + sorted(contacts, key=lambda c: (c.a, c.b)))


def areas_between(assembly: Assembly, contacts: Iterable[Contact]) -> dict[tuple[int, int], list[float]]:
    """Numbers of two parts that touch, or of one and `TABLE`, -> the areas of their patches; in the contacts' order."""
    areas: dict[tuple[int, int], list[float]] = {}
    for c in contacts:
        b = TABLE if c.b == TABLE else int(assembly.owners[c.b])
        areas.setdefault((int(assembly.owners[c.a]), b), []).append(c.area)
    return areas


def _same_axes(assembly: Assembly, pairs: Numbers) -> Truths:
    """Which pairs are two boxes with parallel axes, bool (k,)."""
    boxes = assembly.bodies.is_box[pairs].all(axis=1)
    R = assembly.X_WB[:, :3, :3]
    sines = np.sort(np.abs(np.swapaxes(R[pairs[:, 0]], 1, 2) @ R[pairs[:, 1]]), axis=2)[:, :, :2]
    parallel = np.linalg.norm(sines, axis=2).max(axis=1, initial=0.0) <= assembly.tolerances.parallel
    return np.asarray(boxes & parallel)


def _box_contacts(assembly: Assembly, pairs: Numbers) -> list[Contact]:
    """Contacts of boxes with parallel axes, pairs (k, 2): in the first box's frame all is intervals."""
    if not len(pairs):
        return []
    touch = assembly.touch
    a, b = pairs.T
    X = assembly.X_WB
    R = X[a, :3, :3]
    across = np.swapaxes(R, 1, 2)
    half_a = assembly.bodies.box_sizes[a] / 2
    half_b = np.einsum("kij,kj->ki", np.abs(across @ X[b, :3, :3]).round(), assembly.bodies.box_sizes[b]) / 2
    centre = np.einsum("kij,kj->ki", across, X[b, :3, 3] - X[a, :3, 3])
    low, high = np.maximum(-half_a, centre - half_b), np.minimum(half_a, centre + half_b)
    overlap = high - low
    flat = overlap <= assembly.mate
    axis = flat.argmax(axis=1)
    found = []
    for k in np.flatnonzero((flat.sum(axis=1) == 1) & (overlap >= -touch).all(axis=1)):
        n = int(axis[k])
        u, v = (n + 1) % 3, (n + 2) % 3
        sign = 1.0 if centre[k, n] > 0 else -1.0
        corners = np.zeros((4, 3))
        corners[:, n] = sign * half_a[k, n]
        corners[:, u] = low[k, u], high[k, u], high[k, u], low[k, u]
        corners[:, v] = low[k, v], low[k, v], high[k, v], high[k, v]
        points = corners @ R[k].T + X[a[k], :3, 3]
        area = float(overlap[k, u] * overlap[k, v])
        gap = max(0.0, -float(overlap[k, n]))
        found.append(Contact(int(a[k]), int(b[k]), points, sign * R[k, :, n], area, gap))
    return found


def _table_contacts(assembly: Assembly) -> list[Contact]:
    if not assembly.has_table:
        return []
    down = np.array([0.0, 0.0, -1.0])
    reach = assembly.ground + assembly.touch
    found = []
    for i in np.flatnonzero(assembly.body_bounds[:, 0, 2] <= reach):
        vertices = assembly.bodies.vertices(int(i))
        points = hull_points(vertices[vertices[:, 2] <= reach], down)
        area = _area(points, down)
        if _is_wide(points, area, assembly.touch):
            gap = max(0.0, float(points[:, 2].min()) - assembly.ground)
            found.append(Contact(int(i), TABLE, points, down, area, gap))
    return found


def _area(points: Array, normal: Array) -> float:
    """Area of a convex polygon with corners (k, 3) in order."""
    if len(points) < 3:
        return 0.0
    arms = points - points.mean(axis=0)
    return 0.5 * abs(float(np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0) @ normal))


def _is_wide(points: Array, area: float, touch: float) -> bool:
    """Whether a patch is wider than the tolerance: edges and corners that meet are no contact."""
    return len(points) >= 3 and area > touch * float(np.linalg.norm(np.ptp(points, axis=0)))


def hull_points(points: Array, normal: Array) -> Array:
    """Corners, in order, of the convex hull of coplanar points (n, 3); empty when they span no area."""
    if len(points) < 3:
        return points[:0]
    u, v = plane_axes(normal)
    flat = np.stack([points @ u, points @ v], axis=1)
    try:
        corners: Array = points[ConvexHull(flat).vertices]
        return corners
    except QhullError:
        return points[:0]


def _facet_contacts(
    assembly: Assembly, surfaces: Surfaces, pairs: Numbers, sine: float, gap: float
) -> list[Contact]:
    """Contacts of bodies by clipping triangles that face one another, all pairs (k, 2) at once.

    Args:
        sine: of the angle up to which normals count as opposite.
        gap: how far apart (length) the faces may be; an overlap may be as deep as `tolerances.mate` says.
    """
    i, j = _facing(assembly, surfaces, pairs, sine, gap).T
    planes = _planes(assembly, surfaces, i, j, max(sine, 1e-3))
    if not planes:
        return []
    number = np.repeat(np.arange(len(planes)), [len(members) for members in planes])
    i, j = (t[np.concatenate(planes)] for t in (i, j))
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    origins = surfaces.middles[i[starts]]
    normals = np.add.reduceat(surfaces.normals[i] - surfaces.normals[j], starts)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    axes = np.stack(plane_axes(normals), axis=2)  # (planes, 3, 2)
    shadows = [(surfaces.triangles[t] - origins[number][:, None]) @ axes[number] for t in (i, j)]
    clipped = shapely.intersection(*map(shapely.polygons, shadows), grid_size=GRID * assembly.touch)
    areas = shapely.area(clipped)
    kept = np.flatnonzero(areas > 0)
    number, clipped, areas = number[kept], clipped[kept], areas[kept]
    # Where a line along the normal, through the middle of the patch, meets one plane and the other.
    middle = origins[number] + np.einsum("kde,ke->kd", axes[number], shapely.get_coordinates(shapely.centroid(clipped)))
    heights = [
        np.einsum("kd,kd->k", surfaces.normals[t], surfaces.middles[t] - middle)
        / np.einsum("kd,kd->k", surfaces.normals[t], normals[number])
        for t in (i[kept], j[kept])
    ]
    apart = heights[1] - heights[0]
    near = (apart <= gap) & (apart >= -assembly.mate)
    number, clipped, areas, apart = number[near], clipped[near], areas[near], apart[near]
    total = np.bincount(number, areas, len(planes))
    gaps = np.bincount(number, areas * np.maximum(apart, 0.0), len(planes)) / np.maximum(total, 1e-300)
    uv, source = shapely.get_coordinates(clipped, return_index=True)
    found = []
    for k, corners in _hulls(uv, number[source], 1e-2 * assembly.touch):
        points = origins[k] + corners @ axes[k].T
        if _is_wide(points, _area(points, normals[k]), assembly.touch):
            a, b = surfaces.body[i[starts[k]]], surfaces.body[j[starts[k]]]
            found.append(Contact(int(a), int(b), points, normals[k], float(total[k]), float(gaps[k])))
    return found


def _facing(assembly: Assembly, surfaces: Surfaces, pairs: Numbers, sine: float, gap: float) -> Numbers:
    """Pairs of triangles, the first of the lower body, that are near and face each other, int64 (k, 2)."""
    # Only what reaches into the bounds of the other body of a pair can touch it.
    ways = np.concatenate([pairs, pairs[:, ::-1]])
    run, place = spans(np.diff(surfaces.first)[ways[:, 0]])
    candidate = surfaces.first[ways[run, 0]] + place
    bounds = assembly.body_bounds[ways[run, 1]]
    low, high = surfaces.triangles.min(axis=1) - gap, surfaces.triangles.max(axis=1) + gap
    inside = (low[candidate] <= bounds[:, 1]).all(axis=1) & (high[candidate] >= bounds[:, 0]).all(axis=1)
    near = np.unique(candidate[inside])
    i, j = near[overlapping_pairs(low[near], high[near], assembly.owners[surfaces.body[near]])].T
    n = len(assembly.bodies)
    kept = np.isin(surfaces.body[i] * n + surfaces.body[j], pairs[:, 0] * n + pairs[:, 1])
    kept &= np.einsum("kd,kd->k", surfaces.normals[i], surfaces.normals[j]) < 0
    kept &= np.linalg.norm(np.cross(surfaces.normals[i], surfaces.normals[j]), axis=1) <= sine
    return np.stack([i[kept], j[kept]], axis=1)


def _planes(assembly: Assembly, surfaces: Surfaces, i: Numbers, j: Numbers, sine: float) -> list[Numbers]:
    """Facing pairs of triangles gathered by pair of bodies and, in it, by the plane of the first triangle."""
    points, normals = surfaces.middles[i], surfaces.normals[i]
    keys = surfaces.body[i] * len(assembly.bodies) + surfaces.body[j]
    order = np.argsort(keys, kind="stable")
    found = []
    for left in np.split(order, np.flatnonzero(np.diff(keys[order])) + 1):
        while len(left):
            same = normals[left] @ normals[left[0]] > 1 - sine**2 / 2
            same &= np.abs((points[left] - points[left[0]]) @ normals[left[0]]) <= 2 * assembly.mate
            found.append(left[same])
            left = left[~same]
    return found


def _hulls(uv: Array, group: Numbers, noise: float) -> list[tuple[int, Array]]:
    """Corners of the convex hull of each group of points in the plane; those less than `noise` off an edge go."""
    if not len(uv):
        return []
    order = np.argsort(group, kind="stable")
    present, number = np.unique(group[order], return_inverse=True)
    hulls = shapely.simplify(shapely.convex_hull(shapely.multipoints(uv[order], indices=number)), noise)
    return [(int(k), shapely.get_coordinates(h)[:-1]) for k, h in zip(present, hulls) if h.geom_type == "Polygon"]
