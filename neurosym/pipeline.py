"""`solve`: the whole flow on one page. Read this first."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import ContractError, InputError
from neurosym.language.domain import Problem
from neurosym.language.search_problem import SearchProblem
from neurosym.planning.planner import Budget, OrderCount, Planner, PlanResult, Status
from neurosym.planning.prior import OrderScores, Prior
from neurosym.planning.validation import replay, validate
from neurosym.registry import load_planner, load_prior

ORACLES = ("geometry", "physics")


def solve(
    problem: Problem,
    *,
    planner: str | Planner = "backtracking",
    prior: str | Path | Prior | OrderScores | None = None,
    budget: Budget | None = None,
    rng: np.random.Generator | int | None = None,
    oracle: str = "geometry",
) -> PlanResult:
    """Plan: ground the symbols, read the prior, search, and replay what was found.

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
    prior: str | Path | Prior | OrderScores | None = None,
    budget: Budget | None = None,
    rng: np.random.Generator | int | None = None,
    oracle: str = "geometry",
) -> list[PlanResult]:
    """The k best plans, the likeliest first (planners whose traits say `k_best`); with None one, as `solve`."""
    searcher = load_planner(planner)
    if k is not None and not searcher.traits.k_best:
        raise InputError(f"Expected a planner that gives several plans, best-first or exhaustive; got {planner!r}.")
    if k is not None and k < 1:
        raise InputError(f"Expected k of at least 1; got {k}.")
    if not isinstance(problem, Problem):
        raise InputError(f"Expected a Problem, as Domain.problem makes it; got {problem!r}.")
    if budget is not None and not isinstance(budget, Budget):
        raise InputError(f"Expected a Budget, for instance Budget(seconds=10); got {budget!r}.")
    seeded = rng is None or (isinstance(rng, int | np.integer) and not isinstance(rng, bool) and rng >= 0)
    if not seeded and not isinstance(rng, np.random.Generator):
        raise InputError(f"Expected rng as a numpy Generator or a seed of 0 or more; got {rng!r}.")
    generator = rng if isinstance(rng, np.random.Generator) else np.random.default_rng(0 if rng is None else rng)
    scores = advice(problem, prior)
    if problem.refute is not None and oracle == "geometry":
        start = time.perf_counter()
        why_not = problem.refute()
        if why_not is not None:
            none = PlanResult(Status.UNSOLVABLE, None, 0, 0, 0, time.perf_counter() - start, why_not=why_not)
            return [none] if k is None else []
    with ExitStack() as stack:
        search: SearchProblem[Any] = stack.enter_context(open_oracle(problem, oracle))
        if k is None:
            results = [searcher.plan(search, scores, budget=budget, rng=generator)]
        else:
            results = searcher.plans(search, scores, k=k, budget=budget, rng=generator)  # type: ignore[attr-defined]
    for result in results:
        if result.plan is not None:
            check_plan(problem, result.plan, oracle, planner, result.how)
    if problem.explain is not None and oracle == "geometry":
        results = [r if r.solved else replace(r, why_not=problem.explain(r)) for r in results]
    return results


def advice(problem: Problem, prior: str | Path | Prior | OrderScores | None) -> OrderScores | None:
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


def count_plans(problem: Problem) -> int:
    """How many different orders solve a problem: exact, by dynamic programming over states."""
    count: int = load_planner("exhaustive").count_plans(problem.ground())  # type: ignore[attr-defined]
    return count


def count_orders(problem: Problem, *, budget: Budget | None = None) -> OrderCount:
    """The same within a budget, whose end is a result: no number. A problem that is refuted at once has none."""
    start = time.perf_counter()
    if problem.refute is not None and problem.refute() is not None:
        return OrderCount(0, True, 0, time.perf_counter() - start)
    counter = load_planner("exhaustive")
    found: OrderCount = counter.count_orders(problem.ground(), budget=budget)  # type: ignore[attr-defined]
    return found


class _Geometry:
    """The grounded problem as a context, so that both oracles are opened and closed alike."""

    def __init__(self, problem: Problem) -> None:
        self.search = problem.ground()

    def __enter__(self) -> SearchProblem[Any]:
        return self.search

    def __exit__(self, *_: object) -> None:
        pass


def open_oracle(problem: Problem, oracle: str) -> Any:
    if oracle == "geometry":
        return _Geometry(problem)
    if oracle != "physics":
        raise InputError(f"Expected an oracle, one of {', '.join(ORACLES)}; got {oracle!r}.")
    rule = problem.simulation
    if rule is None:
        raise InputError(
            f"Expected a problem that says how physics would judge it; {problem.name!r} does not "
            "(for Soma: collapse='cubes' or 'rigid'). Use oracle='geometry'."
        )
    from neurosym.simulation.oracle import PhysicsOracle

    removes = [rule.removes[name] for name in problem.actions]
    return PhysicsOracle(problem.symbols, problem.world, removes=removes, bodies=rule.bodies, absent=rule.absent)


def check_plan(
    problem: Problem, plan: Sequence[str], oracle: str, planner: object, how: Sequence[Any] = ()
) -> None:
    if oracle == "geometry":
        found = validate(problem, plan, how)
    else:
        with open_oracle(problem, oracle) as search:
            found = replay(search, plan)
    if not found.ok:
        raise ContractError(
            f"The planner {planner!r} answered with the plan {', '.join(plan)}, which fails its replay: {found.reason} "
            "This is a fault of the planner or of the oracle; please report it."
        )
