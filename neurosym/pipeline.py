"""`solve`: the whole flow on one page. Read this first."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import ContractError, InputError
from neurosym.language.problem import Problem
from neurosym.language.search_problem import SearchProblem
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.planner import Planner
from neurosym.planning.prior import Prior
from neurosym.planning.result import OrderCount, PlanResult, Status
from neurosym.planning.validation import replay, validate
from neurosym.registry import load_planner, load_prior

ORACLES = ("geometry", "physics")
Advice = str | Path | Prior | OrderScores | None


def solve(
    problem: Problem,
    *,
    planner: str | Planner = "backtracking",
    prior: Advice = None,
    budget: Budget | None = None,
    rng: np.random.Generator | int | None = None,
    oracle: str = "geometry",
) -> PlanResult:
    """Plan: ground the symbols, read the prior, search, and replay what came out.

    Args:
        problem: made by a domain, for instance ``ns.load_domain("soma").problem(17)``.
        planner: a name or a planner.
        prior: a name, a weights file, a prior, its scores, or None.
        budget: when to stop.
        rng: a generator or a seed; the same seed gives the same answer.
        oracle: what answers attempts: ``"geometry"``, or ``"physics"``, a simulation in the loop.

    Returns:
        The result; no plan is a result, never an exception. Every plan was replayed: by `validate`, or for
        physics in a fresh simulation.

    Raises:
        ContractError: the planner's plan does not survive its replay.
    """
    return plans(problem, k=None, planner=planner, prior=prior, budget=budget, rng=rng, oracle=oracle)[0]


def plans(
    problem: Problem,
    *,
    k: int | None = None,
    planner: str | Planner = "best-first",
    prior: Advice = None,
    budget: Budget | None = None,
    rng: np.random.Generator | int | None = None,
    oracle: str = "geometry",
) -> list[PlanResult]:
    """The k best plans, the likeliest first (planners whose traits say `k_best`); with None one, as `solve`."""
    searcher = load_planner(planner)
    generator = _guarded(problem, searcher, k, budget, rng)
    scores = advice(problem, prior)
    by_geometry, start = oracle == "geometry", time.perf_counter()
    if by_geometry and (why_not := problem.semantics.refute(problem)) is not None:
        none = PlanResult(Status.UNSOLVABLE, None, 0, 0, 0, time.perf_counter() - start, why_not=why_not)
        return [none] if k is None else []
    with open_oracle(problem, oracle) as search:
        results = search_and_check(problem, search, searcher, scores, k=k, budget=budget, rng=generator, oracle=oracle)
    return [_explained(problem, result) for result in results] if by_geometry else results


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
) -> list[PlanResult]:
    """One planner's results on an opened oracle (with k the k best plans, else one result), each plan replayed.

    Raises:
        ContractError: a plan does not survive its replay.
    """
    if k is None:
        results = [planner.plan(search, scores, budget=budget, rng=rng)]
    else:
        results = planner.plans(search, scores, k=k, budget=budget, rng=rng)  # type: ignore[attr-defined]
    for result in results:
        if result.plan is None:
            continue
        if oracle == "geometry":
            replayed = validate(problem, result.plan, result.motions)
        else:
            with open_oracle(problem, oracle) as fresh:
                replayed = replay(fresh, result.plan)
        if not replayed.ok:
            raise ContractError(
                f"The planner {type(planner).__name__} answered with the plan {', '.join(result.plan)}, which fails "
                f"its replay: {replayed.reason} This is a fault of the planner or of the oracle; please report it."
            )
    return results


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
    count: int = load_planner("exhaustive").count_plans(problem.ground())  # type: ignore[attr-defined]
    return count


def count_orders(problem: Problem, *, budget: Budget | None = None) -> OrderCount:
    """The same within a budget, whose end is a result: no number. A problem that is refuted at once has none."""
    start = time.perf_counter()
    if problem.semantics.refute(problem) is not None:
        return OrderCount(0, True, 0, time.perf_counter() - start)
    counter = load_planner("exhaustive")
    counted: OrderCount = counter.count_orders(problem.ground(), budget=budget)  # type: ignore[attr-defined]
    return counted


def _explained(problem: Problem, result: PlanResult) -> PlanResult:
    """The result with why there is no plan, where the problem can tell. A budget that ended says nothing of it."""
    if result.status in (Status.SOLVED, Status.OUT_OF_BUDGET):
        return result
    return replace(result, why_not=problem.semantics.explain(problem, result.best_prefix))


def _guarded(problem: object, planner: Planner, k: object, budget: object, rng: Any) -> np.random.Generator:
    """What was given, checked; the generator."""
    if k is not None and not planner.traits.k_best:
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
