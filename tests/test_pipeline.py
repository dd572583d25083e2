"""The whole flow: any planner with any prior gives a replayed plan or an honest status."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurosym as ns
from neurosym.pipeline import plans

soma = ns.load_domain("soma")
part = ns.Type("part")
present = ns.Fluent("present", part)
p = part("p")
take = ns.Action(
    "take", p, pre=[present(p), ns.predicates.stable_without(present)(p)], eff=[~present(p)], label="{p}"
)
UNLOAD = ns.Domain("unload", fluents=[present], actions=[take])

COMPLETE = [name for name in ns.planner_names() if ns.load_planner(name).traits.complete]


def beam(places):
    """Weights on a beam over one post: dead ends, and for some sets of places no way at all."""
    cells = {"post": [(0, 0, 0)], "beam": [(x, 0, 1) for x in range(-3, 4)]}
    cells |= {f"w{x}": [(x, 0, 2), (x, 0, 3)] for x in places}
    world = ns.Assembly.from_cells(cells)
    return UNLOAD.problem(
        world=world,
        objects={part: world.names},
        init=[present(n) for n in world.names],
        goal=[~present(f"w{x}") for x in places],
    )


@pytest.mark.parametrize("planner", ns.planner_names())
@pytest.mark.parametrize("prior", [None, "uniform", "random"])
def test_every_planner_with_every_prior(planner, prior):
    result = ns.solve(soma.problem(17), planner=planner, prior=prior, rng=3)
    assert result.solved
    assert ns.validate(soma.problem(17), result.plan).ok
    assert ns.solve(soma.problem(17), planner=planner, prior=prior, rng=3).plan == result.plan


@settings(max_examples=25, deadline=None)
@given(
    st.sets(st.integers(-3, 3), min_size=1, max_size=5),
    st.integers(0, 2**32 - 1),
    st.sampled_from(["random", "one-hot", "against", "nothing"]),
    st.sampled_from(COMPLETE),
)
def test_any_prior_leaves_complete_planners_complete(places, seed, kind, planner):
    """On solvable and unsolvable problems with dead ends; the count by dynamic programming is the truth."""
    problem = beam(sorted(places))
    rng = np.random.default_rng(seed)
    n = len(problem.actions)
    table = {
        "random": rng.standard_normal((n, n)) * 20,
        "one-hot": np.where(np.eye(n)[rng.permutation(n)] > 0, 0.0, -1e9),
        "against": -1e6 * np.ones((n, n)) * np.eye(n)[rng.permutation(n)],
        "nothing": np.full((n, n), -np.inf),
    }[kind]
    scores = ns.OrderScores(table, problem.actions)
    result = ns.solve(problem, planner=planner, prior=scores, rng=seed)
    assert result.status is (ns.Status.SOLVED if ns.count_plans(problem) else ns.Status.UNSOLVABLE)


def test_both_kinds_of_beam_occur():
    assert ns.count_plans(beam([-2, 0, 2])) > 0
    assert ns.count_plans(beam([-3, 3])) == 0


def test_a_planner_that_lies_is_found_out():
    class Liar(ns.Planner):
        traits = ns.PlannerTraits(complete=True)

        def plan(self, problem, scores=None, *, budget=None, rng=None):
            return ns.SearchLog(problem).solved(range(len(problem.actions)))

    with pytest.raises(ns.ContractError, match="fails its replay"):
        ns.solve(soma.problem(17), planner=Liar())


@pytest.mark.parametrize("answer", [[], [None], np.zeros((7, 7))])
def test_a_prior_that_answers_with_something_else_is_found_out(answer):
    class Odd(ns.Prior):
        def scores(self, problems):
            return answer

    with pytest.raises(ns.ContractError, match="one OrderScores"):
        ns.solve(soma.problem(17), prior=Odd())


def test_k_best_plans_are_different_and_in_order():
    problem = soma.problem(17)
    scores = ns.OrderScores(np.random.default_rng(0).standard_normal((7, 7)), problem.actions)
    found = plans(problem, k=5, prior=scores)
    costs = [r.cost for r in found]
    assert len({r.plan for r in found}) == 5
    assert costs == sorted(costs)
    assert [r.plan for r in plans(problem, k=5, planner="exhaustive", prior=scores)] == [r.plan for r in found]
    with pytest.raises(ns.InputError, match="several plans"):
        plans(problem, k=2, planner="backtracking")


def test_the_budget_ends_first_and_the_best_prefix_is_kept():
    result = ns.solve(soma.problem(17), budget=ns.Budget(attempts=3), rng=0)
    assert result.status is ns.Status.OUT_OF_BUDGET
    assert result.plan is None
    assert result.attempts == 3
    # The prefix that is kept can really be done.
    assert ns.validate(soma.problem(17), result.best_prefix).failed_at in (None, len(result.best_prefix))


def test_a_prior_for_the_whole_task_advises_one_that_is_half_done():
    whole = soma.problem(17)
    order = ns.solve(whole).plan
    scores = ns.OrderScores.from_order([whole.actions.index(a) for a in order], whole.actions)
    half = soma.problem(17, removed=order[:3])
    result = ns.solve(half, prior=scores)
    assert result.plan == order[3:]
    assert result.iterations == 0


def test_scores_of_other_actions_are_refused():
    scores = ns.OrderScores.uniform(2, ["x", "y"])
    with pytest.raises(ns.InputError, match="actions that this prior knows"):
        ns.solve(soma.problem(0), prior=scores)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: ns.solve(soma.problem(0), planner="beast-first"), "Did you mean 'best-first'"),
        (lambda: ns.solve(soma.problem(0), prior="sinkhor"), "Did you mean 'sinkhorn'"),
        (lambda: ns.solve(soma.problem(0), oracle="magic"), "oracle"),
        (lambda: ns.load_domain("some"), "Did you mean 'soma'"),
        (lambda: ns.load_prior("nowhere/file.safetensors"), "none is there"),
        (lambda: ns.load_planner("swap-repair", speed=3), "options"),
        (lambda: ns.Budget(seconds=-1), "0 or more"),
        (lambda: ns.Budget(seconds="1"), "a number"),
        (lambda: ns.Budget(attempts=3.5), "an integer"),
        (lambda: ns.solve(soma.problem(0), budget=5), "a Budget"),
        (lambda: ns.solve(soma.problem(0), rng=-1), "seed"),
        (lambda: ns.solve(soma.problem(0), rng="a"), "seed"),
        (lambda: ns.solve(None), "a Problem"),
        (lambda: ns.validate(None, []), "a Problem"),
        (lambda: ns.validate(soma.problem(0), None), "list of names"),
        (lambda: ns.validate(soma.problem(0), {"V"}), "list of names"),
        (lambda: ns.validate(soma.problem(0), [["V"]]), "action primitive"),
    ],
)
def test_wrong_calls_say_what_was_expected(call, says):
    with pytest.raises(ns.InputError, match=says):
        call()
