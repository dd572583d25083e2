"""The viewer: the film of a plan, facts, panels, planning in a thread, the page in a browser, the export."""

from __future__ import annotations

import io
import itertools
import json
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import neurosym as ns
from neurosym.cli import main
from neurosym.geometry.readers.meshes import signed_volume
from neurosym.geometry.staging import Staging, staged
from neurosym.geometry.step_motion import StepMotion, Track
from neurosym.language.options import options_of
from neurosym.planning.staging import stage
from neurosym.testing import burrs
from neurosym.viewer import panels, score_table
from neurosym.viewer.exhibit import Exhibit, Query, Search
from neurosym.viewer.export import PAUSE, SECONDS_PER_STEP, _with_panel, follower
from neurosym.viewer.facts import part_facts
from neurosym.viewer.planning import Planning, problem_maker
from neurosym.viewer.solids import solids
from neurosym.viewer.sources import open_source
from neurosym.viewer.steps import (
    AFTER,
    BECAUSE,
    BEFORE,
    FEW,
    HELD,
    MOST_COUNTED,
    MOST_REFUSALS,
    TRIED,
    attempts,
    caption,
    most_refused,
    steps,
)
from neurosym.viewer.timeline import ABSENT, APART, IN_PLACE, ON_PATH, Timeline

UP = (0.0, 0.0, 1.0)
RIGID = {"collapse": "rigid"}


def call(*arguments) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    return int(left.value.code or 0)


@pytest.fixture(scope="module")
def soma():
    problem = ns.load_domain("soma").problem(17, **RIGID)
    return problem, ns.solve(problem)


@pytest.fixture(scope="module")
def film(soma):
    problem, result = soma
    return Timeline(stage(problem, result.plan, result.motions))


@pytest.fixture(scope="module")
def exhibit():
    query = Query("soma", 17, RIGID, "best-first", "random")
    planning = Planning(problem_maker(query, {}), query)
    assert planning.wait(60)
    assert planning.message is None
    return planning.exhibit


class Slow:
    """A problem whose every attempt takes a while, and for which there is no plan."""

    def __init__(self, parts=9, seconds=0.02):
        part = ns.Type("part")
        present = ns.Fluent("present", part)
        self.asked = 0

        @ns.derived(part)
        def allowed(world, state, p):
            self.asked += 1
            time.sleep(seconds)
            return ns.Verdict(p != "p0", (), "not that one")

        p = part("p")
        remove = ns.Action("remove", p, pre=[present(p), allowed(p)], eff=[~present(p)], label="{p}")
        world = ns.Assembly.from_cells({f"p{i}": [(i, 0, 0)] for i in range(parts)})
        self.problem = ns.Domain("slow", fluents=[present], actions=[remove]).problem(
            world=world, objects={part: world.names},
            init=[present(n) for n in world.names], goal=[~present(n) for n in world.names], name="slow",
        )  # fmt: skip


# -- the film -----------------------------------------------------------------------------------------------------


def test_between_steps_each_part_is_in_the_work_or_set_down_before_it(soma, film):
    _, result = soma
    for step in range(film.n_steps + 1):
        gone = set(result.plan[:step])
        assert set(film.state_at(step)) == set(film.names) - gone
        X = film.motions(step)
        for i, name in enumerate(film.names):
            assert film.where[step, i] == (APART if name in gone else IN_PLACE)
            assert np.allclose(X[i, :3, :3], np.eye(3))
            assert np.allclose(X[i, :3, 3], 0) == (name not in gone)
    assert film.visible(3.5).all()


def test_a_part_leaves_along_the_path_of_its_step_while_the_others_rest(soma, film):
    _, result = soma
    for step, (name, motion) in enumerate(zip(result.plan, result.motions)):
        i, direction = film.names.index(name), np.asarray(motion.direction)
        others = [k for k in range(len(film.names)) if k != i]
        before, far = film.motions(step), []
        for share in np.linspace(0.01, ON_PATH, 9):
            X = film.motions(step + share)
            assert (X[others] == before[others]).all()
            assert np.allclose(np.cross(X[i, :3, 3], direction), 0)
            far.append(X[i, :3, 3] @ direction)
        assert (np.diff(far) > 0).all()
        assert far[-1] == pytest.approx(film.staging.motions[step].tracks[0].length)
        assert film.step_at(step) is None
        assert film.step_at(step + 0.5) == step


def test_a_plan_that_puts_together_is_the_film_backwards(soma, film):
    problem, result = soma
    back = result.reversed()
    reverse = Timeline(stage(problem, back, back.motions))
    assert reverse.backwards
    assert (reverse.where == film.where[::-1]).all()
    # Rows are in the order of either plan; what is in the work, or on its path, is where it was.
    for step, share in itertools.product(range(film.n_steps), (0.0, 0.2, 0.5, ON_PATH)):
        there = film.where[step] == IN_PLACE
        assert there.any()
        assert np.allclose(reverse.motions(film.n_steps - step - share)[there], film.motions(step + share)[there])


def test_the_tower_is_built_from_above():
    problem = ns.load_domain("tower").problem(5)
    result = ns.solve(problem)
    film = Timeline(stage(problem, result.plan, result.motions))
    assert (film.where[0] == APART).all()
    assert (film.where[-1] == IN_PLACE).all()
    for step in range(film.n_steps):
        heights = [film.frames(step + s)[0][step, 2] for s in np.linspace(1 - ON_PATH, 1, 7)]
        assert (np.diff(heights) < 0).all()


def test_tiles_are_laid_flat_with_their_faces_up():
    problem = ns.load_domain("scrabble").problem(5)
    result = ns.solve(problem)
    staging = stage(problem, result.plan)
    assert staging.assembly.names == result.plan
    assert set(staging.tops) == set(result.plan)
    film = Timeline(staging)
    positions = film.frames(film.n_steps)[0]
    assert np.allclose(positions[:, 1:], positions[0, 1:])
    assert (np.diff(positions[:, 0]) > 1).all()


@pytest.mark.parametrize("building", [False, True])
def test_effects_say_what_leaves_and_what_comes(building):
    part = ns.Type("part")
    present, painted, plain = (ns.Fluent(name, part) for name in ("present", "painted", "plain"))
    p = part("p")
    world = ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)], "aside": [(3, 0, 0)]})
    effect = present(p) if building else ~present(p)
    paint = ns.Action("paint", p, pre=[plain(p)], eff=[painted(p), ~plain(p)])
    move = ns.Action("move", p, pre=[~effect, ns.predicates.free(present)(p)], eff=[effect])
    init = [*(plain(n) for n in world.names), *(present(n) for n in world.names if not building or n == "aside")]
    goal = [present("low"), present("high")] if building else [~present(n) for n in world.names]

    def problem_with(action):
        domain = ns.Domain("d", fluents=[present, painted, plain], actions=[action])
        return domain.problem(world=world, objects={part: world.names}, init=init, goal=goal if action is move else [])

    problem = problem_with(move)
    result = ns.solve(problem)
    staging = stage(problem, result.plan, result.motions)
    assert {m.arrives for m in staging.motions} == {building}
    assert staging.present == (("aside",) if building else world.names)
    assert all(m.parts[0] in action for action, m in zip(staging.plan, staging.motions))
    assert not staging.guessed
    film = Timeline(staging)
    assert (film.where[-1] == (IN_PLACE if building else APART)).all()
    with pytest.raises(ns.InputError, match="in space"):
        stage(problem_with(paint), ["paint(low)"])


