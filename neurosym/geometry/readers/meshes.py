"""Sound meshes as parts, turned into boxes where they are unions of cubes of one grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.mesh.topology import signed_volume
from neurosym.geometry.mesh.triangles import are_convex, are_inside, area_vectors
from neurosym.geometry.rigid_motions import posed, shifted
from neurosym.geometry.shapes import Body, Box, Convex, Mesh, Part
from neurosym.geometry.tolerances import Tolerances
from neurosym.support.arrays import Array, Numbers, bounds
from neurosym.support.deadline import check

Triangles = tuple[Array, Numbers]

#: A grid finer than this many cells a part is kept as a mesh: boxes would be slower than triangles.
MAX_CELLS = 4_000

#: Together more cells than this are no puzzle of unit cubes: a cuboid then is one box, any other shape a mesh.
MAX_UNIT_CUBES = 1_000


def as_triangles(name: str, mesh: Any) -> Triangles:
    """Vertices (n, 3) and faces (m, 3) of anything that has them, or is a pair of them."""
    try:
        vertices, faces = (mesh.vertices, mesh.faces) if hasattr(mesh, "vertices") else mesh
        v, f = np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.int64)
    except (TypeError, ValueError) as error:
        raise AssemblyError(f"Part {name!r}: expected a mesh with vertices and faces; got {mesh!r}: {error}.") from None
    if v.ndim != 2 or v.shape[1] != 3 or f.ndim != 2 or f.shape[1] != 3:
        raise AssemblyError(f"Part {name!r}: expected vertices (n, 3) and faces (m, 3); got {v.shape} and {f.shape}.")
    return v, f


def parts_from_meshes(meshes: Mapping[str, Triangles], tolerances: Tolerances) -> tuple[Part, ...]:
    """One part a sound mesh (closed, its faces outward), all in the world's frame."""
    cubes = _common_grid(meshes, tolerances) if meshes else {}
    return tuple(
        Part(name, cubes[name] if name in cubes else (_one_body(*meshes[name]),), np.eye(4)) for name in meshes
    )


def _one_body(vertices: Array, faces: Numbers) -> Body:
    """A single body, its frame at the centre of its bounds, so that numbers stay small."""
    centre = np.mean(bounds(vertices), axis=0)
    local = vertices - centre
    convex = are_convex(local, faces, 1e-9 * float(np.ptp(local)))
    return Body((Convex if convex else Mesh)(local, faces), shifted(centre))


def _common_grid(meshes: Mapping[str, Triangles], tolerances: Tolerances) -> dict[str, tuple[Body, ...]]:
    """Boxes for the parts that are unions of cubes of one common grid; the others are left out."""
    # Far from the origin a frame's rounding would grow into shifts: all is measured from the middle.
    middle = np.mean([v.mean(axis=0) for v, _ in meshes.values()], axis=0)
    near = {name: (v - middle, f) for name, (v, f) in meshes.items()}
    frames = {name: _orthogonal_frame(v, f, tolerances) for name, (v, f) in near.items()}
    frame = next((f for f in frames.values() if f is not None), None)
    if frame is None:
        return {}
    fitting = [n for n, own in frames.items() if own is not None and _same_axes(frame, own, tolerances)]
    frame = _mean_frame(frame, [near[n] for n in fitting])
    local = {name: (near[name][0] @ frame, near[name][1]) for name in fitting}
    spans = []
    for vertices, _ in local.values():
        for axis in vertices.T:
            gaps = np.diff(np.sort(axis))
            spans.append(gaps[gaps > 1e-3 * max(float(np.ptp(axis)), 1e-300)])
    pitch = _common_divisor(np.concatenate(spans))
    if pitch is None:
        return {}
    boxes: dict[str, tuple[Body, ...]] = {}
    origin = local[fitting[0]][0].min(axis=0)
    cells = {name: _cells(vertices, faces, pitch) for name, (vertices, faces) in local.items()}
    many = sum(len(c) for c in cells.values() if c is not None) > MAX_UNIT_CUBES
    for name, own_cells in cells.items():
        if own_cells is None:
            continue
        low = local[name][0].min(axis=0)
        steps = (low - origin) / pitch
        if np.abs(steps - np.round(steps)).max() < 0.01:
            low = origin + np.round(steps) * pitch
        counts = own_cells.max(axis=0) + 1
        if many and len(own_cells) != counts.prod():
            continue
        box = Box(counts * pitch if many else np.full(3, pitch))
        centres = [counts / 2] if many else own_cells + 0.5
        boxes[name] = tuple(Body(box, posed(frame, middle + frame @ (low + centre * pitch))) for centre in centres)
    return boxes


def _mean_frame(frame: Array, meshes: list[Triangles]) -> Array:
    """The rotation (3, 3) nearest to all faces of all meshes, each weighed by its area."""
    triangles = np.concatenate([v[f] for v, f in meshes])
    area = area_vectors(triangles)
    along = area @ frame
    axis = np.abs(along).argmax(axis=1)
    columns = [(np.sign(along[axis == k, k])[:, None] * area[axis == k]).sum(axis=0) for k in range(3)]
    u, _, vt = np.linalg.svd(np.stack([c / np.linalg.norm(c) for c in columns], axis=1))
    return np.asarray(u @ vt)


def _orthogonal_frame(vertices: Array, faces: Numbers, tolerances: Tolerances) -> Array | None:
    """Rotation (3, 3) whose columns are the directions of all faces, or None when they are not three such."""
    check()
    normals = area_vectors(vertices[faces])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > 1e-9 * lengths.max()]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    axes: list[Array] = []
    left = normals
    while len(left) and len(axes) < 3:
        axes.append(left[0])
        left = left[np.linalg.norm(np.cross(left, left[0]), axis=1) > 10 * tolerances.parallel]
    if len(left) or len(axes) != 3:
        return None
    frame = np.stack(axes, axis=1)
    if not np.allclose(frame.T @ frame, np.eye(3), atol=10 * tolerances.parallel):
        return None
    frame[:, 2] = np.cross(frame[:, 0], frame[:, 1])
    return frame


def _same_axes(a: Array, b: Array, tolerances: Tolerances) -> bool:
    return bool(np.allclose(np.sort(np.abs(a.T @ b).ravel()), [0] * 6 + [1] * 3, atol=10 * tolerances.parallel))


def _common_divisor(gaps: Array) -> float | None:
    """The largest length of which all gaps are whole multiples (within 1%), or None."""
    smallest = float(gaps.min())
    for parts in (1, 2, 3):
        pitch = smallest / parts
        ratio = gaps / pitch
        if np.abs(ratio - np.round(ratio)).max() < 0.01:
            return float(gaps.sum() / np.round(ratio).sum())
    return None


def _cells(local: Array, faces: Numbers, pitch: float) -> Numbers | None:
    """The cells, int64 (n, 3) from 0, that a mesh in the grid's frame is the union of; None when it is not."""
    check()
    low = local.min(axis=0)
    along = np.round(np.ptp(local, axis=0) / pitch)
    if along.min() < 1 or along.prod() > MAX_CELLS:
        return None
    counts = along.astype(int)
    offsets = (local - low) / pitch
    if np.abs(offsets - np.round(offsets)).max() > 0.01:
        return None
    t: Array = np.round(offsets)[faces]
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    cells = cells[are_inside(np.add(cells, 0.5), t)]
    if abs(len(cells) - signed_volume(t.reshape(-1, 3), np.arange(3 * len(t)).reshape(-1, 3))) > 1e-6:
        return None
    return cells
