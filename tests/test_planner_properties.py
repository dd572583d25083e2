"""Properties of the planners on random problems with dead ends, solvable and not, under any prior."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import Status
from neurosym.testing.toys import Counting, NumberLine, Removal, Tiles, brute_force_plans
from planners import Backtracking, BestFirst, Exhaustive, all_plans, count_plans, order_marginals
from planners.assignment_heuristic import AssignmentHeuristic

removals = st.builds(
    Removal.random,
    st.integers(0, 10_000),
    st.integers(2, 5),
    blocking=st.sampled_from([0.1, 0.25, 0.4]),
    spoiling=st.sampled_from([0.0, 0.08, 0.2]),
    partial=st.booleans(),
)
lines = st.builds(
    NumberLine, st.lists(st.sampled_from([-2, -1, 1, 2, 3]), max_size=5).map(tuple), st.integers(0, 7), st.just(6)
)
tiles = st.builds(Tiles, st.text("abc", min_size=1, max_size=5), st.tuples(*[st.text("abc", max_size=4)] * 3))


@st.composite
def tables(draw, problem):
    """Scores of any shape, spread and opinion of the length; sharing classes or not."""
    n = len(problem.actions)
    steps = draw(st.integers(0, n))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    spread = draw(st.sampled_from([0.0, 1.0, 10.0, 1e6]))
    length = rng.normal(size=steps + 1) * spread if draw(st.booleans()) else None
    classes = tuple(problem.classes) if draw(st.booleans()) else ()
    return OrderScores(rng.normal(size=(steps, n)) * spread, problem.actions, length, classes)


@st.composite
def cases(draw):
    problem = draw(st.one_of(removals, tiles, lines))
    scores = draw(st.one_of(st.none(), tables(problem)))
    return problem, scores, draw(st.integers(0, 100))


@pytest.mark.parametrize(
    "planner", [Backtracking(), BestFirst(), BestFirst(priority="greedy"), BestFirst(priority="levin"), Exhaustive()]
)
@given(case=cases())
@settings(max_examples=60, deadline=None)
def test_any_prior_leaves_complete_planners_complete(planner, case) -> None:
    problem, scores, seed = case
    there_is_one = next(brute_force_plans(problem), None) is not None
    result = planner.plan(problem, scores, rng=np.random.default_rng(seed))
    assert result.status is (Status.SOLVED if there_is_one else Status.UNSOLVABLE)


@given(case=cases(), k=st.integers(0, 8))
@settings(max_examples=100, deadline=None)
def test_the_k_best_are_those_of_exhaustive_search(case, k: int) -> None:
    problem, scores, seed = case
    exact = Exhaustive().plans(problem, scores, k=k)
    found = BestFirst().plans(problem, scores, k=k, rng=np.random.default_rng(seed))
    assert len(found) == len(exact)
    assert len(
        {tuple(a.rstrip("0123456789") if isinstance(problem, Tiles) else a for a in r.plan) for r in found}
    ) == len(found)
    lengths = {len(plan) for plan in brute_force_plans(problem)}
    if scores is not None and (scores.log_length is not None or lengths <= {scores.n_steps}):
        np.testing.assert_allclose([r.cost for r in found], [r.cost for r in exact], atol=1e-5)
    if scores is not None:
        assert [r.cost for r in found] == sorted(r.cost for r in found)


@given(problem=st.one_of(removals, tiles, lines))
@settings(max_examples=100, deadline=None)
def test_counts_and_shares_are_those_of_all_plans(problem) -> None:
    plans = list(brute_force_plans(problem))
    assert count_plans(problem) == len(plans)
    names = [tuple(problem.actions[a] for a in plan) for plan in plans]
    assert sorted(all_plans(problem)) == sorted(names)
    shares = order_marginals(problem)
    n, longest = len(problem.actions), max(map(len, plans), default=0)
    assert shares.shape == (longest, n)
    assert shares.dtype == np.float64
    expected = np.zeros((longest, n))
    for plan in plans:
        for step, action in enumerate(plan):
            fellows = [a for a in range(n) if problem.classes[a] == problem.classes[action]]
            expected[step, fellows] += 1 / len(fellows) / len(plans)
    np.testing.assert_allclose(shares, expected, atol=1e-12)


@given(case=cases())
@settings(max_examples=60, deadline=None)
def test_promises_save_attempts_and_change_no_answer(case) -> None:
    """Exhaustive search believes no promise: it is the judge of those who do."""
    problem, scores, seed = case
    reference = Exhaustive().plan(problem, scores)
    for planner in (Backtracking(), BestFirst()):
        counting = Counting(problem)
        result = planner.plan(counting, scores, rng=np.random.default_rng(seed))
        assert result.status is reference.status
        assert counting.attempts <= reference.attempts, "no state and action is asked for twice"


@given(
    n=st.integers(1, 6),
    data=st.data(),
    spread=st.sampled_from([0.0, 1.0, 30.0]),
    known=st.booleans(),
    same=st.booleans(),
)
@settings(max_examples=150, deadline=None)
def test_one_assignment_tells_what_each_next_action_costs(n: int, data, spread: float, known: bool, same: bool) -> None:
    steps = data.draw(st.integers(1, n))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    classes = tuple(a // 2 for a in range(n)) if same else ()
    length = None if known else rng.normal(size=steps + 1) * 2
    scores = OrderScores(rng.normal(size=(steps, n)) * spread, log_length=length, classes=classes)
    step = data.draw(st.integers(0, steps - 1))
    gone = [int(a) for a in rng.permutation(n)[:step]]
    assignment = AssignmentHeuristic(scores, rng).assign(step, sum(1 << a for a in gone))

    for action in range(n):
        if action in gone:
            assert assignment.values[action] == np.inf
            continue
        left = [a for a in range(n) if a not in gone and a != action]
        options = []
        for end in [steps] if known else range(step + 1, steps + 1):
            costs = scores.costs[step + 1 : end][:, left]
            rows, columns = linear_sum_assignment(costs)
            rest = costs[rows, columns].sum() + (0.0 if known else scores.length_cost(end))
            options.append(scores.cost(step, action) + rest)
        expected = min(options)
        if known or expected < scores.cost(step, action) + 28:
            assert assignment.values[action] == pytest.approx(expected, abs=1e-5)
        else:  # very unlikely lengths are bounded together
            assert assignment.values[action] <= expected + 1e-5
    if assignment.completion:
        assert assignment.values[assignment.completion[0]] == pytest.approx(assignment.values.min(), abs=1e-5)