def test_a_group_is_set_down_as_one_and_taken_apart_there():
    cells = {"base": [(0, 0, 0)], "a": [(0, 0, 1)], "b": [(0, 0, 2)]}
    world = ns.Assembly.from_cells(cells)
    film = Timeline(staged(world, world.names, ["a", "b"], [StepMotion(("a", "b"), UP), StepMotion(("b",), UP)]))
    first, second = film.shifts[1], film.shifts[2]
    assert (first[1] == first[2]).all()
    assert first[1].any()
    assert (second[1] == first[1]).all(), "what the other was taken off stays where it is"
    assert not np.allclose(second[2], first[2])
    # The second path begins where the group was set down.
    assert np.allclose(film.motions(1.001)[2, :3, 3], first[2], atol=0.01)


def test_parts_that_make_way_are_back_in_place_afterwards():
    world = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(1, 0, 0)]})
    path, aside = np.tile(np.eye(4), (3, 1, 1)), np.tile(np.eye(4), (3, 1, 1))
    path[1:, 2, 3], aside[1:, 0, 3] = (1.0, 4.0), 0.5
    motion = StepMotion(("a",), tracks=(Track(("a",), path, np.zeros(3)), Track(("b",), aside, np.zeros(3))))
    film = Timeline(Staging(world, world.names, ("a",), (motion,)))
    assert film.motions(ON_PATH)[1, 0, 3] == pytest.approx(0.5)
    assert np.allclose(film.motions(1.0)[1], np.eye(4))
    assert film.motions(0.999)[1, 0, 3] < 0.05


def test_turning_paths_turn_the_part():
    world = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(1, 0, 0)]})
    path = np.tile(np.eye(4), (2, 1, 1))
    path[1, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    path[1, 2, 3] = 3.0
    track = Track(("a",), path, np.full(3, 0.5))
    film = Timeline(Staging(world, world.names, ("a",), (StepMotion(("a",), tracks=(track,)),)))
    turns = film.frames(ON_PATH)[1]
    assert np.allclose(turns[0], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    assert np.allclose(turns[1], [1, 0, 0, 0])
    assert np.allclose(film.frames(1.0)[1], [1, 0, 0, 0])


def test_what_leaves_and_comes_back_is_in_place_again():
    world = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(1, 0, 0)]})
    out = StepMotion(("a",), UP)
    film = Timeline(staged(world, world.names, ["out", "in"], [out, out.reversed()]))
    assert film.where[:, 0].tolist() == [IN_PLACE, APART, IN_PLACE]
    assert np.allclose(film.motions(2.0), np.eye(4))
    assert np.allclose(film.motions(1.001)[0, :3, 3], film.shifts[1, 0], atol=0.01)


def test_parts_that_were_gone_before_are_not_seen():
    problem = ns.load_domain("soma").problem(17, removed=["V"], **RIGID)
    result = ns.solve(problem)
    film = Timeline(stage(problem, result.plan, result.motions))
    gone = film.names.index("V")
    assert (film.where[:, gone] == ABSENT).all()
    assert [bool(film.visible(t)[gone]) for t in (0.0, 2.5, 6.0)] == [False] * 3


@st.composite
def removals(draw):
    """Random parts in one row a part, taken away in a random order along random axes."""
    n = draw(st.integers(2, 6))
    columns = draw(st.lists(st.integers(1, 4), min_size=n, max_size=n))
    world = ns.Assembly.from_cells({f"p{i}": [(i, 0, z) for z in range(c)] for i, c in enumerate(columns)})
    order = draw(st.permutations(world.names))
    axes = draw(st.lists(st.sampled_from([UP, (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]), min_size=n, max_size=n))
    return staged(world, world.names, order, [StepMotion((name,), axis) for name, axis in zip(order, axes)])


@settings(max_examples=25, deadline=None)
@given(removals())
def test_the_film_has_no_cuts_and_nothing_is_set_down_on_anything(staging):
    film = Timeline(staging)
    times = np.linspace(0, film.n_steps, film.n_steps * 100 + 1)
    frames = np.array([film.frames(t)[0] for t in times])
    extent = np.ptp(film.bounds(), axis=0).max()
    assert np.abs(np.diff(frames, axis=0)).max() < 0.15 * extent
    boxes = film.bounds_at_rest + film.shifts[-1][:, None]
    for a, b in itertools.combinations(boxes, 2):
        assert ((a[1] <= b[0] + 1e-9) | (b[1] <= a[0] + 1e-9)).any()
    assert np.allclose(boxes[:, 0, 2], staging.assembly.ground)
    low, high = film.bounds()
    assert (boxes[:, 0] >= low - 1e-9).all()
    assert (boxes[:, 1] <= high + 1e-9).all()


def test_many_parts_are_set_down_wide_so_that_the_work_stays_in_sight():
    world = ns.Assembly.from_cells({f"p{x}{y}": [(x, y, 0)] for x in range(7) for y in range(7)})
    film = Timeline(staged(world, world.names, world.names, [StepMotion((n,), UP) for n in world.names]))
    boxes = film.bounds_at_rest + film.shifts[-1][:, None]
    wide, deep = np.ptp(boxes[..., :2].reshape(-1, 2), axis=0)
    assert deep < 0.6 * wide


@pytest.mark.parametrize("t", [float("nan"), float("inf")])
def test_a_time_is_a_number(film, t):
    with pytest.raises(ns.InputError, match="time"):
        film.motions(t)


def test_times_beyond_the_ends_are_the_ends(film):
    assert (film.motions(-3) == film.motions(0)).all()
    assert (film.motions(99) == film.motions(film.n_steps)).all()


# -- solids -------------------------------------------------------------------------------------------------------


@settings(max_examples=30, deadline=None)
@given(st.sets(st.tuples(*[st.integers(0, 2)] * 3), min_size=1, max_size=12))
def test_a_solid_is_the_surface_of_its_cells(cells):
    (solid,) = solids(ns.Assembly.from_cells({"a": sorted(cells)}))
    assert signed_volume(solid.vertices, solid.faces) == pytest.approx(len(cells))
    steps = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    open_sides = sum(tuple(np.add(c, s)) not in cells for c in cells for s in steps)
    assert len(solid.faces) == 2 * open_sides
    # No edge of the outline lies between two squares of one plane.
    assert len(solid.outline) <= 4 * open_sides


def test_the_outline_of_a_cube_has_twelve_edges():
    (solid,) = solids(ns.Assembly.from_cells({"a": list(itertools.product(range(2), repeat=3))}))
    # Each edge of the large cube is two of the small ones'.
    assert len(solid.outline) == 24
    assert np.ptp(solid.outline.reshape(-1, 3), axis=0).tolist() == [2, 2, 2]


def test_round_things_are_outlined_at_their_sharp_edges_only():
    import trimesh

    cylinder = trimesh.creation.cylinder(radius=1, height=2, sections=40)
    (solid,) = solids(ns.Assembly.from_meshes({"a": cylinder}))
    assert len(solid.outline) == 80


# -- facts --------------------------------------------------------------------------------------------------------


def test_facts_agree_with_what_planners_ask(soma):
    problem, _ = soma
    world, there = problem.geometry, problem.world.names
    free = ns.predicates.free(next(f for f in problem.domain.fluents if f.name == "present"))
    for name in world.names:
        facts = part_facts(world, name, there)
        state = ns.language.grounding.BitState(problem.ground(), problem.ground().initial)
        verdict = free.function(world, state, name)
        assert any(e.free for e in facts.exits) == verdict.holds
        assert {b for e in facts.exits for b in e.blockers} >= set(verdict.because)
        for other in facts.touches:
            assert name in part_facts(world, other, there).touches
        for other in facts.carries:
            assert name in part_facts(world, other, there).stands_on
        assert set(facts.stands_on) | set(facts.carries) <= set(facts.touches)


def test_facts_speak_of_the_parts_that_are_there():
    world = ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)]})
    both, alone = (part_facts(world, "low", there) for there in (world.names, ("low",)))
    assert both.carries == ("high",)
    assert both.on_table
    ways = {way.direction: way for way in both.exits}
    assert ways["+z"].blockers == ("high",)
    assert ways["-z"].into_table
    assert ways["+x"].free
    assert alone.carries == alone.touches == ()
    assert not part_facts(world, "high", ("low",)).present
    with pytest.raises(ns.UnknownNameError, match="lo"):
        part_facts(world, "lo", world.names)


