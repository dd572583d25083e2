"""The bodies of a world inside Bullet: made, put somewhere, taken out, asked where they are, in the scene's scale."""

import hashlib
import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import UnknownNameError
from neurosym.simulation.client import Client, Closeable
from neurosym.simulation.physics import BodyKey, Frame, Physics, Snapshot
from neurosym.simulation.solids import RigidBody, quaternion
from neurosym.support.arrays import Array


class Bodies(Closeable):
    """Rigid bodies on a table, in a simulator of their own (a context manager).

    Args:
        made: the bodies that there can be.
        physics: gravity and the solver's numbers.
        surface: friction of each surface: Bullet multiplies those of the two bodies.
        static: names of parts that never move.
        ground: height of the table; minus infinity: there is none.

    Attributes:
        there: the bodies that are there, in the assembly's order, with the simulator's numbers.
    """

    def __init__(
        self,
        made: Mapping[BodyKey, RigidBody],
        physics: Physics,
        *,
        surface: float,
        static: Collection[str],
        ground: float,
    ) -> None:
        self.made, self.physics, self.surface = made, physics, surface
        self._static, self._ground = static, ground
        self.client = Client()
        self.p = self.client.p
        self._shapes: dict[tuple[float, ...], int] = {}
        self.there: dict[BodyKey, int] = {}

    def close(self) -> None:
        """Close the simulator; closing twice does nothing."""
        self.client.close()

    def numbers(self, part: str) -> dict[BodyKey, int]:
        """The simulator's numbers of a part's bodies; empty when it is not there."""
        return {key: number for key, number in self.there.items() if key[0] == part}

    def restore(self, snapshot: Snapshot) -> None:
        """Put the bodies of `snapshot`, and no others, where it says, at rest.

        The scene is built anew: contacts that Bullet remembers would make answers depend on what was asked before.
        """
        p, physics = self.p, self.physics
        p.resetSimulation()
        p.setGravity(0, 0, -physics.gravity)
        p.setPhysicsEngineParameter(
            fixedTimeStep=physics.time_step,
            numSolverIterations=physics.solver_iterations,
            deterministicOverlappingPairs=1,
        )
        if np.isfinite(self._ground):
            table = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE), basePosition=[0, 0, self._ground])
            p.changeDynamics(table, -1, lateralFriction=self.surface)
        self.there, self._shapes = {}, {}
        self._put(snapshot.frames)

    def _put(self, frames: Mapping[BodyKey, Frame]) -> None:
        """Put bodies into the scene, each at its frame, in the order in which they were made."""
        with tempfile.TemporaryDirectory(prefix="neurosym-") as folder:
            for key, body in self.made.items():
                if key in frames:
                    shape = collision_shape(self.p, body, self._shapes, Path(folder))
                    mass, inertia = 0.0 if body.part in self._static else body.mass, body.inertia.tolist()
                    self.there[key] = number = self.p.createMultiBody(mass, shape, -1, *frames[key])
                    self.p.changeDynamics(number, -1, lateralFriction=self.surface, localInertiaDiagonal=inertia)

    def remove(self, *parts: str) -> None:
        """Take whole parts out of the scene. Raises UnknownNameError: a part that is not, or no longer, there."""
        for part in parts:
            gone = self.numbers(part)
            if not gone:
                raise UnknownNameError("part in the scene", part, {name for name, _ in self.there})
            for key, number in gone.items():
                self.p.removeBody(number)
                del self.there[key]

    def step(self, steps: int = 1) -> None:
        """Advance by `steps` time steps."""
        for _ in range(steps):
            self.p.stepSimulation()

    def poses(self) -> Snapshot:
        """Where everything lies now."""
        return Snapshot({key: self.p.getBasePositionAndOrientation(i) for key, i in self.there.items()})

    def motion(self) -> dict[BodyKey, float]:
        """v^2 + w^2 of each body, in squared scene units (a typical body is one) and radians a second."""
        motions = {}
        for key, number in self.there.items():
            (vx, vy, vz), (wx, wy, wz) = self.p.getBaseVelocity(number)
            motions[key] = vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
        return motions

    def depth(self, first: int, second: int) -> float:
        """How deep two bodies, by the simulator's numbers, overlap, in scene lengths; 0 where they do not."""
        # Entry 8 is the distance between the two bodies there, negative where they overlap.
        return max((-float(point[8]) for point in self.p.getClosestPoints(first, second, 0.0)), default=0.0)


def resting_frame(body: RigidBody) -> Frame:
    """Position and quaternion, rounded: faces that touch exactly must not be parted by the last bits of a product.

    Bullet finds other contacts between cubes 1e-16 apart than between cubes that touch.
    """
    return (
        tuple((np.round(body.X_WC[:3, 3], 9) + 0.0).tolist()),
        tuple((np.round(quaternion(body.X_WC[:3, :3]), 12) + 0.0).tolist()),
    )


#: PyBullet joins so many shapes to a compound, and drops all further ones without a word.
MOST_JOINED = 16


def collision_shape(p: Any, body: RigidBody, shapes: dict[tuple[float, ...], int], folder: Path) -> int:
    """The number of a collision shape in the body's centre-of-mass frame.

    `p`: the simulator. `body`: what the shape is made of. `shapes`: half edges -> shape, of single boxes made before:
    those of one size share theirs. `folder`: for the files that PyBullet wants; they may go once the shape is there.
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
    """Write corners as a file, an object a hull, since PyBullet joins meshes to a compound from files only."""
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
