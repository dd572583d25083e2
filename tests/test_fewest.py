"""Selective disassembly: some parts only, with the fewest removals, and whether that is proved."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import neurosym as ns
from neurosym.cli import app
from neurosym.language.search_problem import Step
from neurosym.planning.budget import Budget
from neurosym.planning.validation import validate
from neurosym.testing.toys import NumberLine
from planners.fewest import Fewest

STACK = {f"s{i}": [(0, 0, i)] for i in range(4)} | {f"t{i}": [(1, 0, i)] for i in range(4)}


def own():
    return ns.load_domain("assembly")


def fewest_by_brute_force(problem: ns.Problem) -> int | None:
    """The size of the smallest set whose members can leave in some order after which the goal holds: all sets tried."""
    search = problem.ground()
    reached = {frozenset[int](): search.initial}
    for size in range(len(search.actions) + 1):
        if any(search.is_goal(state) for state in reached.values()):
            return size
        steps = {}
        for done, state in reached.items():
            for action in search.candidates(state):
                answer = search.attempt(state, action)
                if isinstance(answer, Step):
                    steps[done | {action}] = answer.state
        reached = steps
    return None


@st.composite
def problems(draw: st.DrawFn) -> tuple[ns.Assembly, dict[str, object]]:
    shape = draw(st.sampled_from([(2, 2, 2), (3, 2, 2), (3, 3, 1), (4, 2, 1), (2, 2, 3)]))
    cells = list(itertools.product(*map(range, shape)))
    owner = draw(st.lists(st.integers(0, 5), min_size=len(cells), max_size=len(cells)))
    parts: dict[str, list[tuple[int, int, int]]] = {}
    for cell, name in zip(cells, owner):
        parts.setdefault(f"p{name}", []).append(cell)
    names = sorted(parts)
    assume(len(names) > 2)
    target = draw(st.lists(st.sampled_from(names), min_size=1, max_size=2, unique=True))
    others = [n for n in names if n not in target]
    options: dict[str, object] = {"target": target, "gravity": draw(st.booleans()), "held": draw(st.integers(0, 1))}
    options["fixed"] = draw(st.lists(st.sampled_from(others), max_size=1)) if others else []
    options["before"] = [tuple(draw(st.permutations(names))[:2])] if draw(st.booleans()) else []
    return ns.Assembly.from_cells(parts), options


@settings(max_examples=80, deadline=None)
@given(problems(), st.integers(0, 3))
def test_the_fewest_removals_are_those_that_trying_all_sets_finds(given: tuple, seed: int):
    assembly, options = given
    problem = own().problem(assembly, **options)
    result = ns.solve(problem, rng=seed)
    least = fewest_by_brute_force(own().problem(assembly, **options))
    assert (None if result.plan is None else len(result.plan)) == least
    assert result.fewest is (None if least is None else True)
    if result.plan is not None:
        assert validate(problem, result.plan, result.motions)
        assert set(options["target"]) <= set(result.plan)


@settings(max_examples=40, deadline=None)
@given(problems(), st.data())
def test_a_bound_is_never_above_what_is_needed(given: tuple, data: st.DataObject):
    assembly, options = given
    problem = own().problem(assembly, **options)
    ground, state, done = problem.ground(), problem.ground().initial, 0
    least = fewest_by_brute_force(problem)
    while least is not None and not ground.is_goal(state):
        known = ground.relaxed_plan(state)
        steps = [a for c in ground.candidates(state) if isinstance(a := ground.attempt(state, c), Step)]
        # From here: the brute force of what is left, by its own count.
        rest = _needed(ground, state)
        assert known.at_least <= (rest if rest is not None else len(ground.actions))
        if not options["gravity"] and rest is not None:
            assert known.at_least == rest  # without gravity it is no bound, but the number
        if not steps:
            return
        state, done = data.draw(st.sampled_from(steps)).state, done + 1


def _needed(ground, start: int) -> int | None:
    layer, seen = {start}, {start}
    for depth in range(len(ground.actions) + 1):
        if any(map(ground.is_goal, layer)):
            return depth
        answers = (ground.attempt(s, a) for s in layer for a in ground.candidates(s))
        layer = {answer.state for answer in answers if isinstance(answer, Step)} - seen
        seen |= layer
    return None


def test_only_what_has_to_go_goes():
    assembly = ns.Assembly.from_cells(STACK)
    result = ns.solve(own().problem(assembly, target=["s1"], directions="+z"))
    assert (result.plan, result.fewest) == (("s3", "s2", "s1"), True)
    both = ns.solve(own().problem(assembly, target=["s2", "t1"], directions="+z"))
    assert len(both.plan or ()) == 5
    assert len(ns.solve(own().problem(assembly, directions="+z")).plan or ()) == 8
    assert ns.solve(own().problem(assembly)).fewest is None  # nobody asked


def test_gravity_asks_for_more_than_blocking_does():
    # The foot can leave sideways, but what stands on it would fall.
    cells = {"foot": [(0, 0, 0)], "load": [(0, 0, 1)], "hat": [(0, 0, 2)], "far": [(5, 0, 0)]}
    problem = own().problem(ns.Assembly.from_cells(cells), target=["foot"])
    assert problem.ground().relaxed_plan(problem.ground().initial).at_least == 1
    result = ns.solve(problem)
    assert (result.plan, result.fewest) == (("hat", "load", "foot"), True)
    held = ns.solve(own().problem(ns.Assembly.from_cells(cells), target=["foot"], held=2))
    assert (held.plan, held.fewest) == (("foot",), True)


def test_other_planners_say_what_the_bound_proves():
    problem = own().problem(ns.Assembly.from_cells(STACK), target=["s3"])
    shortest = ns.solve(problem, planner="exhaustive")
    assert shortest.fewest is (len(shortest.plan or ()) == 1)
    assert {ns.solve(problem, planner="backtracking", rng=s).fewest for s in range(8)} == {True, False}


def test_when_the_effort_ends_there_is_a_plan_and_no_proof():
    cells = {"foot": [(0, 0, 0)], "load": [(0, 0, 1)], "hat": [(0, 0, 2)], "far": [(5, 0, 0)]}
    problem = own().problem(ns.Assembly.from_cells(cells), target=["foot"])
    result = ns.solve(problem, planner=Fewest(effort=0))
    assert result.plan is not None
    assert result.fewest is False
    assert ns.solve(problem, budget=Budget(attempts=1)).status is ns.Status.OUT_OF_BUDGET
    with pytest.raises(ns.InputError, match="effort"):
        Fewest(effort=-1)


def test_the_fewest_actions_of_a_problem_without_a_bound():
    for goal in range(1, 9):
        line = NumberLine((1, 2, -1, 4, 3, -2), goal)
        result = Fewest().plan(line)
        best = next(n for n in range(10) if any(_reach(line, n)))
        assert (len(result.plan or ()), result.fewest) == (best, True)


def _reach(line: NumberLine, size: int) -> Iterator[bool]:
    """Whether each order of so many actions that can be done leads to the goal."""
    for order in itertools.permutations(range(len(line.actions)), size):
        state = line.initial
        for action in order:
            answer = line.attempt(state, action)
            if not isinstance(answer, Step):
                break
            state = answer.state
        else:
            yield line.is_goal(state)


def test_groups_take_a_target_out_of_its_block():
    floor = [(x, y, 0) for x in range(4) for y in range(4)]
    rim = [(x, y, 1) for x in range(4) for y in range(4) if x in (0, 3) or y in (0, 3)]
    hooks = {"p": [(1, 1, 1), (2, 1, 1), (1, 1, 2), (1, 2, 2)], "q": [(1, 2, 1), (2, 2, 1), (2, 2, 2), (2, 1, 2)]}
    assembly = ns.Assembly.from_cells({"tray": floor + rim, **hooks, "far": [(9, 9, 0)]})
    problem = own().problem(assembly, fixed=["tray"], groups=True, target=["p"])
    result = ns.solve(problem)
    assert (len(result.plan or ()), result.fewest) == (2, False)  # a split stands for several: no search proves it
    assert validate(problem, result.plan or (), result.motions)
    assert not validate(problem, (result.plan or ())[:1])
    lone = ns.solve(own().problem(assembly, fixed=["tray"], groups=True, target=["far"]))
    assert (len(lone.plan or ()), lone.fewest) == (1, True)
    sealed = [c for c in itertools.product(range(3), repeat=3) if c != (1, 1, 1)]
    boxed = ns.Assembly.from_cells({"s": sealed, "b": [(1, 1, 1)], "c": [(3, 0, 0)]})
    assert ns.solve(own().problem(boxed, groups=True, target=["b"])).status is ns.Status.UNSOLVABLE
    assert ns.solve(own().problem(boxed, target=["c"])).plan == ("c",)  # that the ball never comes out is nothing to it


def test_targets_and_parts_that_stay_together():
    shell = [c for c in itertools.product(range(3), repeat=3) if c != (1, 1, 1)]
    boxed = ns.Assembly.from_cells({"shell": shell, "ball": [(1, 1, 1)], "lid": [(1, 1, 3)]})
    result = ns.solve(own().problem(boxed, keep=[["shell", "ball"]], target=["ball"], directions="+z"))
    assert (result.plan, result.fewest) == (("lid", "shell+ball"), True)


@pytest.mark.parametrize(("options", "said"), [
    ({"target": ["s9"]}, "name of a target"),
    ({"target": "s1"}, "list of names"),
    ({"target": ["s1"], "fixed": ["s1"]}, "not fixed, to take out; 's1' is"),
])  # fmt: skip
def test_a_target_that_is_none_is_said(options: dict[str, object], said: str):
    with pytest.raises(ns.InputError, match=said):
        own().problem(ns.Assembly.from_cells(STACK), **options)


def test_the_command_line_takes_out_targets(tmp_path: Path):
    path = tmp_path / "stack.json"
    ns.Assembly.from_cells(STACK).save(path)

    def run(*arguments: object) -> str:
        return CliRunner().invoke(app, ["plan", str(path), *map(str, arguments)]).stdout

    printed = run("--target", "s1", "--target", "s2", "--directions", "+z", "--out", tmp_path / "plan.json")
    assert "3 steps; proved fewest." in printed
    assert "fewest with the prior" in printed
    document = json.loads((tmp_path / "plan.json").read_text())
    assert (document["plan"], document["fewest"]) == (["s3", "s2", "s1"], True)
    assert "not proved" in run("--target", "s0", "--planner", "backtracking", "--seed", 3, "--prior", "none")
