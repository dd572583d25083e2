"""Parts that are taken along a path, or held: by hand, past the others, or by a grip that pulls against them."""

from collections.abc import Callable, Mapping, Sequence
from math import ceil
from typing import Self

import numpy as np

from neurosym.geometry.step_motion import StepMotion
from neurosym.simulation.physics import BodyKey
from neurosym.simulation.solids import matrix, quaternion
from neurosym.simulation.world import World

#: Position and quaternion (x, y, z, w) of a body's centre-of-mass frame, in the scene's scale.
Frame = tuple[list[float], list[float]]
#: Overlap on the way that is still touch, as a share of a typical body: settled parts sink into one another by
#: thousandths, and hulls carry a margin of 1e-3.
TOUCH_SHARE = 1e-2
#: How fast a part is pulled: typical bodies a second. Slow enough that friction acts and inertia hardly does.
PULL_SPEED = 1.0
#: How hard a grip may pull, in weights of everything there: enough for friction, not for tearing things apart.
PULL_WEIGHTS = 20.0


class Grip:
    """Holds bodies by constraints: where they are, or where `to` says (a context manager)."""

    def __init__(self, world: World, numbers: Mapping[BodyKey, int]) -> None:
        self._p = world.p
        self._constraints: dict[BodyKey, int] = {}
        self.frames: dict[BodyKey, Frame] = {}
        for key, number in numbers.items():
            position, turn = self._p.getBasePositionAndOrientation(number)
            self.frames[key] = (list(position), list(turn))
            joint = (self._p.JOINT_FIXED, (0, 0, 0), (0, 0, 0), position, (0, 0, 0, 1), turn)
            self._constraints[key] = self._p.createConstraint(number, -1, -1, -1, *joint)

    def to(self, frames: Mapping[BodyKey, Frame], force: float) -> None:
        """Draw each body towards a frame, with at most `force`."""
        for key, constraint in self._constraints.items():
            position, turn = frames[key]
            self._p.changeConstraint(constraint, position, turn, maxForce=force)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for constraint in self._constraints.values():
            self._p.removeConstraint(constraint)


class Carrier:
    """Takes the moving parts of one step along their path, from where they lie now.

    `world`: where they are. `motion`: the step; of its parts and those that make way, all that are there move.
    """

    def __init__(self, world: World, motion: StepMotion) -> None:
        self.world, self.motion = world, motion
        self._p = world.p
        self._numbers: dict[BodyKey, int] = {}
        for name in motion.parts + motion.making_way:
            self._numbers |= world.numbers(name)
        self._start = {
            key: matrix(*self._p.getBasePositionAndOrientation(number)) for key, number in self._numbers.items()
        }

    def in_the_way(self) -> tuple[str, ...]:
        """Names of the parts that the moving ones would cut into anywhere on the way, others where they lie now.

        Looked for at places half the thinnest body apart, so that nothing is jumped over.
        """
        reach = max(self.motion.tracks[0].length, self._turning())
        count = max(1, ceil(reach / (self.world.assembly.smallest_extent / 2)))
        hit: set[str] = set()
        for i in range(1, count + 1):
            self.put(i / count)
            hit |= self._overlapped()
        self.put(0.0)
        return tuple(name for name in self.world.assembly.names if name in hit)

    def put(self, out: float) -> None:
        """Put the moving parts, at rest, where they are at a share of the way out: 0 in place, 1 outside."""
        for key, (position, turn) in self._frames(out).items():
            number = self._numbers[key]
            self._p.resetBasePositionAndOrientation(number, position, turn)
            self._p.resetBaseVelocity(number, (0, 0, 0), (0, 0, 0))

    def collide(self, wanted: bool) -> None:
        """Whether the moving parts collide with anything from now on."""
        for number in self._numbers.values():
            self._p.setCollisionFilterGroupMask(number, -1, int(wanted), -int(wanted))

    def pull(self, after_step: Callable[[], None]) -> float:
        """Pull the moving parts along, out or in as the step goes, by a grip: friction and collisions included.

        `after_step`: called after each time step. Returns how far they stayed behind the path at the end, at most, in
        the assembly's length unit: far, if jammed.
        """
        world = self.world
        inward = self.motion.arrives
        self.put(float(inward))
        far = max(self.motion.tracks[0].length, self._turning()) * world.scale
        steps = ceil(far / PULL_SPEED / world.physics.time_step)
        aims = self._frames(float(inward))
        with Grip(world, self._numbers) as grip:
            for i in range(1, steps + 1):
                aims = self._frames(1 - i / steps if inward else i / steps)
                grip.to(aims, PULL_WEIGHTS * world.weight)
                world.step()
                after_step()
                if not inward and i % 24 == 0 and self._is_clear():
                    break
            ends = {k: self._p.getBasePositionAndOrientation(n)[0] for k, n in self._numbers.items()}
        return max(float(np.linalg.norm(np.subtract(ends[k], aims[k][0]))) for k in ends) / world.scale

    def _frames(self, out: float) -> dict[BodyKey, Frame]:
        where = self.motion.out(out)
        found = {}
        for key, X in self._start.items():
            motion = where[key[0]].copy()
            motion[:3, 3] *= self.world.scale
            Y = motion @ X
            found[key] = (Y[:3, 3].tolist(), quaternion(Y[:3, :3]).tolist())
        return found

    def _turning(self) -> float:
        """How far a corner of what moves goes by turning alone, about."""
        R = self.motion.tracks[0].poses[:, :3, :3]
        angles = np.arccos(np.clip((np.einsum("kij,kij->k", R[1:], R[:-1]) - 1) / 2, -1, 1))
        return float(angles.sum()) * self.world.assembly.smallest_extent * 2

    def _overlapped(self) -> set[str]:
        world = self.world
        limit, own = TOUCH_SHARE * world.unit * world.scale, {key[0] for key in self._numbers}
        others = [(key[0], number) for key, number in world.there.items() if key[0] not in own]
        return {name for name, number in others if any(world.depth(n, number) > limit for n in self._numbers.values())}

    def _is_clear(self) -> bool:
        """Whether the bounds of what moves are away from those of all else."""
        mine = np.array([self._p.getAABB(n) for n in self._numbers.values()])
        others = [n for k, n in self.world.there.items() if k not in self._numbers]
        if not others:
            return True
        theirs = np.array([self._p.getAABB(n) for n in others])
        below = (mine[:, None, 0] < theirs[None, :, 1]).all(axis=2)
        return not (below & (mine[:, None, 1] > theirs[None, :, 0]).all(axis=2)).any()


def hold(world: World, parts: Sequence[str]) -> Grip:
    """A grip that keeps parts where they lie now, until it is left."""
    numbers = {key: number for name in parts for key, number in world.numbers(name).items()}
    grip = Grip(world, numbers)
    grip.to({key: grip.frames[key] for key in numbers}, PULL_WEIGHTS * world.weight)
    return grip
