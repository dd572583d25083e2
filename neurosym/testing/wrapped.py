"""The same search problem, asked otherwise: relabelled, counted, with nothing proved. For testing planners."""

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from neurosym.language.search_problem import Rejection, SearchProblem, Step

S = TypeVar("S", bound=Hashable)


class Wrapped(Generic[S]):
    """Answers as another problem does; subclasses say what differs."""

    problem: SearchProblem[S]

    @property
    def actions(self) -> Sequence[str]:
        return self.problem.actions

    @property
    def classes(self) -> Sequence[int]:
        return self.problem.classes

    @property
    def initial(self) -> S:
        return self.problem.initial

    def is_goal(self, state: S) -> bool:
        return self.problem.is_goal(state)

    def candidates(self, state: S) -> Iterable[int]:
        return self.problem.candidates(state)

    def attempt(self, state: S, action: int) -> Step[S] | Rejection:
        return self.problem.attempt(state, action)


@dataclass(frozen=True)
class Unproved(Wrapped[S]):
    """The same problem with refusals that prove nothing, as those of a search for a path that ended without one."""

    problem: SearchProblem[S]

    def attempt(self, state: S, action: int) -> Step[S] | Rejection:
        answer = self.problem.attempt(state, action)
        return replace(answer, until=(), unconditional=False, proved=False) if isinstance(answer, Rejection) else answer


@dataclass(frozen=True)
class Relabelled(Wrapped[S]):
    """The same problem with its actions in another order: action i here is `order[i]` there."""

    problem: SearchProblem[S]
    order: tuple[int, ...]

    @property
    def actions(self) -> tuple[str, ...]:
        return tuple(self.problem.actions[a] for a in self.order)

    @property
    def classes(self) -> tuple[int, ...]:
        return tuple(self.problem.classes[a] for a in self.order)

    def candidates(self, state: S) -> list[int]:
        return [self.order.index(a) for a in self.problem.candidates(state)]

    def attempt(self, state: S, action: int) -> Step[S] | Rejection:
        answer = self.problem.attempt(state, self.order[action])
        if isinstance(answer, Rejection):
            until = tuple(self.order.index(a) for a in answer.until)
            return replace(answer, until=until)
        return answer


@dataclass
class Counting(Wrapped[S]):
    """The same problem, counting what is asked of it, and whether anything was asked that is no candidate."""

    problem: SearchProblem[S]
    attempts: int = 0
    refusals: int = 0
    expansions: int = 0
    no_candidates: list[tuple[S, int]] = field(default_factory=list)

    def candidates(self, state: S) -> list[int]:
        self.expansions += 1
        return list(self.problem.candidates(state))

    def attempt(self, state: S, action: int) -> Step[S] | Rejection:
        self.attempts += 1
        if action not in self.problem.candidates(state):
            self.no_candidates.append((state, action))
        answer = self.problem.attempt(state, action)
        self.refusals += isinstance(answer, Rejection)
        return answer
