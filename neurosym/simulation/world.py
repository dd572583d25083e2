"""An assembly under gravity: build it in PyBullet, take parts away, see what moves.

Lengths come and go in the assembly's unit; inside, the scene is scaled so that a typical body measures one unit,
because Bullet is less trustworthy with small bodies (5 cm cubes were judged wrongly far more often than 1 m ones).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from math import sqrt

import numpy as np

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.simulation.bodies import Bodies, resting_frame
from neurosym.simulation.client import Client, Closeable
from neurosym.simulation.physics import MOVED_SHARE, REST, SETTLE_STEPS, BodyKey, Physics, Snapshot
from neurosym.simulation.solids import BodiesKind, MeshesKind, RigidBody, matrix, rigid_bodies, typical_extent
from neurosym.support.arrays import Array


class World(Closeable):
    """An assembly on its table, in a simulator of its own (a context manager).

    Args:
        assembly: the parts, in the world.
        bodies: ``"parts"``: each part moves as one; ``"cubes"``: every body of every part moves alone.
        physics: friction, gravity and the solver's numbers.
        ground: height of the table; None takes the assembly's own, which may be none at all.
        present: names of the parts that are there; None means all.
        meshes: whether meshes that are not convex are refused, or taken apart into convex pieces.

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
    ) -> None:
        self.assembly = assembly
        self.physics = physics or Physics()
        self.unit = typical_extent(assembly)
        self._scale = 1 / self.unit
        made = rigid_bodies(assembly, bodies, self._scale, self.physics.clearance, meshes)
        self._made = {(body.part, body.index): body for body in made}
        self._corners = {key: body.corners_C for key, body in self._made.items()}
        if present is not None and (unknown := set(present) - {part for part, _ in self._made}):
            raise UnknownNameError("part", min(unknown), (part for part, _ in self._made))
        self._client = Client()
        self._bodies = Bodies(
            self._client,
            self._made,
            self.physics,
            surface=self.surface,
            static=assembly.fixed,
            ground=(assembly.ground if ground is None else ground) * self._scale,
        )
        try:
            self.initial = Snapshot(
                {key: resting_frame(body) for key, body in self._made.items() if present is None or key[0] in present}
            )
            self.restore(self.initial)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the simulator; closing twice does nothing."""
        self._client.close()

    @property
    def bodies(self) -> tuple[BodyKey, ...]:
        """The bodies that are there, in the assembly's order."""
        return tuple(self._bodies.numbers)

    def restore(self, snapshot: Snapshot) -> None:
        """Put the bodies of `snapshot`, and no others, where it says, at rest.

        The scene is built afresh: contacts that Bullet remembers would make answers depend on what was asked before.
        """
        self._bodies.restore(snapshot)

    @property
    def surface(self) -> float:
        """Friction of each surface: Bullet multiplies those of the two bodies."""
        return sqrt(self.assembly.friction if self.physics.friction is None else self.physics.friction)

    def add(self, *parts: str) -> None:
        """Put whole parts into the scene, where they rest when assembled. Raises UnknownNameError: no such part."""
        for part in parts:
            own = {key: resting_frame(body) for key, body in self._made.items() if key[0] == part}
            if not own:
                raise UnknownNameError("part", part, self.assembly.names)
            self._bodies.add(own)

    def numbers(self, part: str) -> dict[BodyKey, int]:
        """The simulator's numbers of a part's bodies; empty when it is not there."""
        return {key: number for key, number in self._bodies.numbers.items() if key[0] == part}

    @property
    def made(self) -> Mapping[BodyKey, RigidBody]:
        """All bodies that there can be, as the simulator takes them."""
        return self._made

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
        return gravity * sum(body.mass for key, body in self._made.items() if key in self._bodies.numbers)

    def step(self, steps: int = 1) -> None:
        """Advance by `steps` time steps."""
        self._bodies.step(steps)

    def settle(
        self, steps: int = SETTLE_STEPS, *, until_rest: bool = False, watch: Callable[[], None] | None = None
    ) -> int:
        """Let things fall for at most `steps`; with `until_rest`, stop once nothing moves.

        `watch`: called after each time step. Returns the steps taken.
        """
        quiet = 0
        for done in range(1, steps + 1):
            self.step()
            if watch is not None:
                watch()
            if until_rest:
                # What has just begun to fall, or turns at the top of a swing, is slow for a moment too.
                quiet = quiet + 1 if max(self.motion().values(), default=0.0) < REST else 0
                if quiet == 8:
                    return done
        return steps

    def remove(self, *parts: str) -> None:
        """Take whole parts out of the scene. Raises UnknownNameError: a part that is not, or no longer, there."""
        for part in parts:
            self._bodies.remove(part)

    def poses(self) -> Snapshot:
        """Where everything lies now."""
        return self._bodies.poses()

    def motion(self) -> dict[BodyKey, float]:
        """v^2 + w^2 of each body, in squared scene units (a typical body is one) and radians a second."""
        return self._bodies.motion()

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

        `threshold`: a length; None means `MOVED_SHARE` of a typical body. `since`: compared with this; None means the
        initial poses.
        """
        limit = MOVED_SHARE * self.unit if threshold is None else threshold
        found: dict[str, float] = {}
        for (part, _), distance in self.displacement(since).items():
            if distance > limit:
                found[part] = max(distance, found.get(part, 0.0))
        return found

    def overlaps(self, part: str, shift: Array, tolerance: float) -> tuple[str, ...]:
        """The parts that `part` would cut into, deeper than `tolerance`, if it were moved by `shift`.

        `part`: name of a part that is there. `shift`: float64 (3,), in the assembly's length unit. `tolerance`: depth
        of overlap that counts as touch, same unit.
        """
        hit = self._bodies.overlaps(part, shift * self._scale, tolerance * self._scale)
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
