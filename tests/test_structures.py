"""Structures made at random: the same each time, within bounds, apart in some order; and what is learned from them."""

from __future__ import annotations

import numpy as np
import pytest

import neurosym as ns
from domains.assembly_labels import order_shares
from domains.structures import KINDS, SIZES, SPAN, TESTING, kind_of, structure
from neurosym.errors import DemonstrationError, InputError, UnknownNameError
from neurosym.language.labelled_problems import LabelledProblems
from neurosym.planning.outermost_first import OutermostFirst
from planners import order_marginals

family = ns.load_domain("assembly")


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_comes_apart_and_is_the_same_each_time(kind):
    numbers = family.numbers("test", kind=kind)
    assert {family.kind(n) for n in numbers} == {kind}
    problem = family.problem(numbers[0])
    assert SIZES[0] <= len(problem.world) <= SIZES[1]
    assert ns.solve(problem, prior="outermost-first", side="full").plan
    structure.cache_clear()
    again = family.problem(numbers[0])
    assert again.world.names == problem.world.names
    np.testing.assert_array_equal(again.world.part_bounds, problem.world.part_bounds)
    other = family.problem(numbers[1]).world
    assert other.names != again.world.names or not np.array_equal(other.part_bounds, again.world.part_bounds)


def test_the_difficulty_is_how_often_outermost_first_is_refused():
    number = next(n for n in family.numbers("test", kind="nested") if structure(family, n).difficulty)
    made = structure(family, number)
    result = ns.solve(family.problem(number), planner="backtracking", prior="outermost-first", side="full")
    assert result.iterations == pytest.approx(made.difficulty, abs=3)  # ties are broken by another generator


def test_numbers_of_training_and_test_do_not_overlap():
    train, test = set(family.numbers("train")), set(family.numbers("test"))
    assert not train & test
    assert len([n for n in test if n >= SPAN]) == TESTING * len(KINDS)
    with pytest.raises(UnknownNameError, match="arch"):
        family.numbers("test", kind="arhc")
    for wrong in (SPAN - 1, SPAN * (len(KINDS) + 1)):
        with pytest.raises(InputError):
            kind_of(wrong)


def test_where_parts_are_fixed_one_may_be_held_unless_the_user_says_otherwise():
    number = family.numbers("test", kind="arch")[0]
    assert family.problem(number).details["held"] == 1
    assert family.problem(number, held=0).details["held"] == 0


def test_weighted_shares_are_those_of_all_orders_each_by_its_probability():
    problem = family.problem(family.numbers("test", kind="nested")[0])
    search, scores = problem.ground(), OutermostFirst(decay=1.0).scores([problem])[0]
    n = len(search.actions)
    expected = np.zeros((n, n))
    for plan in ns.load_planner("exhaustive").all_plans(search):
        order = [search.actions.index(name) for name in plan]
        expected[np.arange(n), order] += np.exp(-scores.plan_cost(order))
    for label in set(search.classes):  # equal parts share
        own = np.flatnonzero(np.asarray(search.classes) == label)
        expected[:, own] = expected[:, own].mean(axis=1, keepdims=True)
    np.testing.assert_allclose(order_marginals(search, scores), expected / expected[0].sum(), atol=1e-9)
    uniform = ns.OrderScores.uniform(n, search.actions)
    np.testing.assert_allclose(order_marginals(search, uniform), order_marginals(search), atol=1e-9)


def test_sampled_shares_are_of_orders_that_work():
    number = next(n for n in family.numbers("test", kind="corbel") if len(structure(family, n).assembly) > 10)
    problem = family.problem(number)
    shares = order_shares(problem, np.random.default_rng(0))
    np.testing.assert_allclose([shares.sum(axis=0), shares.sum(axis=1)], 1.0)
    search = problem.ground()
    free = [a for a in search.candidates(search.initial) if isinstance(search.attempt(search.initial, a), ns.Step)]
    assert set(np.flatnonzero(shares[0])) <= set(free)


def test_labelled_problems_are_written_and_read_again(tmp_path):
    made = family.labelled_problems("test", count=1, without="wall", workers=1)
    assert len(made) == len(KINDS) - 1
    again = LabelledProblems.load(made.save(tmp_path / "made.npz"), family)
    for (one, shares), (other, read) in zip(made, again):
        assert (one.name, one.actions) == (other.name, other.actions)
        assert dict(one.details) == dict(other.details)
        np.testing.assert_array_equal(one.world.part_bounds, other.world.part_bounds)
        np.testing.assert_array_equal(shares, read)
    (tmp_path / "odd.npz").write_text("no")
    with pytest.raises(DemonstrationError, match="labelled problems"):
        LabelledProblems.load(tmp_path / "odd.npz", family)
    with pytest.raises(DemonstrationError, match="rows that sum to one"):
        LabelledProblems(made.problems, tuple(table * 2 for table in made.marginals))


def test_a_users_own_folder_is_read(tmp_path):
    for number in (0, 3):
        family.problem(number).world.save(tmp_path / f"{number}.json")
    made = family.labelled_problems(folder=tmp_path, gravity=False, workers=2)
    assert [p.name for p in made.problems] == ["0.json", "3.json"]
    assert not any(p.details["gravity"] for p in made.problems)
    with pytest.raises(InputError, match="hold"):
        family.labelled_problems(folder=tmp_path, hold=1)
    with pytest.raises(InputError, match="there is none"):
        family.labelled_problems(folder=tmp_path / "none")
