"""What a planner that claims `either_side` is held to: from the goal, or both ends, it answers as from the start."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from neurosym.errors import ContractError
from neurosym.language.reversal import reversed_problem
from neurosym.language.search_problem import SearchProblem
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.planner import Planner, TwoSidedPlanner
from neurosym.planning.result import Status


def check_sides(
    planner: Planner,
    problem: SearchProblem[Any],
    plans: Collection[tuple[int, ...]],
    scores: OrderScores | None,
    where: str,
) -> None:
    """Check the answers from the goal and from both ends of a problem that can be searched so, `plans` being all.

    Raises:
        ContractError: what was expected and what came.
    """
    if not isinstance(planner, TwoSidedPlanner):
        raise ContractError(f"{where}: expected a method plan_from, which the trait either_side promises; got none.")
    if reversed_problem(problem) is None:
        return
    for side in ("empty", "both"):
        result = planner.plan_from(problem, scores, side=side, rng=np.random.default_rng(3))
        wanted = Status.SOLVED if plans else Status.UNSOLVABLE
        if result.status is not wanted:
            raise ContractError(f"{where}, side {side}: expected {wanted.name}; got {result.status.name}.")
        order = tuple(map(list(problem.actions).index, result.plan or ()))
        if plans and order not in plans:
            raise ContractError(f"{where}, side {side}: expected one of {len(plans)} plans, forwards; got {order}.")
        whole = scores is not None and scores.n_steps == len(problem.actions) and scores.log_length is None
        if plans and scores is not None and whole and planner.traits.optimal:
            least = min(map(scores.plan_cost, plans))
            if scores.plan_cost(order) > least + 1e-5:
                raise ContractError(f"{where}, side {side}: expected a plan of cost {least}; got {result.cost}.")
