"""Swap repair, the planner of the paper: run the prior's order, swap the action that fails with a random later one.

Burke, Subr, Ramamoorthy, "Action sequencing using visual permutations", RA-L 2021, Sec. V: at most 30 iterations.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, TypeVar

import numpy as np

from neurosym.errors import InputError
from neurosym.language.search_problem import Rejection, SearchProblem
from neurosym.planning.planner import Budget, Planner, PlannerTraits, PlanResult, SearchLog, Status
from neurosym.planning.prior import OrderScores
from planners.evidence import fitted

S = TypeVar("S", bound=Hashable)


class SwapRepair(Planner):
    """Keeps what worked, and swaps the failing action with one drawn from its own position to the last.

    The draw includes the failing position itself, as in the paper: then the same action fails again, and counts
    again. An iteration is a failed rollout, whether the symbols or the oracle refused. Not complete: it never
    goes back on an action that worked.

    Args:
        cap: iterations after which it gives up; None never does, which may not end on an unsolvable problem.
    """

    traits = PlannerTraits(complete=False)

    def __init__(self, *, cap: int | None = 30) -> None:
        if cap is not None and cap < 1:
            raise InputError(f"Expected a cap of at least 1 iteration, or None; got {cap}.")
        self.cap = cap

    def plan(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None = None,
        *,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        rng = rng or np.random.default_rng(0)
        scores = fitted(problem, scores)
        log = SearchLog(problem, budget)
        order = self._first_order(len(problem.actions), scores, rng)
        state, motions = problem.initial, list[Any]()
        applicable: frozenset[int] | None = None
        done = 0
        while not problem.is_goal(state):
            if done == len(order):
                return log.failed(Status.GAVE_UP, first_guess_failed=True)
            if log.out_of_budget():
                return log.failed(Status.OUT_OF_BUDGET, first_guess_failed=log.iterations > 0 or None)
            if applicable is None:
                applicable = frozenset(log.candidates(state))
                continue
            prefix, action = tuple(order[:done]), order[done]
            if action in applicable:
                answer = log.attempt(prefix, state, action)
                if not isinstance(answer, Rejection):
                    state, applicable, done = answer.state, None, done + 1
                    motions.append(answer.motion)
                    continue
            else:
                log.refuse(prefix, action, f"{problem.actions[action]} is not applicable here.")
            if self.cap is not None and log.iterations >= self.cap:
                return log.failed(Status.GAVE_UP, first_guess_failed=True)
            other = int(rng.integers(done, len(order)))
            order[done], order[other] = order[other], order[done]
        return log.solved(order[:done], motions, scores=scores, first_guess_failed=log.iterations > 0)

    @staticmethod
    def _first_order(n_actions: int, scores: OrderScores | None, rng: np.random.Generator) -> list[int]:
        """The prior's order, then whatever it leaves out, at random."""
        guess = [] if scores is None else list(scores.order(rng))
        rest = [int(a) for a in rng.permutation(n_actions)]
        placed = set(guess)
        return guess + [a for a in rest if a not in placed]
