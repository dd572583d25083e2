"""Searching from the goal: what can be built up is what can be taken down, and a proof from either side is a proof."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import neurosym as ns
from neurosym.cli import app
from neurosym.language.reversal import reversed_problem
from neurosym.language.search_problem import Rejection
from neurosym.pipeline import count_orders
from neurosym.planning.result import Status

DATA = Path(__file__).parents[2] / "shared" / "data"
ASSEMBLY = ns.load_domain("assembly")
FORWARDS = ns.load_planner("backtracking")
BEST_FIRST = ns.load_planner("best-first")


def random_problem(seed: int) -> ns.Problem:
    """Polycubes in a loose 3 x 3 x 3 block, overhangs and gaps included, some fixed, some held, some ordered."""
    rng = np.random.default_rng(seed)
    cells = list(itertools.product(range(3), repeat=3))
    count = int(rng.integers(2, 7))
    parts = {f"p{k}": [cells[i]] for k, i in enumerate(rng.choice(len(cells), count, replace=False))}
    free = [c for c in cells if all(c not in own for own in parts.values())]
    for _ in range(int(rng.integers(0, 18))):
        name = f"p{rng.integers(count)}"
        near = [c for c in free if any(math.dist(c, own) == 1 for own in parts[name])]
        if near:
            free.remove(near[int(rng.integers(len(near)))])
            parts[name].append(next(c for c in near if c not in free))
    names = list(parts)
    pairs = [tuple(sorted(rng.choice(names, 2, replace=False)))] if rng.random() < 0.3 else []
    fixed = [str(n) for n in rng.choice(names, int(rng.integers(0, 3)), replace=False)][: count - 1]
    before = [pair for pair in pairs if not set(pair) & set(fixed)]
    gravity, held = bool(rng.random() < 0.7), int(rng.random() < 0.2)
    assembly = ns.Assembly.from_cells(parts, friction=float(rng.choice([0.1, 0.5])))
    return ASSEMBLY.problem(assembly, gravity=gravity, held=held, fixed=fixed, before=before)


def random_scores(problem: ns.Problem, seed: int) -> ns.OrderScores | None:
    rng, n = np.random.default_rng(seed), len(problem.actions)
    return None if seed % 3 == 0 else ns.OrderScores(3 * rng.normal(size=(n, n)), problem.actions)


@pytest.mark.parametrize("block", range(10))
def test_the_sides_agree_on_random_assemblies(block):
    ended = set()
    for seed in range(30 * block, 30 * (block + 1)):
        problem, case = random_problem(seed), f"random assembly {seed}"
        scores = random_scores(problem, seed)
        shared = scores and replace(scores, classes=tuple(problem.classes))  # parts that may be swapped share a price
        for planner in (FORWARDS, BEST_FIRST):
            by_side = {s: planner.plan_from(problem.ground(), scores, side=s) for s in ("full", "empty", "both")}
            assert len({r.status for r in by_side.values()}) == 1, case
            assert by_side["empty"].side == "empty"
            assert by_side["full"].best_suffix is None
            for result in by_side.values():
                if result.plan is not None:
                    assert ns.validate(problem, result.plan, result.motions), case
                    assert scores is None or result.cost == pytest.approx(shared.plan_cost(indices(problem, result)))
            costs = [r.cost for r in by_side.values() if r.plan is not None and scores is not None]
            if planner is BEST_FIRST and costs:
                assert max(costs) == pytest.approx(min(costs), abs=1e-5), case
            ended.add(by_side["full"].status)
    assert ended == {Status.SOLVED, Status.UNSOLVABLE}


def indices(problem, result):
    return [problem.actions.index(name) for name in result.plan]


@given(st.integers(0, 10**6))
@settings(max_examples=25, deadline=None)
def test_what_is_promised_from_the_goal_holds(seed):
    """Every rejection met on the way is asked again in all states: none of those it promises may allow the action."""
    problem = random_problem(seed)
    search = reversed_problem(problem.ground())
    states, promises = {search.initial: 0}, []
    for state in states_from(search, states):
        for action in search.candidates(state):
            answer = search.attempt(state, action)
            if isinstance(answer, Rejection) and answer.until:
                promises.append((states[state], action, answer))
    for used, action, answer in promises:
        until, wanted = sum(1 << a for a in answer.until), sum(1 << a for a in answer.given)
        for state, done in states.items():
            below = not used & ~done and not until & done
            everywhere = answer.unconditional and not wanted & ~done and not until & done
            if (below or everywhere) and action in search.candidates(state):
                assert isinstance(search.attempt(state, action), Rejection), (answer, problem.actions[action])


def states_from(search, states):
    """All states that steps lead to, breadth first; `states` says which actions were undone in each."""
    waiting = list(states)
    for state in waiting:
        yield state
        for action in search.candidates(state):
            answer = search.attempt(state, action)
            if not isinstance(answer, Rejection) and answer.state not in states:
                states[answer.state] = states[state] | 1 << action
                waiting.append(answer.state)


@pytest.mark.parametrize("seed", range(12))
def test_orders_are_as_many_as_permutations_say(seed):
    problem = random_problem(seed)
    orders = sum(bool(ns.validate(problem, order)) for order in itertools.permutations(problem.actions))
    assert count_orders(problem).told_apart == orders


def test_components_stand_or_fall_by_themselves():
    cells = {"foot": [(0, 0, 0)], "on": [(0, 0, 1)], "far": [(5, 0, 0)], "off": [(5, 0, 1), (6, 0, 1), (7, 0, 1)]}
    stability = ASSEMBLY.problem(ns.Assembly.from_cells(cells)).geometry.limit
    mask = stability.assembly.mask
    assert stability.standing(mask(["foot", "on", "far"])).stands
    asked = sum(stability.asked.values())
    assert stability.standing(mask(["foot", "on"])).stands, "each was judged by itself, and is remembered"
    assert sum(stability.asked.values()) == asked
    fallen = stability.standing(mask(list(cells)))
    assert not fallen.stands
    assert fallen.moving == mask(["off"])


def leaning(towers: int, **options) -> ns.Problem:
    """Towers of loose blocks, and two hooks that stand only as long as each leans on the other."""
    cells = {f"t{k}{z}": [(3 * k, 0, z)] for k in range(towers) for z in range(3)}
    x = 3 * towers
    cells["left"] = [(x, 0, 0), (x, 0, 1), (x + 1, 0, 1), (x + 2, 0, 1)]
    cells["right"] = [(x + 5, 0, 0), (x + 5, 0, 1), (x + 4, 0, 1), (x + 3, 0, 1)]
    return ASSEMBLY.problem(ns.Assembly.from_cells(cells, friction=0.9), **options)


@pytest.mark.parametrize("side", ["empty", "both", None])
def test_it_is_told_how_far_the_empty_side_gets(side):
    problem = leaning(2)
    result = ns.solve(problem, side=side)
    assert result.status is Status.UNSOLVABLE
    if side == "empty":
        assert sorted(result.best_suffix) == [n for n in sorted(problem.actions) if n.startswith("t")]
        assert result.why_not.left == ("left", "right")
        assert result.why_not.building == ()
        assert result.why_not.sentences[0].startswith("From the table alone only 6 of 8 parts")
        assert {f.without[0] for f in result.why_not.falls} == {"left", "right"}


def test_sides_that_cannot_be_are_refused_and_both_does_without():
    for problem, options in (
        (ASSEMBLY.problem(0, groups=True), {}),
        (ASSEMBLY.problem(0), {"planner": "swap-repair"}),
        (ns.load_domain("soma").problem(17, removed=["V"]), {"oracle": "physics"}),
    ):
        with pytest.raises(ns.InputError, match="begin at the goal"):
            ns.solve(problem, side="empty", **options)
    assert ns.solve(ASSEMBLY.problem(0, groups=True), side="both").side == "full"
    with pytest.raises(ns.InputError, match="middle"):
        ns.solve(ASSEMBLY.problem(0), side="middle")


def test_held_parts_are_held_in_plans_from_the_goal():
    result = ns.solve(leaning(1, held=1), side="empty")
    assert result.solved
    assert any(motion.held for motion in result.motions)


def test_the_command_says_which_side_decided(tmp_path):
    file = tmp_path / "plan.json"
    command = ["plan", "assembly", "--problem", "0", "--side", "empty", "--out", str(file)]
    assert CliRunner().invoke(app, command).exit_code == 0
    answer = json.loads(file.read_text())
    assert answer["side"] == "empty"
    assert answer["best_suffix"] == answer["plan"]
    assert all(refusal["side"] == "empty" for refusal in answer["refusals"])


@pytest.mark.skipif(not (DATA / "crossvault").is_dir(), reason="the shared data is not here")
def test_the_cross_vault_can_be_built_up_no_further_than_its_corners():
    result = ns.solve(ASSEMBLY.problem(DATA / "crossvault"), prior="outermost-first")
    assert (result.status, result.side, len(result.best_suffix)) == (Status.UNSOLVABLE, "empty", 12)
    assert "only 12 of 180" in result.why_not.sentences[0]
