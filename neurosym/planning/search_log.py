"""The log that every planner keeps while it searches, so that planners are compared in one unit."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any, Generic, TypeVar

from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import Plan, PlanResult, Status
from neurosym.support.deadline import OutOfTime, within

S = TypeVar("S", bound=Hashable)
#: Rejections kept as evidence in a result. Beyond it only the count goes on: a hard search would fill the memory.
MAX_BLAME = 10_000


@dataclass
class _Counts:
    """What the two sides of one search count together."""

    attempts: int = 0
    expansions: int = 0
    iterations: int = 0
    rejections: list[Rejection] = field(default_factory=list)  # the first `MAX_BLAME`
    start: float = field(default_factory=perf_counter)
    timed_out: bool = False


class SearchLog(Generic[S]):
    """Counts, budget, evidence and best prefix of one search. Every attempt of a planner goes through it.

    Args:
        beside: the log of a search of the same problem from its other end. Then `problem` is the reversed one; budget
            and counts are shared, and results are told forwards.

    Attributes:
        side: "full" or, beside another log, "empty".
        best_prefix: the longest order that was verified from this side.
        refused: how many attempts were rejected from this side.
        all_proved: whether all of them were certain.
    """

    def __init__(
        self, problem: SearchProblem[S], budget: Budget | None = None, *, beside: SearchLog[Any] | None = None
    ) -> None:
        self.problem = problem
        self.budget = budget or Budget()
        self.side = "full" if beside is None else "empty"
        self.best_prefix: tuple[int, ...] = ()
        self.refused = 0
        self.all_proved = True
        self._counts: _Counts = _Counts() if beside is None else beside._counts
        self._names = tuple(problem.actions)
        self._other: SearchLog[Any] | None = beside
        if beside is not None:
            beside._other = self

    @property
    def attempts(self) -> int:
        """Questions to the oracle."""
        return self._counts.attempts

    @property
    def expansions(self) -> int:
        """States whose candidates were generated."""
        return self._counts.expansions

    @property
    def iterations(self) -> int:
        """Rejections."""
        return self._counts.iterations

    @property
    def timed_out(self) -> bool:
        """Whether the time cut an answer short."""
        return self._counts.timed_out

    @property
    def seconds(self) -> float:
        return perf_counter() - self._counts.start

    @property
    def _left(self) -> float | None:
        return None if self.budget.seconds is None else self.budget.seconds - self.seconds

    def out_of_budget(self) -> bool:
        """Whether a limit has been reached: ask before every attempt and every expansion."""
        b = self.budget
        return (
            self.timed_out
            or (b.attempts is not None and self.attempts >= b.attempts)
            or (b.expansions is not None and self.expansions >= b.expansions)
            or (b.seconds is not None and self.seconds >= b.seconds)
            or (b.watch is not None and b.watch(self))
        )

    def candidates(self, state: S) -> Sequence[int]:
        """The candidates of `state`, none where the time ends meanwhile; counts one expansion."""
        self._counts.expansions += 1
        try:
            with within(self._left):
                return tuple(self.problem.candidates(state))
        except OutOfTime:
            self._counts.timed_out = True
            return ()

    def attempt(self, prefix: Collection[int], state: S, action: int) -> Step[S] | Rejection:
        """Ask the oracle for `action` after `prefix`, which led to `state`; counts one attempt.

        Where the time ends meanwhile, the answer is a rejection that promises nothing, and the budget is spent.
        """
        self._counts.attempts += 1
        try:
            with within(self._left):
                answer = self.problem.attempt(state, action)
        except OutOfTime:
            self._counts.timed_out = True
            return Rejection("The time ended before there was an answer.", proved=False)
        if isinstance(answer, Rejection):
            self._keep(prefix, action, answer)
        elif len(prefix) >= len(self.best_prefix):
            self.best_prefix = (*prefix, action)
        return answer

    def refuse(self, prefix: tuple[int, ...], action: int, reason: str) -> None:
        """Note a guess that failed without asking the oracle (not a candidate): an iteration, no attempt."""
        self._keep(prefix, action, Rejection(reason))

    def _keep(self, prefix: Collection[int], action: int, rejection: Rejection) -> None:
        counts = self._counts
        counts.iterations += 1
        self.refused += 1
        self.all_proved = self.all_proved and rejection.proved
        if len(counts.rejections) < MAX_BLAME:
            after, name = self.names(tuple(prefix)), self._names[action]
            counts.rejections.append(replace(rejection, action=name, after=after, side=self.side))

    def names(self, actions: Sequence[int]) -> tuple[str, ...]:
        return tuple([self._names[a] for a in actions])

    def solved(
        self,
        plan: Sequence[int],
        motions: Sequence[StepMotion | None] = (),
        *,
        scores: OrderScores | None = None,
        first_guess_failed: bool | None = None,
        fewest: bool | None = None,
        cheapest: bool | None = None,
    ) -> PlanResult:
        """The result for a plan, given as indices of actions, forwards."""
        named, cost = Plan(self.names(plan), motions), None if scores is None else scores.plan_cost(plan)
        costs: Sequence[float] | None = getattr(self.problem, "costs", None)
        total = None if costs is None else sum(costs[action] for action in plan)
        rest = {"motions": named.motions, "cost": cost, "fewest": fewest, "cheapest": cheapest, "total_cost": total}
        return self._result(Status.SOLVED, named, tuple(named), first_guess_failed, **rest)

    def failed(self, status: Status, *, first_guess_failed: bool | None = None) -> PlanResult:
        """The result for a search that ended without a plan.

        What was rejected without proof leaves nothing proved: UNSOLVABLE then becomes GAVE_UP. Where the time cut an
        answer short, the budget ended the search, whatever the planner made of it.
        """
        if self.timed_out:
            status = Status.OUT_OF_BUDGET
        if status is Status.UNSOLVABLE and not self.all_proved:
            status = Status.GAVE_UP
        full = self if self.side == "full" else self._other
        return self._result(status, None, self.names(full.best_prefix if full else ()), first_guess_failed)

    def _result(
        self, status: Status, plan: Plan | None, best_prefix: tuple[str, ...], failed: bool | None, **rest: Any
    ) -> PlanResult:
        counts = (self.iterations, self.expansions, self.attempts, self.seconds)
        blame = tuple(self._counts.rejections)
        empty = self if self.side == "empty" else self._other
        if empty is not None:
            rest |= {"best_suffix": self.names(empty.best_prefix[::-1])}
        rest = {"side": self.side, **rest}
        return PlanResult(status, plan, *counts, best_prefix, blame, first_guess_failed=failed, **rest)
