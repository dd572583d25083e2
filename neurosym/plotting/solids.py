"""Parts as a viewer from afar sees them: faces that look at the viewer, how light they are, and their outlines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from neurosym.plotting.painter import Piece

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]

#: Faces that meet at less than this are one surface, without a line between them (cosine of 25 degrees).
SMOOTH = 0.906
#: A face that is turned from the edge-on position by less is not seen (sine of the angle).
EDGE_ON = 1e-6
#: Corners no farther apart than this are one, as a share of the part's extent; so far may a convex body be dented.
_SAME = 1e-6
#: Towards the light, in the viewer's frame, a unit vector; and how light a face is that looks away from it (0..1).
_LIGHT = np.array([-0.43, 0.79, 0.44])
_SHADE = 0.45


def seen_from(azimuth: float, elevation: float) -> Array:
    """float64 (3, 3): rows to the right, up and towards the viewer; degrees, 0, 0 looks from +x and z is up."""
    a, e = np.radians([azimuth, elevation])
    return np.array(
        [
            [-np.sin(a), np.cos(a), 0.0],
            [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)],
            [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)],
        ]
    )


def pieces_of(assembly: Assembly, shifts: Mapping[str, Array], view: Array) -> list[Piece]:
    """All that can be seen of the parts.

    Args:
        assembly: the parts at rest.
        shifts: part name -> float64 (3,), by how much it is moved, in the world.
        view: float64 (3, 3), as `seen_from` gives it.
    """
    found: list[Piece] = []
    for number, name in enumerate(assembly.names):
        bodies = np.flatnonzero(assembly.owners == number)
        corners = [(assembly.body_vertices(int(i)) + shifts[name]) @ view.T for i in bodies]
        faces = [np.asarray(assembly.bodies[int(i)].shape.faces) for i in bodies]
        found += _part(number, corners, faces)
    return found


def _part(number: int, corners: list[Array], triangles: list[NDArray[np.int64]]) -> list[Piece]:
    """Pieces of one part, whose bodies share the lines between them."""
    every = np.concatenate(corners)
    near = _SAME * max(float(np.ptp(every, axis=0).max()), 1e-300)
    same = np.unique(np.round(every / near).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    points = np.zeros((int(same.max()) + 1, 3))
    points[same] = every
    loops: list[tuple[int, ...]] = []  # corners of each face in order
    planes: list[Array] = []
    groups: list[list[int]] = []  # faces that make a piece
    start = 0
    for own, faces in zip(corners, triangles):
        numbers = same[start : start + len(own)]
        start += len(own)
        mine = np.array([t for t in numbers[faces].tolist() if len(set(t)) == 3], dtype=np.int64).reshape(-1, 3)
        normals = np.cross(points[mine[:, 1]] - points[mine[:, 0]], points[mine[:, 2]] - points[mine[:, 0]])
        lengths = np.linalg.norm(normals, axis=1)
        mine, normals = mine[lengths > near**2], (normals / np.maximum(lengths, 1e-300)[:, None])[lengths > near**2]
        if len(mine) == 0:
            continue
        offsets = np.einsum("ij,ij->i", normals, points[mine[:, 0]])
        flat = _in_one_plane(normals, offsets, near)
        convex = bool((_highest(normals, points[np.unique(mine)]) <= offsets + 10 * near).all())
        first = len(loops)
        for group in flat:
            plane = np.append(normals[group[0]], offsets[group[0]])
            merged = [_around(points, mine[group], plane[:3])] if convex else [tuple(t) for t in mine[group].tolist()]
            groups.append(list(range(len(loops), len(loops) + len(merged))))
            loops += merged
            planes += [plane] * len(merged)
        if convex:
            groups[-len(flat) :] = [list(range(first, len(loops)))]
    return _pieces(number, points, loops, planes, groups)


def _pieces(
    number: int, points: Array, loops: list[tuple[int, ...]], planes: list[Array], groups: list[list[int]]
) -> list[Piece]:
    # Where two bodies of a part lie against one another neither face is part of its surface.
    twins: dict[frozenset[int], list[int]] = {}
    for k, loop in enumerate(loops):
        twins.setdefault(frozenset(loop), []).append(k)
    inner = {k for pair in twins.values() if len(pair) > 1 for k in pair}
    beside: dict[frozenset[int], list[int]] = {}
    for k, loop in enumerate(loops):
        for a, b in zip(loop, loop[1:] + loop[:1]) if k not in inner else ():
            beside.setdefault(frozenset((a, b)), []).append(k)
    found = []
    for group in groups:
        front = [k for k in group if k not in inner and planes[k][2] > EDGE_ON]
        edges = {edge for k in front for edge in map(frozenset, zip(loops[k], loops[k][1:] + loops[k][:1]))}
        drawn = [sorted(edge) for edge in edges if _is_line([planes[k] for k in beside[edge]])]
        if front:
            found.append(
                Piece(
                    number,
                    tuple(points[list(loops[k])] for k in front),
                    tuple(_lightness(planes[k][:3]) for k in front),
                    tuple(points[ends] for ends in sorted(drawn)),
                    np.unique([planes[k] for k in front], axis=0),
                )
            )
    return found


def _is_line(planes: list[Array]) -> bool:
    """Whether an edge between these faces is drawn: a crease, or where the surface turns away from the viewer."""
    if len(planes) != 2:
        return True
    a, b = planes
    return float(a[:3] @ b[:3]) < SMOOTH or (a[2] > EDGE_ON) != (b[2] > EDGE_ON)


def _in_one_plane(normals: Array, offsets: Array, near: float) -> list[NDArray[np.int64]]:
    """Numbers of the faces, gathered by the plane in which they lie."""
    keys = np.column_stack([np.round(normals, 5), np.round(offsets / (20 * near))]) + 0.0
    which = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    return np.split(np.argsort(which, kind="stable"), np.cumsum(np.bincount(which))[:-1])


def _highest(normals: Array, points: Array) -> Array:
    """float64 (n_normals,): how far the points reach along each normal; in blocks, as meshes can be large."""
    return np.concatenate([(normals[k : k + 512] @ points.T).max(axis=1) for k in range(0, len(normals), 512)])


def _around(points: Array, triangles: NDArray[np.int64], normal: Array) -> tuple[int, ...]:
    """The corners of a convex face in order, counterclockwise about its normal; without those inside it."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    pairs, times = np.unique(edges, axis=0, return_counts=True)
    own = np.unique(pairs[times == 1])
    arms = points[own] - points[own].mean(axis=0)
    across = arms[int(np.argmax(np.linalg.norm(arms, axis=1)))]
    across = across / np.linalg.norm(across)
    angles = np.arctan2(arms @ np.cross(normal, across), arms @ across)
    return tuple(int(i) for i in own[np.argsort(angles)])


def _lightness(normal: Array) -> float:
    return _SHADE + (1 - _SHADE) * (1 + float(normal @ _LIGHT)) / 2
