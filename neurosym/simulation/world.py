"""An assembly under gravity: build it in PyBullet, take parts away, see what moves.

Lengths come and go in the assembly's unit; inside, the scene is scaled so that a typical body measures one unit,
because Bullet is less trustworthy with small bodies (5 cm cubes were judged wrongly far more often than 1 m ones).
"""

from collections.abc import Callable, Collection
from math import sqrt

import numpy as np

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.simulation.bodies import Bodies, resting_frame
from neurosym.simulation.physics import MOVED_SHARE, REST, SETTLE_STEPS, BodyKey, Physics, Snapshot
from neurosym.simulation.solids import BodiesKind, MeshesKind, matrix, rigid_bodies, typical_extent
from neurosym.support.arrays import Array


class World(Bodies):
    """An assembly on its table, in a simulator of its own (a context manager).

    Its fixed parts never move, whatever their shape.

    Args:
        assembly: the parts, in the world.
        bodies: ``"parts"``: each part moves as one; ``"cubes"``: every body of every part moves alone.
        physics: friction, gravity and the solver's numbers.
        ground: height of the table; None takes the assembly's own, which may be none at all.
        present: names of the parts that are there; None means all.
        meshes: whether meshes that are not convex are refused, or taken apart into convex pieces.

    Attributes:
        scale: scene lengths per length unit of the assembly.

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
        self.assembly, self.unit = assembly, typical_extent(assembly)
        self.scale = 1 / self.unit
        physics = physics or Physics()
        made = {(b.part, b.index): b for b in rigid_bodies(assembly, bodies, self.scale, physics.clearance, meshes)}
        self._corners = {key: body.corners_C for key, body in made.items()}
        if present is not None and (unknown := set(present) - {part for part, _ in made}):
            raise UnknownNameError("part", min(unknown), (part for part, _ in made))
        surface = sqrt(assembly.friction if physics.friction is None else physics.friction)
        height = (assembly.ground if ground is None else ground) * self.scale
        super().__init__(made, physics, surface=surface, static=assembly.fixed, ground=height)
        there = {key: resting_frame(body) for key, body in made.items() if present is None or key[0] in present}
        self.initial = Snapshot(there)
        try:
            self.restore(self.initial)
        except BaseException:
            self.close()
            raise

    def add(self, *parts: str) -> None:
        """Put whole parts into the scene, where they rest when assembled. Raises UnknownNameError: no such part."""
        for part in parts:
            own = {key: resting_frame(body) for key, body in self.made.items() if key[0] == part}
            if not own:
                raise UnknownNameError("part", part, self.assembly.names)
            self._put(own)

    @property
    def weight(self) -> float:
        """Of everything that moves and is there, in the scene's units of force; under no gravity as on Earth."""
        masses = (body.mass for key, body in self.made.items() if key in self.there)
        return (self.physics.gravity or 9.81) * sum(masses)

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

    def displacement(self, since: Snapshot | None = None) -> dict[BodyKey, float]:
        """How far each body's farthest-moved corner is from where it was, in the assembly's length unit."""
        before, now = (self.initial if since is None else since).frames, self.poses().frames
        far = {}
        for key in now:
            change = matrix(*now[key]) - matrix(*before[key])
            shift = self._corners[key] @ change[:3, :3].T + change[:3, 3]
            far[key] = float(np.linalg.norm(shift, axis=1).max()) * self.unit
        return far

    def moved(self, threshold: float | None = None, *, since: Snapshot | None = None) -> dict[str, float]:
        """The parts that moved by more than `threshold`, with how far, in the assembly's length unit.

        `threshold`: a length; None means `MOVED_SHARE` of a typical body. `since`: compared with this; None means the
        initial poses.
        """
        limit = MOVED_SHARE * self.unit if threshold is None else threshold
        far: dict[str, float] = {}
        for (part, _), distance in self.displacement(since).items():
            if distance > limit:
                far[part] = max(distance, far.get(part, 0.0))
        return far

    def pressed(self) -> dict[tuple[str, str], float]:
        """Pairs of parts that overlap as they lie now, with how deep, in the assembly's length unit."""
        part = {number: key[0] for key, number in self.there.items()}
        depths: dict[tuple[str, str], float] = {}
        self.p.performCollisionDetection()
        for contact in self.p.getContactPoints():
            a, b, deep = part.get(contact[1]), part.get(contact[2]), -float(contact[8]) * self.unit
            if a is not None and b is not None and a != b and deep > 0:
                depths[a, b] = max(deep, depths.get((a, b), 0.0))
        return depths

    def overlaps(self, part: str, shift: Array, tolerance: float) -> tuple[str, ...]:
        """The parts that `part` would cut into, deeper than `tolerance`, if it were moved by `shift`.

        `part`: name of a part that is there. `shift`: float64 (3,), in the assembly's length unit. `tolerance`: depth
        of overlap that counts as touch, same unit.
        """
        p, hit = self.p, set[str]()
        for number in self.numbers(part).values():
            position, turn = p.getBasePositionAndOrientation(number)
            p.resetBasePositionAndOrientation(number, (np.asarray(position) + shift * self.scale).tolist(), turn)
            for (other, _), i in self.there.items():
                if other != part and other not in hit and self.depth(number, i) > tolerance * self.scale:
                    hit.add(other)
            p.resetBasePositionAndOrientation(number, position, turn)
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
        assembly, present, physics, ground: as `World` takes them.
        steps: time steps to wait.
        threshold: a part moved when a corner of it did by more, in the assembly's length unit; None means
            `MOVED_SHARE` of a typical body.

    Raises:
        InputError: a part that is not made of convex pieces.
    """
    with World(assembly, physics=physics, ground=ground, present=present) as world:
        world.settle(steps)
        return world.moved(threshold)
