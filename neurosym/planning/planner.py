"""The interface of planners: subclass `Planner`, declare `traits` truthfully, and ask through a `SearchLog`."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from neurosym.language.search_problem import SearchProblem
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import OrderCount, PlanResult
from neurosym.support.arrays import Array


@dataclass(frozen=True)
class PlannerTraits:
    """What a planner claims; the conformance suite checks it.

    Attributes:
        complete: finds a plan whenever there is one, and proves that there is none otherwise.
        optimal: its plan has the least total prior cost of all plans.
        uses_scores: a prior changes what it does.
        k_best: `plans(k=...)` gives the k best plans; it is a `KBestPlanner`.
        either_side: `plan_from(side=...)` searches from the goal, too; it is a `TwoSidedPlanner`.
    """

    complete: bool
    optimal: bool = False
    uses_scores: bool = True
    k_best: bool = False
    either_side: bool = False


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


#: From where a problem is searched: its initial state, its goal, or both in turn.
SIDES = ("full", "empty", "both")


@runtime_checkable
class TwoSidedPlanner(Protocol):
    """What the trait `either_side` claims: a complete planner that may search from the goal, or from both ends.

    Where the problem cannot be reversed, it is searched from its initial state alone. Plans come out forwards.
    """

    def plan_from(
        self,
        problem: SearchProblem[Any],
        scores: OrderScores | None = None,
        *,
        side: str,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult: ...


@runtime_checkable
class OrderCounter(Protocol):
    """A planner that counts the orders that reach the goal, and says in what share of them an action has a step."""

    def count_orders(self, problem: SearchProblem[Any], *, budget: Budget | None = None) -> OrderCount: ...

    def order_marginals(self, problem: SearchProblem[Any], scores: OrderScores | None = None) -> Array: ...
