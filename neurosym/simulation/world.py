"""An assembly under gravity: build it in PyBullet, take parts away, see what moves.

Lengths come and go in the assembly's unit; inside, the scene is scaled so that a typical body measures one unit,
because Bullet is less trustworthy with small bodies (5 cm cubes were judged wrongly far more often than 1 m ones).
"""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from math import sqrt
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError, UnknownNameError
from neurosym.simulation.client import Client
from neurosym.simulation.collision_shapes import collision_shape
from neurosym.simulation.solids import (
    BodiesKind,
    MeshesKind,
    RigidBody,
    matrix,
    quaternion,
    rigid_bodies,
    typical_extent,
)

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]
#: A body of a world: the part's name, and which of its pieces (always 0 for whole parts).
BodyKey = tuple[str, int]

#: Steps of settling: one second. With a quarter of it 8 verdicts in 100 are wrong, as things fall too slowly.
SETTLE_STEPS = 240
#: A part has moved when a corner of it did by more than this share of a typical body. Settling itself shifts
#: things by thousandths; what topples or drops moves by halves. In between, verdicts do not depend on it.
MOVED_SHARE = 0.2
#: A body is at rest when v^2 + w^2 is below this, in squared scene units and radians a second: a tenth of the
#: threshold at which the paper's simulation says that a cube moves.
REST = 1e-4


