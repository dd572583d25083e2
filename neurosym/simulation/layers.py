"""Exact convex pieces of a mesh in layers: plates with holes, flanges, bushings, bolts, whatever CAD extruded.

Where every face is along one axis or across it, the planes across it cut the solid into layers that are one polygon
each. A polygon is triangulated on its own corners (constrained Delaunay), and triangles are joined while they stay
convex (Hertel and Mehlhorn 1983). So a hole keeps its walls, facet by facet, and no piece reaches into it.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from neurosym.support.arrays import Array, Numbers
from neurosym.support.deadline import check

#: Faces are along the axis, or across it, up to this sine.
STRAIGHT = 1e-5
#: More layers, or more pieces, than this are not worth it.
MOST_LAYERS, MOST_PIECES = 40, 1_500
#: Heights and corners nearer than this share of the mesh's extent are one.
SAME = 1e-6


def layered(vertices: Array, faces: Numbers) -> list[Array] | None:
    """Corners of convex pieces that make up a closed mesh exactly, each float64 (n, 3); None: it is not in layers."""
    triangles = vertices[faces]
    areas = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    sizes = np.linalg.norm(areas, axis=1)
    extent = float(np.ptp(vertices, axis=0).max())
    sound = sizes > (SAME * extent) ** 2
    normals = areas[sound] / sizes[sound, None]
    for axis in _axes(normals, sizes[sound]):
        across = np.abs(normals @ axis)
        if ((across < STRAIGHT) | (across > 1 - STRAIGHT)).all():
            return _pieces(vertices, faces[sound], axis, SAME * extent)
    return None


def _axes(normals: Array, sizes: Array) -> list[Array]:
    """Normals of the largest flats, those of the three largest areas."""
    rounded = np.round(normals, 4)
    rounded *= np.where(rounded[np.arange(len(rounded)), np.abs(rounded).argmax(axis=1)] < 0, -1, 1)[:, None]
    _, first, group = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    largest = np.argsort(-np.bincount(group.ravel(), weights=sizes))[:3]
    return [normals[first[k]] for k in largest]


def _pieces(vertices: Array, faces: Numbers, axis: Array, same: float) -> list[Array] | None:
    import shapely
    from trimesh import Trimesh
    from trimesh.intersections import mesh_plane

    u = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    u /= np.linalg.norm(u)
    frame = np.stack([u, np.cross(axis, u), axis], axis=1)
    mesh = Trimesh(vertices @ frame, faces, process=False)
    heights = np.sort(mesh.vertices[:, 2])
    heights = heights[np.append(True, np.diff(heights) > 2 * same)]
    if not 1 < len(heights) <= MOST_LAYERS:
        return None
    pieces: list[Array] = []
    for bottom, top in itertools.pairwise(heights.tolist()):
        check()
        cut = mesh_plane(mesh, (0, 0, 1), (0, 0, (bottom + top) / 2))[:, :, :2]  # type: ignore[no-untyped-call]
        # A segment is as its neighbours have it: corners of one place get the same numbers.
        outline = shapely.build_area(shapely.multilinestrings(list(np.round(cut / same) * same)))
        for polygon in shapely.get_parts(shapely.simplify(outline, same)):
            for corners in convex_parts(polygon, same):
                flat, ends = np.tile(corners, (2, 1)), np.repeat([bottom, top], len(corners))
                pieces.append(np.column_stack([flat, ends]) @ frame.T)
        if len(pieces) > MOST_PIECES:
            return None
    return pieces or None


def convex_parts(polygon: Any, same: float = 0.0) -> list[Array]:
    """Corners, in order, of convex polygons that make up a polygon with holes, float64 (n, 2) each.

    `same`: a corner that goes inward by less, as an angle's sine times its edges, is none.
    """
    import shapely

    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    rings = [shapely.get_coordinates(shapely.orient_polygons(t))[:-1] for t in triangles]
    known: dict[tuple[float, float], int] = {}
    loops = [[known.setdefault((x, y), len(known)) for x, y in ring.tolist()] for ring in rings]
    places = np.array(list(known))
    owner = {(a, b): k for k, loop in enumerate(loops) for a, b in zip(loop, loop[1:] + loop[:1])}
    # The longest inner edges go first: what stays is short cuts.
    inner = [(a, b) for a, b in owner if a < b and (b, a) in owner]
    for a, b in sorted(inner, key=lambda edge: -float(np.linalg.norm(places[edge[0]] - places[edge[1]]))):
        one, two = owner[a, b], owner[b, a]
        joined = _joined(loops[one], loops[two], a, b)
        if joined is None or not _turns_left(places, joined, (a, b), same):
            continue
        loops[one], loops[two] = joined, []
        owner |= dict.fromkeys(zip(joined, joined[1:] + joined[:1]), one)
    return [places[loop] for loop in loops if loop]


def _joined(one: list[int], two: list[int], a: int, b: int) -> list[int] | None:
    """Two loops over the edge from a to b of the first; None where they are one already."""
    if one is two:
        return None
    i, j = one.index(b), two.index(a)
    # From b round to a in the first, then from a round to b in the second.
    return one[i:] + one[:i] + (two[j:] + two[:j])[1:-1]


def _turns_left(places: Array, loop: list[int], at: tuple[int, int], same: float) -> bool:
    """Whether a loop is convex at two of its corners."""
    for corner in at:
        k = loop.index(corner)
        before, here, after = (places[loop[n]] for n in (k - 1, k, (k + 1) % len(loop)))
        (x, y), (z, w) = here - before, after - here
        if x * w - y * z < -same * (abs(x) + abs(y) + abs(z) + abs(w)):
            return False
    return True
