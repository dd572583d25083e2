"""`solve`: the whole flow on one page. Read this first."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import ContractError, InputError
from neurosym.language.problem import Problem
from neurosym.language.search_problem import RelaxedPlan, SearchProblem
from neurosym.language.semantics import Semantics
from neurosym.planning.budget import Budget
from neurosym.planning.guard import guarded, side_of
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.planner import KBestPlanner, OrderCounter, Planner, TwoSidedPlanner
from neurosym.planning.prior import Prior
from neurosym.planning.result import OrderCount, PlanResult, Status
from neurosym.planning.validation import confirm, replay, validate
from neurosym.registry import load_planner, load_prior
from neurosym.support.arrays import Array
from neurosym.support.deadline import OutOfTime, within

#: Seconds beyond the budget for looking over what came out of it: a plan's replay, or why there is none.
GRACE = 0.5

ORACLES = ("geometry", "physics")
Advice = str | Path | Prior | OrderScores | None


def solve(
    problem: Problem,
    *,
    planner: str | Planner | None = None,
    prior: Advice = None,
    budget: Budget | None = None,
    rng: np.random.Generator | int | None = None,
    oracle: str = "geometry",
    side: str | None = None,
) -> PlanResult:
    """Plan: ground the symbols, read the prior, search, and replay what came out.

    Args:
        problem: made by a domain, for instance ``ns.load_domain("soma").problem(17)``.
        planner: a name or a planner; None: the one that suits the problem, most often backtracking.
        prior: a name, a weights file, a prior, its scores, or None.
        budget: when to stop. Its seconds hold for all of this, geometry included. Looking over what came out may take
            `GRACE` longer; a plan that is not replayed by then is the best prefix of a result without one.
        rng: a generator or a seed; the same seed gives the same answer.
        oracle: what answers attempts: ``"geometry"``, or ``"physics"``, a simulation in the loop.
        side: from where to search: ``"full"``, the initial state; ``"empty"``, the goal; or ``"both"`` in turn, where
            the problem and the planner can. Default both for assemblies taken apart part by part, full for others.

    Returns:
        The result; no plan is a result, never an exception. Every plan was replayed: by `validate`, or for
        physics in a fresh simulation.

    Raises:
        ContractError: the planner's plan does not survive its replay.
    """
    if planner is None:
        planner = suited_planner(problem)
    options: dict[str, Any] = {"planner": planner, "prior": prior, "budget": budget, "rng": rng, "oracle": oracle}
    return plans(problem, k=None, side=side, **options)[0]


def suited_planner(problem: Problem) -> str:
    """The name of the planner that suits a problem: greedy search where actions may be done again, else its own."""
    if isinstance(problem, Problem) and problem.ground() is problem.symbols and problem.symbols.repeating:
        return "greedy"
    return getattr(problem, "semantics", Semantics()).planner


def plans(
    problem: Problem,
    *,
    k: int | None = None,
    planner: str | Planner = "best-first",
    prior: Advice = None,
    budget: Budget | None = None,
    rng: np.random.Generator | int | None = None,
    oracle: str = "geometry",
    side: str | None = None,
) -> list[PlanResult]:
    """The k best plans, the likeliest first (planners whose traits say `k_best`); with None one, as `solve`."""
    searcher = load_planner(planner)
    generator = guarded(problem, searcher, k, budget, rng)
    budget, by_geometry, start = budget or Budget(), oracle == "geometry", time.perf_counter()

    def spent() -> float:
        return time.perf_counter() - start

    try:
        with within(_with_grace(budget)):
            side = side_of(problem, searcher, side, alone=k is None and by_geometry)
            scores = advice(problem, prior)
            if by_geometry and (why_not := problem.semantics.refute(problem)) is not None:
                known: dict[str, Any] = {"why_not": why_not, "n_actions": len(problem.actions)}
                none = PlanResult(Status.UNSOLVABLE, None, 0, 0, 0, spent(), **known)
                return [none] if k is None else []
            with open_oracle(problem, oracle) as search:
                asked: dict[str, Any] = {"k": k, "budget": budget.less(spent()), "rng": generator, "oracle": oracle}
                results = search_and_check(problem, search, searcher, scores, side=side, **asked)
            return [_explained(problem, result) for result in results] if by_geometry else results
    except OutOfTime:
        return [PlanResult(Status.OUT_OF_BUDGET, None, 0, 0, 0, spent())] if k is None else []


def search_and_check(
    problem: Problem,
    search: SearchProblem[Any],
    planner: Planner,
    scores: OrderScores | None,
    *,
    k: int | None = None,
    budget: Budget | None = None,
    rng: np.random.Generator,
    oracle: str = "geometry",
    side: str = "full",
) -> list[PlanResult]:
    """One planner's results on an opened oracle (with k the k best plans, else one result), each plan replayed.

    Where the time ends during a replay, those plans are left out, and the first result says so if none is left.

    Raises:
        ContractError: a plan does not survive its replay.
    """
    with within(_with_grace(budget)):
        if k is not None and isinstance(planner, KBestPlanner):
            results = planner.plans(search, scores, k=k, budget=budget, rng=rng)
        elif side != "full" and isinstance(planner, TwoSidedPlanner):
            results = [planner.plan_from(search, scores, side=side, budget=budget, rng=rng)]
        else:
            results = [planner.plan(search, scores, budget=budget, rng=rng)]
        results = [_bounded(search, result) for result in results]
        for i, result in enumerate(results):
            try:
                if result.plan is not None and oracle == "geometry":
                    confirm(planner, result.plan, validate(problem, result.plan, result.motions))
                elif result.plan is not None:
                    with open_oracle(problem, oracle) as fresh:
                        confirm(planner, result.plan, replay(fresh, result.plan))
            except OutOfTime:
                nothing: dict[str, Any] = {"plan": None, "motions": ()}
                nothing |= dict.fromkeys(("cost", "fewest", "total_cost", "cheapest"))
                return results[:i] or [replace(result, status=Status.OUT_OF_BUDGET, **nothing)]
    return results


def _with_grace(budget: Budget | None) -> float | None:
    return None if budget is None or budget.seconds is None else budget.seconds + GRACE


def _bounded(search: SearchProblem[Any], result: PlanResult) -> PlanResult:
    """The result with how many actions there are, and whether it has the fewest, where the problem has a bound."""
    result = replace(result, n_actions=len(search.actions))
    known: RelaxedPlan | None = search.relaxed_plan(search.initial) if hasattr(search, "relaxed_plan") else None
    if result.plan is None or known is None:
        return result
    return replace(result, fewest=bool(result.fewest) or len(result.plan) <= known.at_least)


def advice(problem: Problem, prior: Advice) -> OrderScores | None:
    """A prior's scores for the action primitives of a problem, in their order."""
    if prior is None:
        return None
    if isinstance(prior, OrderScores):
        scores = prior
    else:
        given = load_prior(prior).scores([problem])
        if not isinstance(given, list | tuple) or len(given) != 1 or not isinstance(given[0], OrderScores):
            raise ContractError(f"Expected the prior {prior!r} to give one OrderScores a problem; got {given!r}.")
        scores = given[0]
    return scores.restricted(problem.actions) if scores.actions else scores