# -- panels -------------------------------------------------------------------------------------------------------


def test_panels_escape_what_names_hold(exhibit):
    evil = "<img src=x onerror=alert(1)>"
    search = replace(
        exhibit.search,
        steps=(evil,),
        settings=evil,
        sentence=evil,
        refusals=(refused(evil, evil, after=(evil,)), refused(evil, evil)),
    )
    scores = ns.OrderScores.uniform(1, [evil])
    world = ns.Assembly.from_cells({evil: [(0, 0, 0)], "b": [(0, 0, 1)]})
    nasty = replace(exhibit, search=search, timeline=None, notes=(evil,))
    texts = [
        panels.overview(nasty),
        steps(nasty, 0),
        caption(nasty, 0.0),
        attempts(search),
        score_table.scores_table(scores, [evil], [evil]),
        panels.facts(part_facts(world, "b", world.names)),
        panels.facts(part_facts(world, evil, world.names)),
        panels.message(evil),
        panels.options(evil, {"a": evil}),
        most_refused(replace(search, refusals=search.refusals * FEW)),
    ]
    for text in texts:
        assert "<img src=x" not in text
    assert sum("&lt;img" in text for text in texts) == len(texts) - 1  # a caption without a film names the problem
    assert follower(["</script>"] * 3, 1.0, 1.5).count("</script>") == 1


def changed(exhibit, plan, motions, guessed=(), **change):
    """`exhibit` with the steps of a plan of other motions, each in a search that found it."""
    assembly = exhibit.timeline.staging.assembly
    film = Timeline(Staging(assembly, assembly.names, tuple(plan), tuple(motions), guessed=frozenset(guessed)))
    search = replace(exhibit.search, steps=tuple(plan), refusals=())
    return replace(exhibit, timeline=film, search=replace(search, **change))


def test_ways_that_were_looked_for_are_remarked_on_once(exhibit):
    plan, motions = exhibit.timeline.staging.plan, exhibit.timeline.staging.motions
    given = steps(exhibit, None)
    assert "looked for" not in given
    without = changed(exhibit, plan, motions, range(len(plan)))
    assert steps(without, None).count("looked for") == 1
    assert "looked for" not in caption(without, 0.5)
    mixed = steps(changed(exhibit, plan, motions, [2]), None)
    assert mixed.count("looked for") == 1
    rows = [row for row in mixed.split("<li")[1:] if "data-step" in row]
    assert [" *</li>" in row for row in rows] == [i == 2 for i in range(len(motions))]


def test_what_goes_together_is_held_or_makes_way_is_said(exhibit):
    action, first = exhibit.timeline.staging.plan[0], exhibit.timeline.staging.motions[0]
    a, b, c, d = [n for n in exhibit.timeline.names if n != action][:4]
    tracks = tuple(replace(first.tracks[0], parts=parts) for parts in ((action, a, b), (c,)))
    one = changed(exhibit, [action], [replace(first, parts=(action, a, b), tracks=tracks, held=(d,))])
    said = caption(one, 0.5)
    assert f"<b>{action}, {a}, {b}</b> together leave " in said
    assert f"{c} making way" in said
    assert f">{d}</span> is held" in said
    assert f"together with {a}, {b}, {c} making way, while {d} is held" in steps(one, 0)
    tracks = tuple(replace(first.tracks[0], parts=parts) for parts in ((a, b), (c,)))
    other = caption(changed(exhibit, [action], [replace(first, parts=(a, b), tracks=tracks)]), 0.5)
    assert f"<b>{action}</b>: <b>{a}, {b}</b> together leave" in other
    assert "together" not in caption(exhibit, 0.5)


def test_a_long_list_keeps_the_step_under_way_in_sight(exhibit):
    staging = exhibit.timeline.staging
    long = changed(exhibit, staging.plan[:1] * 100, staging.motions[:1] * 100)
    assert steps(long, None).count("<li") == 100
    for now in (0, 3, 50, 97, 99):
        text = steps(long, now)
        numbers = [int(piece.split("'")[0]) for piece in text.split("data-step='")[1:]]
        assert len(numbers) == BEFORE + AFTER + 1
        assert numbers == list(range(numbers[0], numbers[-1] + 1))
        assert now in numbers
        assert f"<ol start='{numbers[0] + 1}'>" in text
        assert text.count("aria-current") == 1
        assert f"aria-current='step' data-step='{now}'" in text


def test_where_there_is_no_plan_the_panel_says_why(exhibit):
    never = {"status": ns.Status.UNSOLVABLE, "why_not": ("a blocks b", "b blocks a")}
    stuck = changed(exhibit, [], [], **never)
    assert "No plan, and no step to show" in steps(stuck, None)
    assert steps(stuck, None).count("blocks") == 2
    assert "no plan" in caption(stuck, 0.0)
    staging = exhibit.timeline.staging
    some = changed(exhibit, staging.plan[:2], staging.motions[:2], refusals=exhibit.search.refusals[:1], **never)
    assert "the longest prefix that works is shown" in steps(some, None)
    assert "tab Search" in steps(some, None)
    assert "no plan" not in caption(exhibit, 0.0)


