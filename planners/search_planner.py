"""Planners that are one function of a search context."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np

from neurosym.errors import InputError
from neurosym.language.search_problem import SearchProblem
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.planner import Planner
from neurosym.planning.result import PlanResult, Status
from planners.search_context import BudgetSpent, SearchContext


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
