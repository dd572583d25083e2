"""What `solve` refuses to be given."""

from typing import Any

import numpy as np

from neurosym.errors import InputError, UnknownNameError
from neurosym.language.problem import Problem
from neurosym.language.reversal import reversed_problem
from neurosym.planning.budget import Budget
from neurosym.planning.planner import SIDES, KBestPlanner, Planner, TwoSidedPlanner


def guarded(problem: object, planner: Planner, k: object, budget: object, rng: Any) -> np.random.Generator:
    """Refuse what cannot be planned, before anything is done; gives the generator.

    Raises InputError: k without a planner that gives several plans, or something else than was expected.
    """
    if k is not None and not (planner.traits.k_best and isinstance(planner, KBestPlanner)):
        raise InputError(f"Expected a planner that gives several plans, best-first or exhaustive; got {planner!r}.")
    if k is not None and not (isinstance(k, int | np.integer) and k >= 1):
        raise InputError(f"Expected k of at least 1; got {k}.")
    if not isinstance(problem, Problem):
        raise InputError(f"Expected a Problem, as Domain.problem makes it; got {problem!r}.")
    if budget is not None and not isinstance(budget, Budget):
        raise InputError(f"Expected a Budget, for instance Budget(seconds=10); got {budget!r}.")
    if isinstance(rng, np.random.Generator):
        return rng
    if rng is None:
        return np.random.default_rng(0)
    if isinstance(rng, int | np.integer) and not isinstance(rng, bool) and rng >= 0:
        return np.random.default_rng(rng)
    raise InputError(f"Expected rng as a numpy Generator or a seed of 0 or more; got {rng!r}.")


def side_of(problem: Problem, planner: Planner, side: str | None, *, alone: bool) -> str:
    """From which side to search: what was asked for, or the problem's own; where only "full" can be, that.

    Args:
        alone: whether geometry answers, and one plan is asked for.

    Raises:
        InputError: "empty" was asked for, and cannot be.
    """
    if side is not None and side not in SIDES:
        raise UnknownNameError("side", side, SIDES)
    wanted = problem.semantics.side(problem) if side is None else side
    if wanted == "full":
        return wanted
    hindrances = {
        f"the planner {type(planner).__name__} searches from one end only": not (
            planner.traits.either_side and isinstance(planner, TwoSidedPlanner)
        ),
        "a simulation only takes away, and several plans are looked for from one end": not alone,
        "not every action is asked for by the goal, once, beside others that change something else": alone
        and reversed_problem(problem.ground()) is None,
    }
    why = next((sentence for sentence, hinders in hindrances.items() if hinders), None)
    if why is not None and side == "empty":
        raise InputError(f"Expected a search that can begin at the goal for side 'empty'; {why}. Take side 'full'.")
    return wanted if why is None else "full"