def test_attempts_come_in_order_with_the_plan_between():
    refusals = (
        refused("b", "b is under a"),
        refused("c", "c is fixed", after=("a",)),
        refused("y", "elsewhere", after=("a", "x")),
    )
    search = make_search(("a", "b"), refusals)
    text = attempts(search)
    places = [text.index(w) for w in ("b is under a", "1. a<", "c is fixed", "elsewhere", "2. b<")]
    assert places == sorted(places)
    many = make_search((), refusals[:1] * (MOST_REFUSALS + 7))
    assert "7 more refusals" in attempts(many)


def test_of_many_refusals_those_about_the_one_looked_at_are_listed():
    many = [refused(f"a{i}", f"reason {i}.") for i in range(1, 2 * MOST_REFUSALS + 8)]
    many[-1] = refused("late", "reason late.", after=("x",))
    search = make_search(("x", "y"), tuple(many))
    for around, first, last in [(0, 1, 300), (1, 1, 300), (300, 1, 300), (301, 301, 600), (606, 601, 607)]:
        text = attempts(search, around)
        assert f"Refusals {first} to {last} of 607" in text
        assert (f"✘ {first}. " in text, f"✘ {last}. " in text) == (True, True)
        assert text.count("✘") == last - first + 1
        assert text.count("✔") == 2, "each step of the plan is listed once, on every page"
    assert attempts(search, 606).index("✔ 1.") < attempts(search, 606).index("✘ 607.")


def test_what_was_refused_most_often_is_counted():
    few = tuple(refused("a", "why") for _ in range(FEW))
    assert most_refused(make_search((), few)) == ""
    others = (refused("b", "once"), refused("a", "else"))
    text = most_refused(make_search((), few + others))
    assert f"<b>a</b> {FEW + 1}×: why" in text
    assert f"({FEW}×)" in text
    assert "<b>b</b> 1×: once</li>" in text
    assert text.index("<b>a</b>") < text.index("<b>b</b>")
    many = most_refused(make_search((), tuple(refused(f"a{i}", "r") for i in range(FEW + 10))))
    assert many.count("<li>") == MOST_COUNTED
    assert f"and {FEW + 10 - MOST_COUNTED} more actions" in many


def refused(action, reason, *, after=()):
    return ns.Rejection(reason, action=action, after=after)


def make_search(steps, refusals):
    return Search(steps, (), ns.Status.SOLVED, "", refusals, {}, "")


@pytest.mark.parametrize(("rows", "columns"), [(7, 7), (6, 98), (1, 1), (0, 3)])
def test_scores_are_cells_with_what_was_taken_ringed(rows, columns):
    rng = np.random.default_rng(0)
    names = [f"a{j}" for j in range(columns)]
    scores = ns.OrderScores(rng.normal(size=(rows, columns)), tuple(names))
    taken = [names[-1 - i] for i in range(rows)]
    text = score_table.scores_table(scores, names, taken)
    assert text.count("stroke=") == rows
    shown_columns = min(columns, score_table.MOST_COLUMNS)
    assert text.count("<title>") == rows * shown_columns
    assert ("left out" in text) == (columns > score_table.MOST_COLUMNS)
    for name in taken:
        assert f">{name}<" in text, "what was taken is never left out"


def test_interchangeable_actions_share_a_column_of_a_wide_table():
    names = [f"e{j}" for j in range(20)] + [f"o{j}" for j in range(20)]
    classes = [0] * 20 + [1] * 20
    log_prob = np.full((2, 40), -20.0)
    log_prob[0, 3] = log_prob[1, 25] = 0.0
    scores = ns.OrderScores(log_prob, tuple(names), classes=tuple(classes))
    text = score_table.scores_table(scores, names, ["e7", "o9"])
    assert text.count("<title>") == 4
    assert ">e0 +19<" in text
    # What was taken is as likely as what the prior names: ringed are the likely cells.
    assert "step 1, e0 +19: 1<" in text
    assert "step 2, o0 +19: 1<" in text
    assert text.count("stroke=") == 2
    assert "left out" not in text
    assert "share a column" in text
    few = score_table.scores_table(ns.OrderScores.uniform(2, ["a", "b"]), ["a", "b"], ["a"])
    assert "share a column" not in few


def test_large_tables_of_scores_are_pictures():
    names = [f"a{j}" for j in range(184)]
    text = score_table.scores_table(ns.OrderScores.uniform(184, names), names, names)
    assert text.startswith("<img src='data:image/png;base64,")
    assert len(text) < 20_000


def test_without_a_prior_the_panel_says_so():
    assert "without a prior" in score_table.scores_table(None, ["a"], ["a"])


# -- planning in a thread -------------------------------------------------------------------------------------------


def test_a_search_is_shown_with_its_prior_and_pictures(exhibit):
    assert exhibit.search.solved
    assert exhibit.search.scores.actions == exhibit.problem.actions
    assert exhibit.pictures.shape == (4, 64, 64, 3)
    assert exhibit.timeline.n_steps == 7
    assert exhibit.notes == ()
    counts = exhibit.search.counts
    assert counts["attempts"] >= counts["iterations"] + 7
    assert len(exhibit.search.refusals) == counts["iterations"]


@pytest.mark.parametrize("planner", ns.planner_names())
def test_a_stop_ends_every_planner(planner):
    slow = Slow()
    planning = Planning(lambda: slow.problem, Query("slow", planner=planner))
    while slow.asked < 3 and planning.running:
        time.sleep(0.01)
    planning.stop()
    assert planning.wait(5)
    if planner == "swap-repair" and planning.exhibit.search.status is ns.Status.GAVE_UP:
        return
    assert planning.exhibit.search.status is ns.Status.OUT_OF_BUDGET
    assert "Stopped" in planning.exhibit.search.sentence
    assert planning.exhibit.timeline is not None
    asked = slow.asked
    time.sleep(0.1)
    assert slow.asked == asked, "nothing goes on behind the page"


def test_progress_is_told_while_the_search_goes_on():
    slow = Slow()
    planning = Planning(lambda: slow.problem, Query("slow", planner="exhaustive"))
    while planning.progress.attempts < 3:
        time.sleep(0.01)
    now = planning.progress
    planning.stop()
    assert now.phase == "searching"
    assert now.steps == 9
    assert now.seconds > 0
    assert "attempts" in panels.progress(now, stopping=False)
    assert planning.wait(5)


def test_a_stop_before_the_search_begins_is_heeded():
    slow = Slow()

    def make():
        planning.stop()
        return slow.problem

    planning = Planning(lambda: (time.sleep(0.05), make())[1], Query("slow"))
    assert planning.wait(5)
    assert planning.exhibit is None
    assert "before" in planning.message
    assert slow.asked == 0


def test_what_is_refused_is_a_message_and_so_is_a_fault():
    def refused():
        raise ns.AssemblyError("Expected parts; got none.")

    def faulty():
        raise ZeroDivisionError("oh")

    planning = Planning(refused, Query("x"))
    planning.wait(5)
    assert planning.message == "Expected parts; got none."
    planning = Planning(faulty, Query("x"))
    planning.wait(5)
    assert planning.message == "Planning failed with an unexpected ZeroDivisionError: oh"


