"""PDDL in and out, unified-planning on both sides, and plans that a validator of others confirms."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from test_planning_language import made, tasks

import neurosym as ns
from neurosym.cli import main
from planners import BestFirst

up = pytest.importorskip("unified_planning", reason="unified-planning is not installed: pip install '.[pddl]'")
up.shortcuts = pytest.importorskip("unified_planning.shortcuts")

DOMAIN = """
(define (domain ferry)
  (:requirements :strips :typing :adl :action-costs)
  (:types place car - object lorry - car)
  (:constants dock - place)
  (:predicates (at ?c - car ?p - place) (ferry ?p - place) (aboard ?c - car) (open ?p - place) (rung))
  (:functions (total-cost) - number (way ?a ?b - place) - number)
  (:action sail :parameters (?a ?b - place)
    :precondition (and (ferry ?a) (not (= ?a ?b)) (or (open ?b) (= ?b dock)))
    :effect (and (ferry ?b) (not (ferry ?a)) (increase (total-cost) (way ?a ?b))))
  (:action board :parameters (?c - car ?p - place)
    :precondition (and (at ?c ?p) (ferry ?p) (forall (?o - lorry) (not (aboard ?o))))
    :effect (and (aboard ?c) (not (at ?c ?p)) (increase (total-cost) 1)))
  (:action empty :parameters (?p - place)
    :precondition (and (ferry ?p) (imply (rung) (exists (?c - car) (aboard ?c))))
    :effect (and (rung) (forall (?c - car) (when (aboard ?c) (and (at ?c ?p) (not (aboard ?c)))))
                 (increase (total-cost) 2))))
"""
PROBLEM = """
(define (problem crossing) (:domain ferry)
  (:objects east west - place a b - car l - lorry)
  (:init (ferry dock) (at a east) (at b dock) (at l dock) (open east) (open west) (= (total-cost) 0)
    (= (way dock east) 4) (= (way east dock) 4) (= (way dock west) 9) (= (way west dock) 9)
    (= (way east west) 3) (= (way west east) 3) (= (way dock dock) 0) (= (way east east) 0) (= (way west west) 0))
  (:goal (and (at a west) (at b west) (at l west)))
  (:metric minimize (total-cost)))
"""


def planned(name, problem, **params):
    with up.shortcuts.OneshotPlanner(name=name, params=params or None) as planner:
        return planner.solve(problem)


@pytest.fixture(scope="module", autouse=True)
def ours():
    up.shortcuts.get_environment().credits_stream = None
    ns.register_engine()
    ns.register_engine()  # twice does no harm


def test_a_file_with_formulas_effects_under_conditions_and_costs_is_planned_at_the_least_cost():
    problem = ns.from_pddl(DOMAIN, PROBLEM)
    best = ns.solve(problem, planner="best-first")
    assert best.cheapest
    for planner in ("greedy", "backtracking"):
        result = ns.solve(problem, planner=planner)
        assert ns.validate(problem, result.plan)
        assert result.total_cost >= best.total_cost
    again = ns.from_unified_planning(ns.to_unified_planning(problem))
    assert ns.solve(again, planner="best-first").total_cost == best.total_cost


@settings(max_examples=40, deadline=None)
@given(tasks)
def test_a_round_trip_keeps_the_least_cost(task):
    problem = made(task, costly=True)
    text = ns.to_pddl(problem)
    again = ns.from_pddl(text.domain, text.problem)
    first, second = (ns.solve(p, planner=BestFirst()) for p in (problem, again))
    assert (first.status, first.total_cost) == (second.status, second.total_cost)
    if second.plan is not None:
        assert ns.validate(problem, text.order([name.replace("(", "").replace(")", "") for name in second.plan]))


def test_once_survives_the_round_trip():
    thing = ns.Type("thing")
    on, done, x = ns.Fluent("on", thing), ns.Fluent("done", thing), thing("x")
    strike = ns.Action("strike", x, pre=[~on(x)], eff=[on(x)], once=True)
    blow = ns.Action("blow", x, pre=[on(x)], eff=[~on(x), done(x)])
    domain = ns.Domain("Match", fluents=[on, done], actions=[strike, blow])
    for goal, status in (([done("a")], ns.Status.SOLVED), ([done("a"), on("a")], ns.Status.UNSOLVABLE)):
        text = ns.to_pddl(domain.problem(objects={thing: ["a", "b c"]}, init=[], goal=goal))
        assert ns.solve(ns.from_pddl(text.domain, text.problem), planner="best-first").status is status


def test_the_engine_plans_and_validates_for_unified_planning():
    problem = ns.to_unified_planning(ns.from_pddl(DOMAIN, PROBLEM))
    result = planned("neurosym", problem, planner="best-first")
    assert result.status is up.engines.PlanGenerationResultStatus.SOLVED_OPTIMALLY
    for name in ("neurosym", "sequential_plan_validator"):
        with up.shortcuts.PlanValidator(name=name) as validator:
            assert validator.validate(problem, result.plan).status is up.engines.ValidationResultStatus.VALID
            broken = up.plans.SequentialPlan(result.plan.actions[1:])
            assert validator.validate(problem, broken).status is up.engines.ValidationResultStatus.INVALID


def test_geometry_leaves_as_what_it_found_and_comes_back():
    problem = ns.load_domain("assembly").problem(1, gravity=False)
    assert ns.to_pddl(problem).sound
    found = planned("neurosym", ns.to_unified_planning(problem))
    order = ns.to_pddl(problem).order([a.action.name for a in found.plan.actions])
    assert ns.validate(problem, order)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("(rung))", "(rung)) (:functions (fuel))", "Expected"),
        ("(:action sail", "(:durative-action sail", "Expected"),
        ("minimize (total-cost)", "maximize (total-cost)", "a metric other than"),
        ("(define (domain", "(defin (domain", "two texts in PDDL"),
    ],
)
def test_what_is_beyond_the_language_gets_a_sentence(old, new, says):
    with pytest.raises(ns.InputError, match=says):
        ns.from_pddl(DOMAIN.replace(old, new), PROBLEM.replace(old, new))


def test_the_command_plans_pddl_files(tmp_path: Path, capsys):
    (tmp_path / "d.pddl").write_text(DOMAIN)
    (tmp_path / "p.pddl").write_text(PROBLEM)
    call = ["plan", "--pddl", str(tmp_path / "d.pddl"), str(tmp_path / "p.pddl"), "--planner", "best-first"]
    with pytest.raises(SystemExit) as left:
        main([*call, "--heuristic", "max", "--json"])
    assert not left.value.code
    answer = json.loads(capsys.readouterr().out)
    assert answer["cheapest"]
    with pytest.raises(SystemExit):
        main(call)
    shown = capsys.readouterr().out
    assert f"cost {answer['total_cost']:g}; proved that none is cheaper" in shown
    with pytest.raises(SystemExit) as left:
        main(["plan", "--pddl", str(tmp_path / "none"), str(tmp_path / "p.pddl")])
    assert left.value.code not in (0, None)
