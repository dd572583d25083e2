"""Examples run, say what they claim, and stay short."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

import neurosym as ns

FOLDER = Path(__file__).parent.parent / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(f"example_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_each_is_short_and_says_what_it_shows(path):
    text = path.read_text()
    assert len(text.splitlines()) < (121 if path.stem == "bearing_block" else 80)
    assert "shows" in text.split('"""')[1]
    assert f"python examples/{path.name}" in text


def test_the_new_domain_is_defined_in_25_lines():
    text = (FOLDER / "new_domain.py").read_text()
    definition = text.split("# -- the definition")[1].split("# -- what it shows")[0].splitlines()[1:]
    assert len([line for line in definition if line.strip()]) <= 25


@pytest.fixture(scope="module")
def balance():
    return load("new_domain")


def test_the_balance_has_plans_and_dead_ends(balance):
    problem = balance.balance()
    assert ns.count_plans(problem) == 28
    inner_gone = ("near-left", "near-right", "middle")
    assert all(ns.validate(problem, inner_gone[: i + 1]).failed_at == i + 1 for i in range(3)), "the prefix can be done"
    assert not any(ns.validate(problem, [*inner_gone, last]).failed_at == 4 for last in ("far-left", "far-right"))
    assert ns.solve(balance.balance(("far-left", "far-right"))).status is ns.Status.UNSOLVABLE


def test_backtracking_really_goes_back_on_the_balance(balance):
    problem = balance.balance()
    deepest = 0
    for planner in ("backtracking", "best-first", "exhaustive"):
        for seed in range(20):
            result = ns.solve(problem, planner=planner, rng=seed)
            assert result.solved, (planner, seed)
            if planner == "backtracking":
                # Every state on a plan is expanded once; more than that were entered and left again.
                deepest = max(deepest, result.expansions - len(result.plan))
    assert deepest > 0


@pytest.mark.parametrize("planner", ["backtracking", "best-first"])
def test_a_prior_that_lures_into_the_dead_end_does_no_lasting_harm(balance, planner):
    problem = balance.balance()
    bait = [problem.actions.index(a) for a in ("near-left", "near-right", "middle", "far-left", "far-right")]
    lured = ns.OrderScores.from_order(bait, problem.actions)
    assert ns.solve(problem, planner=planner, prior=lured).solved
    stuck = ns.solve(balance.balance(("far-left", "far-right")), planner=planner)
    assert stuck.status is ns.Status.UNSOLVABLE


def test_new_domain_shows_who_gets_stuck(balance, capsys):
    solved = balance.main(seeds=10)
    assert solved["swap-repair"] < 10
    assert solved["backtracking"] == solved["best-first"] == 10
    assert "Proved: no order" in capsys.readouterr().out


def test_plan_one_cube(capsys):
    result, wish = load("plan_one_cube").main()
    assert result.solved
    assert wish.status is ns.Status.UNSOLVABLE
    said = capsys.readouterr().out
    assert " ".join(result.plan) in said
    assert "the same backwards: Step 0" in said


def test_compare_iterations(tmp_path, capsys):
    means = load("compare_iterations").main(problems=6, out=str(tmp_path / "iterations.png"))
    assert means["swap-repair", "tallest-first"] < means["swap-repair", "none"]
    assert (tmp_path / "iterations.png").stat().st_size > 5000
    assert "saves iterations" in capsys.readouterr().out


