"""The simulator in the loop: a search problem whose attempts are answered by physics instead of geometry.

The symbols stay those of the grounded problem; each action takes one part away, and PyBullet says whether the rest
bears it. What has fallen lies where it fell, so under physics a state is the sequence of removals, not their set.
"""

from collections import OrderedDict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol, Self

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.problem import Problem
from neurosym.language.search_problem import Rejection, Step
from neurosym.simulation.client import Closeable
from neurosym.simulation.physics import MOVED_SHARE, SETTLE_STEPS, Physics, Snapshot
from neurosym.simulation.world import World
from neurosym.support.arrays import Array
from neurosym.support.words import joined

#: The state of a problem under physics: the symbols, and the actions done so far, in order.
PhysicsState = tuple[int, tuple[int, ...]]

#: The paper's collapse test: steps simulated after a removal, and v^2 + w^2 above which a cube moves (cube edges and
#: radians a second). A cube in free fall has 0.0067 after two steps of 1/240 s; one that rests, some 1e-6.
COLLAPSE_STEPS = 2
COLLAPSE_MOTION = 1e-3
#: One cube falling alone is no collapse; it is where more than this many move.
COLLAPSE_CUBES = 1
#: Share of their width that cubes give up at their sides (see `Physics.clearance`). Against the integer rule on hard
#: orders, first failures agreed in 75 of 80 with none and in 80 of 80 with 1e-3 or 1e-2; real puzzles have play too.
CUBES_CLEARANCE = 1e-3
#: Fallen cubes are waited for until they rest, but at most this many steps: three seconds.
_PATIENCE = 3 * SETTLE_STEPS
#: Overlap along a straight way out that is still touch, as a share of a typical body: settled parts sink into one
#: another by thousandths, and hulls carry a margin of 1e-3.
PROBE_TOLERANCE = 1e-2
#: Answers kept. Older ones are simulated again when they are asked for, with the same result.
_KEPT = 20_000


class RemovalProblem(Protocol):
    """The grounded problem an oracle wraps: a `SearchProblem` over bitsets that can apply effects unasked."""

    @property
    def actions(self) -> Sequence[str]: ...
    @property
    def classes(self) -> Sequence[int]: ...
    @property
    def initial(self) -> int: ...
    def is_goal(self, state: int) -> bool: ...
    def candidates(self, state: int) -> Iterable[int]: ...
    def apply(self, state: int, action: int) -> int: ...


@dataclass(frozen=True, slots=True)
class _Accepted:
    """A removal that the rest bore: its motion, and where everything then lay (for rigid parts)."""

    motion: StepMotion | None = None
    poses: Snapshot = field(default_factory=Snapshot)


