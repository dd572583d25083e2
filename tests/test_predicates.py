"""Ready-made predicates: verdicts with evidence, and the fifteen-line domain of the documentation."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import neurosym as ns
from neurosym.geometry.step_motion import StepMotion
from neurosym.testing.domains import check_problem

part = ns.Type("part")
present = ns.Fluent("present", part)
p = part("p")

BOX_WITH_LID = {
    "box": [(x, y, z) for x, y, z in itertools.product(range(3), range(3), range(2)) if (x, y, z) != (1, 1, 1)],
    "ball": [(1, 1, 1)],
    "lid": [(x, y, 2) for x, y in itertools.product(range(3), range(3))],
}


def take_apart(cells, *, pre=None, **options):
    conditions = pre or [present(p), ns.predicates.free(present)(p), ns.predicates.stable_without(present)(p)]
    remove = ns.Action("remove", p, pre=conditions, eff=[~present(p)], label="{p}")
    world = ns.Assembly.from_cells(cells)
    options = {"init": [present(n) for n in world.names], "goal": [~present(n) for n in world.names], **options}
    return ns.Domain("take-apart", fluents=[present], actions=[remove]).problem(
        world=world, objects={part: world.names}, **options
    )


def ask(predicate, problem, *args):
    """A predicate's verdict in the initial state of a problem, by its tables and asked anew."""
    from neurosym.language.grounding import BitState

    ground = problem.ground()
    state = BitState(ground, ground.initial)
    quick = predicate.function(problem.geometry, state, *args)
    slow = predicate.function(problem.geometry.anew(), state, *args)
    assert quick.holds == slow.holds
    assert set(quick.because) == set(slow.because)
    return quick


def test_free_says_who_blocks_and_in_which_directions():
    problem = take_apart(BOX_WITH_LID)
    free = ns.predicates.free(present)
    blocked = ask(free, problem, "ball")
    assert not blocked
    assert set(blocked.because) == {"box", "lid"}
    assert "+z: lid" in blocked.reason
    assert "+x: box" in blocked.reason
    assert "-z: the table" in blocked.reason
    open_ = ask(free, problem, "lid")
    assert open_.holds
    assert open_.motion.direction == (0.0, 0.0, 1.0)
    assert "+z" in open_.reason


def test_a_part_that_only_the_table_blocks_is_blocked_for_good():
    problem = take_apart({"a": [(0, 0, 0)], "b": [(1, 0, 0)]})
    down = ns.predicates.free(present, directions=[(0, 0, -1)])
    verdict = ask(down, problem, "a")
    assert not verdict
    assert verdict.until == ()
    assert ask(ns.predicates.free(present, directions=[(0, 0, -1)], table=False), problem, "a").holds


def test_one_blocker_a_direction_keeps_the_promise():
    problem = take_apart(BOX_WITH_LID)
    verdict = ask(ns.predicates.free(present), problem, "ball")
    assert set(verdict.until) == {present("box"), present("lid")}
    assert ask(ns.predicates.free(present, removal=False), problem, "ball").until is None


def test_interlocked_means_that_no_single_part_is_free():
    interlocked = ns.predicates.interlocked(present)
    loose = take_apart(BOX_WITH_LID)
    assert not ask(interlocked, loose)
    assert ask(interlocked, loose).because == ("lid",)
    # Without their lid's way up (directions sideways only) nothing can leave the box, nor the box itself.
    sideways = ns.predicates.interlocked(present, directions=np.concatenate([np.eye(3)[:2], -np.eye(3)[:2]]))
    stuck = take_apart({k: v for k, v in BOX_WITH_LID.items() if k != "lid"})
    assert ask(sideways, stuck).holds


def test_supported_names_what_carries_and_what_was_lost():
    cells = {"base": [(0, 0, 0), (1, 0, 0)], "top": [(0, 0, 1)], "side": [(2, 0, 0)]}
    supported = ns.predicates.supported(present)
    assert ask(supported, take_apart(cells), "top").because == ("base",)
    assert ask(supported, take_apart(cells), "side").because == ("the table",)
    lost = ask(supported, take_apart(cells, init=[present("top"), present("side")]), "top")
    assert not lost
    assert lost.because == ("base",)
    assert lost.until == ()


