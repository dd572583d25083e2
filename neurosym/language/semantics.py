"""What symbols cannot say of a problem: another space to search, pictures, parts in space, why there is no plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from neurosym.geometry.staging import Staging
    from neurosym.geometry.step_motion import StepMotion
    from neurosym.language.explanation import WhyNot
    from neurosym.language.problem import Problem
    from neurosym.language.search_problem import RelaxedPlan, SearchProblem


@dataclass(frozen=True)
class Validation:
    """What a replay of an order came to. Truthy exactly when the order is a plan.

    Attributes:
        ok: every action could be done, and the goal holds at the end.
        failed_at: number of the first action (from 0) that could not; the order's length when all could but
            the goal is missed; None when ok.
        because: names of the objects that decided it.
        reason: one sentence.
    """

    ok: bool
    failed_at: int | None = None
    because: tuple[str, ...] = ()
    reason: str = "Every action can be done, and the goal is reached."

    def __bool__(self) -> bool:
        return self.ok


class Semantics:
    """What a problem means beyond its symbols. This one leaves all to the symbols; a family overrides what it knows."""

    @property
    def planner(self) -> str:
        """Name of the planner that suits it, where the user names none."""
        return "backtracking"

    def search(self, problem: Problem) -> SearchProblem[Any]:
        """What planners see: by default the ground symbols, which name the actions, precedence and goal in any case."""
        return problem.symbols

    def interchangeable(self, problem: Problem) -> Sequence[Sequence[str]]:
        """Groups of names of actions, each two of which may be swapped in all of the problem without changing it."""
        return ()

    def side(self, problem: Problem) -> str:
        """From where it is searched unless somebody says otherwise: see `planning.planner.SIDES`."""
        return "full"

    def replay(self, problem: Problem, order: Sequence[str], motions: Sequence[StepMotion | None]) -> Validation | None:
        """See `validate`: shares no table with `search` and asks the world anew. None: by the symbols."""
        return None

    def relaxed_plan(self, problem: Problem, state: Any) -> RelaxedPlan | None:
        """How many actions are needed from a state of the symbols on; for problems that want as few as can be."""
        return None

    def refute(self, problem: Problem) -> WhyNot | None:
        """A proof, before any search, that there is no plan; None: there may be one."""
        return None

    def explain(self, problem: Problem, done: Sequence[str]) -> WhyNot | None:
        """Why a search that ended got no further than `done`, the longest prefix that works; None: it cannot tell."""
        return None

    def explain_from_goal(self, problem: Problem, undone: Sequence[str]) -> WhyNot | None:
        """The same for a search from the goal: why no more can be undone than `undone`, the longest end of an order."""
        return None

    def observe(self, problem: Problem) -> NDArray[np.uint8] | None:
        """Pictures of the finished work, uint8 (V, H, W, 3), the same each time; None: there are none."""
        return None

    def staging(self, problem: Problem, plan: Sequence[str], motions: Sequence[StepMotion | None]) -> Staging | None:
        """What a plan does to parts in space; None: it follows from the effects, or from `Problem.simulation`."""
        return None
