"""The tower family: facts recomputed, geometry against PyBullet, matching, promises, pictures, demonstrations."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurosym as ns
from domains.tower_blocks import COLOURS, Block, ReferenceTower
from domains.tower_demonstrations import shares
from domains.tower_pictures import SETTINGS, draw_offsets
from domains.tower_variants import VARIANTS, colours_of, sequence_numbers, sequences, towers
from neurosym.cli import main
from neurosym.simulation import stands
from neurosym.testing.domains import check_domain, check_problem

tower = ns.load_domain("tower")


@pytest.fixture(autouse=True, scope="module")
def _own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NEUROSYM_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def attempt(problem, name, done=()):
    """What the oracle says of a block after others were placed."""
    search = problem.ground()
    state = search.initial
    for earlier in done:
        step = search.attempt(state, search.actions.index(earlier))
        assert isinstance(step, ns.Step), step
        state = step.state
    return search.attempt(state, search.actions.index(name))


# -- facts and numbers ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("fact", tower.known_facts())
def test_known_facts_are_recomputed(fact):
    published, recompute = tower.known_facts()[fact]
    assert recompute() == published


def test_counts_by_formula():
    falling = [math.factorial(6) // math.factorial(6 - height) for height in range(2, 7)]
    assert len(towers("heights")) == sum(falling)
    assert len(sequences("colours")) == math.factorial(6) // 2**3
    for variant in VARIANTS:
        assert len(set(towers(variant))) == len(towers(variant))
        of = sequence_numbers(variant)
        assert all(sequences(variant)[of[n]] == colours_of(variant, n) for n in range(0, len(of), 37))


@pytest.mark.parametrize("by", ["tower", "sequence"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_splits_never_overlap(variant, by):
    for split in range(3):
        train, test = (tower.numbers(part, split=split, variant=variant, by=by) for part in ("train", "test"))
        assert sorted((*train, *test)) == list(tower.numbers("all", variant=variant))
        assert len(train) == pytest.approx(2 * len(test), rel=0.1)
        if by == "sequence":
            assert not {colours_of(variant, n) for n in train} & {colours_of(variant, n) for n in test}
        assert train == tower.numbers("train", split=split, variant=variant, by=by)
        assert train != tower.numbers("train", split=split + 1, variant=variant, by=by)
        assert list(train) != sorted(train), "the first n are a random sample"


@pytest.mark.parametrize("by", ["tower", "sequence"])
def test_a_tower_of_two_variants_is_in_the_same_part_of_both(by):
    for split in range(2):
        tall = {towers("heights")[n] for n in tower.numbers("train", split=split, variant="heights", by=by)}
        tested = {towers("colours")[n] for n in tower.numbers("test", split=split, variant="colours", by=by)}
        assert not tall & tested
        assert len([order for order in tall if len(order) == 6]) == 480


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"number": 720}, "0 to 719"),
        ({"number": -1}, "0 to 719"),
        ({"number": "3"}, "0 to 719"),
        ({"number": 1950, "variant": "heights"}, "0 to 1949"),
        ({"variant": "sizes"}, "colours, heights, unique"),
        ({"pictures": "pretty"}, "easy"),
        ({"offsets": [(0, 0)]}, "offsets"),
        ({"offsets": [(0, math.nan)] * 6}, "finite"),
        ({"placed": ["green"]}, "red-1"),
        ({"placed": ["blue-1"]}, "level 1 asks for red"),
        ({"placed": ["red-1", "red-1"]}, "different"),
        ({"placed": ["red-1", "red-2"], "offsets": [(0.6 * i, 0) for i in range(6)]}, "would fall"),
    ],
)
def test_bad_requests_are_refused_with_the_reason(asked, says):
    with pytest.raises(ns.InputError, match=re.escape(says)):
        tower.problem(**asked)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Block("a", "pink"), "colour"),
        (lambda: Block("a", "red", (1, 0, 1)), "above 0"),
        (lambda: ReferenceTower.of([Block("a", "red")], []), "at least one"),
        (lambda: ReferenceTower.of([Block("a", "red")], ["b"]), "block"),
        (lambda: ReferenceTower.of([Block("a", "red")], ["a", "a"]), "one level"),
        (lambda: ReferenceTower.of([Block("a", "red"), Block("a", "blue")], ["a"]), "once"),
        (lambda: tower.numbers("some"), "part"),
        (lambda: tower.numbers(by="block"), "split"),
        (lambda: tower.numbers(split=-1), "0 or more"),
        (lambda: tower.demonstrations(count=0), "count"),
        (lambda: tower.demonstrations(recipe="none", count=1), "recipe"),
    ],
)
def test_bad_towers_and_parts_are_refused(make, says):
    with pytest.raises(ns.InputError, match=says):
        make()


# -- rules ----------------------------------------------------------------------------------------------------


def test_only_blocks_that_match_the_level_are_placed():
    problem = tower.problem(5)
    assert problem.details["colours"] == ("red", "red", "yellow", "blue", "blue", "yellow")
    refused = attempt(problem, "blue-1", ["red-2"])
    assert refused.reason == "Level 2 of the reference is red, blue-1 is blue."
    assert refused.because == ("red-1",), "what would match"
    assert isinstance(attempt(problem, "red-1", ["red-2"]), ns.Step)
    order = ["red-2", "red-1", "yellow-2", "blue-1", "blue-2", "yellow-1"]
    assert ns.validate(problem, order).ok
    wrong = ns.validate(problem, [*order[:2], "blue-1"])
    assert (wrong.ok, wrong.failed_at) == (False, 2)
    short = ns.validate(problem, order[:5])
    assert (short.ok, short.failed_at, short.because) == (False, 5, ("yellow-1",))
    assert "5 of 6 levels" in short.reason


def test_a_block_placed_again_demolishes_the_tower():
    problem = tower.problem(5)
    again = attempt(problem, "red-1", ["red-1"])
    assert "demolish" in again.reason
    assert again.because == ("red-1",)
    assert again.until == (problem.actions.index("red-1"),), "for good"
    assert not ns.validate(problem, ["red-1", "red-1"]).ok


def test_a_lower_tower_is_finished_before_all_blocks_are_placed():
    number = towers("heights").index((0, 2))
    problem = tower.problem(number, variant="heights")
    assert len(problem.actions) == 6
    assert ns.validate(problem, ["red-2", "yellow-1"]).ok
    assert "all its 2 levels" in attempt(problem, "blue-1", ["red-1", "yellow-1"]).reason
    for planner in ("backtracking", "best-first"):
        assert len(ns.solve(problem, planner=planner, prior="uniform").plan) == 2
    assert ns.count_plans(problem) == 1, "up to blocks of one colour"


def test_classes_are_colour_and_size():
    assert tower.problem(0).classes == (0, 0, 2, 2, 4, 4)
    assert tower.problem(0, variant="unique").classes == tuple(range(6))
    blocks = [Block("a", "red"), Block("b", "red", (2, 1, 1)), Block("c", "red"), Block("d", "blue")]
    problem = tower.problem_from_blocks(blocks, ["b", "a", "d"])
    assert problem.classes == (0, 1, 0, 3)
    assert "size (2.0, 1.0, 1.0), a has size (1.0, 1.0, 1.0)" in attempt(problem, "a").reason
    assert ns.validate(problem, ["b", "c", "d"]).ok


def test_a_tower_that_stands_in_part():
    problem = tower.problem(5, placed=["red-2", "red-1", "yellow-1"])
    assert problem.actions == ("yellow-2", "blue-1", "blue-2")
    assert ns.solve(problem).plan[-1] == "yellow-2"
    check_problem(problem)
    scores = ns.load_prior("uniform").scores([tower.problem(5)])[0]
    assert len(ns.solve(problem, planner="best-first", prior=scores).plan) == 3


def test_precedence_is_obeyed():
    problem = tower.problem(5, before=[("red-2", "red-1")])
    assert ns.solve(problem).plan[:2] == ("red-2", "red-1")
    circle = tower.problem(5, before=[("blue-1", "red-1"), ("blue-2", "red-2")])
    assert ns.solve(circle).status is ns.Status.UNSOLVABLE


# -- geometry -------------------------------------------------------------------------------------------------


def test_a_block_outside_the_support_topples_the_tower():
    steps = [(0.3 * i, 0.0) for i in range(6)]
    problem = tower.problem(5, offsets=steps)
    assert not stands(problem.world.assembly, present=["level 1", "level 2", "level 3"])
    refused = attempt(problem, "blue-2", ["red-1", "red-2", "yellow-2"])
    assert "on level 4 the tower topples" in refused.reason
    assert "blue-2" in refused.because
    result = ns.solve(problem)
    assert result.status is ns.Status.UNSOLVABLE
    assert len(result.best_prefix) == 3
    assert any("topples" in r.reason for r in result.blame)


def test_a_heavy_foot_carries_what_a_small_one_does_not():
    for width, solved in ((1.0, False), (3.0, True)):
        blocks = [Block("foot", "blue", (width, 1, 1)), Block("beam", "red", (3, 1, 1))]
        problem = tower.problem_from_blocks(blocks, ["foot", "beam"], offsets=[(0, 0), (0.8, 0)])
        assert ns.solve(problem).solved is solved


def test_a_counterweight_comes_too_late():
    """The finished tower would stand, but not the one without its last block: every level is asked about."""
    blocks = [Block("foot", "blue"), Block("beam", "red", (4, 1, 1)), Block("weight", "green", (1, 1, 4))]
    problem = tower.problem_from_blocks(blocks, ["foot", "beam", "weight"], offsets=[(0, 0), (1, 0), (-0.7, 0)])
    assert not problem.world.falling(3)
    assert not stands(problem.world.assembly)
    assert ns.solve(problem).best_prefix == ("foot",)


def margin(sizes, offsets) -> list[float]:
    """For each height, how far inside its support the least stable joint is: the lever rule, without any program."""
    sizes, offsets = np.asarray(sizes), np.asarray(offsets)
    weights = sizes.prod(axis=1)
    found = []
    for height in range(1, len(sizes) + 1):
        least = math.inf
        for joint in range(1, height):
            centre = np.average(offsets[joint:height], axis=0, weights=weights[joint:height])
            low = np.maximum(*(offsets[i] - sizes[i, :2] / 2 for i in (joint - 1, joint)))
            high = np.minimum(*(offsets[i] + sizes[i, :2] / 2 for i in (joint - 1, joint)))
            least = min(least, *(centre - low), *(high - centre))
        found.append(least)
    return found


def untidy(rng, n, spread=0.35):
    sizes = np.round(rng.uniform(0.7, 1.5, (n, 3)), 3)
    return sizes, np.round(np.cumsum(rng.uniform(-spread, spread, (n, 2)), axis=0), 3)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6))
def test_geometry_agrees_with_the_lever_rule(seed):
    sizes, offsets = untidy(np.random.default_rng(seed), 5)
    blocks = [Block(f"b{i}", "red", tuple(size)) for i, size in enumerate(sizes)]
    world = ReferenceTower.of(blocks, [b.name for b in blocks], offsets)
    for height, inside in enumerate(margin(sizes, offsets), 1):
        if abs(inside) > 0.03:
            assert bool(world.falling(height)) == (inside < 0)


def test_geometry_agrees_with_pybullet():
    rng = np.random.default_rng(0)
    falls = []
    while len(falls) < 30:
        sizes, offsets = untidy(rng, 4, 0.5)
        if abs(margin(sizes, offsets)[-1]) < 0.04:
            continue  # so nearly balanced that it takes longer than a second to fall
        blocks = [Block(f"b{i}", "red", tuple(size)) for i, size in enumerate(sizes)]
        world = ReferenceTower.of(blocks, [b.name for b in blocks], offsets)
        falls.append(bool(world.falling(4)))
        assert bool(stands(world.assembly)) is falls[-1], (sizes, offsets)
    assert 5 < sum(falls) < 25


def test_untidy_references_stand_at_every_height():
    for seed in range(40):
        offsets = draw_offsets("hard", 6, seed)
        assert min(margin(np.ones((6, 3)), offsets)[1:]) > 0.1
        world = tower.problem(seed, pictures="hard", seed=seed).world
        assert not any(world.falling(height) for height in range(7))
    assert not stands(world.assembly)
    assert (draw_offsets("easy", 6, 0) == 0).all()
    assert SETTINGS["hard"].lean > 0


# -- promises -------------------------------------------------------------------------------------------------


def test_the_family_conforms():
    check_domain(tower, walks=1)


@pytest.mark.parametrize("variant", VARIANTS)
def test_problems_of_every_variant_conform(variant):
    number = tower.numbers(variant=variant)[0]
    topples = [(0.3 * i, 0) for i in range(len(towers(variant)[number]))]
    check_problem(tower.problem(number, variant=variant, pictures="hard"), walks=2)
    check_problem(tower.problem(number, variant=variant, offsets=topples), walks=4)


def test_promises_are_kept_in_every_state():
    """Sound, both those for what follows and the unconditional ones, with blocks left over and towers that topple."""
    kinds = [Block(f"{c}-{i}", c, (1 + (i > 2), 1, 1)) for c in ("red", "blue") for i in (1, 2, 3)]
    kinds.append(Block("green", "green"))
    rng = np.random.default_rng(3)
    checked = lessons = 0
    for trial in range(25):
        levels = [kinds[i].name for i in rng.permutation(7)[: rng.integers(2, 7)]]
        offsets = np.cumsum(rng.uniform(-0.25, 0.25, (len(levels), 2)), axis=0) if trial % 2 else None
        search = tower.problem_from_blocks(kinds, levels, offsets=offsets).ground()
        reached, waiting = {search.initial: [frozenset()]}, [(search.initial, frozenset())]
        refusals, allowed = [], []
        while waiting:
            state, done = waiting.pop()
            for action in set(search.candidates(state)) - done:
                answer = search.attempt(state, action)
                if isinstance(answer, ns.Rejection):
                    refusals.append((done, action, answer))
                    continue
                allowed.append((done, action))
                after = done | {action}
                if after not in reached.setdefault(answer.state, []):
                    reached[answer.state].append(after)
                    waiting.append((answer.state, after))
        for done, action, refusal in refusals:
            for later, chosen in allowed:
                if refusal.until and chosen == action and later >= done:
                    assert set(refusal.until) & (later - done), refusal
                    checked += 1
                if refusal.until and refusal.unconditional and chosen == action:
                    assert set(refusal.until) & later, refusal
                    lessons += 1
    assert checked > 300
    assert lessons > 300


# -- pictures -------------------------------------------------------------------------------------------------


def test_pictures_are_of_one_view_and_follow_their_seed():
    easy, hard = tower.problem(5), tower.problem(5, pictures="hard")
    assert easy.observation.shape == (1, 64, 64, 3)
    assert easy.observation.dtype == np.uint8
    assert (easy.observation == tower.problem(5, seed=1).observation).all()
    assert (hard.observation == tower.problem(5, pictures="hard").observation).all()
    assert (hard.observation != tower.problem(5, pictures="hard", seed=1).observation).mean() > 0.1
    assert (hard.observation != easy.observation).mean() > 0.3
    assert (tower.problem(5, pictures="varied").observation == hard.observation).all()
    assert (tower.problem(5, pictures="clean").observation == easy.observation).all()
    again = tower.pictures(hard, style="hard", rng=np.random.default_rng(hard.details["seed"]))
    assert (again == hard.observation).all()


def test_the_picture_shows_the_colours_from_the_bottom_up():
    for variant, number in (("colours", 222), ("unique", 444), ("heights", 100)):
        problem = tower.problem(number, variant=variant)
        view = problem.observation[0].astype(float)
        rows = np.flatnonzero((view < 250).any(axis=(1, 2)))
        middle = view[rows[0] : rows[-1] + 1, 32][::-1]
        n = len(problem.details["colours"])
        assert len(rows) == pytest.approx(64 / 6.6 * n, abs=6), "one scale for all heights"
        for level, colour in enumerate(problem.details["colours"]):
            pixel = middle[int((level + 0.5) * len(rows) / n)]
            rgb = {c: np.array(v) for c, v in COLOURS.items()}
            nearest = max(rgb, key=lambda c: pixel @ rgb[c] / np.linalg.norm(rgb[c]))
            assert nearest == colour


def test_a_hard_picture_shows_where_the_blocks_stand():
    left, right = (tower.problem(0, offsets=[(0, y)] * 6).observation[0] for y in (-1, 1))
    columns = [np.flatnonzero((view < 250).any(axis=(0, 2))).mean() for view in (left, right)]
    assert columns[0] < 25 < 38 < columns[1]


def test_many_pictures_at_once_are_those_taken_one_by_one():
    problems = [tower.problem(n, variant="heights", pictures=s) for n in (0, 700, 1900) for s in ("easy", "hard")]
    for alone, together in zip(problems, tower.observed(problems)):
        assert (together.observation == alone.observation).all()


# -- demonstrations -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("recipe", ["paper", "full"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_demonstrations_are_valid(variant, recipe):
    made = tower.demonstrations("test", variant=variant, recipe=recipe, style="hard", seed=4, count=12)
    assert made.domain == "tower"
    assert made.pictures.shape == (12, 1, 64, 64, 3)
    assert made.sequences.shape == (12, 6)
    for row, number in enumerate(tower.numbers("test", variant=variant)[:12]):
        problem = tower.problem(number, variant=variant, pictures="hard", seed=4)
        order = [made.actions[a] for a in made.sequences[row] if a >= 0]
        assert ns.validate(problem, order).ok
        assert (problem.observation == made.pictures[row]).all()
        assert sequences(variant)[made.groups[row]] == problem.details["colours"]
        if recipe == "full":
            assert (made.marginals[row].sum(axis=1) == pytest.approx((made.sequences[row] >= 0).astype(float)))
            counted = ns.load_planner("exhaustive").order_marginals(problem.ground())
            n = len(order)
            np.testing.assert_allclose(made.marginals[row, :n], counted[:n], atol=1e-6)
    assert (made.marginals is None) is (recipe == "paper")


def test_which_of_two_like_blocks_comes_first_is_chance():
    made = tower.demonstrations("all", recipe="paper", count=90)
    first = [row[np.isin(row, (0, 1))][0] for row in made.sequences]
    assert 25 < sum(first) < 65
    assert shares("colours", ("red", "blue"))[1].tolist() == [0, 0, 0, 0, 0.5, 0.5]


def test_splits_by_sequence_hold_for_demonstrations():
    train, test = (tower.demonstrations(part, recipe="full", by="sequence", count=60) for part in ("train", "test"))
    assert not set(train.groups) & set(test.groups)


# -- command line ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [[], ["--option", "variant=heights"]])
def test_planners_compare_on_towers(options, capsys):
    asked = ["compare", "tower", "--prior", "none", "--prior", "uniform", "--problems", "5", "--workers", "1", "--json"]
    with pytest.raises(SystemExit) as left:
        main([*asked, *options])
    assert not left.value.code
    rows = json.loads(capsys.readouterr().out)["rows"]
    complete = [row for row in rows if row["planner"] != "swap-repair"]
    assert complete
    assert all(row["solved"] == 5 for row in complete)


def test_one_tower_is_planned_from_the_command_line(capsys):
    options = ["--option", "variant=unique", "--option", 'placed=["red"]', "--pictures", "varied"]
    with pytest.raises(SystemExit) as left:
        main(["plan", "tower", "--problem", "3", *options, "--json"])
    assert not left.value.code
    answer = json.loads(capsys.readouterr().out)
    assert answer["options"]["pictures"] == "varied"
    assert len(answer["plan"]) == 5