def test_stable_without_names_what_falls_and_what_it_loses():
    cells = {"left": [(0, 0, 0)], "right": [(2, 0, 0)], "beam": [(0, 0, 1), (1, 0, 1), (2, 0, 1)]}
    problem = take_apart(cells)
    verdict = ask(ns.predicates.stable_without(present), problem, "left")
    assert not verdict
    assert verdict.because == ("beam",)
    assert verdict.until == (present("beam"),)
    assert "beam loses left" in verdict.reason
    assert ask(ns.predicates.stable_without(present), problem, "beam").holds


def test_the_domain_of_the_documentation_plans():
    problem = take_apart(BOX_WITH_LID)
    result = ns.solve(problem)
    assert result.plan == ("lid", "ball", "box")
    assert (result.motions[0].parts, result.motions[0].direction) == (("lid",), (0.0, 0.0, 1.0))
    check_problem(problem)
    wrong = ns.validate(problem, ["ball"])
    assert (wrong.ok, wrong.failed_at) == (False, 0)
    assert "blocked in every direction" in wrong.reason


def test_putting_together_is_taking_apart_backwards():
    """Insertion is removal reversed: placed parts must be reachable along a straight line, and stand."""

    @ns.derived(part)
    def can_be_put(world, state, name):
        graph = world.blocking()
        there = state.mask(present, world.names)
        number = world.index[name]
        reachable = graph.free_directions(number, there)
        stands = world.stability.standing(there | 1 << number)
        return ns.Verdict(bool(reachable) and stands.stands, (), f"{name} does not fit here yet.")

    place = ns.Action("place", p, pre=[~present(p), can_be_put(p)], eff=[present(p)], label="{p}")
    world = ns.Assembly.from_cells(BOX_WITH_LID)
    build = ns.Domain("build", fluents=[present], actions=[place]).problem(
        world=world, objects={part: world.names}, init=[], goal=[present(n) for n in world.names]
    )
    plans = set(ns.load_planner("exhaustive").all_plans(build.ground()))
    taken = set(ns.load_planner("exhaustive").all_plans(take_apart(BOX_WITH_LID).ground()))
    assert plans == {tuple(reversed(order)) for order in taken}


def test_a_direction_becomes_the_motion_of_the_parts_that_the_action_takes_or_brings():
    def along(direction):
        return ns.derived(part)(lambda world, state, name: ns.Verdict(True, motion=direction))(p)

    cells = {"low": [(0, 0, 0)], "high": [(0, 0, 1)]}
    hand = ns.derived(part)(lambda world, state, name: ns.Verdict(True, motion=StepMotion(held=("low",))))(p)
    removed = take_apart(cells, pre=[present(p), hand, along([0, 0, 2])]).ground()
    step = removed.attempt(removed.initial, removed.actions.index("high"))
    assert step.motion == StepMotion(("high",), (0.0, 0.0, 1.0), held=("low",))
    place = ns.Action("place", p, pre=[~present(p), along(np.array([0, 0, 1]))], eff=[present(p)], label="{p}")
    world = ns.Assembly.from_cells(cells)
    placed = ns.Domain("build", fluents=[present], actions=[place]).problem(
        world=world, objects={part: world.names}, init=[], goal=[present("low")]
    )
    assert ns.solve(placed).motions == (StepMotion(("low",), (0.0, 0.0, -1.0), arrives=True),)
    for wrong in ("up", (0, 0), (0, 0, 0), [[1, 0, 0]]):
        search = take_apart(cells, pre=[present(p), along(wrong)]).ground()
        with pytest.raises(ns.ContractError, match="a StepMotion as motion, or with a direction of three numbers"):
            search.attempt(search.initial, 0)


@pytest.mark.parametrize("wrong", ["present", ns.Fluent("pair", part, part), None])
def test_a_predicate_wants_the_fluent_of_one_part(wrong):
    with pytest.raises(ns.DefinitionError, match="fluent of one part"):
        ns.predicates.free(wrong)
