"""Comparisons: the same for any number of processes, resumable, and counted right."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

import neurosym as ns
from neurosym.experiments import benchmark
from neurosym.experiments.baselines import best_fixed_order, order_fails
from neurosym.experiments.benchmark import Comparison, Outcome, Run, ask_priors, image_blind, run
from neurosym.experiments.journal import Journal, key_of
from neurosym.experiments.reporting import markdown, rows, table, write_csv

PLANNERS = ("swap-repair", "backtracking")
SMALL = Comparison("soma", (3, 17, 42), PLANNERS, ("none", "random"), {"collapse": "cubes"}, seeds=2)


def counted(runs):
    """Runs without their times, which no two machines share."""
    return [replace(r, seconds=0.0) for r in runs]


@pytest.fixture(scope="module")
def runs():
    return run(SMALL)


def test_one_run_a_cell_and_problem_in_the_order_of_the_table(runs):
    assert [(r.planner, r.prior, r.seed, r.number) for r in runs] == [
        (*cell, number) for cell in SMALL.cells for number in SMALL.numbers
    ]


def test_the_number_of_processes_changes_nothing(runs):
    assert counted(run(SMALL, workers=2)) == counted(runs)


def test_other_problems_and_planners_change_nothing_for_the_rest(runs):
    alone = run(replace(SMALL, numbers=(17,), planners=("backtracking",), priors=("random",), seeds=1))
    here = [r for r in runs if (r.planner, r.prior, r.seed, r.number) == ("backtracking", "random", 0, 17)]
    assert counted(alone) == counted(here)


def test_every_solved_run_made_its_plan_with_one_attempt_a_step(runs):
    assert all(r.attempts == r.iterations + 7 for r in runs if r.solved)


def test_whether_the_first_order_fails_does_not_depend_on_the_planner(runs):
    for prior, seed, number in itertools.product(SMALL.priors, range(2), SMALL.numbers):
        said = {r.first_order_failed for r in runs if (r.prior, r.seed, r.number) == (prior, seed, number)}
        assert len(said) == 1


def test_the_first_order_is_the_priors_own(runs):
    family = ns.load_domain("soma")
    for r in runs:
        if r.prior == "random":
            problem = family.problem(r.number, collapse="cubes")
            order = ns.load_prior("random").scores([problem])[0].names()
            assert r.first_order_failed is not bool(ns.validate(problem, order))


def test_a_prior_that_knows_a_plan_never_fails_first():
    class Knows(ns.Prior):
        def scores(self, problems):
            plans = [ns.solve(p).plan for p in problems]
            orders = [[p.actions.index(a) for a in plan] for p, plan in zip(problems, plans)]
            return [ns.OrderScores.from_order(o, p.actions) for o, p in zip(orders, problems)]

    comparison = replace(SMALL, priors=("knows",), planners=("swap-repair", "backtracking", "best-first"))
    found = run(comparison, ask_priors(comparison, loaded={"knows": Knows()}))
    assert all(r.iterations == 0 and not r.first_order_failed and r.solved for r in found)


def test_a_plan_with_false_motions_is_refused_as_by_solve(monkeypatch):
    class Liar(ns.Planner):
        """The right order; but the bolt, which leaves along +x, is pushed into its case."""

        traits = ns.load_planner("backtracking").traits

        def plan(self, problem, scores, *, budget, rng):
            result = ns.load_planner("backtracking").plan(problem, scores, budget=budget, rng=rng)
            first, *others = result.motions
            return replace(result, motions=(replace(first, direction=(-1.0, 0.0, 0.0)), *others))

    drawer = ns.load_domain("assembly").problem(5)
    assert ns.validate(drawer, ns.solve(drawer).plan), "the order alone is right"
    with pytest.raises(ns.ContractError, match="bolt cannot go along -x"):
        ns.solve(drawer, planner=Liar())
    monkeypatch.setattr(benchmark, "load_planner", lambda name: Liar())
    with pytest.raises(ns.ContractError, match="bolt cannot go along -x"):
        run(Comparison("assembly", (5,), ("liar",), ("none",)))


class TestResuming:
    def test_what_is_done_is_not_done_again(self, runs, tmp_path, monkeypatch):
        journal = tmp_path / "deep" / "runs.jsonl"
        first = run(SMALL, journal=journal)
        assert counted(first) == counted(runs)
        monkeypatch.setattr(benchmark, "_solve_one", lambda *_: pytest.fail("asked again"))
        assert run(SMALL, journal=journal) == first
        assert run(replace(SMALL, priors=("random",), seeds=1), journal=journal)

    def test_after_a_kill_only_the_rest_is_done(self, runs, tmp_path, monkeypatch):
        journal = tmp_path / "runs.jsonl"
        run(SMALL, journal=journal)
        lines = journal.read_bytes().splitlines(keepends=True)
        journal.write_bytes(b"".join(lines[:10]) + lines[10][:25])
        asked = []
        solve_one = benchmark._solve_one
        monkeypatch.setattr(benchmark, "_solve_one", lambda *job: asked.append(len(job[2])) or solve_one(*job))
        assert counted(run(SMALL, journal=journal)) == counted(runs)
        assert sum(asked) == len(lines) - 10
        assert len(Journal(journal)) == len(lines)

    @pytest.mark.parametrize(
        "other",
        [
            {"options": {"collapse": "strict"}},
            {"oracle": "physics"},
            {"budget": ns.Budget(attempts=1)},
            {"numbers": (4, 18, 43)},
        ],
        ids=lambda other: next(iter(other)),
    )
    def test_another_configuration_is_another_run(self, other, tmp_path):
        journal = tmp_path / "runs.jsonl"
        small = replace(SMALL, priors=("none",), planners=("backtracking",), seeds=1)
        run(small, journal=journal)
        run(replace(small, **other), journal=journal)
        assert len(Journal(journal)) == 6

    def test_a_prior_that_was_trained_anew_is_another_prior(self, tmp_path):
        journal = tmp_path / "runs.jsonl"
        small = replace(SMALL, priors=("random",), planners=("backtracking",), seeds=1)
        scores = ask_priors(small)
        run(small, scores, journal=journal)
        run(small, scores, journal=journal)
        assert len(Journal(journal)) == 3
        other = {"random": [ns.OrderScores.uniform(7, s.actions) for s in scores["random"]]}
        run(small, other, journal=journal)
        assert len(Journal(journal)) == 6


class TestJournal:
    def test_it_keeps_what_it_is_given(self, tmp_path):
        Journal(tmp_path / "j").add({"a": {"x": 1}, "b": {"x": 2}})
        again = Journal(tmp_path / "j")
        assert (again["a"], again["b"], "c" in again) == ({"x": 1}, {"x": 2}, False)

    @pytest.mark.parametrize("torn", [b'{"key": "b", "val', b"\xff\xfe", b"3", b'{"key": "b"}'])
    def test_a_torn_line_costs_only_itself(self, torn, tmp_path):
        Journal(tmp_path / "j").add({"a": {"x": 1}})
        with open(tmp_path / "j", "ab") as file:
            file.write(torn)
        Journal(tmp_path / "j").add({"c": {"x": 3}})
        again = Journal(tmp_path / "j")
        assert len(again) == 2
        assert again["c"] == {"x": 3}

    def test_without_a_path_it_remembers_nothing(self):
        journal = Journal(None)
        journal.add({"a": {}})
        assert "a" not in journal

    def test_keys_do_not_depend_on_the_order_of_options(self):
        assert key_of({"a": 1, "b": 2}) == key_of({"b": 2, "a": 1}) != key_of({"a": 1, "b": 3})


class TestImageBlind:
    def test_the_best_fixed_order_is_the_best_of_all(self):
        # Three pieces leave 3! orders, few enough to look at all.
        family = ns.load_domain("soma")
        gone = ("V", "T", "L", "P")
        problems = [family.problem(n, collapse="strict", removed=gone) for n in range(12)]
        searches = [p.ground() for p in problems]
        failures = {o: sum(order_fails(s, o) for s in searches) for o in itertools.permutations(range(3))}
        best = best_fixed_order(searches)
        assert failures[tuple(problems[0].actions.index(a) for a in best)] == min(failures.values())
        assert min(failures.values()) < max(failures.values())

    def test_an_order_fails_exactly_when_its_replay_does(self):
        problem = ns.load_domain("soma").problem(17, collapse="strict")
        rng = np.random.default_rng(0)
        orders = [rng.permutation(7) for _ in range(50)] + [[problem.actions.index(a) for a in ns.solve(problem).plan]]
        for order in orders:
            assert order_fails(problem.ground(), order) is not bool(
                ns.validate(problem, [problem.actions[a] for a in order])
            )
        assert order_fails(problem.ground(), orders[-1][:3]), "the goal is not reached"

    def test_problems_without_common_actions_have_none(self):
        family = ns.load_domain("soma")
        assert best_fixed_order([]) is None
        assert best_fixed_order([family.problem(1).ground(), family.problem(1, removed=["V"]).ground()]) is None

    def test_on_the_test_cubes_it_is_the_known_one(self):
        comparison = Comparison("soma", ns.load_domain("soma").numbers("test"), ("backtracking",), ("none",))
        share, order = image_blind(comparison)
        assert share == pytest.approx(0.733, abs=0.001)
        assert sorted(order) == sorted("VLTZABP")


class TestRows:
    def outcome(self, **changes):
        comparison = replace(SMALL, numbers=(0, 1), planners=("swap-repair",), priors=("none",), seeds=2, **changes)
        counts = [(0, 0, 4, True), (0, 1, 0, False), (1, 0, 30, True), (1, 1, 2, True)]
        runs = [
            Run("swap-repair", "none", s, n, "GAVE_UP" if i == 30 else "SOLVED", i, 7, 7 + i, 0.5, failed)
            for s, n, i, failed in counts
        ]
        return Outcome(comparison, tuple(runs), 0.75, ("V",))

    def test_figures_are_over_problems_times_seeds(self):
        (row,) = rows(self.outcome())
        assert (row["problems"], row["seeds"], row["runs"]) == (2, 2, 4)
        assert (row["solved"], row["runs_solved"]) == (1, 3), "problem 0 was not solved under every seed"
        assert row["initial_failure_rate"] == 0.75
        assert row["iterations_mean"] == 9
        assert row["iterations_std"] == pytest.approx(np.std([4, 0, 30, 2]))
        assert (row["seconds"], row["seconds_mean"]) == (2.0, 0.5)
        assert row["published"]["iterations"] == (5.35, 4.12)

    def test_they_can_be_written(self, tmp_path):
        given = rows(self.outcome())
        json.dumps(given)
        assert "5.35" in write_csv(given, tmp_path / "out" / "results.csv").read_text()
        assert "| swap-repair | none | 3/4 | 75.0 | 9.00 ± 12.21 |" in markdown(given)
        assert table(given).row_count == 1


@pytest.mark.parametrize(
    "wrong",
    [
        {"numbers": ()},
        {"seeds": 0},
        {"oracle": "magic"},
        {"planners": ("best",)},
        {"domain": "somma"},
        {"options": {"colour": "red"}},
    ],
    ids=lambda wrong: next(iter(wrong)),
)
def test_a_wrong_comparison_is_refused_at_once(wrong):
    with pytest.raises(ns.InputError, match="Expected"):
        replace(SMALL, **wrong)


def test_a_prior_that_does_not_know_the_problems_can_be_left_out(tmp_path):
    said = []
    comparison = replace(SMALL, priors=("none", str(tmp_path / "missing.safetensors"), "random"))
    scores = ask_priors(comparison, leave_out=lambda name, error: said.append((name, str(error))))
    assert list(scores) == ["none", "random"]
    assert said[0][1].startswith("Expected a weights file")
    with pytest.raises(ns.CheckpointError):
        ask_priors(comparison)
