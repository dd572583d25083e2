"""The interface of planners: subclass `Planner`, declare `traits` truthfully, and ask through a `SearchLog`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from neurosym.language.search_problem import SearchProblem
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import OrderCount, PlanResult


@dataclass(frozen=True)
class PlannerTraits:
    """What a planner claims; the conformance suite checks it.

    Attributes:
        complete: finds a plan whenever there is one, and proves that there is none otherwise.
        optimal: its plan has the least total prior cost of all plans.
        uses_scores: a prior changes what it does.
        k_best: `plans(k=...)` gives the k best plans; it is a `KBestPlanner`.
    """

    complete: bool
    optimal: bool = False
    uses_scores: bool = True
    k_best: bool = False


class Planner(ABC):
    """A planner: one method, and an honest declaration of what it can do."""

    #: Usually set on the class; an instance may set its own where an option changes what can be claimed.
    traits: PlannerTraits

    @abstractmethod
    def plan(
        self,
        problem: SearchProblem[Any],
        scores: OrderScores | None = None,
        *,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        """Search for an order of actions that reaches the goal.

        Args:
            problem: what to solve.
            scores: a prior's advice. Advice only: a complete planner stays complete under any scores.
            budget: when to stop; None never stops early.
            rng: breaks ties; None means a fixed seed.
        """


@runtime_checkable
class KBestPlanner(Protocol):
    """What the trait `k_best` claims: the k best plans, cheapest first; fewer where the budget ends.

    Orders that differ only by interchangeable actions count once.
    """

    def plans(
        self,
        problem: SearchProblem[Any],
        scores: OrderScores | None = None,
        *,
        k: int,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> list[PlanResult]: ...


@runtime_checkable
class OrderCounter(Protocol):
    """A planner that counts the orders that reach the goal, and says in what share of them an action has a step."""

    def count_orders(self, problem: SearchProblem[Any], *, budget: Budget | None = None) -> OrderCount: ...

    def order_marginals(self, problem: SearchProblem[Any]) -> NDArray[np.float64]: ...
