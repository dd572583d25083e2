"""Scrabble: the tile set, words from chance and from lists, one tile a letter, pictures of wood."""

from __future__ import annotations

import itertools
import json
import re
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurosym as ns
from domains import scrabble_pictures
from domains.scrabble_drawing import STYLES, draw_word
from domains.scrabble_pictures import cached_pictures
from domains.scrabble_tiles import N_TEST, N_TRAIN, TILES, VALUES, part_of, random_word
from neurosym.testing.domains import check_problem

scrabble = ns.load_domain("scrabble")
ALL_LETTERS = "abcdefghijklmnopqrstuvwxyz"


@pytest.fixture(autouse=True)
def own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("NEUROSYM_CACHE", str(tmp_path / "cache"))


@pytest.mark.parametrize("fact", scrabble.known_facts())
def test_known_facts_are_recomputed(fact):
    published, recompute = scrabble.known_facts()[fact]
    assert recompute() == published


def test_tiles_come_in_rounds():
    assert TILES[:26] == tuple(f"{c}1" for c in ALL_LETTERS)
    assert TILES[26] == "a2"
    assert len(set(TILES)) == 98
    assert TILES[-1] == "e12"
    assert set(VALUES) == set(ALL_LETTERS)


@pytest.mark.parametrize("tiles", [6, 11, 26, 50, 98])
def test_the_actions_are_the_first_tiles_and_letters_are_classes(tiles):
    problem = scrabble.problem(3, tiles=tiles)
    assert problem.actions == TILES[:tiles]
    groups: dict[int, set[str]] = {}
    for name, kind in zip(problem.actions, problem.classes):
        groups.setdefault(kind, set()).add(name[0])
    assert sorted(map(sorted, groups.values())) == [[c] for c in sorted({t[0] for t in TILES[:tiles]})]


def test_a_tile_must_match_and_is_used_once():
    problem = scrabble.problem_from_word("eel")
    assert ns.validate(problem, ["e3", "e12", "l1"]).ok
    again = ns.validate(problem, ["e3", "e3", "l1"])
    assert (again.ok, again.failed_at, again.because) == (False, 1, ("e3",))
    assert "done already" in again.reason
    wrong = ns.validate(problem, ["e3", "l1", "e1"])
    assert (wrong.failed_at, wrong.because) == (1, ("l1",))
    assert "Slot 1 wants e; l1 is an l, wanted at slot 2." in wrong.reason
    assert "z1 is a z, wanted nowhere later." in ns.validate(problem, ["z1"]).reason
    short = ns.validate(problem, ["e1", "e2"])
    assert (short.failed_at, "2 of 3 slots" in short.reason) == (2, True)
    long = ns.validate(problem, ["e1", "e2", "l1", "z1"])
    assert (long.failed_at, "All 3 slots are filled" in long.reason) == (3, True)


def test_refusals_promise_what_they_can():
    def refused(state, name):
        answer = search.attempt(state, index[name])
        assert isinstance(answer, ns.Rejection)
        return {search.actions[i] for i in answer.until}, answer.unconditional

    search = scrabble.problem_from_word("eel").ground()
    index = {name: i for i, name in enumerate(search.actions)}
    assert refused(search.initial, "z1") == ({"z1"}, True)
    assert refused(search.initial, "l1") == ({f"e{i}" for i in range(1, 13)}, True)
    state = search.attempt(search.initial, index["e1"]).state
    state = search.attempt(state, index["e2"]).state
    # An e is wanted no more from here on, but it was: that is no lesson for other branches.
    assert refused(state, "e5") == ({"e5"}, False)
    search = scrabble.problem_from_word("bread").ground()
    index = {name: i for i, name in enumerate(search.actions)}
    # The slot before its own must be filled, not only the next one.
    assert refused(search.initial, "d2")[0] == {f"a{i}" for i in range(1, 10)}


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 40_000), st.sampled_from([6, 7, 12, 40]), st.integers(0, 2))
def test_promises_are_kept_everywhere(number, tiles, started):
    """Every refusal in every reachable state, against every state: try to catch the domain lying."""
    word = scrabble.word(number, tiles=tiles)
    used: Counter[str] = Counter()
    start = []
    for letter in word[:started]:
        used[letter] += 1
        start.append(f"{letter}{used[letter]}")
    search = scrabble.problem(number, tiles=tiles, start=start).ground()
    # Equal letters are interchangeable: one of a class, as planners do, leaves few states.
    reached, waiting = {search.initial: frozenset()}, [search.initial]
    while waiting:
        state = waiting.pop()
        for a in search.candidates(state):
            step = search.attempt(state, a)
            if isinstance(step, ns.Step) and step.state not in reached and len(reached) < 200:
                reached[step.state] = reached[state] | {a}
                waiting.append(step.state)
    for state, done in reached.items():
        for a in search.candidates(state):
            refused = search.attempt(state, a)
            if not isinstance(refused, ns.Rejection):
                continue
            assert refused.until, "each refusal here can promise something"
            for other, after in reached.items():
                later = done <= after and not set(refused.until) & (after - done)
                anywhere = refused.unconditional and not set(refused.until) & after
                if (later or anywhere) and a not in after:
                    assert isinstance(search.attempt(other, a), ns.Rejection)


