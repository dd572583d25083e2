"""Meshes that are not convex, as convex pieces for a simulator that moves nothing else.

Joints, frames and whatever else has few inner edges are cut exactly (`neurosym.simulation.cutting`). What would fall
into too many pieces goes to V-HACD, which PyBullet brings and which approximates: measured on a channel of volume 5,
its pieces have 5.9, and the hollow is half filled. So a part in a snug or curved hole may be pressed by its neighbours
where the real one is not. A part that never moves needs none of this: it collides as the mesh it is.
"""

import os
import tempfile
from pathlib import Path

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.simulation.client import pybullet, without_output
from neurosym.simulation.cutting import cut_into_convex
from neurosym.support.arrays import Array, Numbers

#: V-HACD's voxels in a part's bounding box: at 100,000 a cubic part has some 46 along an edge.
VOXELS = 100_000
#: How hollow a piece may stay, as a share of the part's volume.
CONCAVITY = 0.001


def convex_pieces(name: str, vertices: Array, faces: Numbers) -> list[Array]:
    """Corners of convex pieces that together make up a closed mesh, each float64 (n, 3), in the mesh's frame.

    Args:
        name: of the part, for messages.
        vertices: float64 (n, 3).
        faces: int64 (m, 3).

    Raises:
        AssemblyError: neither way finds any piece in the mesh.
    """
    return cut_into_convex(vertices, faces) or _by_vhacd(name, vertices, faces)


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