@dataclass(frozen=True, slots=True)
class Physics:
    """Numbers of the simulation.

    Attributes:
        friction: coefficient between any two bodies, and the table; None takes the assembly's.
        gravity: in scene units per second squared, downward along z.
        time_step: seconds. 1/60 changes 6 verdicts in 100.
        solver_iterations: of Bullet's contact solver, each step.
        clearance: share of its width that an upright box gives up at its sides, so that neighbours side by side
            do not touch. With none, Bullet's solver lets them press on one another, and what should fall may jam.
    """

    friction: float | None = None
    gravity: float = 9.81
    time_step: float = 1 / 240
    solver_iterations: int = 50
    clearance: float = 0.0


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Where the bodies of a world lay: each body's centre-of-mass frame, in the scene's scale.

    A snapshot can be given to `World.restore` of the same world, or of another one made from the same assembly.
    """

    frames: Mapping[BodyKey, tuple[tuple[float, ...], tuple[float, ...]]] = field(default_factory=dict)


class World:
    """An assembly on its table, in a simulator of its own (a context manager).

    Args:
        assembly: the parts, in the world.
        bodies: ``"parts"``: each part moves as one; ``"cubes"``: every body of every part moves alone.
        physics: friction, gravity and the solver's numbers.
        ground: height of the table; None takes the assembly's own, which may be none at all.
        present: names of the parts that are there; None means all.
        meshes: whether meshes that are not convex are refused, or taken apart into convex pieces.
        window: show it in PyBullet's own window.

    The assembly's fixed parts never move, whatever their shape.

    Raises:
        InputError: a part that is not made of convex pieces, where those are asked for.
    """

    def __init__(
        self,
        assembly: Assembly,
        *,
        bodies: BodiesKind = "parts",
        physics: Physics | None = None,
        ground: float | None = None,
        present: Collection[str] | None = None,
        meshes: MeshesKind = "refuse",
        window: bool = False,
    ) -> None:
        self.assembly = assembly
        self.physics = physics or Physics()
        self.unit = typical_extent(assembly)
        self._scale = 1 / self.unit
        self._ground = assembly.ground if ground is None else ground
        made = rigid_bodies(assembly, bodies, self._scale, self.physics.clearance, meshes)
        self._made = {(body.part, body.index): body for body in made}
        self._corners = {key: body.corners_C for key, body in self._made.items()}
        self._ids: dict[BodyKey, int] = {}
        self._shapes: dict[tuple[float, ...], int] = {}
        if present is not None and (unknown := set(present) - {part for part, _ in self._made}):
            raise UnknownNameError("part", min(unknown), (part for part, _ in self._made))
        self._client = Client(window=window)
        self._p: Any = self._client.p
        try:
            self.initial = Snapshot(
                {key: _frame(body) for key, body in self._made.items() if present is None or key[0] in present}
            )
            self.restore(self.initial)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the simulator; closing twice does nothing."""
        self._client.close()

    def __enter__(self) -> World:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def bodies(self) -> tuple[BodyKey, ...]:
        """The bodies that are there, in the assembly's order."""
        return tuple(self._ids)

    def restore(self, snapshot: Snapshot) -> None:
        """Put the bodies of `snapshot`, and no others, where it says, at rest.

        The scene is built afresh: contacts that Bullet remembers would make answers depend on what was asked before.
        """
        p, c = self._p, self._client.id
        p.resetSimulation(physicsClientId=c)
        p.setGravity(0, 0, -self.physics.gravity, physicsClientId=c)
        p.setPhysicsEngineParameter(
            fixedTimeStep=self.physics.time_step,
            numSolverIterations=self.physics.solver_iterations,
            deterministicOverlappingPairs=1,
            physicsClientId=c,
        )
        if np.isfinite(self._ground):
            plane = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=c)
            table = p.createMultiBody(0, plane, basePosition=[0, 0, self._ground * self._scale], physicsClientId=c)
            p.changeDynamics(table, -1, lateralFriction=self.surface, physicsClientId=c)
        self._ids, self._shapes = {}, {}
        self._build(snapshot)

    @property
    def surface(self) -> float:
        """Friction of each surface: Bullet multiplies those of the two bodies."""
        return sqrt(self.assembly.friction if self.physics.friction is None else self.physics.friction)

    def add(self, *parts: str) -> None:
        """Put whole parts into the scene, where they rest when assembled.

        Raises:
            UnknownNameError: no such part.
        """
        for part in parts:
            own = {key: _frame(body) for key, body in self._made.items() if key[0] == part}
            if not own:
                raise UnknownNameError("part", part, self.assembly.names)
            self._build(Snapshot(own))

    def numbers(self, part: str) -> dict[BodyKey, int]:
        """The simulator's numbers of a part's bodies; empty when it is not there."""
        return {key: number for key, number in self._ids.items() if key[0] == part}

    def paint(self, part: str, colour: tuple[float, float, float]) -> None:
        """Give a part that is there a colour, RGB in 0..1, for a window."""
        for number in self.numbers(part).values():
            self._p.changeVisualShape(number, -1, rgbaColor=[*colour, 1.0], physicsClientId=self._client.id)

    @property
    def client(self) -> Client:
        """The connection to the simulator."""
        return self._client

    @property
    def scale(self) -> float:
        """Scene lengths per length unit of the assembly."""
        return self._scale

    @property
    def weight(self) -> float:
        """Of everything that moves and is there, in the scene's units of force; under no gravity as on Earth."""
        gravity = self.physics.gravity or 9.81
        return gravity * sum(body.mass for key, body in self._made.items() if key in self._ids)

    def _build(self, snapshot: Snapshot) -> None:
        p, c = self._p, self._client.id
        with tempfile.TemporaryDirectory(prefix="neurosym-") as folder:
            for key, body in self._made.items():
                if key not in snapshot.frames:
                    continue
                position, turn = snapshot.frames[key]
                shape = collision_shape(self._client, body, self._shapes, Path(folder))
                mass = 0.0 if body.part in self.assembly.fixed else body.mass
                number = p.createMultiBody(mass, shape, -1, position, turn, physicsClientId=c)
                p.changeDynamics(
                    number,
                    -1,
                    lateralFriction=self.surface,
                    localInertiaDiagonal=body.inertia.tolist(),
                    physicsClientId=c,
                )
                self._ids[key] = number

    def step(self, steps: int = 1) -> None:
        """Advance by `steps` time steps."""
        for _ in range(steps):
            self._p.stepSimulation(physicsClientId=self._client.id)

    def settle(self, steps: int = SETTLE_STEPS, *, until_rest: bool = False) -> int:
        """Let things fall for at most `steps`; with `until_rest`, stop once nothing moves. Returns the steps taken."""
        quiet = 0
        for done in range(1, steps + 1):
            self.step()
            if until_rest:
                # What has just begun to fall, or turns at the top of a swing, is slow for a moment too.
                quiet = quiet + 1 if max(self.motion().values(), default=0.0) < REST else 0
                if quiet == 8:
                    return done
        return steps

    def remove(self, *parts: str) -> None:
        """Take whole parts out of the scene.

        Raises:
            UnknownNameError: a part that is not, or no longer, there.
        """
        for part in parts:
            gone = [key for key in self._ids if key[0] == part]
            if not gone:
                raise UnknownNameError("part in the scene", part, {name for name, _ in self._ids})
            for key in gone:
                self._p.removeBody(self._ids.pop(key), physicsClientId=self._client.id)

    def poses(self) -> Snapshot:
        """Where everything lies now."""
        c = self._client.id
        return Snapshot(
            {key: self._p.getBasePositionAndOrientation(i, physicsClientId=c) for key, i in self._ids.items()}
        )

    def motion(self) -> dict[BodyKey, float]:
        """v^2 + w^2 of each body, in squared scene units (a typical body is one) and radians a second."""
        found = {}
        for key, number in self._ids.items():
            (vx, vy, vz), (wx, wy, wz) = self._p.getBaseVelocity(number, physicsClientId=self._client.id)
            found[key] = vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
        return found

    def displacement(self, since: Snapshot | None = None) -> dict[BodyKey, float]:
        """How far each body's farthest-moved corner is from where it was, in the assembly's length unit."""
        before, now = (self.initial if since is None else since).frames, self.poses().frames
        found = {}
        for key in now:
            X, Y = matrix(*before[key]), matrix(*now[key])
            shift = self._corners[key] @ (Y - X)[:3, :3].T + (Y - X)[:3, 3]
            found[key] = float(np.linalg.norm(shift, axis=1).max()) * self.unit
        return found

    def moved(self, threshold: float | None = None, *, since: Snapshot | None = None) -> dict[str, float]:
        """The parts that moved by more than `threshold`, with how far, in the assembly's length unit.

        Args:
            threshold: a length; None means `MOVED_SHARE` of a typical body.
            since: compared with this; None means the initial poses.
        """
        limit = MOVED_SHARE * self.unit if threshold is None else threshold
        found: dict[str, float] = {}
        for (part, _), distance in self.displacement(since).items():
            if distance > limit:
                found[part] = max(distance, found.get(part, 0.0))
        return found

    def overlaps(self, part: str, shift: Array, tolerance: float) -> tuple[str, ...]:
        """The parts that `part` would cut into, deeper than `tolerance`, if it were moved by `shift`.

        Args:
            part: name of a part that is there.
            shift: float64 (3,), in the assembly's length unit.
            tolerance: depth of overlap that counts as touch, same unit.
        """
        p, c, hit = self._p, self._client.id, set[str]()
        for key, number in self._ids.items():
            if key[0] != part:
                continue
            position, turn = p.getBasePositionAndOrientation(number, physicsClientId=c)
            p.resetBasePositionAndOrientation(
                number, (np.asarray(position) + shift * self._scale).tolist(), turn, physicsClientId=c
            )
            for other, i in self._ids.items():
                if other[0] != part and other[0] not in hit:
                    near = p.getClosestPoints(number, i, 0.0, physicsClientId=c)
                    # Entry 8 is the distance between the two bodies there, negative where they overlap.
                    if any(-point[8] > tolerance * self._scale for point in near):
                        hit.add(other[0])
            p.resetBasePositionAndOrientation(number, position, turn, physicsClientId=c)
        return tuple(name for name in self.assembly.names if name in hit)

    def bounds(self, part: str | None = None) -> Array:
        """Box around one part, or all that are there, where they lie now: float64 (2, 3), assembly's unit."""
        points = []
        for key, frame in self.poses().frames.items():
            if part is None or key[0] == part:
                X = matrix(*frame)
                points.append(self._corners[key] @ X[:3, :3].T + X[:3, 3])
        if not points:
            raise InputError("Expected a part that is in the scene, or a scene that is not empty.")
        stacked = np.concatenate(points)
        return np.stack([stacked.min(axis=0), stacked.max(axis=0)]) * self.unit