@pytest.mark.parametrize("options", [{}, {"start": ["e3"]}, {"tiles": 98}])
def test_problems_conform(options):
    check_problem(scrabble.problem_from_word("eerie", **{"tiles": 70, **options}), walks=2)


def test_a_word_that_is_begun():
    problem = scrabble.problem_from_word("eel", start=["e7"])
    assert "e7" not in problem.actions
    assert len(problem.actions) == 97
    assert len(ns.solve(problem, rng=3).plan) == 2
    for start in (["l1"], ["e1", "e1"], ["e1", "e2", "l1"]):
        with pytest.raises(ns.InputError, match="begin the word 'eel'"):
            scrabble.problem_from_word("eel", start=start)
    with pytest.raises(ns.UnknownNameError, match="tile"):
        scrabble.problem_from_word("eel", start=["e13"])


def test_numbers_are_split_and_words_never_meet():
    assert list(scrabble.numbers("train", count=3)) == [0, 1, 2]
    assert list(scrabble.numbers("test", count=2)) == [N_TRAIN, N_TRAIN + 1]
    assert list(scrabble.numbers("test", split=1, count=1)) == [2 * N_TRAIN + N_TEST]
    assert len(scrabble.numbers("all")) == 250
    for tiles in (6, 98):
        for split in (0, 1):
            words = {
                part: {scrabble.word(n, tiles=tiles) for n in scrabble.numbers(part, split=split, count=1500)}
                for part in ("train", "test")
            }
            assert not words["train"] & words["test"]
            if tiles == 6:  # nearly all of the few that there are
                assert len(words["train"] | words["test"]) > 900
    for bad in ({"part": "tset"}, {"count": 0}, {"count": 5001}, {"split": -1}):
        with pytest.raises(ns.InputError):
            scrabble.numbers(**bad)


def test_random_words_use_every_length_and_no_more_tiles_than_there_are():
    for tiles in (6, 30, 98):
        there = Counter(t[0] for t in TILES[:tiles])
        words = [random_word(n, tiles) for n in range(300)]
        assert {len(w) for w in words} == {3, 4, 5, 6}
        assert all(not Counter(w) - there for w in words)
        assert all(part_of(w, 0) == "train" for w in words)
        assert words == [random_word(n, tiles) for n in range(300)]


def test_words_of_a_list():
    words = ["Bread", "bean", "bride", "chair", "dance", "bread", "fig"]
    shown = {
        part: {p.details["word"] for p in scrabble.problems(part, count=20, words=words)} for part in ("train", "test")
    }
    assert shown["train"] | shown["test"] == {w.lower() for w in words}
    assert not shown["train"] & shown["test"]
    assert len(shown["test"]) == 2
    assert scrabble.problem(0, words=["cat"]).details["word"] == "cat"
    assert scrabble.problem(N_TRAIN, words=["cat"]).details["word"] == "cat"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "at least one word"),
        ("cat", "Write ['cat']"),
        (["at"], "'at' has 2"),
        (["letters"], "'letters' has 7"),
        (["naïve"], "letters a to z"),
        ([7], "letters a to z"),
        (["pizza"], "'pizza' needs z 2 times, and there is 1"),
        (["cat", "jazz"], "'jazz' needs z 2 times"),
    ],
)
def test_words_that_cannot_be_laid_are_refused(words, says):
    with pytest.raises(ns.InputError, match=re.escape(says)):
        scrabble.problem(0, words=words)