@contextmanager
def open_oracle(problem: Problem, oracle: str) -> Iterator[SearchProblem[Any]]:
    """What planners search: the grounded problem, or the same with a simulation that answers its attempts."""
    if oracle == "geometry":
        yield problem.ground()
        return
    if oracle != "physics":
        raise InputError(f"Expected an oracle, one of {', '.join(ORACLES)}; got {oracle!r}.")
    from neurosym.simulation.oracle import PhysicsOracle

    with PhysicsOracle.of(problem) as simulated:
        yield simulated


def count_plans(problem: Problem) -> int:
    """How many different orders solve a problem: exact, by dynamic programming over states."""
    orders = _counter().count_orders(problem.ground()).orders
    assert orders is not None  # no budget could end it
    return orders


def order_marginals(problem: Problem) -> Array:
    """float64 (N, N): in what share of all orders that solve a problem action j is step i; exact, rows sum to 1.

    Labels for training: a network that is shown single orders learns their accidents by heart.
    """
    return _counter().order_marginals(problem.ground())


def count_orders(problem: Problem, *, budget: Budget | None = None) -> OrderCount:
    """The same within a budget, whose end is a result: no number. A problem that is refuted at once has none."""
    budget, start = budget or Budget(), time.perf_counter()
    try:
        with within(_with_grace(budget)):
            if problem.semantics.refute(problem) is not None:
                return OrderCount(0, True, 0, time.perf_counter() - start, 0)
            search = problem.ground()
            return _counter().count_orders(search, budget=budget.less(time.perf_counter() - start))
    except OutOfTime:
        return OrderCount(None, False, 0, time.perf_counter() - start)


def _counter() -> OrderCounter:
    counter = load_planner("exhaustive")
    assert isinstance(counter, OrderCounter)
    return counter


def _explained(problem: Problem, result: PlanResult) -> PlanResult:
    """The result with why there is no plan, where the problem can tell. A budget that ended says nothing of it."""
    if result.status in (Status.SOLVED, Status.OUT_OF_BUDGET):
        return result
    try:
        if result.side == "empty":
            return replace(result, why_not=problem.semantics.explain_from_goal(problem, result.best_suffix or ()))
        return replace(result, why_not=problem.semantics.explain(problem, result.best_prefix))
    except OutOfTime:
        return result