def test_a_budget_is_watched_by_a_function():
    seen = []
    problem = ns.load_domain("soma").problem(17)
    result = ns.solve(problem, budget=ns.Budget(watch=lambda log: seen.append(log.attempts) or len(seen) > 4))
    assert result.status is ns.Status.OUT_OF_BUDGET
    assert seen == sorted(seen)
    assert len(seen) == 5
    assert ns.Budget(watch=lambda log: False) == ns.Budget()
    assert ns.Budget(attempts=3).limits == {"seconds": None, "attempts": 3, "expansions": None}
    with pytest.raises(ns.InputError, match="watch"):
        ns.Budget(watch=True)


# -- what it is pointed at --------------------------------------------------------------------------------------------


@pytest.fixture
def plan_file(tmp_path, capsys):
    path = tmp_path / "plan.json"
    call("plan", "soma", "--problem", 17, "--collapse", "rigid", "--prior", "random", "--out", path)
    capsys.readouterr()
    return path


def test_a_plan_is_opened_as_it_was_made(plan_file):
    source = open_source(Query(str(plan_file)))
    document = json.loads(plan_file.read_text())
    exhibit = Exhibit.saved(source.saved)
    assert list(exhibit.search.steps) == document["plan"]
    assert exhibit.search.counts["iterations"] == document["iterations"]
    assert len(exhibit.search.refusals) == len(document["refusals"])
    assert exhibit.search.scores is not None
    assert not exhibit.timeline.staging.guessed
    assert (source.query.domain, source.query.number, source.query.prior) == ("soma", 17, "random")
    assert source.query.options["collapse"] == "rigid"


def test_a_plan_that_was_edited_is_not_shown_as_one_that_holds(plan_file, tmp_path):
    document = json.loads(plan_file.read_text())
    turned = {**document, "plan": document["plan"][::-1], "steps": document["steps"][::-1]}
    edited = tmp_path / "edited.json"
    edited.write_text(json.dumps(turned))
    exhibit = Exhibit.saved(open_source(Query(str(edited))).saved)
    assert not exhibit.search.solved
    assert "does not hold" in exhibit.search.sentence
    edited.write_text(json.dumps({**document, "plan": document["plan"][:2]}))
    with pytest.raises(ns.InputError, match="the same actions"):
        open_source(Query(str(edited)))


def test_a_number_does_not_go_with_a_file(plan_file):
    with pytest.raises(ns.InputError, match="it is a file or a folder"):
        open_source(Query(str(plan_file), 3))


def test_a_prior_that_is_gone_leaves_a_note(plan_file):
    document = json.loads(plan_file.read_text()) | {"prior": "gone.safetensors"}
    plan_file.write_text(json.dumps(document))
    exhibit = Exhibit.saved(open_source(Query(str(plan_file))).saved)
    assert exhibit.search.scores is None
    assert "gone.safetensors" in exhibit.notes[0]


def test_a_search_that_found_nothing_is_worth_a_look(tmp_path, capsys):
    path = tmp_path / "none.json"
    before = [part for other in "VTZABP" for part in ("--before", f"L,{other}")]
    assert call("plan", "soma", "--problem", 17, *before, "--out", path) == 11
    exhibit = Exhibit.saved(open_source(Query(str(path))).saved)
    assert exhibit.search.status is ns.Status.UNSOLVABLE
    assert exhibit.search.refusals
    assert exhibit.timeline.n_steps == 0
    assert (exhibit.timeline.where == IN_PLACE).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"refusals": None}, "plan's file"),
        ({"status": "SOLVED?"}, "plan's file"),
        ({"schema": 99}, "schema"),
        ({"domain": "nowhere"}, "nowhere"),
        ({"number": 999}, "999"),
        ({"steps": [{"action": "Q"}]}, "'Q'"),
    ],
)
def test_a_plan_that_is_none_is_refused(plan_file, change, said):
    plan_file.write_text(json.dumps(json.loads(plan_file.read_text()) | change))
    with pytest.raises(ns.InputError, match=said):
        Exhibit.saved(open_source(Query(str(plan_file))).saved)


def test_a_domain_or_a_path_and_nothing_else():
    with pytest.raises(ns.UnknownNameError, match="no file or folder"):
        open_source(Query("nowhere"))
    assert open_source(Query("soma")).query.number == 0
    with pytest.raises(ns.InputError, match=r"got 'tower'\.$"):
        open_source(Query("tower"), {"a": [(0, 0, 0)]})
    with pytest.raises(ns.InputError, match=r"got 'soma' and the number 3\.$"):
        open_source(Query("soma", 3), {"a": [(0, 0, 0)]})


def test_cells_travel_with_their_plan(tmp_path, capsys):
    cells = tmp_path / "cells.json"
    cells.write_text(json.dumps({"a": [[0, 0, 0]], "b": [[0, 0, 1]]}))
    plan = tmp_path / "plan.json"
    assert call("plan", "soma", "--cells", cells, "--out", plan) == 0
    source = open_source(Query(str(plan)))
    (name,) = source.given
    assert source.query.domain == name == "plan.json"
    again = problem_maker(replace(source.query, options=RIGID), source.given)()
    assert again.actions == ("a", "b")
    with pytest.raises(ns.InputError, match=r"among collapse, .*; got nonsense"):
        problem_maker(replace(source.query, options={"nonsense": 1}), source.given)


def test_an_assembly_can_be_planned_again_with_its_options(tmp_path):
    ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)]}).save(tmp_path / "box.json")
    source = open_source(Query(str(tmp_path / "box.json"), options={"held": 1}))
    known = options_of(source.given["box.json"])
    assert (known["held"], known["gravity"]) == (None, True)
    again = problem_maker(replace(source.query, options={"gravity": False, "directions": "+z"}), source.given)()
    assert ns.solve(again).plan == ("high", "low")
    with pytest.raises(ns.InputError, match=r"box\.json.*; got collapse"):
        problem_maker(replace(source.query, options={"collapse": "rigid"}), source.given)


def test_the_film_of_a_prefix_shows_how_its_steps_are_done(tmp_path):
    ns.Assembly.from_cells(burrs.PAIRS.cells).save(tmp_path / "pairs.json")
    query = Query(str(tmp_path / "pairs.json"), options={"groups": True}, prior="outermost-first")
    source = open_source(query)
    planning = Planning(lambda: source.problem, source.query)
    assert planning.wait(60)
    exhibit = planning.exhibit
    assert not exhibit.search.solved
    assert exhibit.search.steps
    first = exhibit.timeline.staging.motions[0]
    assert not first.arrives
    assert len(first.parts) == 2
    assert not exhibit.timeline.staging.guessed


def test_an_assembly_is_planned_as_plan_plans_it(tmp_path, capsys):
    box = ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)]})
    box.save(tmp_path / "box.json")
    page = tmp_path / "box.html"
    assert call("view", tmp_path / "box.json", "--directions", "+z", "--no-gravity", "--export", page) == 0
    text = page.read_text()
    assert "backtracking with the prior outermost-first" in text
    assert text.index(">high <") < text.index(">low <")
    # Nothing goes down through the table.
    assert call("view", tmp_path / "box.json", "--directions=-z", "--export", page) == 11
    assert "No plan, and no step to show" in page.read_text()
    assert "Nothing can be taken out" in page.read_text()