def test_words_need_the_tiles_that_there_are():
    with pytest.raises(ns.InputError, match="needs z 1 times, and there are none"):
        scrabble.problem_from_word("zap", tiles=20)
    with pytest.raises(ns.InputError, match="needs e 3 times, and there are 2"):
        scrabble.problem_from_word("eerie", tiles=40)
    for bad in (5, 99, True, "98"):
        with pytest.raises(ns.InputError, match="first 6 to 98 tiles"):
            scrabble.problem(0, tiles=bad)
    for bad in (-1, 1.5, "3", True):
        with pytest.raises(ns.InputError, match="number of a word"):
            scrabble.problem(bad)


def reading(problem):
    """What a good reader of the picture would say: 6 steps, and an unsure length."""
    word = problem.details["word"]
    table = np.full((6, len(problem.actions)), 1e-4)
    for slot, letter in enumerate(word):
        table[slot, [name[0] == letter for name in problem.actions]] = 1
    length = np.full(7, -9.0)
    length[len(word)] = 0
    return ns.OrderScores(np.log(table), problem.actions, length)


@pytest.mark.parametrize("planner", ["swap-repair", "backtracking", "best-first"])
def test_a_reader_of_pictures_makes_planning_short(planner):
    for problem in scrabble.problems(count=8):
        result = ns.solve(problem, planner=planner, prior=reading(problem))
        assert result.solved
        assert (result.iterations, result.attempts) == (0, len(problem.details["word"]))
        assert "".join(name[0] for name in result.plan) == problem.details["word"]


@pytest.mark.parametrize("prior", [None, "uniform", "random"])
@pytest.mark.parametrize("planner", ["backtracking", "best-first"])
def test_without_a_reader_each_letter_is_asked_for_hardly_more_than_once(planner, prior):
    """98 tiles, but 26 classes; what is wanted nowhere is never asked for again."""
    iterations = []
    for k, problem in enumerate(scrabble.problems(count=12)):
        result = ns.solve(problem, planner=planner, prior=prior, rng=k)
        assert result.solved
        iterations.append(result.iterations)
    assert 5 < np.mean(iterations) < 40
    assert max(iterations) < 26 + 5 + 4 + 3 + 2 + 1


def test_swap_repair_without_a_reader_gives_up():
    results = [ns.solve(p, planner="swap-repair", rng=k) for k, p in enumerate(scrabble.problems(count=10))]
    assert sum(r.solved for r in results) < 5
    assert all(r.status in (ns.Status.SOLVED, ns.Status.GAVE_UP) for r in results)


def test_pictures_are_seeded_and_show_the_word():
    first = scrabble.problem(4, seed=1)
    assert first.observation.shape == (1, 32, 192, 3)
    assert first.observation.dtype == np.uint8
    assert (scrabble.problem(4, seed=1).observation == first.observation).all()
    assert (scrabble.problem(4, seed=2).observation != first.observation).any()
    assert (scrabble.problem(4, seed=1, pictures="hard").observation != first.observation).any()
    for alias, style in (("clean", "easy"), ("varied", "hard")):
        assert scrabble.problem(4, pictures=alias).details["pictures"] == style
    with pytest.raises(ns.UnknownNameError, match="picture style"):
        scrabble.problem(4, pictures="pretty")
    drawn = scrabble.pictures(first, style="hard", rng=np.random.default_rng(3))
    assert (drawn == draw_word(first.details["word"], STYLES["hard"], np.random.default_rng(3))).all()


@pytest.mark.parametrize("style", ["easy", "hard"])
def test_letters_differ_where_they_lie_and_nowhere_else(style):
    """One letter exchanged changes its own slot: nothing of it may be cut off or hidden by a neighbour."""
    pictures = [draw_word(w, STYLES[style], np.random.default_rng(5))[0].astype(int) for w in ("qooooo", "ooooob")]
    plain = draw_word("oooooo", STYLES[style], np.random.default_rng(5))[0].astype(int)
    at_first, at_last = (np.abs(p - plain).max(axis=(0, 2)) > 30 for p in pictures)
    assert at_first[:34].any()
    assert not at_first[48:].any()
    assert at_last[-34:].any()
    assert not at_last[:-48].any()


