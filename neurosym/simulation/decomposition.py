"""Meshes that are not convex, as convex pieces for a simulator that moves nothing else.

Joints, frames and whatever else has few inner edges are cut exactly, by binary space partition along their own faces:
the plane of a face divides the space that is left, and the faces that lie across it; where no face is left, what is
behind the last one is inside (Fuchs, Kedem and Naylor 1980). Planes that cut no face come first, so a convex mesh
stays whole and a joint or a frame falls into few pieces. Plates with holes, flanges and bushings fall into prisms,
exactly too (see `neurosym.simulation.layers`). What, like a bowl, is neither goes to CoACD (Wei et al., "Approximate
convex decomposition for 3D meshes with collision-aware concavity and tree search", 2022), or without it to V-HACD,
which PyBullet brings. Both approximate: a part in a snug hole may be pressed by its neighbours where the real one is
not. A replay looks for that before it begins. A part that never moves collides as the mesh it is.
"""

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.simulation.client import pybullet, without_output
from neurosym.simulation.layers import layered
from neurosym.support import disk_cache
from neurosym.support.arrays import Array, Numbers

#: V-HACD's voxels in a part's bounding box: at 100,000 a cubic part has some 46 along an edge.
VOXELS = 100_000
#: How far CoACD's pieces may be from the part (Hausdorff distance, as a share of its extent), and how long it looks.
CONCAVE = 0.03
SEARCH: dict[str, Any] = {"mcts_nodes": 10, "mcts_iterations": 40, "mcts_max_depth": 2, "resolution": 1000, "seed": 0}
#: How hollow a piece may stay, as a share of the part's volume.
CONCAVITY = 0.001


def convex_pieces(name: str, vertices: Array, faces: Numbers) -> list[Array]:
    """Corners of convex pieces that together make up a closed mesh, each float64 (n, 3), in the mesh's frame.

    `name`: of the part, for messages. `vertices`: float64 (n, 3). `faces`: int64 (m, 3). Raises AssemblyError: neither
    way finds any piece in the mesh.
    """
    exact = cut_into_convex(vertices, faces) or layered(vertices, faces)
    return exact or _by_coacd(vertices, faces) or _by_vhacd(name, vertices, faces)


def _by_coacd(vertices: Array, faces: Numbers) -> list[Array] | None:
    """Approximately; kept on disk, for it takes its time. None: CoACD is not installed, or finds nothing."""
    place = disk_cache.place("pieces", np.ascontiguousarray(vertices).tobytes(), np.ascontiguousarray(faces).tobytes())
    kept = disk_cache.load_all(place)
    if kept is None:
        try:
            import coacd
        except ImportError:
            return None
        coacd.set_log_level("error")
        low, span = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
        mesh = coacd.Mesh((vertices - low) / span, faces)
        found = [hull * span + low for hull, _ in coacd.run_coacd(mesh, threshold=CONCAVE, **SEARCH)]
        kept = {str(k): hull for k, hull in enumerate(found)}
        disk_cache.store_all(place, kept)
    return list(kept.values()) or None


def _by_vhacd(name: str, vertices: Array, faces: Numbers) -> list[Array]:
    # It works in single precision and expects lengths of about one.
    low, span = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    scaled = (vertices - low) / span
    with tempfile.TemporaryDirectory(prefix="neurosym-") as folder:
        given, found = Path(folder, "part.obj"), Path(folder, "pieces.obj")
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in scaled.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
        given.write_text("\n".join(lines) + "\n")
        with without_output():
            pybullet().vhacd(
                str(given), str(found), os.devnull, resolution=VOXELS, concavity=CONCAVITY, maxNumVerticesPerCH=64
            )
        pieces = _read(found.read_text()) if found.exists() else []
    if not pieces:
        raise AssemblyError(
            f"Expected part {name!r} to come apart into convex pieces for the simulator; V-HACD found none. Check that "
            "the mesh is closed, or give the part as several Convex bodies."
        )
    return [piece * span + low for piece in pieces]


def _read(text: str) -> list[Array]:
    """Corners of the objects in an OBJ file."""
    pieces: list[list[list[float]]] = []
    for line in text.splitlines():
        if line.startswith("o "):
            pieces.append([])
        elif line.startswith("v "):
            if not pieces:
                pieces.append([])
            pieces[-1].append([float(x) for x in line.split()[1:4]])
    return [np.array(piece) for piece in pieces if len(piece) > 3]


