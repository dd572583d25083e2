"""What each planner does beyond its contract: what it saves, what it counts, what it learns from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from neurosym.language.search_problem import Step
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import Status
from neurosym.testing.toys import Counting, NumberLine, Removal, Table, Tiles
from planners import Backtracking, BestFirst, Exhaustive, SwapRepair, count_plans, order_marginals
from planners.assignment_heuristic import AssignmentHeuristic
from planners.node import Node
from planners.search_context import SearchContext

COMPLETE = [Backtracking(), BestFirst(), BestFirst(priority="greedy"), BestFirst(priority="levin"), Exhaustive()]


def stack(n: int, *, promises: bool = True) -> Removal:
    """A pile: each part is blocked by the next."""
    above = tuple((1 << p + 1 if p + 1 < n else 0,) for p in range(n))
    return Removal(above, (0,) * n, (0,) * n, (1 << n) - 1, promises)


def rngs(n: int):
    return [np.random.default_rng(seed) for seed in range(n)]


# --- swap repair ---------------------------------------------------------------------------------------------


def test_a_swap_may_draw_the_failing_position_itself() -> None:
    """Two parts in the wrong order: each draw is right with probability 1/2, so 2 iterations on average."""
    problem = stack(2)
    wrong = OrderScores.from_order((0, 1), problem.actions)
    counts = [SwapRepair().plan(problem, wrong, rng=rng).iterations for rng in rngs(400)]
    assert np.mean(counts) == pytest.approx(2.0, abs=0.3)


def test_swap_repair_keeps_what_worked() -> None:
    problem = stack(5)
    for rng in rngs(20):
        counting = Counting(problem)
        result = SwapRepair(cap=None).plan(counting, rng=rng)
        assert result.plan == tuple(reversed(problem.actions))
        assert counting.attempts == 5 + result.iterations
        assert counting.expansions == 5


def test_swap_repair_gives_up_at_its_cap() -> None:
    for cap in (1, 30):
        result = SwapRepair(cap=cap).plan(Table(("a", "b"), {}, "end"))
        assert (result.status, result.iterations) == (Status.GAVE_UP, cap)


def test_a_guess_that_the_symbols_refuse_is_an_iteration_without_an_attempt() -> None:
    problem = Removal(((0,), (0,)), (0, 0), (0b10, 0), 0b11)  # part0 becomes a candidate after part1
    wrong = OrderScores.from_order((0, 1), problem.actions)
    result = SwapRepair().plan(problem, wrong)
    assert result.solved
    assert result.iterations >= 1
    assert result.attempts == 2
    assert "not applicable" in result.blame[0].reason


def test_swap_repair_draws_from_actions_that_the_scores_leave_out() -> None:
    problem = NumberLine((1, 2, 4), goal=7)
    assert SwapRepair().plan(problem, OrderScores(np.zeros((1, 3)))).solved


@pytest.mark.parametrize("planner", [SwapRepair(), Backtracking(), BestFirst()])
def test_whether_the_first_guess_failed(planner) -> None:
    problem = stack(4)
    right, wrong = (OrderScores.from_order(o, problem.actions) for o in ((3, 2, 1, 0), (0, 1, 2, 3)))
    assert planner.plan(problem, right).first_guess_failed is False
    assert planner.plan(problem, wrong).first_guess_failed is True


# --- what complete planners save -----------------------------------------------------------------------------


@pytest.mark.parametrize("planner", COMPLETE)
def test_a_proof_visits_each_set_of_actions_once(planner) -> None:
    """Eight loose parts and one that never leaves: 8! orders, 2^8 sets."""
    problem = Removal(((0,),) * 8 + ((1 << 9,),), (0,) * 10, (0,) * 10, (1 << 9) - 1, promises=False)
    result = planner.plan(replace(problem, blockers=(*problem.blockers, (1 << 9,))))
    assert result.status is Status.UNSOLVABLE
    assert result.expansions <= 2**8


@pytest.mark.parametrize("planner", COMPLETE)
def test_interchangeable_actions_are_asked_for_once(planner) -> None:
    problem = NumberLine((2,) * 12, goal=9)
    counting = Counting(problem)
    assert planner.plan(counting).status is Status.UNSOLVABLE
    assert counting.attempts <= 6


@pytest.mark.parametrize("planner", [Backtracking(), BestFirst()])
def test_promises_are_believed(planner) -> None:
    """With a promise, a refused part is not asked for again before its blocker is gone."""
    for rng in rngs(20):
        result = planner.plan(stack(8), rng=rng)
        assert result.iterations <= 7, "one refusal for each part that has something above it"


@pytest.mark.parametrize("planner", [Backtracking(), BestFirst()])
def test_what_a_refusal_names_is_tried_next(planner) -> None:
    """No promises, but evidence: the named part is the one to ask for, and the way back is known then."""
    for rng in rngs(20):
        assert planner.plan(stack(8, promises=False), rng=rng).iterations <= 7


def test_names_are_found_inside_the_names_of_actions() -> None:
    actions = ("take lid", "take cup", *(f"take p{i}" for i in range(6)))
    leads = {("start", "take lid"): "open", ("open", "take cup"): "end"}
    names = {("start", a): ("lid",) for a in actions} | {("open", a): ("cup",) for a in actions}
    for rng in rngs(20):
        assert Backtracking().plan(Table(actions, leads, "end", names), rng=rng).iterations <= 2


def test_a_completion_that_holds_costs_one_assignment(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    original = AssignmentHeuristic.assign
    monkeypatch.setattr(AssignmentHeuristic, "assign", lambda self, *a: calls.append(a) or original(self, *a))
    for rng in rngs(10):
        word = Tiles("".join(rng.permutation(list("testset"))), ("tetsset", "testset"))
        table = np.array([[0.0 if tile == letter else -8.0 for tile in word.letters] for letter in "testset"])
        scores = OrderScores(table, word.actions, classes=word.classes)
        for planner in (Backtracking(), BestFirst()):
            calls.clear()
            result = planner.plan(word, scores, rng=np.random.default_rng(1))
            assert result.iterations == 0
            assert "".join(name[0] for name in result.plan) == "testset"
            assert len(calls) == 1


def test_an_interchangeable_action_takes_its_place_in_the_completion() -> None:
    context = SearchContext(NumberLine((5, 1, 2, 1), goal=9))  # the actions 1 and 3 are interchangeable
    assert context.restated((3, 1, 2), [1, 2]) == (1, 3, 2)
    assert context.restated((3, 2), [0, 1]) == (1, 2)
    assert context.restated((3, 2), [0, 2]) == ()
    assert Node("", completion=(1, 3, 2)).child(1, Step("")).completion == (3, 2)
    assert Node("", completion=(1, 3, 2)).child(3, Step("")).completion == ()
    assert Node("").child(3, Step("")).completion == ()


def test_backtracking_goes_back_from_dead_ends() -> None:
    """part1 must go before part0, which spoils it; part0 goes at any time. The prior is sure of the wrong order."""
    problem = Removal(((0,), (0,), (0,)), (0, 0b001, 0), (0, 0, 0), 0b111)
    wrong = OrderScores.from_order((0, 2, 1), problem.actions)
    for planner in COMPLETE:
        result = planner.plan(problem, wrong)
        assert result.solved
        assert result.plan.index("part1") < result.plan.index("part0")
    assert SwapRepair().plan(problem, wrong).status is Status.GAVE_UP


def test_best_first_asks_only_for_what_it_takes_out() -> None:
    problem = Removal.loose(6)
    scores = OrderScores.from_order((5, 0, 4, 1, 3, 2), problem.actions)
    result = BestFirst().plan(problem, scores)
    assert (result.attempts, result.expansions, result.iterations) == (6, 6, 0)


def test_without_preferences_best_first_goes_deep() -> None:
    problem = Removal.loose(12)
    for scores in (None, OrderScores.uniform(12, problem.actions)):
        assert BestFirst().plan(problem, scores).attempts == 12


def test_scores_that_ignore_the_problem_s_classes_are_summed_over_them() -> None:
    """Equal tiles are equal, even when a prior has a favourite: all planners then compare one cost."""
    word = Tiles("aab", ("aab", "aba"))
    rng = np.random.default_rng(4)
    blind = OrderScores(rng.normal(size=(3, 3)) * 4, word.actions)
    summed = replace(blind, classes=word.classes)
    for planner in (BestFirst(), Exhaustive()):
        costs = [r.cost for r in planner.plans(word, blind, k=5)]
        assert costs == pytest.approx(sorted(summed.plan_cost(p) for p in ((0, 1, 2), (0, 2, 1))), abs=1e-6)


# --- counting ------------------------------------------------------------------------------------------------


def test_counting_asks_for_each_state_and_action_once() -> None:
    counting = Counting(Removal.loose(7))
    assert count_plans(counting) == 5040
    assert counting.attempts == 7 * 2**6
    assert order_marginals(Removal.loose(7)) == pytest.approx(np.full((7, 7), 1 / 7))


def test_counts_are_those_of_permutations() -> None:
    assert count_plans(stack(11)) == 1
    assert count_plans(Removal.loose(11)) == 39_916_800


def test_a_users_problem_is_grounded_first() -> None:
    class Wrapped:
        def ground(self):
            return Removal.loose(3)

    assert Exhaustive().count_plans(Wrapped()) == 6
    assert Exhaustive().order_marginals(Wrapped()).shape == (3, 3)
    assert len(list(Exhaustive().all_plans(Wrapped()))) == 6