def test_every_pair_of_letters_can_be_told_apart():
    shown = [draw_word(c * 3, STYLES["easy"], np.random.default_rng(9)).astype(float) for c in ALL_LETTERS]
    least = min(np.abs(a - b).mean() for a, b in itertools.combinations(shown, 2))
    assert least > 3  # levels of 255, table included


def test_pictures_do_not_depend_on_workers_and_come_from_disk(monkeypatch, tmp_path):
    monkeypatch.setattr(scrabble_pictures, "CHUNK", 8)
    jobs = [(random_word(n, 98), n) for n in range(20)]
    alone = cached_pictures(jobs, style="hard", workers=1, folder=tmp_path / "one")
    together = cached_pictures(jobs, style="hard", workers=2, folder=tmp_path / "two")
    assert (alone == together).all()
    assert (alone[7] == draw_word(jobs[7][0], STYLES["hard"], np.random.default_rng(7))).all()
    files = sorted((tmp_path / "one").rglob("*.z"))
    assert len(files) == 3
    damaged = bytearray(files[0].read_bytes())
    damaged[100] ^= 1
    files[0].write_bytes(damaged)
    told = []
    again = cached_pictures(
        jobs, style="varied", workers=1, folder=tmp_path / "one", progress=lambda *now: told.append(now)
    )
    assert (again == alone).all()
    assert told[0][0] in (12, 16), "the others were found"
    assert told[-1] == (20, 20)
    monkeypatch.setattr(scrabble_pictures, "_draw_chunk", None)  # nothing is drawn any more
    assert (cached_pictures(jobs, style="hard", workers=1, folder=tmp_path / "one") == alone).all()
    assert cached_pictures([], folder=tmp_path).shape == (0, 1, 32, 192, 3)


def test_observed_problems_show_what_they_would_show_alone():
    problems = [scrabble.problem(n, pictures=style) for n, style in ((0, "easy"), (1, "hard"), (2, "easy"))]
    for plain, observed in zip(problems, scrabble.observed(problems)):
        assert (plain.observation == observed.observation).all()
        assert plain.name == observed.name


def test_demonstrations_are_valid_orders_with_their_pictures():
    given = scrabble.demonstrations(recipe="paper", count=40, seed=3, workers=1)
    assert given.marginals is None
    assert given.sequences.shape == (40, 6)
    assert set(given.lengths.tolist()) == {3, 4, 5, 6}
    picked = set()
    for n in range(40):
        problem = scrabble.problem(n, seed=3)
        order = [given.actions[a] for a in given.sequences[n] if a >= 0]
        assert ns.validate(problem, order).ok
        picked |= {name for name in order if name[0] == "e"}
        if n % 10 == 0:
            assert (given.pictures[n] == problem.observation).all()
    assert len(picked) > 5, "of equal letters any may come"


def test_full_demonstrations_share_alike_among_equal_letters():
    words = ["eel", "seek", "peer"]
    given = scrabble.demonstrations(count=6, words=words, style="hard", tiles=90, workers=1)
    again = scrabble.demonstrations(count=6, words=words, style="hard", tiles=90, workers=1)
    assert (given.sequences == again.sequences).all()
    assert given.actions == TILES[:90]
    counter = ns.load_planner("exhaustive")
    for k in range(6):
        word = scrabble.word(k, words=words, tiles=90)
        assert given.groups[k] == given.groups[k % 2]  # two words to train, one to test
        small = scrabble.problem_from_word(word, tiles=90).ground()
        if len(word) == 3:
            expected = counter.order_marginals(small)[:3]
            np.testing.assert_allclose(given.marginals[k, :3], expected, atol=1e-6)
        np.testing.assert_allclose(given.marginals[k].sum(axis=1), np.arange(6) < len(word), atol=1e-6)
    with pytest.raises(ns.UnknownNameError, match="recipe"):
        scrabble.demonstrations(recipe="fuller", count=1)


def test_compare_on_the_command_line(capsys):
    from neurosym.cli import main

    arguments = ["compare", "scrabble", "--prior", "uniform", "--problems", "5", "--workers", "1", "--json"]
    try:
        code = main(arguments)
    except SystemExit as end:
        code = end.code
    assert not code
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert {row["planner"] for row in rows} == {"swap-repair", "backtracking", "best-first"}
    assert all(row["problems"] == 5 for row in rows)
