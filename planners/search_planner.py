"""Planners that are one function of a search context."""

from abc import abstractmethod
from collections.abc import Generator
from typing import Any, TypeVar

import numpy as np

from neurosym.errors import InputError, UnknownNameError
from neurosym.language.search_problem import SearchProblem
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.planner import SIDES, Planner
from neurosym.planning.result import PlanResult, Status
from planners.search_context import BudgetSpent, SearchContext

T = TypeVar("T")

#: A search that can be interrupted: after each attempt it gives the depth at which it is, and returns its result.
Steps = Generator[int, None, PlanResult]

#: From both sides, that from the goal begins when the other one has been refused so often: what goes smoothly is left
#: alone.
PATIENCE = 3


class SearchPlanner(Planner):
    """A planner that is one function of a search context."""

    def plan(
        self,
        problem: SearchProblem[Any],
        scores: OrderScores | None = None,
        *,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        context = SearchContext(problem, scores, budget, rng)
        try:
            return self.search(context)
        except BudgetSpent:
            return context.failed(Status.OUT_OF_BUDGET)

    @abstractmethod
    def search(self, context: SearchContext) -> PlanResult:
        """Search; where the budget ends first, `BudgetSpent` passes through."""


class TwoSidedSearchPlanner(SearchPlanner):
    """A complete one whose search can be interrupted, so that it goes on from both ends of a problem in turn."""

    @abstractmethod
    def steps(self, context: SearchContext) -> Steps:
        """Search, an attempt at a time; where the budget ends first, `BudgetSpent` passes through."""

    def search(self, context: SearchContext) -> PlanResult:
        return finish(self.steps(context))

    def plan_from(
        self,
        problem: SearchProblem[Any],
        scores: OrderScores | None = None,
        *,
        side: str,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        """See `TwoSidedPlanner`: from both sides the one that ends first decides.

        A side's turn lasts until its work exceeds the other's. The work of an attempt is taken as the cube of the
        number of actions that are not done in its state: for parts, of those that are there.
        """
        if side not in SIDES:
            raise UnknownNameError("side", side, SIDES)
        full = SearchContext(problem, scores, budget, rng)
        empty = None if side == "full" else SearchContext.from_empty(full)
        if empty is None and side == "empty":
            raise InputError("Expected a problem that can be searched from its goal; got one that cannot. Take 'full'.")
        try:
            if empty is None:
                return self.search(full)
            return self.search(empty) if side == "empty" else self._from_both(full, empty)
        except BudgetSpent:
            return full.failed(Status.OUT_OF_BUDGET)

    def _from_both(self, full: SearchContext, empty: SearchContext) -> PlanResult:
        forwards, backwards = _Side(full, self.steps(full)), _Side(empty, self.steps(empty))
        alone = False
        while True:
            # Where nothing was accepted yet, this side has the initial state left to look at, and no more.
            waiting = alone or full.log.refused < PATIENCE or not full.log.best_prefix
            side = forwards if waiting or forwards.work <= backwards.work else backwards
            result = side.advance()
            if result is not None and side is backwards and result.status is Status.GAVE_UP:
                alone = True  # what was refused without proof there may be known from the other side
            elif result is not None:
                return result


class _Side:
    """One side of a search, and how much it has worked."""

    def __init__(self, context: SearchContext, steps: Steps) -> None:
        self.context, self.steps, self.work = context, steps, 0

    def advance(self) -> PlanResult | None:
        """Search until after the next attempt; the result, if there is one by then."""
        try:
            depth = next(self.steps)
        except StopIteration as end:
            result: PlanResult = end.value
            return result
        left = len(self.context.classes) - depth
        self.work += (1 + depth if self.context.from_goal else left) ** 3
        return None


def finish(steps: Generator[int, None, T]) -> T:
    """The result of a search that nothing interrupts."""
    try:
        while True:
            next(steps)
    except StopIteration as end:
        result: T = end.value
        return result


class KBestSearchPlanner(SearchPlanner):
    """One that goes on after its first plan."""

    def plans(
        self,
        problem: SearchProblem[Any],
        scores: OrderScores | None = None,
        *,
        k: int,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> list[PlanResult]:
        """See `KBestPlanner`. Each result carries the counts at the time when its plan was reached."""
        if k < 0:
            raise InputError(f"Expected k of 0 or more; got {k}.")
        return self.search_k_best(SearchContext(problem, scores, budget, rng), k)

    @abstractmethod
    def search_k_best(self, context: SearchContext, k: int) -> list[PlanResult]:
        """The k best plans, cheapest first; where the budget ends first, those that were reached."""
