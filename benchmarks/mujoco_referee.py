"""A second referee: parts made of boxes settle for a second in MuJoCo (extra `mujoco`)."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

import neurosym as ns
from neurosym.geometry.shapes import Box

#: Steps a second, and steps that are waited.
RATE, STEPS = 1000, 1000


def settled(assembly: ns.Assembly, present: Collection[str]) -> dict[str, float]:
    """How far each part goes within a second: the farthest of its bodies' corners, in the assembly's unit.

    The scene is scaled so that a typical body measures 1. Contact is as stiff as the time step allows, friction cones
    are round, and no slip is tolerated: MuJoCo's soft friction creeps by default.
    """
    import mujoco

    scale = 1 / float(np.mean([b.shape.vertices.max() - b.shape.vertices.min() for b in assembly.bodies]))
    spec = mujoco.MjSpec()
    spec.option.timestep = 1 / RATE
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.noslip_iterations = 10
    spec.option.iterations = 200
    solver = {"solref": [3 / RATE, 1.0], "solimp": [0.99, 0.999, 1e-4, 0.5, 2.0]}
    friction = [assembly.friction, 0.0, 0.0]
    ground = mujoco.mjtGeom.mjGEOM_PLANE
    plane = {"type": ground, "size": [50.0, 50.0, 1.0], "pos": [0.0, 0.0, assembly.ground * scale]}
    spec.worldbody.add_geom(friction=friction, condim=3, **plane, **solver)
    for name in present:
        part = assembly[name]
        body = spec.worldbody.add_body(name=name)
        if name not in assembly.fixed:
            body.add_freejoint()
        for piece in part.bodies:
            if not isinstance(piece.shape, Box):
                raise TypeError(f"Expected parts made of boxes; {name} has {type(piece.shape).__name__}.")
            X = part.X_WP @ piece.X_PB
            quat = np.zeros(4)
            mujoco.mju_mat2Quat(quat, X[:3, :3].ravel())
            box = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": piece.shape.size / 2 * scale, "pos": X[:3, 3] * scale}
            body.add_geom(quat=quat, friction=friction, condim=3, density=part.density, **box, **solver)
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    return {name: _travel(assembly, name, data.body(name), scale) / scale for name in present}


def _travel(assembly: ns.Assembly, name: str, body: object, scale: float) -> float:
    """How far the farthest corner of a body went from where it is when assembled."""
    part = assembly[name]
    points: list[NDArray[np.float64]] = []
    for piece in part.bodies:
        X = part.X_WP @ piece.X_PB
        points.append((piece.shape.vertices @ X[:3, :3].T + X[:3, 3]) * scale)
    at = np.concatenate(points)
    moved = at @ body.xmat.reshape(3, 3).T + body.xpos  # type: ignore[attr-defined]
    return float(np.linalg.norm(moved - at, axis=1).max())