def test_train_prior(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("NEUROSYM_CACHE", str(tmp_path / "cache"))
    failures = load("train_prior").main(epochs=3, tested=4, out=str(tmp_path / "prior.safetensors"))
    assert failures.keys() == {"random", "trained"}
    assert (tmp_path / "prior.safetensors").exists()
    assert "from the pictures of soma-" in capsys.readouterr().out


TOWERS = {"pictures": ("hard",), "seeds": 1}
STUDIES = {
    "tower": {**TOWERS, "sizes": (12,), "methods": ("bc", "sinkhorn"), "test": lambda _: {"count": 10}},
    "unseen": {**TOWERS, "sizes": (12,), "methods": ("sinkhorn",), "part": "test"},
    "variable": {**TOWERS, "sizes": (12,), "methods": ("bc",), "test": lambda _: {"variant": "heights", "count": 10}},
    "scrabble": {
        "sizes": (8,),
        "methods": ("bc",),
        "options": lambda n: {"tiles": n, "count": 12},
        "test": lambda n: {"tiles": n, "count": 10},
    },
}


@pytest.mark.parametrize("name", STUDIES)
def test_reproduced_studies(name, tmp_path, capsys):
    example = load(f"reproduce_{name}")
    given = replace(example.study(name), figures=(), **STUDIES[name])
    found = example.main(given, out=str(tmp_path), epochs=1)
    assert set(found.records["method"]) == {*given.rows, *given.controls}
    assert "report.md" in capsys.readouterr().out
    assert (tmp_path / "report.md").exists()
    assert (tmp_path / "results.csv").exists()


def test_reproduce_soma(tmp_path, capsys):
    example = load("reproduce_soma")
    given = replace(example.soma_experiment(), splits=1, styles=("clean",), methods=("sinkhorn-paper",))
    given = replace(given, planners=("swap-repair",), epochs=1, repeats=1, tests=4)
    shares = example.main(given, out=str(tmp_path))
    assert {"random, clean pictures", "sinkhorn-paper, clean pictures"} <= set(shares)
    assert "of the cubes" in capsys.readouterr().out


def test_a_bearing_block_has_the_same_answers_in_every_format(tmp_path):
    block = load("bearing_block")
    answers = []
    for units, path in block.write(tmp_path).items():
        assembly = ns.Assembly.load(path, units=units or None)
        problem = ns.load_domain("assembly").problem(assembly, gravity=False, fixed=["base"])
        geometry = problem.geometry
        names = [*assembly.names, "table"]
        touching = {frozenset((names[assembly.owners[c.a]], names[-1 if c.b < 0 else assembly.owners[c.b]]))
                    for c in geometry.contacts}  # fmt: skip
        graph = geometry.blocking()
        hits = {
            (d, name, other)
            for d, rows in enumerate(graph.by_part)
            for name, row in zip(assembly.names, rows)
            for other in assembly.in_mask(row)
        }
        assert ns.solve(problem, prior="outermost-first").solved
        kept = ["base", *(n for n in assembly.names if n.startswith(("ball", "pin")))]
        under_gravity = ns.load_domain("assembly").problem(assembly, fixed=kept)
        assert ns.solve(under_gravity, prior="outermost-first").solved
        answers.append((set(assembly.names), touching, hits))
    assert all(answer == answers[0] for answer in answers)
    names, touching, hits = answers[0]
    assert len(names) == 24
    assert {frozenset(("pin 0", "base")), frozenset(("bolt 1", "cap")), frozenset(("clip 0", "collar 0"))} <= touching
    up = {(name, other) for d, name, other in hits if tuple(graph.vectors[d]) == (0, 0, 1)}
    assert {("collar 0", "clip 0"), ("housing", "cap"), ("cap", "bolt 2")} <= up
    assert not {("pin 0", "base"), ("outer ring", "housing"), ("shaft", "inner ring")} & up  # pressed in, not stuck


def test_tools_are_changed_once_and_the_film_shows_every_step(capsys):
    result = load("tools").main()
    assert result.cheapest
    assert result.total_cost == 28
    assert [step.split("(")[0] for step in result.plan].count("pick_tool") == 2
    assert "none costs less: True" in capsys.readouterr().out
    from neurosym.planning.staging import stage
    from neurosym.simulation.animation import frames
    from neurosym.simulation.storyboard import describe

    staging = stage(load("tools").problem(), result.plan, result.motions)
    words = [describe(staging, i) for i in range(len(staging.plan))]
    assert [w for w in words if w.startswith("pick_tool")] == [s for s in result.plan if s.startswith("pick_tool")]
    assert staging.there(11) == ("box",)
    assert sum(1 for _ in frames(staging, size=(80, 60))) > 2 * len(words)


def test_the_notebook_runs_and_shows_tables_and_figures(tmp_path):
    """As a notebook runs it, in a kernel of its own: results are tables, figures are pictures, no cell fails."""
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed (extra dev)")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed (extra dev)")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(FOLDER / "stool.ipynb", as_version=4)
    ran = nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in ran.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [o for o in outputs if o.output_type == "stream" and o.name == "stderr"]
    shown = [set(o.data) for o in outputs if o.output_type == "execute_result"]
    assert [("text/html" in s, "image/png" in s) for s in shown] == [
        (True, False), (True, False), (True, False), (False, True), (True, False), (True, False), (False, True),
        (False, True),
    ]  # fmt: skip
