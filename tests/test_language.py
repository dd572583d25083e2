"""The symbolic language: definitions are checked at once, problems ground to bitsets, and replays agree."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import neurosym as ns
from neurosym.language.state import AtomSet

block = ns.Type("block")
small = ns.Type("small", block)
table = ns.Type("table")
on = ns.Fluent("on", block, table)
clear = ns.Fluent("clear", block)
here = ns.Fluent("here", block)
b, c, t = block("b"), block("c"), table("t")


@ns.derived(block)
def light(world, state, name):
    heavy = world[name] > 5
    return ns.Verdict(not heavy, (name,), f"{name} weighs {world[name]}.")


take = ns.Action("take", b, pre=[here(b), light(b)], eff=[~here(b)], label="{b}")
domain = ns.Domain("shelf", fluents=[here, clear], actions=[take])


def shelf(weights, **options):
    names = tuple(weights)
    options = {"init": [here(n) for n in names], "goal": [~here(n) for n in names], **options}
    return domain.problem(world=weights, objects={block: names}, **options)


def test_a_plan_is_found_and_replayed():
    problem = shelf({"a": 1, "b": 2})
    result = ns.solve(problem)
    assert result.status is ns.Status.SOLVED
    assert sorted(result.plan) == ["a", "b"]
    assert ns.validate(problem, result.plan)


def test_what_cannot_be_done_is_proved_and_blamed():
    result = ns.solve(shelf({"a": 1, "b": 9}))
    assert result.status is ns.Status.UNSOLVABLE
    assert any(r.action == "b" and r.because == ("b",) and "weighs 9" in r.reason for r in result.blame)


def test_states_are_bitsets_and_atoms_come_back():
    ground = shelf({"a": 1, "b": 2}).ground()
    assert isinstance(ground.initial, int)
    assert {str(a) for a in ground.atoms(ground.initial)} == {"here(a)", "here(b)"}
    step = ground.attempt(ground.initial, ground.actions.index("a"))
    assert {str(a) for a in ground.atoms(step.state)} == {"here(b)"}


def test_goals_may_use_derived_predicates():
    @ns.derived()
    def lonely(world, state):
        left = state.objects(here)
        return ns.Verdict(len(left) == 1, left, f"{len(left)} are left.")

    problem = shelf({"a": 1, "b": 1, "c": 1}, goal=[lonely(), ~here("b")])
    result = ns.solve(problem)
    assert result.solved
    assert len(result.plan) == 2
    assert "b" in result.plan
    wrong = ns.validate(problem, ["b"])
    assert not wrong.ok
    assert wrong.failed_at == 1
    assert "2 are left" in wrong.reason


def test_negated_derived_preconditions_and_goals():
    drop = ns.Action("drop", b, pre=[here(b), ~light(b)], eff=[~here(b)], label="drop {b}")
    heavy_only = ns.Domain("heavy", fluents=[here], actions=[drop])
    problem = heavy_only.problem(world={"a": 9, "b": 1}, objects={block: ["a", "b"]}, init=[here("a"), here("b")],
                                 goal=[~here("a")])
    assert ns.solve(problem).plan == ("drop a",)
    assert not ns.validate(problem, ["drop b"]).ok


def test_subtypes_count_as_their_parents():
    problem = domain.problem(
        world={"a": 1, "s": 1}, objects={block: ["a"], small: ["s"]}, init=[here("a"), here("s")], goal=[~here("s")]
    )
    assert ns.solve(problem).solved
    assert set(problem.actions) == {"a", "s"}


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: on(b), "expected 2 arguments"),
        (lambda: on(t, b), "expected a block"),
        (lambda: here(3), "name of an object"),
        (lambda: ns.Fluent("x", "block"), "expected a Type"),
        (lambda: ns.Type(" "), "type name"),
        (lambda: ns.Action("a", b, pre=[here(c)], eff=[~here(b)]), "pre[0]"),
        (lambda: ns.Action("a", b, pre=[here], eff=[~here(b)]), "pre[0]"),
        (lambda: ns.Action("a", b, pre=[here(b)], eff=[light(b)]), "eff[0]"),
        (lambda: ns.Action("a", b, eff=[]), "at least one effect"),
        (lambda: ns.Action("a", b, eff=[here(b), ~here(b)]), "both made true and made false"),
        (lambda: ns.Action("a", b, b, eff=[here(b)]), "different names"),
        (lambda: ns.Action("a", "b", eff=[here(b)]), "expected a variable"),
        (lambda: ns.Action("a", b, eff=[here(b)], label="{q}"), "label"),
        (lambda: ns.Domain("d", fluents=[clear], actions=[take]), "not declared"),
        (lambda: ns.Domain("d", fluents=[here, here], actions=[take]), "twice"),
        (lambda: ns.Domain("d", fluents=[here], actions=[]), "at least one action"),
        (lambda: shelf({"a": 1}, init=[here("z")]), "init[0]"),
        (lambda: shelf({"a": 1}, init=[light("a")]), "init[0]"),
        (lambda: shelf({"a": 1}, goal=[~here("b")]), "goal[0]"),
        (lambda: shelf({"a": 1}, goal=[clear("a")]), "no action that can be reached"),
        (lambda: shelf({"a": 1}, goal=[on("a", "a")]), "not the domain's"),
        (lambda: shelf({"a": 1, "b": 1}, before=[("a", "z")]), "before[0]"),
        (lambda: shelf({"a": 1, "b": 1}, before=[("a", "b"), ("b", "a")]), "circle"),
        (lambda: shelf({"a": 1}, interchangeable=[("a", "zz")]), "interchangeable[0]"),
        (lambda: domain.problem(world={}, objects={block: ["a"], table: ["a"]}, init=[], goal=[]), "twice"),
        (lambda: domain.problem(world={}, objects={table: ["u"]}, init=[here("u")], goal=[]), "expected a block"),
    ],
)
def test_mistakes_are_named_at_once_with_their_place(make, says):
    with pytest.raises(ns.DefinitionError, match=re.escape(says)):
        make()


def test_two_ground_actions_of_one_name_are_refused():
    both = ns.Action("swap", b, c, pre=[here(b)], eff=[~here(c)], label="{b}")
    with pytest.raises(ns.DefinitionError, match="called 'a'"):
        ns.Domain("d", fluents=[here], actions=[both]).problem(
            world={}, objects={block: ["a", "b"]}, init=[here("a")], goal=[]
        )


def test_a_predicate_that_answers_with_no_verdict_is_a_broken_contract():
    @ns.derived(block)
    def sloppy(world, state, name):
        return True

    action = ns.Action("take", b, pre=[here(b), sloppy(b)], eff=[~here(b)])
    problem = ns.Domain("d", fluents=[here], actions=[action]).problem(
        world=None, objects={block: ["a"]}, init=[here("a")], goal=[~here("a")]
    )
    with pytest.raises(ns.ContractError, match="Verdict"):
        ns.solve(problem)


def test_precedence_is_kept_by_planners_and_by_the_replay():
    problem = shelf(dict.fromkeys("abcd", 1), before=[("d", "a"), ("c", "d")])
    for seed in range(5):
        plan = ns.solve(problem, rng=seed).plan
        assert plan.index("c") < plan.index("d") < plan.index("a")
    wrong = ns.validate(problem, "abcd")
    assert (wrong.ok, wrong.failed_at, wrong.because) == (False, 0, ("d",))
    assert ns.count_plans(problem) == 4


def test_a_problem_may_start_half_done():
    problem = shelf(dict.fromkeys("abc", 1), init=[here("a"), here("c")], before=[("b", "a")])
    assert problem.actions == ("a", "c")
    assert sorted(ns.solve(problem).plan) == ["a", "c"]
    assert ns.validate(problem, ["a", "c"]).ok
    assert not ns.validate(problem, ["b", "a", "c"]).ok


def test_interchangeable_actions_share_a_class_unless_precedence_tells_them_apart():
    plain = shelf(dict.fromkeys("abcd", 1), interchangeable=[("a", "b"), ("c", "d")])
    assert len(set(plain.classes)) == 2
    told = shelf(dict.fromkeys("abcd", 1), interchangeable=[("a", "b"), ("c", "d")], before=[("a", "c")])
    assert len(set(told.classes)) == 4


def test_a_promise_of_atoms_becomes_a_promise_of_actions():
    @ns.derived(block)
    def uncovered(world, state, name):
        over = [n for n in world[name] if state.holds(here(n))]
        return ns.Verdict(not over, tuple(over), f"{over} on {name}", tuple(here(n) for n in over[:1]))

    @ns.derived(block)
    def never(world, state, name):
        return ns.Verdict(False, (), "never", ())

    stack = ns.Domain(
        "stack",
        fluents=[here],
        actions=[
            ns.Action("take", b, pre=[here(b), uncovered(b)], eff=[~here(b)], label="{b}"),
            ns.Action("no", b, pre=[here(b), never(b)], eff=[~here(b)], label="no {b}"),
        ],
    )
    problem = stack.problem(
        world={"a": ["b"], "b": []}, objects={block: ["a", "b"]}, init=[here("a"), here("b")], goal=[~here("a")]
    )
    ground = problem.ground()
    refused = ground.attempt(ground.initial, ground.actions.index("a"))
    assert {ground.actions[i] for i in refused.until} == {"b", "no b"}
    hopeless = ground.attempt(ground.initial, ground.actions.index("no a"))
    assert hopeless.until == (ground.actions.index("no a"),)


@given(st.sets(st.sampled_from("abcdefg")))
def test_bit_states_and_set_states_answer_alike(left):
    names = tuple("abcdefg")
    problem = shelf(dict.fromkeys(names, 1), init=[here(n) for n in left] or [clear("a")], goal=[])
    ground = problem.ground()
    seen = {}

    from neurosym.language.grounding import BitState

    bit, plain = BitState(ground, ground.initial), AtomSet(set(problem.init), names)
    for order in (names, names[::-1], ("g", "a")):
        seen[order] = bit.mask(here, order)
        assert seen[order] == plain.mask(here, order)
    assert bit.objects(here) == plain.objects(here)
    assert all(bit.holds(here(n)) == plain.holds(here(n)) for n in names)


def test_validate_names_unknown_and_repeated_actions():
    problem = shelf({"a": 1, "b": 1})
    with pytest.raises(ns.UnknownNameError, match="'z'"):
        ns.validate(problem, ["z"])
    again = ns.validate(problem, ["a", "a"])
    assert (again.ok, again.failed_at) == (False, 1)
    short = ns.validate(problem, ["a"])
    assert (short.ok, short.failed_at) == (False, 1)
    assert "goal" in short.reason