def _frame(body: RigidBody) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Position and quaternion, rounded: faces that touch exactly must not be parted by the last bits of a product.

    Bullet finds other contacts between cubes 1e-16 apart than between cubes that touch.
    """
    return (
        tuple((np.round(body.X_WC[:3, 3], 9) + 0.0).tolist()),
        tuple((np.round(quaternion(body.X_WC[:3, :3]), 12) + 0.0).tolist()),
    )


def stands(
    assembly: Assembly,
    *,
    present: Collection[str] | None = None,
    physics: Physics | None = None,
    ground: float | None = None,
    steps: int = SETTLE_STEPS,
    threshold: float | None = None,
) -> dict[str, float]:
    """Let an assembly of rigid parts settle for a second: which parts moved, and how far. Empty: it stands.

    Args:
        assembly: the parts, in the world.
        present: names of those that are there; None means all.
        physics: friction, gravity and the solver's numbers.
        ground: height of the table; None takes the assembly's own.
        steps: time steps to wait.
        threshold: a part moved when a corner of it did by more, in the assembly's length unit; None means
            `MOVED_SHARE` of a typical body.

    Raises:
        InputError: a part that is not made of convex pieces.
    """
    with World(assembly, physics=physics, ground=ground, present=present) as world:
        world.settle(steps)
        return world.moved(threshold)
