"""Every registered domain keeps its promises, and the suite catches those that do not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import neurosym as ns
from neurosym.testing import check_domain
from neurosym.testing.domains import check_problem

soma = ns.load_domain("soma")


@pytest.mark.parametrize("name", ns.domain_names())
def test_registered_domains_conform(name):
    check_domain(name, facts=False)  # test_soma recomputes the facts, one by one


@pytest.mark.parametrize("rule", ["cubes", "strict", "rigid"])
def test_soma_conforms_under_every_rule(rule):
    check_problem(soma.problem(42, collapse=rule), walks=3)
    check_problem(soma.problem(42, collapse=rule, removed=["V"], before=[("L", "T")]), walks=2)


item = ns.Type("item")
there = ns.Fluent("there", item)
x = item("x")


def problem_with(answer):
    derived = ns.Derived("may_go", [item], answer)
    take = ns.Action("take", x, pre=[there(x), derived(x)], eff=[~there(x)], label="{x}")
    names = ("a", "b", "c")
    return ns.Domain("liars", fluents=[there], actions=[take]).problem(
        world=None, objects={item: names}, init=[there(n) for n in names], goal=[~there(n) for n in names]
    )


def test_a_broken_promise_is_caught():
    def liar(world, state, name):
        gone = 3 - len(state.objects(there))
        # Promises to stay refused until c goes, but gives way as soon as anything does.
        return ns.Verdict(name != "a" or gone > 0, (), "not yet", (there("c"),))

    with pytest.raises(ns.ContractError, match="keep its promise"):
        check_problem(problem_with(liar), walks=20)


def test_an_unconditional_promise_that_depends_on_the_state_is_caught():
    def conditional(world, state, name):
        # Without b, a waits for c; with b, it does not: what it says of c depends on the rest of the state.
        refused = name == "a" and state.holds(there("c")) and not state.holds(there("b"))
        return ns.Verdict(not refused, (), "c is in the way", (there("c"),), unconditional=True)

    with pytest.raises(ns.ContractError, match="unconditionally"):
        check_problem(problem_with(conditional), walks=40)


def test_an_oracle_that_changes_its_mind_is_caught():
    rng = np.random.default_rng(0)

    def moody(world, state, name):
        return ns.Verdict(bool(rng.integers(2)), (), "perhaps")

    with pytest.raises(ns.ContractError, match=r"asked twice|agree"):
        check_problem(problem_with(moody), walks=20)


def test_a_refusal_without_a_reason_gets_one():
    problem = problem_with(lambda world, state, name: ns.Verdict(name != "a" or not state.holds(there("b"))))
    check_problem(problem)
    search = problem.ground()
    assert "may_go(a) does not hold" in search.attempt(search.initial, 0).reason


def test_overlapping_parts_wrong_facts_and_moody_pictures_are_caught():
    class Family(ns.ProblemFamily):
        name, reference = "fake", "none"
        domain = soma.domain

        def problem(self, number=0):
            return soma.problem(number)

        def problems(self, part="test", *, split=0):
            return [soma.problem(n) for n in ((1, 2) if part == "train" else (3, 4))]

        def known_facts(self):
            return {"two and two": (5, lambda: 4)}

    with pytest.raises(ns.ContractError, match="two and two"):
        check_domain(Family(), pictures=False, walks=1)

    class Overlapping(Family):
        def problems(self, part="test", *, split=0):
            return [soma.problem(1)]

    with pytest.raises(ns.ContractError, match="overlap"):
        check_domain(Overlapping())

    rng = np.random.default_rng(0)

    class Moody(ns.Semantics):
        def observe(self, problem):
            return rng.integers(0, 255, (4, 8, 8, 3), dtype=np.uint8)

    moody = dataclasses.replace(soma.problem(0), semantics=Moody())
    with pytest.raises(ns.ContractError, match="same pictures"):
        check_domain("soma", problems=[moody], facts=False, walks=1)
