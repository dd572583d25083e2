"""The conformance suite must be able to fail: each broken planner here breaks one promise, and is caught."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from neurosym.errors import ContractError
from neurosym.language.search_problem import Rejection
from neurosym.planning.budget import Budget
from neurosym.planning.planner import Planner, PlannerTraits
from neurosym.planning.result import Status
from neurosym.planning.search_log import SearchLog
from neurosym.testing import check_planner
from planners import Backtracking, BestFirst, Exhaustive, SwapRepair


class Wrapped(Planner):
    """Backtracking with a fault."""

    traits = PlannerTraits(complete=True)
    inner: Planner = Backtracking()

    def plan(self, problem, scores=None, *, budget=None, rng=None):
        return self.spoil(self.inner.plan(problem, scores, budget=budget, rng=rng), problem)

    def spoil(self, result, problem):
        return result


class ClaimsCompleteness(Wrapped):
    inner = SwapRepair()


class ClaimsOptimality(Wrapped):
    traits = PlannerTraits(complete=True, optimal=True)


class ClaimsOptimalityGreedily(Wrapped):
    traits = PlannerTraits(complete=True, optimal=True)
    inner = BestFirst(priority="greedy")


class ClaimsKBestWithoutAMethod(Wrapped):
    traits = PlannerTraits(complete=True, k_best=True)


class ReturnsOneOfKBest(Exhaustive):
    def plans(self, problem, scores=None, *, k, budget=None, rng=None):
        return super().plans(problem, scores, k=min(k, 1), budget=budget, rng=rng)


class RepeatsTheBest(Exhaustive):
    def plans(self, problem, scores=None, *, k, budget=None, rng=None):
        found = super().plans(problem, scores, k=k, budget=budget, rng=rng)
        return [replace(r, plan=found[0].plan, best_prefix=found[0].plan, motions=()) for r in found]


class GivesUpOnProofs(Wrapped):
    def spoil(self, result, problem):
        return replace(result, status=Status.GAVE_UP) if result.status is Status.UNSOLVABLE else result


class ProvesTooMuch(Wrapped):
    traits = PlannerTraits(complete=False)
    inner = SwapRepair(cap=3)

    def spoil(self, result, problem):
        return replace(result, status=Status.UNSOLVABLE) if result.status is Status.GAVE_UP else result


class ReversesItsPlan(Wrapped):
    def spoil(self, result, problem):
        return replace(result, plan=result.plan[::-1], best_prefix=result.plan[::-1]) if result.plan else result


class MiscountsAttempts(Wrapped):
    def spoil(self, result, problem):
        return replace(result, attempts=result.attempts - 1) if result.iterations else result


class MiscountsExpansions(Wrapped):
    def spoil(self, result, problem):
        return replace(result, expansions=result.expansions + 1)


class HidesRefusals(Wrapped):
    def spoil(self, result, problem):
        return replace(result, iterations=0, blame=())


class HidesBlame(Wrapped):
    def spoil(self, result, problem):
        return replace(result, blame=())


class InventsACost(Wrapped):
    def spoil(self, result, problem):
        return replace(result, cost=None if result.cost is None else result.cost + 1)


class LosesThePrefix(Wrapped):
    def spoil(self, result, problem):
        return replace(result, best_prefix=()) if result.solved and result.plan else result


class ForgetsTheMotions(Wrapped):
    def spoil(self, result, problem):
        return replace(result, motions=(object(),) * len(result.motions)) if result.motions else result


class IgnoresTheBudget(Wrapped):
    def plan(self, problem, scores=None, *, budget=None, rng=None):
        return self.inner.plan(problem, scores, rng=rng)


class OverrunsByOne(Wrapped):
    def plan(self, problem, scores=None, *, budget=None, rng=None):
        if budget is not None and budget.attempts is not None:
            budget = Budget(attempts=budget.attempts + 1)
        return self.inner.plan(problem, scores, budget=budget, rng=rng)


class DrawsItsOwnSeed(Wrapped):
    calls = 0

    def plan(self, problem, scores=None, *, budget=None, rng=None):
        type(self).calls += 1
        return self.inner.plan(problem, scores, budget=budget, rng=np.random.default_rng(self.calls))


class IgnoresTheScores(Wrapped):
    inner = Exhaustive()

    def plan(self, problem, scores=None, *, budget=None, rng=None):
        result = self.inner.plan(problem, None, budget=budget, rng=rng)
        if scores is None or result.plan is None:
            return result
        names = list(problem.actions)
        scores = replace(scores, classes=tuple(problem.classes))
        return replace(result, cost=scores.plan_cost([names.index(a) for a in result.plan]))


class PrefersTheFirstAction(Planner):
    """Depth first by index, whatever the scores say on ties: complete, but not the same when relabelled."""

    traits = PlannerTraits(complete=False, uses_scores=True)

    def plan(self, problem, scores=None, *, budget=None, rng=None):
        if scores is not None and scores.n_steps == 4 and np.isclose(scores.log_prob.max(), np.log(0.99)):
            return SwapRepair().plan(problem, scores, budget=budget, rng=rng)
        log, state, prefix, motions = SearchLog(problem, budget), problem.initial, [], []
        while not problem.is_goal(state):
            if log.out_of_budget():
                return log.failed(Status.OUT_OF_BUDGET)
            for a in sorted(set(log.candidates(state)) - set(prefix)):
                if log.out_of_budget():
                    return log.failed(Status.OUT_OF_BUDGET)
                answer = log.attempt(tuple(prefix), state, a)
                if not isinstance(answer, Rejection):
                    break
            else:
                return log.failed(Status.GAVE_UP)
            state = answer.state
            prefix.append(a)
            motions.append(answer.motion)
        if scores is not None:
            scores = replace(scores, classes=tuple(problem.classes))
        return log.solved(prefix, motions, scores=scores)


class AttemptsWhatIsNoCandidate(Wrapped):
    def plan(self, problem, scores=None, *, budget=None, rng=None):
        uncounted = getattr(problem, "problem", problem)
        for action in range(len(problem.actions)):
            if action not in uncounted.candidates(problem.initial):
                problem.attempt(problem.initial, action)
        return super().plan(problem, scores, budget=budget, rng=rng)


@pytest.mark.parametrize(
    ("broken", "says"),
    [
        (ClaimsCompleteness, "expected (SOLVED|UNSOLVABLE)"),
        (ClaimsOptimality, "the least cost"),
        (ClaimsOptimalityGreedily, "the least cost"),
        (ClaimsKBestWithoutAMethod, "a method plans"),
        (ReturnsOneOfKBest, "least costs"),
        (RepeatsTheBest, "plans that differ"),
        (GivesUpOnProofs, "expected UNSOLVABLE"),
        (ProvesTooMuch, "got UNSOLVABLE"),
        (ReversesItsPlan, "to replay|reaches the goal|a candidate|first reached|motions ="),
        (MiscountsAttempts, r"\d attempts; got"),
        (MiscountsExpansions, r"\d expansions; got"),
        (HidesRefusals, "iterations or more"),
        (HidesBlame, "refusals in blame"),
        (InventsACost, "a cost of"),
        (LosesThePrefix, "the plan as best_prefix"),
        (ForgetsTheMotions, "motions ="),
        (IgnoresTheBudget, "no more attempts|OUT_OF_BUDGET"),
        (OverrunsByOne, "no more attempts"),
        (DrawsItsOwnSeed, "the same result from the same seed"),
        (IgnoresTheScores, "scores sure of"),
        (PrefersTheFirstAction, "actions in the order"),
        (AttemptsWhatIsNoCandidate, "candidates alone"),
    ],
)
def test_the_suite_catches(broken: type[Planner], says: str) -> None:
    with pytest.raises(ContractError, match=says):
        check_planner(broken(), seeds=6)


def test_the_sound_wrapper_passes() -> None:
    """The faults, not the wrapper, are what is caught."""
    check_planner(Wrapped(), seeds=6)
