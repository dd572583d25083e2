"""Collision shapes for PyBullet: boxes, and compounds of boxes and convex hulls."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.simulation.solids import RigidBody, quaternion
from neurosym.support.arrays import Array

#: PyBullet joins so many shapes to a compound, and drops all further ones without a word.
MOST_JOINED = 16


def collision_shape(p: Any, body: RigidBody, shapes: dict[tuple[float, ...], int], folder: Path) -> int:
    """The number of a collision shape in the body's centre-of-mass frame.

    Args:
        p: the simulator.
        body: what the shape is made of.
        shapes: half edges -> shape, of single boxes made before: those of one size share theirs.
        folder: for the files that PyBullet wants; they may go once the shape is there.
    """
    first = body.solids[0]
    if len(body.solids) == 1 and first.half is not None:
        size = tuple(first.half.tolist())
        if size not in shapes:
            shapes[size] = p.createCollisionShape(p.GEOM_BOX, halfExtents=size)
        return shapes[size]
    X_CW = np.linalg.inv(body.X_WC)
    if len(body.solids) == 1 and first.faces is not None:
        corners = first.corners @ X_CW[:3, :3].T + X_CW[:3, 3]
        return int(
            p.createCollisionShape(
                p.GEOM_MESH,
                vertices=corners.tolist(),
                indices=first.faces.ravel().tolist(),
                flags=p.GEOM_FORCE_CONCAVE_TRIMESH,
            )
        )
    if len(body.solids) > MOST_JOINED:
        # From a file with an object a piece it makes a compound of hulls, as many as there are.
        hulls = [solid.corners @ X_CW[:3, :3].T + X_CW[:3, 3] for solid in body.solids]
        return int(p.createCollisionShape(p.GEOM_MESH, fileName=_obj(hulls, folder)))
    kinds, halves, files, positions, turns = [], [], [], [], []
    for solid in body.solids:
        X_CB = X_CW @ solid.X_WB
        kinds.append(p.GEOM_MESH if solid.half is None else p.GEOM_BOX)
        halves.append([1.0] * 3 if solid.half is None else solid.half.tolist())
        files.append("" if solid.half is not None else _obj([solid.vertices], folder))
        positions.append(X_CB[:3, 3].tolist())
        turns.append(quaternion(X_CB[:3, :3]).tolist())
    return int(
        p.createCollisionShapeArray(
            shapeTypes=kinds,
            halfExtents=halves,
            fileNames=files,
            collisionFramePositions=positions,
            collisionFrameOrientations=turns,
        )
    )


def _obj(hulls: list[Array], folder: Path) -> str:
    """Write corners as a file, an object a hull, since PyBullet joins meshes to a compound from files only.

    It takes the hulls of the corners, and it remembers files by name: the name is a digest of the content.
    """
    lines, first = [], 1
    for number, vertices in enumerate(hulls):
        lines.append(f"o hull{number or ''}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        lines += [f"f {i} {i + 1} {i + 2}" for i in range(first, first + len(vertices) - 2)]
        first += len(vertices)
    text = "\n".join(lines) + "\n"
    path = folder / f"{hashlib.sha256(text.encode()).hexdigest()}.obj"
    path.write_text(text)
    return str(path)
