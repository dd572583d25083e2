"""Small search problems that know their answers, for testing planners without any domain.

They satisfy `SearchProblem`. `brute_force_plans` finds all their plans, and shares no code with any planner.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.testing.wrapped import Counting as Counting
from neurosym.testing.wrapped import Relabelled as Relabelled
from neurosym.testing.wrapped import Unproved as Unproved

#: Directions in which parts leave.
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True)
class NumberLine:
    """Walk from 0 to `goal` by steps of the given sizes, each usable once, never leaving 0 .. `limit`.

    Equal sizes are interchangeable. The goal may be reached by differing numbers of steps.
    """

    sizes: tuple[int, ...]
    goal: int
    limit: int = 9
    initial: int = 0

    @property
    def actions(self) -> tuple[str, ...]:
        return tuple(f"{size:+d}#{i}" for i, size in enumerate(self.sizes))

    @property
    def classes(self) -> tuple[int, ...]:
        return self.sizes

    def is_goal(self, state: int) -> bool:
        return state == self.goal

    def candidates(self, state: int) -> list[int]:
        return list(range(len(self.sizes)))

    def attempt(self, state: int, action: int) -> Step[int] | Rejection:
        there = state + self.sizes[action]
        if not 0 <= there <= self.limit:
            return Rejection(f"{there} is off the line.")
        return Step(there, StepMotion((f"to {there}",)))


@dataclass(frozen=True)
class Removal:
    """Take parts away, one an action; states are bitsets of the parts that are gone.

    Attributes:
        blockers: a part leaves by any of its one or two directions; each is a bitset of parts that stand in its way.
        spoilers: a part can never leave once one of these is gone. This is what makes dead ends.
        needs: parts that must be gone before a part becomes a candidate at all.
        target: the parts that must go.
        promises: whether refusals promise anything (`Rejection.until`).
    """

    blockers: tuple[tuple[int, ...], ...]
    spoilers: tuple[int, ...]
    needs: tuple[int, ...]
    target: int
    promises: bool = True
    initial: int = 0

    @classmethod
    def random(
        cls, seed: int, n: int = 5, *, blocking: float = 0.25, spoiling: float = 0.06, partial: bool = False
    ) -> Self:
        """A structure drawn from `seed`: sometimes solvable, sometimes not, with dead ends.

        `seed`: of everything. `n`: parts. `blocking`: how likely one part stands in another's way, in each of one or
        two directions. `spoiling`: how likely the removal of one part makes another's impossible. `partial`: ask for
        two of the parts only, so that plans differ in length.
        """
        rng = np.random.default_rng(seed)

        def some(part: int, chance: float) -> int:
            return sum(1 << other for other in range(n) if other != part and rng.random() < chance)

        blockers = tuple(tuple(some(p, blocking) for _ in range(int(rng.integers(1, 3)))) for p in range(n))
        spoilers = tuple(some(p, spoiling) for p in range(n))
        needs = tuple(some(p, 0.04) for p in range(n))
        wanted = rng.permutation(n)[:2] if partial else range(n)
        return cls(blockers, spoilers, needs, sum(1 << int(p) for p in wanted), promises=bool(rng.random() < 0.7))

    @classmethod
    def loose(cls, n: int) -> Self:
        """Nothing stands in the way of anything: every order is a plan."""
        return cls(((0,),) * n, (0,) * n, (0,) * n, (1 << n) - 1)

    @property
    def actions(self) -> tuple[str, ...]:
        return tuple(f"part{p}" for p in range(len(self.blockers)))

    @property
    def classes(self) -> tuple[int, ...]:
        return tuple(range(len(self.blockers)))

    def is_goal(self, state: int) -> bool:
        return state & self.target == self.target

    def candidates(self, state: int) -> list[int]:
        return [p for p in range(len(self.blockers)) if not state >> p & 1 and self.needs[p] & ~state == 0]

    def attempt(self, state: int, action: int) -> Step[int] | Rejection:
        if self.spoilers[action] & state:
            return Rejection("Its support is gone for good.", until=(action,) if self.promises else ())
        present = [way & ~state for way in self.blockers[action]]
        if not all(present):
            return Step(state | 1 << action, StepMotion((self.actions[action],), AXES[present.index(0)]))
        # One blocker a direction: while they all stay, so does the part.
        first = dict.fromkeys((way & -way).bit_length() - 1 for way in present)
        names = tuple(self.actions[p] for p in first)
        return Rejection("Blocked in every direction.", names, tuple(first) if self.promises else (), self.promises)

    def reversed(self) -> Undone | None:
        """The problem from its end, where all parts must go."""
        return Undone(self) if self.target == (1 << len(self.blockers)) - 1 else None


@dataclass(frozen=True)
class Undone:
    """A removal of all parts from its end: they come back, in the reverse order."""

    removal: Removal

    @property
    def actions(self) -> tuple[str, ...]:
        return self.removal.actions

    @property
    def classes(self) -> tuple[int, ...]:
        return self.removal.classes

    @property
    def initial(self) -> int:
        return self.removal.target

    def is_goal(self, state: int) -> bool:
        return state == self.removal.initial

    def candidates(self, state: int) -> list[int]:
        gone = [p for p in range(len(self.actions)) if state >> p & 1]
        return [p for p in gone if p in self.removal.candidates(state & ~(1 << p))]

    def attempt(self, state: int, action: int) -> Step[int] | Rejection:
        before = state & ~(1 << action)
        answer = self.removal.attempt(before, action)
        return Step(before, answer.motion) if isinstance(answer, Step) else Rejection(answer.reason, answer.because)


@dataclass(frozen=True)
class Tiles:
    """Spell one of the words with letter tiles; equal letters are interchangeable.

    The oracle refuses a letter that begins no word only from the third letter on: the first two may lead astray.
    """

    letters: str
    words: tuple[str, ...]
    initial: str = ""

    @property
    def actions(self) -> tuple[str, ...]:
        return tuple(f"{letter}{i}" for i, letter in enumerate(self.letters))

    @property
    def classes(self) -> tuple[int, ...]:
        return tuple(ord(letter) for letter in self.letters)

    def is_goal(self, state: str) -> bool:
        return state in self.words

    def candidates(self, state: str) -> list[int]:
        return list(range(len(self.letters)))

    def attempt(self, state: str, action: int) -> Step[str] | Rejection:
        spelt = state + self.letters[action]
        if len(spelt) > 2 and not any(word.startswith(spelt) for word in self.words):
            return Rejection(f"No word begins with {spelt}.")
        return Step(spelt)


@dataclass(frozen=True)
class Table:
    """A problem written out: where each action leads from each state. What is not listed is refused.

    `actions`: their names; each is its own class. `leads`: (state, action) -> state. `goal`: the state to reach.
    `names`: (state, action) -> the actions that its refusal names as evidence, without a promise.
    """

    actions: tuple[str, ...]
    leads: Mapping[tuple[str, str], str]
    goal: str
    names: Mapping[tuple[str, str], tuple[str, ...]] = field(default_factory=dict)
    initial: str = "start"

    @classmethod
    def crossing(cls) -> Self:
        """Two ways lead to one state, and only one of them leaves the action that is needed there."""
        return cls(("a", "b"), {("start", "a"): "middle", ("start", "b"): "middle", ("middle", "a"): "end"}, "end")

    @property
    def classes(self) -> tuple[int, ...]:
        return tuple(range(len(self.actions)))

    def is_goal(self, state: str) -> bool:
        return state == self.goal

    def candidates(self, state: str) -> list[int]:
        return list(range(len(self.actions)))

    def attempt(self, state: str, action: int) -> Step[str] | Rejection:
        key = (state, self.actions[action])
        if key in self.leads:
            return Step(self.leads[key])
        return Rejection(f"{key[1]} leads nowhere from {state}.", self.names.get(key, ()))


def brute_force_plans(problem: SearchProblem[Any]) -> Iterator[tuple[int, ...]]:
    """Every order of actions that reaches the goal, ending there, as indices; for up to about six actions.

    Of orders that differ only by interchangeable actions, the first by index.
    """

    def extend(state: Any, prefix: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        if problem.is_goal(state):
            yield prefix
            return
        seen = set()
        for action in sorted(problem.candidates(state)):
            label = problem.classes[action]
            if action in prefix or label in seen:
                continue
            seen.add(label)
            answer = problem.attempt(state, action)
            if isinstance(answer, Step):
                yield from extend(answer.state, (*prefix, action))

    return extend(problem.initial, ())