class PhysicsOracle(Closeable):
    """A `SearchProblem` whose attempts are answered by simulation (a context manager).

    Two rules:

    * ``"cubes"``, that of Burke, Subr and Ramamoorthy (2021): every body of a part is independent; a part is deleted;
      it is a collapse when more than one body then moves. What fell settles before the next question.
    * ``"rigid"``: parts are rigid; one may leave along a straight line that the others leave free (the axes of the
      assembly, never downward), and then nothing else may move by more than `MOVED_SHARE` of a typical body.

    The same history has the same answer, whatever was asked before: each simulation starts from a world built afresh.
    It never promises anything (`Rejection.until` is empty).

    Args:
        base: the grounded problem: its symbols decide what is applicable and what the goal is.
        assembly: the parts, in the world.
        removes: for each action of `base`, the name of the part it takes away.
        bodies: the rule.
        absent: names of parts that are gone at the start.
        physics: friction, gravity and the solver's numbers; None takes the assembly's friction, and for ``"cubes"``
            a clearance of `CUBES_CLEARANCE`.

    Raises:
        InputError: `removes` does not fit the actions or the parts, or a part cannot be simulated.
    """

    def __init__(
        self,
        base: RemovalProblem,
        assembly: Assembly,
        *,
        removes: Sequence[str],
        bodies: Literal["cubes", "rigid"] = "cubes",
        absent: Collection[str] = (),
        physics: Physics | None = None,
    ) -> None:
        if bodies not in ("cubes", "rigid"):
            raise InputError(f"Expected bodies='cubes' or bodies='rigid'; got {bodies!r}.")
        if len(removes) != len(base.actions):
            raise InputError(f"Expected the part that each of {len(base.actions)} actions removes; got {len(removes)}.")
        present = tuple(name for name in assembly.names if name not in absent)
        if strange := [name for name in removes if name not in present]:
            raise InputError(f"Expected actions to remove parts that are there ({', '.join(present)}); got {strange}.")
        self._base, self._removes, self._rule = base, tuple(removes), bodies
        self.actions: tuple[str, ...] = tuple(base.actions)
        self.classes: tuple[int, ...] = tuple(base.classes)
        self.initial: PhysicsState = (base.initial, ())
        self._answers: OrderedDict[tuple[int, ...], Rejection | _Accepted] = OrderedDict()
        self._now: tuple[int, ...] | None = ()
        kind: Literal["cubes", "parts"] = "cubes" if bodies == "cubes" else "parts"
        physics = physics or Physics(clearance=CUBES_CLEARANCE if bodies == "cubes" else 0.0)
        self._world = World(assembly, bodies=kind, physics=physics, present=present)

    @classmethod
    def of(cls, problem: Problem) -> Self:
        """The oracle of a problem that says how physics would judge it. Raises InputError: it does not."""
        rule = problem.simulation
        if rule is None:
            raise InputError(
                f"Expected a problem that says how physics would judge it; {problem.name!r} does not "
                "(for Soma: collapse='cubes' or 'rigid'). Use oracle='geometry'."
            )
        removes = [rule.removes[name] for name in problem.actions]
        return cls(problem.symbols, problem.world, removes=removes, bodies=rule.bodies, absent=rule.absent)

    def close(self) -> None:
        """Close the simulator; closing twice does nothing. An oracle that is forgotten closes itself."""
        self._world.close()

    def is_goal(self, state: PhysicsState) -> bool:
        """Whether the symbols of `state` fulfil the goal."""
        return self._base.is_goal(state[0])

    def candidates(self, state: PhysicsState) -> Iterable[int]:
        """Indices of the symbolically applicable actions."""
        return self._base.candidates(state[0])

    def attempt(self, state: PhysicsState, action: int) -> Step[PhysicsState] | Rejection:
        """Simulate taking the part of `action` away, after the removals that `state` remembers.

        The motion of an accepted step says along which direction the part leaves (rule ``"rigid"``). Raises InputError:
        `state` holds a history that was itself refused, so that nothing can follow it.
        """
        symbols, history = state
        answer = self._answer((*history, action))
        if isinstance(answer, Rejection):
            return answer
        return Step((self._base.apply(symbols, action), (*history, action)), answer.motion)

    def _answer(self, history: tuple[int, ...]) -> Rejection | _Accepted:
        known = self._answers.get(history)
        if known is None:
            known = self._continue(history) if self._rule == "cubes" else self._resume(history)
        self._answers[history] = known
        self._answers.move_to_end(history)
        if len(self._answers) > _KEPT:
            self._answers.popitem(last=False)
        return known

    def _continue(self, history: tuple[int, ...]) -> Rejection | _Accepted:
        """Go on from where the world is, or take a fresh one through all removals of `history`: the same bits.

        Cubes are never put back by hand: those that lean on one another would be kicked apart, since Bullet's
        contact forces cannot be put back with them.
        """
        done = len(history) - 1
        if self._now != history[:done]:
            self._world.restore(self._world.initial)
            done = 0
        self._now = None
        for action in history[done:-1]:
            self._must_be_accepted(self._cubes(self._removes[action]))
        answer = self._cubes(self._removes[history[-1]])
        if isinstance(answer, _Accepted):
            self._now = history
        return answer

    def _resume(self, history: tuple[int, ...]) -> Rejection | _Accepted:
        """Put rigid parts back where they lay: the second of settling gives contact forces time to return."""
        poses = self._world.initial
        if len(history) > 1:
            poses = self._must_be_accepted(self._answer(history[:-1])).poses
        self._world.restore(poses)
        return self._rigid(self._removes[history[-1]])

    def _must_be_accepted(self, answer: Rejection | _Accepted) -> _Accepted:
        if isinstance(answer, Rejection):
            raise InputError(f"Expected a state that attempts led to; one removal in it was refused: {answer.reason}")
        return answer

    def _cubes(self, part: str) -> Rejection | _Accepted:
        world = self._world
        before = world.poses()
        world.remove(part)
        world.step(COLLAPSE_STEPS)
        moving = {key for key, motion in world.motion().items() if motion > COLLAPSE_MOTION}
        if len(moving) <= COLLAPSE_CUBES:
            world.settle(_PATIENCE, until_rest=True)
            # Neighbours can hold a column for a moment, by friction, that then comes down all the same.
            moving |= {key for key, far in world.displacement(before).items() if far > MOVED_SHARE * world.unit}
        if len(moving) > COLLAPSE_CUBES:
            parts = tuple(name for name in world.assembly.names if any(name == key[0] for key in moving))
            return Rejection(f"{len(moving)} cubes moved: of {joined(parts)}.", parts)
        return _Accepted()

    def _rigid(self, part: str) -> Rejection | _Accepted:
        world = self._world
        before = world.poses()
        axes = world.assembly.axes
        blockers: dict[str, None] = {}
        for direction in axes[axes[:, 2] > -1e-9]:
            hit = self._in_the_way(part, direction)
            if not hit:
                break
            blockers.update(dict.fromkeys(hit))
        else:
            names = tuple(blockers)
            return Rejection(f"{part} cannot leave along a straight line: {joined(names)} in its way.", names)
        world.remove(part)
        world.settle()
        moved = world.moved(since=before)
        if moved:
            distances = joined(tuple(f"{name} by {distance:.2g}" for name, distance in moved.items()))
            return Rejection(f"Parts moved: {distances}.", tuple(moved))
        return _Accepted(StepMotion.along((part,), direction), world.poses())

    def _in_the_way(self, part: str, direction: Array) -> tuple[str, ...]:
        """The first parts that `part` runs into when it moves along `direction` until it is past everything."""
        world = self._world
        others = [name for name in dict.fromkeys(name for name, _ in world.there) if name != part]
        if not others:
            return ()
        mine, theirs = world.bounds(part), np.array([world.bounds(name) for name in others])
        # The far side of all boxes, against the near side of this part's.
        far = np.where(direction > 0, theirs[:, 1].max(axis=0), theirs[:, 0].min(axis=0)) @ direction
        near = np.where(direction > 0, mine[0], mine[1]) @ direction
        # Half the thinnest body a step: nothing can be jumped over.
        step = world.assembly.smallest_extent / 2
        for i in range(1, int(np.ceil(max(far - near, 0.0) / step)) + 1):
            if hit := world.overlaps(part, direction * (i * step), PROBE_TOLERANCE * world.unit):
                return hit
        return ()