#: Meshes of more faces than this, or that fall into more pieces, are not worth cutting.
MOST_FACES, MOST_PIECES = 600, 60
#: Points nearer than this to a plane lie on it, as a share of the mesh's extent.
ON_PLANE = 1e-6


def cut_into_convex(vertices: Array, faces: Numbers) -> list[Array] | None:
    """Corners of the convex pieces of a closed mesh, each float64 (n, 3); None when they would be too many.

    `vertices`: float64 (n, 3). `faces`: int64 (m, 3), outward.
    """
    if len(faces) > MOST_FACES:
        return None
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    limit = ON_PLANE * float((high - low).max())
    surface = [vertices[face] for face in faces]
    surface = [polygon for polygon in surface if np.linalg.norm(_area(polygon)) > limit * limit]
    # Each entry: a convex cell, given by its faces, and the mesh's faces in it.
    waiting = [(_box(low - 0.1 * (high - low), high + 0.1 * (high - low)), surface)]
    pieces: list[Array] = []
    while waiting:
        if len(pieces) + len(waiting) > MOST_PIECES:
            return None
        cell, within = waiting.pop()
        normal, offset = _best_plane(within, limit)
        before, behind = _part(within, normal, offset, limit), _part(within, -normal, -offset, limit)
        rest = _half(cell, -normal, -offset, limit)
        if before:
            waiting.append((_half(cell, normal, offset, limit), before))
        if behind:
            waiting.append((rest, behind))
        elif rest:
            pieces.append(np.unique(np.round(np.concatenate(rest) / limit) * limit, axis=0))
    return [piece for piece in pieces if len(piece) > 3]


def _area(polygon: Array) -> Array:
    """Twice the area, along the normal, float64 (3,)."""
    spokes = polygon - polygon[0]
    return np.asarray(np.cross(spokes[:-1], spokes[1:]).sum(axis=0))


def _box(low: Array, high: Array) -> list[Array]:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (high - low) + low
    return [corners[f] for f in ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])]


def _best_plane(surface: list[Array], limit: float) -> tuple[Array, float]:
    """The plane of a face that cuts the fewest other faces; among those, one with all of them behind it."""
    corners, owner = np.concatenate(surface), np.repeat(np.arange(len(surface)), [len(p) for p in surface])
    starts = np.searchsorted(owner, np.arange(len(surface)))
    best: tuple[tuple[int, int], Array, float] | None = None
    for polygon in surface:
        normal = _area(polygon)
        normal = normal / np.linalg.norm(normal)
        offset = float(normal @ polygon[0])
        heights = corners @ normal - offset
        front, back = np.maximum.reduceat(heights, starts) > limit, np.minimum.reduceat(heights, starts) < -limit
        cost = (int((front & back).sum()), int(front.sum()))
        if best is None or cost < best[0]:
            best = cost, normal, offset
        if cost == (0, 0):
            break
    assert best is not None
    return best[1], best[2]


def _part(surface: list[Array], normal: Array, offset: float, limit: float) -> list[Array]:
    """What of polygons lies on the side that `normal` points to, those in the plane itself left out."""
    found = []
    for polygon in surface:
        heights = polygon @ normal - offset
        heights[np.abs(heights) <= limit] = 0.0
        if heights.max() <= 0:
            continue
        clipped = polygon if heights.min() >= 0 else _clipped(polygon, heights)
        if len(clipped) > 2 and np.linalg.norm(_area(clipped)) > limit * limit:
            found.append(clipped)
    return found


def _clipped(polygon: Array, heights: Array) -> Array:
    corners = []
    for p, q, h, k in zip(polygon, np.roll(polygon, -1, axis=0), heights, np.roll(heights, -1)):
        if h >= 0:
            corners.append(p)
        if h * k < 0:
            corners.append(p + (q - p) * h / (h - k))
    return np.array(corners)


def _half(cell: list[Array], normal: Array, offset: float, limit: float) -> list[Array]:
    """A convex cell's part on the side that `normal` points to, closed by a face in the plane; maybe empty."""
    kept = _part(cell, normal, offset, limit)
    if not kept:
        return []
    corners = np.concatenate(kept)
    rim = corners[np.abs(corners @ normal - offset) <= limit]
    if len(rim) > 2:
        middle = rim.mean(axis=0)
        u = np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.9 else [0, 1.0, 0])
        v = np.cross(normal, u)
        around = np.argsort(np.arctan2((rim - middle) @ v, (rim - middle) @ u))
        kept.append(rim[around])
    return kept