def test_a_puzzle_of_ones_own(tmp_path, capsys):
    cells = tmp_path / "cells.json"
    cells.write_text(json.dumps({"a": [[0, 0, 0]], "b": [[0, 0, 1]]}))
    page = tmp_path / "page.html"
    assert call("view", "soma", "--cells", cells, "--before", "b,a", "--export", page) == 0
    assert call("view", "soma", "--cells", cells, "--before", "a", "--export", page) == 33
    assert call("view", "tower", "--cells", cells, "--export", page) == 33


# -- the command --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        ["nowhere", "--export", "x.html"],
        ["soma", "--problem", "999", "--export", "x.html"],
        ["soma", "--planner", "none", "--export", "x.html"],
        ["soma", "--prior", "nothing", "--export", "x.html"],
        ["soma", "--option", "nonsense=1", "--export", "x.html"],
        ["soma", "--seconds", "-1", "--export", "x.html"],
        ["soma", "--export", "x.txt"],
        ["soma", "--port", "70000"],
    ],
    ids=lambda a: " ".join(a[1:-2]) or a[0],
)
def test_bad_input_is_refused_before_anything_is_served(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call("view", *arguments) == 33
    assert not list(tmp_path.iterdir())
    assert "Traceback" not in capsys.readouterr().err


def test_without_viser_the_extra_is_named(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert call("view", "soma", "--no-browser") == 33
    assert "neurosym-assembly[viewer]" in capsys.readouterr().err


def test_the_model_loads_no_viser():
    pure = (
        "timeline",
        "facts",
        "solids",
        "panels",
        "steps",
        "score_table",
        "planning",
        "sources",
    )
    names = ", ".join(f"neurosym.viewer.{name}" for name in pure)
    code = f"import sys, neurosym.cli, {names}; assert 'viser' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_forces_at_contacts_are_arrows_between_steps(exhibit):
    from neurosym.viewer.page import Page
    from neurosym.viewer.server import LocalServer

    server = LocalServer(label="neurosym")
    viewer = Page(server, Query("soma", 17))
    viewer.show(exhibit)
    assert viewer.scene._arrows is None
    viewer.forces.value = True
    points = viewer.scene._arrows.points
    assert points.shape[1:] == (2, 3)
    assert (points[:, 1, 2] >= points[:, 0, 2] - 1e-6).all()  # on whichever part each lifts
    viewer.slider.value = 0.5
    assert viewer.scene._arrows is None
    viewer.slider.value = 1.0
    assert viewer.scene._arrows is not None
    assert len(viewer.scene._arrows.points) != len(points) or (viewer.scene._arrows.points != points).any()
    viewer.forces.value = False
    assert viewer.scene._arrows is None
    viewer.close()
    server.stop()


# -- the page -----------------------------------------------------------------------------------------------------

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
ARGUMENTS = [
    "--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"
]  # fmt: skip


#: Software draws every pixel of it: a small window, and a frame or two a second, leave the processor to the tests.
SMALL = {"width": 760, "height": 420}
SELDOM = """
window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 600);
window.cancelAnimationFrame = (id) => clearTimeout(id);
"""


@pytest.fixture(scope="module")
def browser():
    if CHROMIUM is None:
        pytest.skip("no Chromium here: apt-get install chromium")
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def viewer():
    from neurosym.viewer.page import Page
    from neurosym.viewer.server import LocalServer

    server = LocalServer(label="neurosym")
    slow = Slow(parts=14, seconds=0.05)
    page = Page(server, Query("soma", 17, RIGID, "best-first", "random"), {"slow": lambda **options: slow.problem})
    yield page
    page.close()
    server.stop()


@pytest.fixture(scope="module")
def tab(browser, viewer, exhibit):
    """The page in a browser, with all that it said on its console and all that it asked for."""
    viewer.show(exhibit)
    tab = browser.new_page(viewport=SMALL)
    tab.set_default_timeout(120_000)
    tab.add_init_script(SELDOM)
    tab.errors, tab.asked = [], []
    tab.on("console", lambda m: tab.errors.append(m.text) if m.type == "error" else None)
    tab.on("pageerror", lambda e: tab.errors.append(str(e)))
    tab.on("request", lambda r: tab.asked.append(r.url))
    tab.goto(f"http://127.0.0.1:{viewer.server.get_port()}")
    tab.get_by_text("soma-17").first.wait_for()
    return tab


def until(true, seconds=120.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.02)


def field(tab, label):
    """The input beside a label. (viser's labels of text fields point nowhere.)"""
    return tab.locator(f"xpath=//label[.='{label}']/following::input[not(@type='hidden')][1]")


def test_the_page_loads_without_errors_and_asks_nobody_else(tab, viewer):
    tab.locator("canvas").first.wait_for()
    assert tab.errors == []
    assert all(u.startswith(("http://127.0.0.1", "data:", "blob:")) for u in tab.asked), tab.asked


def test_the_slider_moves_the_right_part(tab, viewer, exhibit):
    before = [part.position.copy() for part in viewer.scene.parts]
    field(tab, "Step").fill("0.5")
    field(tab, "Step").press("Enter")
    until(lambda: viewer.slider.value == 0.5)
    until(lambda: viewer._step_shown == (0, 0))
    changed = [(old != part.position).any() for old, part in zip(before, viewer.scene.parts)]
    moved = list(itertools.compress(exhibit.timeline.names, changed))
    assert moved == [exhibit.search.steps[0]]
    tab.get_by_text("Step 1 of 7").wait_for()


def test_play_goes_on_to_the_end_and_starts_over(tab, viewer):
    viewer.speed.value = "8×"
    viewer.slider.value = 6.0
    tab.get_by_role("button", name="Play").click()
    until(lambda: viewer.slider.value == 7.0)
    until(lambda: not viewer.playing)
    tab.get_by_role("button", name="Play").click()
    until(lambda: viewer.playing and 0.0 < viewer.slider.value < 7.0)
    tab.get_by_role("button", name="Pause").click()
    until(lambda: not viewer.playing)


def test_a_part_that_is_chosen_tells_its_facts(tab, viewer):
    viewer.slider.value = 0.0
    tab.get_by_role("tab", name="Part").click()
    viewer._picked("T")
    tab.get_by_text("in the way, by direction").wait_for()
    opaque = [part.opacity is None for part in viewer.scene.parts]
    assert Counter(opaque) == {False: 6, True: 1}
    viewer._picked("(no part)")
    assert all(part.opacity is None for part in viewer.scene.parts)


def test_the_prior_and_the_search_are_there_to_read(tab, viewer, exhibit):
    tab.get_by_role("tab", name="Prior").click()
    tab.locator("svg rect[stroke]").first.wait_for()
    assert tab.locator("svg rect[stroke]").count() == 7
    assert tab.locator(".ns img").count() == 4
    tab.get_by_role("tab", name="Search").click()
    tab.get_by_text(exhibit.search.refusals[0].reason).first.wait_for()


def test_parts_are_seen_in_their_own_colours(tab, viewer, exhibit):
    viewer.show(exhibit)
    viewer.names.value = False
    viewer.slider.value = 7.0  # all parts are set down, and each is seen
    own = [np.array(part.color, dtype=float) for part in viewer.scene.parts]

    def off():
        """For each part, how far its nearest point is from its colour, of 255; and how many of all are pale."""
        picture = Image.open(io.BytesIO(tab.locator("canvas").first.screenshot())).convert("RGB")
        seen = np.asarray(picture, dtype=float).reshape(-1, 3)
        chroma = np.ptp(seen, axis=1)
        coloured = chroma > 30  # the ground and the lines are not
        pale = float((chroma < 0.28 * seen.max(axis=1))[coloured].mean()) if coloured.any() else 1.0
        return max(float(np.abs(seen - colour).max(axis=1).min()) for colour in own), pale

    until(lambda: np.less(off(), (40, 0.03)).all())
    viewer.slider.value = 0.0


def test_what_is_held_has_a_bold_outline_while_the_step_is_done(viewer, exhibit):
    plan, motions = exhibit.timeline.staging.plan, exhibit.timeline.staging.motions
    held = plan[-1]
    viewer.show(changed(exhibit, plan, [replace(motions[0], held=(held,)), *motions[1:]]))
    outlines = viewer.scene._outlines
    usual = {name: outline.thickness for name, outline in outlines.items()}
    viewer.scene.show(0.5)
    assert (outlines[held].colors == HELD).all()
    assert {n for n, outline in outlines.items() if outline.thickness > usual[n]} == {held}
    viewer.scene.show(1.5)
    assert {name: outline.thickness for name, outline in outlines.items()} == usual
    assert len({tuple(outline.colors.reshape(-1, 3)[0]) for outline in outlines.values()}) == 1
    viewer.show(exhibit)


def test_a_refusal_shows_what_stood_in_the_way(viewer, exhibit):
    viewer.show(exhibit)
    refusal = exhibit.search.refusals[0]
    own = dict(zip(exhibit.timeline.names, [tuple(part.color) for part in viewer.scene.parts]))
    viewer.refusal.value = 1
    colours = dict(zip(exhibit.timeline.names, [tuple(part.color) for part in viewer.scene.parts]))
    assert {n for n, c in colours.items() if c == TRIED} == {refusal.action}
    assert {n for n, c in colours.items() if c == BECAUSE} == set(refusal.because) - {refusal.action}
    assert refusal.reason in viewer.refusal_text.content
    if exhibit.search.steps[: len(refusal.after)] == refusal.after:
        assert viewer.slider.value == len(refusal.after)
    viewer._clicked("T")
    assert viewer.refusal.value == 0
    viewer._clicked("T")
    assert viewer.part.value == "(no part)"
    assert dict(zip(exhibit.timeline.names, [tuple(part.color) for part in viewer.scene.parts])) == own


def test_what_cannot_be_built_up_is_faint(viewer, exhibit):
    cells = {"foot": [(0, 0, 0)], "left": [(2, 0, 0), (2, 0, 1), (3, 0, 1), (4, 0, 1)]}
    cells["right"] = [(7, 0, 0), (7, 0, 1), (6, 0, 1), (5, 0, 1)]
    problem = ns.load_domain("assembly").problem(ns.Assembly.from_cells(cells, friction=0.9))
    result = ns.solve(problem, side="empty")
    shown = Exhibit.of(problem, Search.of(result, Query("assembly"), None))
    assert shown.buildable == ("foot",)
    viewer.show(shown)
    assert [part.opacity is None for part in viewer.scene.parts] == [True, False, False]
    viewer._clicked("left")
    viewer._clicked("left")
    assert [part.opacity is None for part in viewer.scene.parts] == [True, False, False]
    assert "Faint in the view" in viewer.plan_tab.content
    viewer.show(exhibit)
    assert {part.opacity for part in viewer.scene.parts} == {None}


def test_a_late_click_on_what_was_shown_before_changes_nothing(viewer, exhibit):
    viewer.show(exhibit)
    viewer._clicked("no longer there")
    assert viewer.part.value == "(no part)"
    assert {part.opacity for part in viewer.scene.parts} == {None}


def test_bad_input_shows_a_message(tab, viewer):
    tab.get_by_role("tab", name="Plan again").click()
    for number, said in (("nonsense", "whole number"), ("999", "0 to 239")):
        field(tab, "Problem").fill(number)
        until(lambda number=number: viewer.form.number.value == number)
        tab.get_by_role("button", name="Plan again").click()
        tab.get_by_role("alert").get_by_text(said).wait_for()
    assert "Traceback" not in tab.content()
    assert viewer.exhibit.problem.name == "soma-17", "what was shown stays"


def test_one_can_plan_again(tab, viewer):
    tab.get_by_role("tab", name="Plan again").click()
    field(tab, "Problem").fill("3")
    until(lambda: viewer.form.number.value == "3")
    tab.get_by_role("button", name="Plan again").click()
    until(lambda: viewer.exhibit.problem.name == "soma-3")
    tab.get_by_text("soma-3").first.wait_for()
    assert viewer.slider.value == 0.0
    assert len(viewer.scene.parts) == 7


def test_another_domain_brings_its_own_options(tab, viewer):
    form = viewer.form
    tab.get_by_role("tab", name="Plan again").click()
    form.domain.value = "soma"
    form.number.value, form.options.value = "5", "collapse=rigid"
    form.domain.value = "tower"
    until(lambda: form.options.value == "")
    assert form.number.value == "0"
    tab.get_by_text("tower takes").get_by_text("variant").wait_for()
    assert viewer.form.asked().options == {}
    form.options.value = "collapse=rigid"
    tab.get_by_role("button", name="Plan again").click()
    tab.get_by_role("alert").get_by_text("Expected options of 'tower' among variant").wait_for()
    form.options.value = ""
    form.domain.value = "slow"
    until(lambda: form.number.disabled)
    assert form.number.value == ""
    form.domain.value = "soma"
    until(lambda: form.options.value == "collapse=rigid")
    assert form.number.value == "5"
    assert not form.number.disabled
    tab.get_by_text("soma takes").get_by_text("collapse").wait_for()


def test_stop_ends_a_search(tab, viewer):
    tab.get_by_role("tab", name="Plan again").click()
    viewer.form.domain.value, viewer.form.options.value, viewer.form.planner.value = "slow", "", "exhaustive"
    tab.get_by_role("button", name="Plan again").click()
    until(lambda: viewer.planning is not None and viewer.planning.progress.attempts > 2)
    planning = viewer.planning
    with pytest.raises(ns.InputError, match="one search at a time"):
        viewer.plan(viewer.query)
    tab.get_by_role("button", name="Stop").click()
    assert planning.wait(5)
    until(lambda: viewer.exhibit.problem.name == "slow")
    tab.get_by_text("Stopped").locator("visible=true").first.wait_for()
    assert tab.errors == []


def test_what_cannot_be_shown_is_said_and_the_page_goes_on(exhibit, monkeypatch, caplog):
    from neurosym.viewer.page import Page
    from neurosym.viewer.server import LocalServer

    server = LocalServer()
    page = Page(server, Query("soma", 17))
    try:
        with monkeypatch.context() as patch:
            patch.setattr(panels, "pictures", lambda views: 1 / 0)
            page.plan(page.query)
            until(lambda: "cannot be shown: ZeroDivisionError" in page.form.message.content)
        assert "What was planned cannot be shown." in caplog.text
        page.plan(page.query)
        until(lambda: page.exhibit is not None and page.planning is None)
        page.play.label = "Play"
        page._toggle()
        until(lambda: page.slider.value > 0)
    finally:
        page.close()
        server.stop()


def test_while_the_first_search_goes_on_the_page_shows_the_parts_and_how_far_it_is():
    from neurosym.viewer.page import Page
    from neurosym.viewer.server import LocalServer

    slow = Slow(parts=14, seconds=0.05)
    server = LocalServer()
    page = Page(server, Query("slow", planner="exhaustive"), {"slow": lambda **options: slow.problem})
    try:
        assert page.slider.disabled
        assert page.play.disabled
        page.plan(page.query, slow.problem)
        until(lambda: "attempts" in page.caption.content)
        assert page.exhibit is None
        assert len(page.scene.parts) == 14
        assert all(part.visible for part in page.scene.parts)
        page._clicked("p0")  # nothing is known of it yet
        assert page.part.value == "(no part)"
        until(lambda: page.planning.progress.depth > 0)
        page._stop()
        until(lambda: page.planning is None)
        until(lambda: not page.slider.disabled)
        page.exhibit = None
        page.plan(replace(page.query, domain="soma", number=999))
        until(lambda: "0 to 239" in page.caption.content)
    finally:
        page.close()
        server.stop()


def test_nobody_can_ask_for_a_tunnel(viewer):
    assert viewer.server.request_share_url() is None
    assert viewer.server.get_host() == "127.0.0.1"


@pytest.mark.parametrize(
    ("origin", "heard"),
    [
        ("http://evil.example", False),
        ("http://127.0.0.1.evil.example:{port}", False),
        ("http://localhost:{port}", True),
        ("http://localhost:1", False),
    ],
)
def test_pages_of_other_sites_are_not_heard(viewer, origin, heard):
    import viser
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    address = f"ws://127.0.0.1:{viewer.server.get_port()}"
    origin = origin.format(port=viewer.server.get_port())
    settings = {"origin": origin, "subprotocols": [f"viser-v{viser.__version__}"], "compression": None}
    if heard:
        with connect(address, **settings) as socket:
            assert socket.recv(timeout=10)
        return
    with pytest.raises(InvalidStatus, match="403"):
        connect(address, **settings)


def test_the_command_serves_until_the_keyboard_ends_it():
    command = [sys.executable, "-m", "neurosym.cli", "view", "soma", "--problem", "17", "--no-browser", "--port", "0"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # Where the tests themselves run in the background, interrupts are ignored, and by what they start, too.
    heard = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    with subprocess.Popen(command, **pipes, **heard) as process:
        try:
            address = process.stdout.readline().split()[0]
            with urllib.request.urlopen(address, timeout=30) as page:
                assert b'<div id="root">' in page.read()
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert address.startswith("http://127.0.0.1:")
    assert (process.returncode, out, err) == (0, "Ended.\n", "")


# -- the export ---------------------------------------------------------------------------------------------------


def test_the_exported_page_plays_without_server_and_network(browser, plan_file, tmp_path, capsys):
    page = tmp_path / "out" / "film.html"
    assert call("view", plan_file, "--export", page) == 0
    assert [p.name for p in page.parent.iterdir()] == ["film.html"], "no half-written file is left beside it"
    context = browser.new_context(viewport=SMALL, offline=True)
    asked, errors = [], []
    tab = context.new_page()
    tab.set_default_timeout(120_000)
    tab.add_init_script(SELDOM)
    tab.on("request", lambda r: asked.append(r.url))
    tab.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
    tab.on("pageerror", lambda e: errors.append(str(e)))
    tab.route("**/*", lambda r: r.continue_() if r.request.url.startswith(("file:", "data:", "blob:")) else r.abort())
    tab.goto(page.as_uri())
    clock = tab.locator("#root input").first
    clock.wait_for()
    first = float(clock.input_value())
    until(lambda: float(clock.input_value()) > first)
    tab.locator("#said").get_by_text("A plan was found.").wait_for()
    plan = json.loads(plan_file.read_text())["plan"]
    now = tab.locator("#steps li[aria-current]")
    for step in (4, 1):
        tab.locator(f"#steps li[data-step='{step}']").click()
        start = f"{PAUSE + step * SECONDS_PER_STEP:.1f}"
        until(lambda start=start: clock.input_value() == start)
        until(lambda step=step: now.count() == 1 and now.get_attribute("data-step") == str(step))
        assert tab.locator("#now").inner_text().startswith(f"Step {step + 1} of 7: {plan[step]} leaves")
    # Somebody moves the player's clock, or the film goes on: the list follows.
    clock.fill(f"{PAUSE + 6.5 * SECONDS_PER_STEP:.1f}")
    until(lambda: now.count() == 1 and now.inner_text().startswith(plan[6]))
    clock.fill("0.2")
    until(lambda: now.count() == 0)
    assert "before the first" in tab.locator("#now").inner_text()
    assert tab.title() == "soma-17"
    assert errors == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in asked), asked
    context.close()


@pytest.mark.parametrize("player", ["<p>something else</p>", "<input value='soon'>", "<input value=''>"])
def test_the_list_stays_a_list_where_the_player_is_another(browser, exhibit, player, tmp_path):
    page = tmp_path / "page.html"
    page.write_text(_with_panel(f"<html><body><div id='root'>{player}</div></body></html>", exhibit))
    tab = browser.new_page()
    errors = []
    tab.on("pageerror", lambda e: errors.append(str(e)))
    tab.goto(page.as_uri())
    tab.locator("#steps li").nth(3).click()
    tab.wait_for_timeout(300)
    assert tab.locator("#steps li[aria-current]").count() == 0
    assert not tab.locator(".hint").is_visible()
    assert errors == []
    # The same page follows a field that tells seconds.
    tab.locator("#root").evaluate(f"(root) => {{ root.innerHTML = '<input value={PAUSE + 2.5 * SECONDS_PER_STEP}>' }}")
    tab.locator("#steps li[aria-current]").wait_for()
    assert tab.locator("#steps li[aria-current]").get_attribute("data-step") == "2"
    assert tab.locator(".hint").is_visible()
    tab.close()


def test_an_export_that_fails_leaves_nothing(exhibit, tmp_path):
    from neurosym.viewer.export import export_page

    with pytest.raises(ns.InputError, match="in space"):
        export_page(replace(exhibit, timeline=None, notes=("no parts",)), tmp_path / "x.html")
    assert not list(tmp_path.iterdir())
