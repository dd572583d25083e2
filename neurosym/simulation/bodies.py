"""The bodies of a world inside Bullet: made, put somewhere, taken out, asked where they are, in the scene's scale."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import UnknownNameError
from neurosym.simulation.client import Client
from neurosym.simulation.collision_shapes import collision_shape
from neurosym.simulation.physics import BodyKey, Frame, Physics, Snapshot
from neurosym.simulation.solids import RigidBody, quaternion
from neurosym.support.arrays import Array


class Bodies:
    """Rigid bodies on a table, in one simulator.

    Args:
        client: the simulator.
        made: the bodies that there can be.
        physics: gravity and the solver's numbers.
        surface: friction of each surface: Bullet multiplies those of the two bodies.
        static: names of parts that never move.
        ground: height of the table; minus infinity: there is none.

    Attributes:
        numbers: the simulator's numbers of the bodies that are there.
    """

    def __init__(
        self,
        client: Client,
        made: Mapping[BodyKey, RigidBody],
        physics: Physics,
        *,
        surface: float,
        static: Collection[str],
        ground: float,
    ) -> None:
        self._client, self._made, self._physics = client, made, physics
        self._surface, self._static, self._ground = surface, static, ground
        self._p: Any = client.p
        self._shapes: dict[tuple[float, ...], int] = {}
        self.numbers: dict[BodyKey, int] = {}

    def restore(self, snapshot: Snapshot) -> None:
        """Put the bodies of `snapshot`, and no others, where it says, at rest, in a scene built afresh."""
        p, c = self._p, self._client.id
        p.resetSimulation(physicsClientId=c)
        p.setGravity(0, 0, -self._physics.gravity, physicsClientId=c)
        p.setPhysicsEngineParameter(
            fixedTimeStep=self._physics.time_step,
            numSolverIterations=self._physics.solver_iterations,
            deterministicOverlappingPairs=1,
            physicsClientId=c,
        )
        if np.isfinite(self._ground):
            plane = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=c)
            table = p.createMultiBody(0, plane, basePosition=[0, 0, self._ground], physicsClientId=c)
            p.changeDynamics(table, -1, lateralFriction=self._surface, physicsClientId=c)
        self.numbers, self._shapes = {}, {}
        self.add(snapshot.frames)

    def add(self, frames: Mapping[BodyKey, Frame]) -> None:
        """Put bodies into the scene, each at its frame, in the order in which they were made."""
        p, c = self._p, self._client.id
        with tempfile.TemporaryDirectory(prefix="neurosym-") as folder:
            for key, body in self._made.items():
                if key not in frames:
                    continue
                position, turn = frames[key]
                shape = collision_shape(self._client, body, self._shapes, Path(folder))
                mass = 0.0 if body.part in self._static else body.mass
                number = p.createMultiBody(mass, shape, -1, position, turn, physicsClientId=c)
                p.changeDynamics(
                    number,
                    -1,
                    lateralFriction=self._surface,
                    localInertiaDiagonal=body.inertia.tolist(),
                    physicsClientId=c,
                )
                self.numbers[key] = number

    def remove(self, part: str) -> None:
        """Take all bodies of a part out. Raises UnknownNameError: a part that is not, or no longer, there."""
        gone = [key for key in self.numbers if key[0] == part]
        if not gone:
            raise UnknownNameError("part in the scene", part, {name for name, _ in self.numbers})
        for key in gone:
            self._p.removeBody(self.numbers.pop(key), physicsClientId=self._client.id)

    def step(self, steps: int) -> None:
        """Advance by so many time steps."""
        for _ in range(steps):
            self._p.stepSimulation(physicsClientId=self._client.id)

    def poses(self) -> Snapshot:
        """Where everything lies now."""
        c = self._client.id
        return Snapshot(
            {key: self._p.getBasePositionAndOrientation(i, physicsClientId=c) for key, i in self.numbers.items()}
        )

    def motion(self) -> dict[BodyKey, float]:
        """v^2 + w^2 of each body, in squared scene units and radians a second."""
        found = {}
        for key, number in self.numbers.items():
            (vx, vy, vz), (wx, wy, wz) = self._p.getBaseVelocity(number, physicsClientId=self._client.id)
            found[key] = vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
        return found

    def overlaps(self, part: str, shift: Array, tolerance: float) -> set[str]:
        """Names of the parts that `part` would cut into, deeper than `tolerance`, moved by `shift`, float64 (3,)."""
        p, c, hit = self._p, self._client.id, set[str]()
        for key, number in self.numbers.items():
            if key[0] != part:
                continue
            position, turn = p.getBasePositionAndOrientation(number, physicsClientId=c)
            p.resetBasePositionAndOrientation(number, (np.asarray(position) + shift).tolist(), turn, physicsClientId=c)
            for other, i in self.numbers.items():
                if other[0] != part and other[0] not in hit:
                    near = p.getClosestPoints(number, i, 0.0, physicsClientId=c)
                    # Entry 8 is the distance between the two bodies there, negative where they overlap.
                    if any(-point[8] > tolerance for point in near):
                        hit.add(other[0])
            p.resetBasePositionAndOrientation(number, position, turn, physicsClientId=c)
        return hit


def resting_frame(body: RigidBody) -> Frame:
    """Position and quaternion, rounded: faces that touch exactly must not be parted by the last bits of a product.

    Bullet finds other contacts between cubes 1e-16 apart than between cubes that touch.
    """
    return (
        tuple((np.round(body.X_WC[:3, 3], 9) + 0.0).tolist()),
        tuple((np.round(quaternion(body.X_WC[:3, :3]), 12) + 0.0).tolist()),
    )
