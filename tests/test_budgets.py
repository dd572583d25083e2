"""Budgets hold inside geometry: what is cut short says so, promises nothing, and is asked again when there is time."""

import itertools
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import trimesh

import neurosym as ns
from neurosym import pipeline
from neurosym.cli import main
from neurosym.commands.exit_codes import INTERRUPTED
from neurosym.language.search_problem import Rejection
from neurosym.planning.search_log import SearchLog
from neurosym.support.deadline import OutOfTime, check, portions, remaining, within
from neurosym.support.progress import heard_by
from neurosym.testing.toys import NumberLine

FAMILY = ns.load_domain("assembly")


def tori(count: int = 3, sections: int = 24) -> ns.Assembly:
    """Rings, each through the next."""
    meshes = {}
    for k in range(count):
        ring = trimesh.creation.torus(10, 2, major_sections=sections, minor_sections=sections // 2)
        turn = trimesh.transformations.rotation_matrix(np.pi / 2 * (k % 2), [1, 0, 0])
        meshes[f"ring{k}"] = ring.apply_transform(turn).apply_translation((12 * k, 0, 0))
    return ns.Assembly.from_meshes(meshes, units="mm")


def shell_mesh(radius: float, *, inward: bool = False) -> trimesh.Trimesh:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    if inward:
        mesh.invert()
    return mesh


def shell() -> ns.Assembly:
    """A ball with room to move in a hollow one, and no way out."""
    hollow = trimesh.util.concatenate([shell_mesh(10), shell_mesh(8, inward=True)])
    return ns.Assembly.from_meshes({"shell": hollow, "ball": shell_mesh(5)}, units="mm")


def grid(side: int) -> ns.Assembly:
    places = itertools.product(range(side), repeat=3)
    return ns.Assembly.from_cells({f"c{k}": [place] for k, place in enumerate(places)})


def test_the_earliest_of_nested_deadlines_holds_and_ends_with_its_block():
    with within(1000), within(0.0), within(500):
        time.sleep(1e-3)
        assert remaining() < 0
        with pytest.raises(OutOfTime):
            check()
    with within(None):
        check()
    assert remaining() == np.inf


@pytest.mark.parametrize("most", [1, 5, 10**9])
def test_portions_are_all_rows_in_order(most):
    weights = np.array([3, 0, 4, 10, 1, 1, 1, 0])
    some = list(portions(weights, most))
    rows = np.concatenate([np.arange(len(weights))[s] for s in some])
    assert rows.tolist() == list(range(len(weights)))
    assert all(weights[s].sum() <= most or s.stop - s.start == 1 for s in some)


@pytest.mark.parametrize(
    ("assembly", "options"),
    [
        (tori, {"gravity": False}),
        (tori, {"gravity": False, "groups": True, "paths": "any"}),
        (shell, {"gravity": False, "paths": "any"}),
        (lambda: grid(3), {}),
        (lambda: grid(4), {"groups": True, "paths": "any"}),
        (lambda: grid(2), {"gravity": False, "paths": "any", "directions": "-z"}),
    ],
)
@pytest.mark.parametrize("planner", ["backtracking", "best-first"])
def test_an_instant_is_no_answer_but_more_time_is(assembly, options, planner):
    """No time at all: out of budget, nothing proved. What was cut short is not taken for an answer afterwards."""
    problem = FAMILY.problem(assembly(), **options)
    for seconds in (0.0, 1e-3, 0.02):
        result = ns.solve(problem, planner=planner, prior="outermost-first", budget=ns.Budget(seconds=seconds))
        # A proof that took less than the grace is one.
        proved = result.status is ns.Status.UNSOLVABLE and result.why_not is not None
        assert result.status is ns.Status.OUT_OF_BUDGET or proved or seconds
        assert result.status is not ns.Status.GAVE_UP
    if options.get("paths") != "any":
        fresh = FAMILY.problem(assembly(), **options)
        once, anew = (ns.solve(p, planner=planner, prior="outermost-first") for p in (problem, fresh))
        assert (once.status, once.plan) == (anew.status, anew.plan)


@pytest.mark.parametrize("options", [{"paths": "any"}, {"paths": "any", "groups": True}])
def test_searches_for_paths_end_with_the_budget(options):
    problem = FAMILY.problem(shell(), gravity=False, **options)
    start = time.perf_counter()
    result = ns.solve(problem, budget=ns.Budget(seconds=0.5))
    assert result.status is ns.Status.OUT_OF_BUDGET
    assert time.perf_counter() - start < 15  # it took 80 s


def test_geometry_stops_where_it_is_and_goes_on_when_asked_again():
    geometry = ns.AssemblyGeometry(tori())
    for question in (lambda: geometry.contacts, lambda: geometry.blocking(50).by_part):
        with within(-1.0), pytest.raises(OutOfTime):
            question()
    blocking = geometry.blocking(50).by_part
    assert blocking == ns.AssemblyGeometry(tori()).blocking(50).by_part


class Slow:
    """A number line whose oracle takes its time over one action."""

    def __init__(self, at: int) -> None:
        self.line, self.at, self.asked = NumberLine((1, 2, 3), 6), at, 0
        self.actions, self.classes, self.initial = self.line.actions, self.line.classes, self.line.initial
        self.is_goal, self.candidates = self.line.is_goal, self.line.candidates

    def attempt(self, state, action):
        self.asked += 1
        while self.asked >= self.at:
            check()
        return self.line.attempt(state, action)


@pytest.mark.parametrize("name", ["backtracking", "best-first", "swap-repair", "exhaustive"])
def test_an_oracle_that_is_cut_short_leaves_every_planner_out_of_budget(name):
    problem = Slow(at=2)
    result = ns.load_planner(name).plan(problem, None, budget=ns.Budget(seconds=0.1), rng=np.random.default_rng(0))
    assert result.status is ns.Status.OUT_OF_BUDGET
    assert len(result.best_prefix) == 1
    assert not any("time" in r.reason for r in result.blame)


def test_what_was_cut_short_is_neither_proved_nor_given_up_whatever_the_planner_says():
    log = SearchLog(Slow(at=1), ns.Budget(seconds=0.01))
    answer = log.attempt((), 0, 0)
    assert isinstance(answer, Rejection)
    assert not answer.until
    assert not answer.proved
    assert log.out_of_budget()
    assert log.failed(ns.Status.UNSOLVABLE).status is ns.Status.OUT_OF_BUDGET


def test_a_plan_that_could_not_be_replayed_in_time_is_a_prefix(monkeypatch):
    def slow(*given):
        while True:
            check()

    monkeypatch.setattr(pipeline, "validate", slow)
    monkeypatch.setattr(pipeline, "GRACE", 0.1)
    result = ns.solve(FAMILY.problem(grid(2)), budget=ns.Budget(seconds=1))
    assert (result.status, result.plan, result.motions) == (ns.Status.OUT_OF_BUDGET, None, ())
    assert sorted(result.best_prefix) == sorted(FAMILY.problem(grid(2)).actions)


def test_an_explanation_that_takes_too_long_leaves_the_answer(monkeypatch):
    problem = FAMILY.problem(tori(), gravity=False)
    monkeypatch.setattr(type(problem.semantics), "refute", lambda *given: None)
    monkeypatch.setattr(type(problem.semantics), "explain", lambda *given: (_ for _ in ()).throw(OutOfTime))
    result = ns.solve(problem, budget=ns.Budget(seconds=60))
    assert (result.status, result.why_not) == (ns.Status.UNSOLVABLE, None)


def test_counting_ends_with_the_budget():
    counted = pipeline.count_orders(FAMILY.problem(grid(4)), budget=ns.Budget(seconds=0.05))
    assert (counted.orders, counted.exact) == (None, False)


def test_the_command_counts_reading_too(tmp_path, capsys):
    for k in range(3):
        trimesh.creation.box((1, 1, 1)).apply_translation((k, 0, 0)).export(tmp_path / f"{k}.stl")
    with pytest.raises(SystemExit) as left:
        main(["plan", str(tmp_path), "--units", "mm", "--seconds", "0"])
    assert left.value.code == ns.Status.OUT_OF_BUDGET.exit_code
    assert "--seconds" in capsys.readouterr().err


def test_geometry_tells_whoever_listens_how_far_it_is():
    told = []
    with heard_by(lambda *given: told.append(given)):
        assembly = tori()
        geometry = ns.AssemblyGeometry(assembly)
        geometry.contacts, geometry.blocking(9).by_part
    geometry.blocking(8).by_part  # noqa: B018
    assert {what for what, *_ in told} >= {"contacts", "blocking", ""}
    assert [(done, total) for what, done, total in told if what == "blocking"] == [(k, 9) for k in range(9)]
    assert told[-1] == ("", 0, 0)


def test_an_interrupted_plan_ends_cleanly(tmp_path):
    for k, name in enumerate(("outer", "ball")):
        mesh = trimesh.util.concatenate([shell_mesh(10), shell_mesh(8, inward=True)]) if not k else shell_mesh(5)
        mesh.export(tmp_path / f"{name}.stl")
    options = ["--units", "mm", "--paths", "any", "--no-gravity"]
    run = subprocess.Popen(
        [sys.executable, "-m", "neurosym.cli", "plan", str(tmp_path), *options], stderr=subprocess.PIPE, text=True
    )
    time.sleep(8)
    assert run.poll() is None, run.stderr.read()
    run.send_signal(signal.SIGINT)
    said = run.communicate(timeout=60)[1]
    assert (run.returncode, "Traceback" in said) == (INTERRUPTED, False)
