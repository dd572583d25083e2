"""What planners share about actions: which to ask for, what a refusal promises, and what it names."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Hashable, Iterable, Sequence
from typing import TypeVar

from neurosym.errors import InputError
from neurosym.language.search_problem import Rejection, SearchProblem
from neurosym.planning.prior import OrderScores

S = TypeVar("S", bound=Hashable)


def representatives(candidates: Iterable[int], used: int, classes: Sequence[int]) -> list[int]:
    """The unused candidates, one a class, by index.

    Of interchangeable actions that are both unused, neither has left a trace in the state, so one speaks for both.
    """
    first: dict[int, int] = {}
    for action in sorted(candidates):
        if not used >> action & 1:
            first.setdefault(classes[action], action)
    return list(first.values())


def promise(rejection: Rejection, used: int) -> int | None:
    """The refusal's promise as a bitset: refused until one of these is done. None when nothing is promised.

    Actions done already cannot be done again, so they never end it; 0 means for ever.
    """
    if not rejection.until:
        return None
    mask = 0
    for action in rejection.until:
        mask |= 1 << action
    return mask & ~used


class Lessons:
    """What unconditional refusals taught: these actions are refused everywhere until one of those is done."""

    def __init__(self) -> None:
        self._masks: dict[int, set[int]] = {}

    def learn(self, action: int, rejection: Rejection) -> None:
        """Keep the promise of a refusal, if it is unconditional."""
        if rejection.unconditional and rejection.until:
            self._masks.setdefault(action, set()).add(sum(1 << a for a in set(rejection.until)))

    def refute(self, action: int, used: int) -> bool:
        """Whether `action` is known to be refused in every state reached by the actions in `used`."""
        return any(not mask & used for mask in self._masks.get(action, ()))


class Names:
    """Finds the actions that a refusal names: those of its promise, and those that its objects occur in."""

    def __init__(self, problem: SearchProblem[S]) -> None:
        self._by_word: dict[str, list[int]] = {}
        for index, name in enumerate(problem.actions):
            for word in dict.fromkeys((name, *re.split(r"[\s(),]+", name))):
                if word:
                    self._by_word.setdefault(word, []).append(index)

    def __call__(self, rejection: Rejection) -> list[int]:
        """Indices, the promised ones first, without repeats."""
        named = list(rejection.until)
        for thing in rejection.because:
            named.extend(self._by_word.get(thing, ()))
        return list(dict.fromkeys(named))


def agenda(named: Sequence[int], before: Sequence[int], gone: int) -> list[int]:
    """What to try next: the actions that the latest refusal named, then those named before; none that is `gone`."""
    fresh = [a for a in named if not gone >> a & 1]
    return fresh + [a for a in before if a not in fresh]


def fitted(problem: SearchProblem[S], scores: OrderScores | None) -> OrderScores | None:
    """The scores, checked against the problem's actions, with interchangeable actions sharing their probability.

    Raises:
        InputError: the scores are about other actions.
    """
    if scores is None:
        return None
    names = tuple(problem.actions)
    if scores.n_actions != len(names):
        raise InputError(
            f"Expected scores with one column an action, {len(names)} in all; got {scores.n_actions}. "
            "Take scores.restricted(problem.actions) when some actions are done already."
        )
    if scores.actions and scores.actions != names:
        raise InputError(
            f"Expected scores for the actions {', '.join(names)}, in this order; got {', '.join(scores.actions)}. "
            "Take scores.restricted(problem.actions)."
        )
    joined = _joined(problem.classes, scores.classes)
    if _partition(joined) == _partition(scores.classes):
        return scores
    return dataclasses.replace(scores, classes=joined)


def _joined(first: Sequence[int], second: Sequence[int]) -> tuple[int, ...]:
    """The finest classes that contain those of both."""
    root = list(range(len(first)))

    def find(a: int) -> int:
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        return a

    for classes in (first, second):
        seen: dict[int, int] = {}
        for action, label in enumerate(classes):
            root[find(action)] = find(seen.setdefault(label, action))
    return tuple(find(a) for a in range(len(root)))


def _partition(classes: Sequence[int]) -> list[int]:
    """Classes renumbered in order of first appearance, so that equal partitions compare equal."""
    number: dict[int, int] = {}
    return [number.setdefault(c, len(number)) for c in classes]
