"""Every registered planner keeps its contract, and does what its traits claim."""

from __future__ import annotations

import numpy as np
import pytest

import neurosym.testing
from neurosym.errors import InputError, UnknownNameError
from neurosym.language.search_problem import Rejection, Step
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import Status
from neurosym.registry import load_planner, planner_names
from neurosym.testing.planners import check_planner, toys
from neurosym.testing.toys import NumberLine, Removal
from planners import Backtracking, BestFirst, Exhaustive, SwapRepair
from planners.priorities import PartialPlan


@pytest.mark.parametrize("name", planner_names())
def test_registered_planners_pass_the_conformance_suite(name: str) -> None:
    check_planner(name)


@pytest.mark.parametrize("priority", ["weighted", "greedy", "levin", lambda partial: -partial.log_policy])
def test_any_priority_leaves_best_first_complete(priority) -> None:
    check_planner(BestFirst(priority=priority), seeds=6)


def test_swap_repair_without_a_cap_is_still_honest() -> None:
    solvable = [
        toy for toy in toys() if toy.plans and isinstance(toy.problem, Removal) and not any(toy.problem.spoilers)
    ]
    assert solvable
    for toy in solvable:
        result = SwapRepair(cap=None).plan(toy.problem, budget=Budget(attempts=2000))
        assert result.status in (Status.SOLVED, Status.OUT_OF_BUDGET)


def test_the_suite_has_problems_of_every_kind() -> None:
    suite = toys()
    assert sum(bool(toy.plans) for toy in suite) >= 8
    assert sum(not toy.plans for toy in suite) >= 8
    assert sum(len(toy.lengths) > 1 for toy in suite) >= 3, "plans of several lengths"
    assert any(_has_dead_end(toy.problem) for toy in suite if toy.plans)


def _has_dead_end(problem) -> bool:
    graph_states, stack = set(), [(problem.initial, 0)]
    while stack:
        state, used = stack.pop()
        if (state, used) in graph_states or problem.is_goal(state):
            continue
        graph_states.add((state, used))
        steps = [
            (answer.state, used | 1 << a)
            for a in problem.candidates(state)
            if not used >> a & 1 and isinstance(answer := problem.attempt(state, a), Step)
        ]
        if not steps:
            return True
        stack.extend(steps)
    return False


def test_toys_keep_their_promises() -> None:
    """A refusal's `until` holds in every state below: a suite that lies would blame honest planners."""
    for toy in toys():
        _check_promises(toy.problem, toy.problem.initial, 0, {})


def _check_promises(problem, state, used, promised) -> None:
    if problem.is_goal(state):
        return
    now = dict(promised)
    steps = []
    for a in problem.candidates(state):
        if used >> a & 1:
            continue
        answer = problem.attempt(state, a)
        if isinstance(answer, Rejection):
            if answer.until:
                now[a] = (*now.get(a, ()), sum(1 << u for u in answer.until if not used >> u & 1))
        else:
            assert all(mask & used for mask in promised.get(a, ())), f"{a} was promised to stay refused"
            steps.append((a, answer.state))
    for a, there in steps:
        _check_promises(problem, there, used | 1 << a, now)


def test_unknown_options_name_the_valid_ones() -> None:
    with pytest.raises(UnknownNameError, match="astar, greedy, levin, weighted"):
        BestFirst(priority="a-star")
    with pytest.raises(InputError, match="at least 1"):
        BestFirst(weight=0.5)
    with pytest.raises(InputError, match="cap"):
        SwapRepair(cap=0)
    for planner in (BestFirst(), Exhaustive()):
        with pytest.raises(InputError, match="k of 0 or more"):
            planner.plans(NumberLine((1,), goal=1), k=-1)


@pytest.mark.parametrize("name", planner_names())
def test_scores_for_other_actions_are_refused(name: str) -> None:
    problem = Removal.loose(3)
    with pytest.raises(InputError, match="one column an action"):
        load_planner(name).plan(problem, OrderScores(np.zeros((2, 2))))
    with pytest.raises(InputError, match=r"restricted\(problem.actions\)"):
        load_planner(name).plan(problem, OrderScores(np.zeros((3, 3)), ("x", "y", "z")))


def test_weighted_costs_at_most_its_weight_times_the_least() -> None:
    rng = np.random.default_rng(0)
    for toy in toys():
        n = len(toy.problem.actions)
        scores = OrderScores(
            rng.normal(size=(n, n)) * 3, log_length=rng.normal(size=n + 1), classes=toy.problem.classes
        )
        least = Exhaustive().plan(toy.problem, scores).cost
        cost = BestFirst(priority="weighted", weight=1.5).plan(toy.problem, scores).cost
        assert (least is None) == (cost is None)
        assert least is None or cost <= 1.5 * least + 1e-5


def test_only_astar_claims_to_be_optimal() -> None:
    assert BestFirst().traits.optimal
    assert not BestFirst(priority="greedy").traits.optimal
    assert BestFirst.traits.optimal, "an instance's claim leaves the class's alone"


def test_levin_is_depth_over_probability() -> None:
    from planners.priorities import levin

    assert levin(PartialPlan(4, 0.0, 0.0, np.log(0.5))) == pytest.approx(np.log(8))


@pytest.mark.parametrize("planner", [SwapRepair(), Backtracking(), BestFirst()])
@pytest.mark.parametrize("with_prior", [False, True])
def test_a_thousand_actions(planner, with_prior: bool) -> None:
    problem = Removal.loose(1000)
    scores = OrderScores.from_order(range(1000), problem.actions) if with_prior else None
    result = planner.plan(problem, scores)
    assert result.solved
    assert result.iterations == 0
    assert result.expansions == 1000
    assert not with_prior or result.plan == problem.actions


def test_the_suites_are_found_by_name() -> None:
    assert neurosym.testing.check_planner is check_planner
    assert set(neurosym.testing.__all__) <= set(dir(neurosym.testing))
    with pytest.raises(AttributeError, match="check_nothing"):
        neurosym.testing.check_nothing  # noqa: B018
