"""Several solids in one mesh, or one file, told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from neurosym.geometry.mesh import topology, triangles
from neurosym.geometry.mesh.broad_phase import CHUNK, near_pairs
from neurosym.geometry.notes import Note
from neurosym.geometry.readers.contents import Contents, RawMesh, united
from neurosym.geometry.readers.mesh_checks import FLAT, MERGE
from neurosym.geometry.shapes import LARGEST
from neurosym.support.arrays import Array, Numbers, extents


def by_name(path: Path, meshes: Sequence[RawMesh]) -> Contents:
    """The named pieces of a file, a part each if one of them is closed by itself; else they are the faces of one."""
    if len(meshes) == 1 or any(map(_is_closed, meshes)):
        return Contents(tuple(meshes))
    one = united(path.stem, [(m.vertices, m.faces) for m in meshes], meshes[0].rounding)
    names = ", ".join(repr(m.name) for m in meshes[:5]) + (", ..." if len(meshes) > 5 else "")
    sentence = f"None of the {len(meshes)} pieces of {path.name} ({names}) is closed by itself: they are one part."
    return Contents((one,), notes=(Note("", "solids", len(meshes), sentence),))


def _is_closed(mesh: RawMesh) -> bool:
    faces = topology.without_repeats(topology.merged(mesh.vertices, mesh.faces)[1])
    return len(faces) > 0 and not len(topology.open_edges(faces)[0])


def separate(contents: Contents) -> Contents:
    """The contents with each solid of each mesh a part of its own."""
    apart = [_within(part) if isinstance(part, RawMesh) else [part] for part in contents.parts]
    notes = [
        Note("", "solids", n, f"{mesh.name!r} is {n} solids: the parts '{mesh.name}-1' to '{mesh.name}-{n}'.")
        for mesh, own in zip(contents.parts, apart)
        if (n := len(own)) > 1
    ]
    return replace(contents, parts=tuple(part for own in apart for part in own), notes=(*contents.notes, *notes))


def _within(mesh: RawMesh) -> list[RawMesh]:
    """The solids of a mesh, which then is a sub-assembly, with what else it says."""
    solids = separated(mesh)
    within = (*mesh.within, (id(mesh), mesh.name)) if len(solids) > 1 else mesh.within
    return [replace(solid, within=within) for solid in solids]


def separated(mesh: RawMesh) -> list[RawMesh]:
    """The solids of a mesh as meshes "name-1", "name-2", ... in its order; the mesh itself where it is one, or open.

    A solid is a shell and the cavities in it: shells that lie inside it, and in no other one inside it. Faces that come
    one after the other until they close are a shell, even where it touches the next.
    """
    if not len(mesh.faces) or mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        return [mesh]
    if not np.abs(mesh.vertices).max() <= LARGEST:
        return [mesh]
    extent = float(extents(mesh.vertices).max())
    vertices, faces = topology.merged(*topology.merged(mesh.vertices, mesh.faces), MERGE * extent)
    once = topology.without_repeats(faces, cancel=False)
    if len(topology.without_repeats(faces)):
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    else:
        faces = once  # each twice, wound both ways
    if not len(faces):
        return [mesh]
    apart, was = topology.unshared(faces, topology.closed_runs(faces))
    if topology.shells_of(apart).max() == 0:
        return [mesh]
    turned = topology.same_winding(apart)
    shells = None if turned is None else topology.closed_shells(turned)
    if turned is None or shells is None:
        return [mesh]
    points = vertices[was]
    volumes = topology.shell_volumes(points, turned, shells)
    areas = np.bincount(shells, weights=np.linalg.norm(triangles.area_vectors(points[turned]), axis=1))
    if (2 * np.abs(volumes) <= FLAT * extent * areas).any():
        return [mesh]
    corners = points[np.where((volumes < 0)[shells, None], turned[:, ::-1], turned)]
    order = np.argsort(shells, kind="stable")
    solid = _solids(np.split(corners[order], np.cumsum(np.bincount(shells))[:-1]), np.abs(volumes))[shells]
    solids: list[RawMesh] = []
    for k in dict.fromkeys(solid.tolist()):
        own = points[apart[solid == k]]
        name = f"{mesh.name}-{len(solids) + 1}"
        solids.append(RawMesh(name, own.reshape(-1, 3), np.arange(3 * len(own)).reshape(-1, 3), mesh.rounding))
    return solids if len(solids) > 1 else [mesh]


def _solids(shells: list[Array], volumes: Array) -> Numbers:
    """int64 (k,): for each shell, (m, 3, 3) outward, the number of the one that it is a cavity of, else its own."""
    low, high = (np.array([f(t.reshape(-1, 3), axis=0) for t in shells]) for f in (np.min, np.max))
    pairs = near_pairs((low, high), (low, high), 20 * CHUNK)
    around: list[list[int]] = [[] for _ in shells]
    for i, j in [] if pairs is None else pairs:
        within = (low[j] <= low[i]).all() and (high[i] <= high[j]).all() and volumes[i] < volumes[j]
        if within and triangles.are_inside(shells[i][:1].mean(axis=1), shells[j])[0]:
            around[i].append(int(j))
    # Inside an odd number of shells is inside a solid: of the innermost of them.
    return np.array([max(a, key=lambda j: len(around[j])) if len(a) % 2 else i for i, a in enumerate(around)])
