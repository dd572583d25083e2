"""Where faces of bodies lie on one another: triangles clipped against triangles, large flat faces as polygons."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from neurosym.geometry.contact.planes import is_wide
from neurosym.geometry.contact.surfaces import FACETS, GRID, BodySurfaces
from neurosym.geometry.mesh import kernels
from neurosym.geometry.mesh.polygons import intersections
from neurosym.geometry.mesh.triangles import plane_axes
from neurosym.support.arrays import Array, Numbers
from neurosym.support.deadline import check, portions

#: Bodies a and b, corners (k, 3), normal (3,) from a to b, area, gap: see `neurosym.geometry.contact.contacts.Contact`.
Patch = tuple[int, int, Array, Array, float, float]

#: Two bodies that touch in more planes than this touch with round surfaces.
_MANY = 32


def facet_patches(
    surfaces: BodySurfaces, pairs: Numbers, *, sine: float, round_sine: float, gap: float, touch: float, mate: float
) -> list[Patch]:
    """Patches in which bodies touch, all pairs (k, 2) at once; those of one pair in one plane are one.

    Args:
        sine: of the angle up to which normals count as opposite.
        round_sine: of the angle between normals up to which facets of round surfaces are taken for one face.
        gap: how far apart (length) the faces may be.
        touch: how wide a patch is at least (length).
        mate: how deep (length) the faces may overlap.
    """
    if not len(pairs):
        return []
    exact, flats = surfaces.exact, surfaces.flats
    # A flat face of many triangles has a number beyond theirs: two such are clipped as polygons.
    m = len(exact.triangles)
    normals, middles = (np.concatenate(x) for x in ((exact.normals, flats.normals), (exact.middles, flats.middles)))
    within, is_flat = np.full(len(pairs), 2 * gap), flats.of_triangle >= 0
    small = exact.facing_trees(~is_flat, 2 * gap, sine)
    flat = exact.facing_trees(is_flat, 2 * gap, sine) if is_flat.any() else small
    near = []
    for some in portions(np.diff(exact.first)[pairs].sum(axis=1), FACETS, "contacts"):
        for one, two in ((small, small), (small, flat), (flat, small))[: 3 if is_flat.any() else 1]:
            found = kernels.facing_pairs(*one, *two, exact.normals, exact.first, pairs[some], within[some], sine)
            near.append(np.add(found, (some.start, 0, 0)))
    of_pair, i, j = np.concatenate([*near, np.add(flats.facing(pairs, 2 * gap, sine), (0, m, m))]).T
    # How far apart two planes are is asked again where they have a part in common: they need not be quite parallel.
    reach = 1.1 * sine * np.linalg.norm(np.ptp(surfaces.bodies.bounds[pairs[of_pair, 1]], axis=1), axis=1)
    apart = np.einsum("kd,kd->k", normals[i], middles[j] - middles[i])
    kept = (apart <= gap + reach) & (apart >= -mate - reach)
    of_pair, i, j = of_pair[kept], i[kept], j[kept]
    planes = _planes(of_pair, normals[i], middles[i], max(sine, 1e-3), round_sine, 2 * mate)
    if not planes:
        return []
    number = np.repeat(np.arange(len(planes)), [len(members) for members in planes])
    of_pair, i, j = (x[np.concatenate(planes)] for x in (of_pair, i, j))
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    origins = middles[i[starts]]
    along = np.add.reduceat(normals[i] - normals[j], starts)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    axes = np.stack(plane_axes(along), axis=2)  # (planes, 3, 2)

    few = np.flatnonzero(i < m)
    seen = [(exact.triangles[x[few]] - origins[number[few], None]) @ axes[number[few]] for x in (i, j)]
    areas, corners, counts = kernels.common_parts(*seen)
    row, uv = np.repeat(few, counts), corners[np.arange(corners.shape[1]) < counts[:, None]]
    many = np.flatnonzero(i >= m)
    if len(many):
        seen = [flats.polygons(x[many] - m, origins[number[many]], axes[number[many]]) for x in (i, j)]
        common = intersections(seen[0], seen[1], GRID * touch)
        corners, place = shapely.get_coordinates(common, return_index=True)
        areas, uv = np.concatenate([areas, shapely.area(common)]), np.concatenate([uv, corners])
        row = np.concatenate([row, many[place]])
    area = np.zeros(len(i))
    area[np.concatenate([few, many])] = areas
    # Where a line along the normal, through the middle of a part in common, meets one plane and the other.
    count = np.bincount(row, minlength=len(i))
    middle = np.stack([np.bincount(row, w, len(i)) / np.maximum(count, 1) for w in uv.T], axis=1)
    middle = origins[number] + np.einsum("kde,ke->kd", axes[number], middle)
    heights = [
        np.einsum("kd,kd->k", normals[x], middles[x] - middle) / np.einsum("kd,kd->k", normals[x], along[number])
        for x in (i, j)
    ]
    apart = heights[1] - heights[0]
    area[(apart > gap) | (apart < -mate)] = 0.0
    kept = area[row] > 0
    total = np.bincount(number, area, len(planes))
    apart = np.bincount(number, area * np.maximum(apart, 0.0), len(planes)) / np.maximum(total, 1e-300)
    plane, hulls = _hulls(uv[kept], number[row[kept]], 1e-2 * touch)
    corners, hull = shapely.get_coordinates(hulls, return_index=True)
    points = origins[plane[hull]] + np.einsum("kde,ke->kd", axes[plane[hull]], corners)
    first = np.searchsorted(hull, np.arange(len(hulls) + 1))
    patches: list[Patch] = []
    for k, area_of_hull, begin, end in zip(plane.tolist(), shapely.area(hulls).tolist(), first[:-1], first[1:]):
        own = points[begin : end - 1]  # the ring's last corner is its first
        if is_wide(own, area_of_hull, touch):
            a, b = pairs[of_pair[starts[k]]]
            patches.append((int(a), int(b), own, along[k], float(total[k]), float(apart[k])))
    return patches


def _planes(
    of_pair: Numbers, normals: Array, points: Array, sine: float, wide: float, thickness: float
) -> list[Numbers]:
    """Rows of facing faces gathered by pair of bodies and, in it, by the plane of the first: normals, points (n, 3).

    Args:
        sine: of the largest angle between two normals; where that makes many planes, as of surfaces that are round,
            `wide` is taken instead.
        thickness: how far from the first plane (length) a point may be.
    """
    order = np.argsort(of_pair, kind="stable")
    planes: list[Numbers] = []
    for rows in np.split(order, np.flatnonzero(np.diff(of_pair[order])) + 1):
        own, left, limit = [], rows, sine
        while len(left):
            check()
            same = normals[left] @ normals[left[0]] > 1 - limit**2 / 2
            same &= np.abs((points[left] - points[left[0]]) @ normals[left[0]]) <= thickness
            own.append(left[same])
            left = left[~same]
            if limit < wide and len(own) > _MANY:
                own, left, limit = [], rows, wide
        planes += own
    return planes


def _hulls(uv: Array, group: Numbers, noise: float) -> tuple[Numbers, NDArray[np.object_]]:
    """Convex hulls of groups of points in the plane, the group of each; corners less than `noise` off an edge go."""
    order = np.argsort(group, kind="stable")
    present, number = np.unique(group[order], return_inverse=True)
    hulls = shapely.simplify(shapely.convex_hull(shapely.multipoints(uv[order], indices=number)), noise)
    kept = shapely.get_type_id(hulls) == shapely.GeometryType.POLYGON
    return present[kept], hulls[kept]
