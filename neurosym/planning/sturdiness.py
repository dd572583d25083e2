"""The sturdiest plan: of all orders the one in which what stands bears the greatest tilt at its weakest moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from neurosym.planning.result import PlanResult, Status

if TYPE_CHECKING:
    from neurosym.language.problem import Problem

#: Degrees to which the tilt is known in the end, and the tilt that nothing bears.
WITHIN, MOST = 0.5, 89.0


@dataclass(frozen=True)
class SturdyPlan:
    """A plan, and what is known of its sturdiness.

    Attributes:
        result: the sturdiest plan that was found; where there is none at all, why.
        bears: a tilt of gravity (degrees, in each of four directions) under which it stands at every step.
        beyond: a tilt for which no plan was found.
        proved: whether there is none for it.
    """

    result: PlanResult
    bears: float
    beyond: float
    proved: bool

    @property
    def sentence(self) -> str:
        """It, told."""
        if self.result.plan is None:
            return "Without a plan there is no sturdiest one."
        none = "no order bears" if self.proved else "no plan was found for"
        return f"At every step what stands bears a tilt of {self.bears:.1f} degrees; {none} {self.beyond:.1f}."

    def as_json(self) -> dict[str, Any]:
        """For a file, without the plan."""
        return {"bears": self.bears, "beyond": self.beyond, "proved": self.proved}


def sturdiest_plan(problem_at: Callable[[float], Problem], solve: Callable[[Problem], PlanResult]) -> SturdyPlan:
    """Halve the tilt for which there is a plan, and that for which there is none, until they are `WITHIN` of another.

    Args:
        problem_at: the problem in which what stays must bear so many degrees (the option `tilt` of assemblies).
        solve: a planner, with its prior and its budget for each problem.
    """
    best = solve(problem_at(0.0))
    low, high, proved = 0.0, MOST, True
    while best.plan is not None and high - low > WITHIN:
        tilt = (low + high) / 2
        result = solve(problem_at(tilt))
        if result.plan is not None:
            best, low = result, tilt
        else:
            high, proved = tilt, result.status is Status.UNSOLVABLE
    return SturdyPlan(best, low, high, proved and best.plan is not None)
