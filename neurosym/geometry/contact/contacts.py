"""Where parts touch: points, normals and areas.

Bounds say which bodies are near. Two boxes with the same axes are compared as intervals; of all other pairs the faces
that lie in one plane, with opposite normals, are clipped against one another. Pairs that have none such, but whose
surfaces touch all the same, touch where their faces nearly lie in one plane. All pairs are handled at once.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.facets import facet_patches
from neurosym.geometry.contact.planes import hull_points, is_wide, polygon_area
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.mesh.broad_phase import overlapping_pairs
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
        round_sine = assembly.tolerances.mate_angle
        sizes = {"round_sine": round_sine, "touch": touch, "mate": assembly.mate}
        patches = facet_patches(surfaces, others, sine=assembly.tolerances.parallel, gap=touch, **sizes)
        known = {patch[:2] for patch in patches}
        left = np.array([pair for pair in others.tolist() if tuple(pair) not in known], dtype=np.int64).reshape(-1, 2)
        rounded = left[surfaces.exact.gaps(left, enough=touch, far=2 * touch) <= touch]
        patches += facet_patches(surfaces, rounded, sine=round_sine, gap=assembly.mate, **sizes)
        contacts += [Contact(*patch) for patch in patches]
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
        area = polygon_area(points, down)
        if is_wide(points, area, assembly.touch):
            gap = max(0.0, float(points[:, 2].min()) - assembly.ground)
            found.append(Contact(int(i), TABLE, points, down, area, gap))
    return found
