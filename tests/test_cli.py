"""The command line: every exit code, what goes to stdout, and what is kept in files."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import learned_priors
import neurosym as ns
from neurosym import __version__
from neurosym.cli import main
from neurosym.commands.exit_codes import BAD_INPUT, EXIT_CODES, INTERRUPTED
from neurosym.language.options import check_options, options_of
from neurosym.planning.weights_header import read_header

#: The L before all others: under the rule `cubes` no order of cube 17 can.
IMPOSSIBLE = [part for other in "VTZABP" for part in ("--before", f"L,{other}")]
ROW_KEYS = {
    *("planner", "prior", "collapse", "oracle", "problems", "solved", "initial_failure_rate"),
    *("iterations_mean", "iterations_std", "expansions_mean", "attempts_mean", "seconds"),
}


def call(*arguments) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    return int(left.value.code or 0)


PLAN = ["plan", "soma", "--problem", "17"]
WALK = [
    (0, [*PLAN]),
    (0, [*PLAN, "--collapse", "rigid", "--planner", "best-first"]),
    (0, [*PLAN, "--oracle", "physics"]),
    (0, [*PLAN, "--k", "3"]),
    (0, ["list"]),
    (0, ["--version"]),
    (0, ["plan", "--help"]),
    (11, [*PLAN, *IMPOSSIBLE]),
    (11, [*PLAN, *IMPOSSIBLE, "--planner", "best-first"]),
    (11, [*PLAN, *IMPOSSIBLE, "--k", "2"]),
    (12, [*PLAN, *IMPOSSIBLE, "--planner", "swap-repair"]),
    (23, [*PLAN, "--attempts", "1"]),
    (23, [*PLAN, "--seconds", "0"]),
    (23, [*PLAN, "--expansions", "2", "--planner", "best-first"]),
    (33, ["plan", "soma", "--problem", "240"]),
    (33, ["plan", "soma", "--problem", "one"]),
    (33, ["plan", "soma"]),
    (33, ["plan", "somma", "--problem", "1"]),
    (33, [*PLAN, "--nonsense"]),
    (33, [*PLAN, "--planner", "bestfirst"]),
    (33, [*PLAN, "--prior", "nothing"]),
    (33, [*PLAN, "--prior", "missing.safetensors"]),
    (33, [*PLAN, "--collapse", "gentle"]),
    (33, [*PLAN, "--oracle", "magic"]),
    (33, [*PLAN, "--oracle", "physics", "--collapse", "strict"]),
    (33, [*PLAN, "--before", "LT"]),
    (33, ["reproduce", "towers"]),
    (33, ["reproduce", "tower", "--scale", "papers"]),
    (33, ["reproduce", "tower", "--engine", "rays"]),
    (33, ["reproduce", "tower", "--address", "127.0.0.1:1"]),
    (33, ["reproduce", "tower", "--engine", "ray", "--address", "127.0.0.1:1"]),
    (33, ["reproduce", "soma", "--engine", "ray", "--address", "127.0.0.1"]),
    (33, [*PLAN, "--before", "L,T", "--before", "T,L"]),
    (33, [*PLAN, "--removed", "Q"]),
    (33, [*PLAN, "--attempts", "-1"]),
    (33, [*PLAN, "--k", "0"]),
    (33, [*PLAN, "--k", "2", "--planner", "backtracking"]),
    (33, [*PLAN, "--cells", "missing.json"]),
    (33, ["plan", "soma", "--cells", "missing.json"]),
    (33, ["compare", "soma", "--problems", "some"]),
    (33, ["compare", "soma", "--problems", "0"]),
    (33, ["compare", "soma", "--problems", "121"]),
    (33, ["compare", "soma", "--problems", "2", "--seeds", "0"]),
    (33, ["compare", "soma", "--problems", "2", "--prior", "nothing", "--json"]),
    (33, ["train", "soma", "--prior", "uniform", "--out", "x.safetensors"]),
    (33, ["train", "soma", "--prior", "sinkhorn", "--out", "x.pt"]),
    (33, ["train", "soma", "--prior", "sinkhorn", "--demos", "missing.npz", "--out", "x.safetensors"]),
    (33, ["demos", "soma", "--out", "x.npy"]),
    (33, ["no-such-command"]),
]


@pytest.mark.parametrize(("code", "arguments"), WALK, ids=[f"{code} {' '.join(a)[:60]}" for code, a in WALK])
def test_exit_code(code, arguments, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert call(*arguments) == code
    said = capfd.readouterr()
    assert "Traceback" not in said.err
    if code == 33:
        assert said.err.strip()
        assert said.out == ""
    elif arguments[0] == "plan" and "--help" not in arguments:
        assert EXIT_CODES[code] in said.out


def test_an_interrupt_has_its_own_code(monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("neurosym.pipeline.plans", interrupted)
    assert call(*PLAN) == INTERRUPTED


def test_a_doctor_that_finds_something_says_so(monkeypatch, capsys):
    monkeypatch.setattr("neurosym.commands.doctor.fcl_works", lambda: 1 / 0)
    assert call("doctor") == 1
    assert "pip install --force-reinstall python-fcl" in capsys.readouterr().out


def test_the_walk_meets_every_code_of_the_table():
    assert {code for code, _ in WALK} | {INTERRUPTED, 1} == EXIT_CODES.keys()
    assert {status.exit_code for status in ns.Status} <= EXIT_CODES.keys()


def test_the_installed_command_keeps_stdout_for_the_answer(tmp_path):
    command = [str(Path(sys.executable).parent / "neurosym"), "compare", "soma", "--problems", "3", "--json"]
    command += ["--prior", "random", "--prior", "none", "--workers", "2", "--oracle", "physics"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)["rows"]
    assert [(r["planner"], r["prior"]) for r in rows] == [
        (planner, prior) for prior in ("random", "none") for planner in ("swap-repair", "backtracking", "best-first")
    ]
    assert list(tmp_path.iterdir()) == []


def test_compare_as_json(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["--problems", "5", "--prior", "none", "--planner", "backtracking", "--seeds", "2", "--workers", "1"]
    assert call("compare", "soma", *arguments, "--collapse", "strict", "--json") == 0
    answer = json.loads(capfd.readouterr().out)
    assert answer.keys() == {"rows"}
    (row,) = answer["rows"]
    assert row.keys() >= ROW_KEYS
    assert (row["collapse"], row["oracle"], row["problems"], row["solved"]) == ("strict", "geometry", 5, 5)
    assert row["runs"] == 10
    assert 0 <= row["initial_failure_rate"] <= 1
    assert row["attempts_mean"] == pytest.approx(row["iterations_mean"] + 7)


def test_compare_writes_a_table_and_a_figure(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["compare", "soma", "--problems", "4", "--planner", "swap-repair", "--prior", "none", "--workers", "1"]
    assert call(*arguments, "--out", tmp_path / "deep" / "out") == 0
    with open(tmp_path / "deep" / "out" / "results.csv", newline="") as file:
        (row,) = csv.DictReader(file)
    assert row.keys() >= ROW_KEYS
    assert row["published_iterations_mean"] == "5.35"
    assert (tmp_path / "deep" / "out" / "iterations.png").read_bytes().startswith(b"\x89PNG")
    said = capsys.readouterr().out
    assert "5.35 ± 4.12" in said, "the paper's row stands beside ours"
    assert "Without looking at any picture" in said
    assert call(*arguments) == 0
    assert (tmp_path / "out" / "compare-soma" / "results.csv").exists(), "the default folder"


def test_plan_keeps_everything(tmp_path, capsys):
    out = tmp_path / "new" / "plan.json"
    options = ["--collapse", "rigid", "--planner", "swap-repair", "--seed", "3", "--out", out]
    assert call(*PLAN, *options, "--json") == 0
    kept, printed = json.loads(out.read_text()), json.loads(capsys.readouterr().out)
    assert kept == printed
    assert (kept["schema"], kept["problem"], kept["neurosym"]) == (1, "soma-17", __version__)
    assert kept["options"]["collapse"] == "rigid"
    assert [step["action"] for step in kept["steps"]] == kept["plan"]
    assert all(len(step["how"]) == 3 for step in kept["steps"]), "the direction in which each piece leaves"
    assert len(kept["refusals"]) == kept["iterations"]
    assert all(refusal["reason"] for refusal in kept["refusals"])
    problem = ns.load_domain("soma").problem(17, collapse="rigid")
    assert ns.validate(problem, kept["plan"])
    assert [p.name for p in out.parent.iterdir()] == ["plan.json"]


def test_plan_shows_each_refusal_with_its_reason_in_order(capsys):
    arguments = [*PLAN, "--planner", "swap-repair", "--seed", "1"]
    assert call(*arguments) == 0
    shown = capsys.readouterr().out
    assert call(*arguments, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    position = 0
    for refusal in answer["refusals"]:
        position = shown.index(refusal["reason"], position) + 1
    for i, action in enumerate(answer["plan"]):
        assert f"{i + 1}. {action}" in shown


def test_a_failed_plan_shows_prefix_and_blame(capsys):
    assert call(*PLAN, *IMPOSSIBLE) == 11
    said = capsys.readouterr().out
    assert "The longest prefix that works: nothing (0 of 7)." in said
    assert "not L: Without L, 2 cubes of Z, B would fall." in said


def test_the_k_best_plans_are_different_and_ordered(capsys, tmp_path):
    assert call(*PLAN, "--k", "4", "--collapse", "strict", "--prior", "random", "--json") == 0
    plans = json.loads(capsys.readouterr().out)["plans"]
    assert len({tuple(p["plan"]) for p in plans}) == 4
    costs = [p["cost"] for p in plans]
    assert costs == sorted(costs)


def test_a_puzzle_of_ones_own(tmp_path, capsys):
    cells = tmp_path / "tower.json"
    cells.write_text(json.dumps({"bottom": [[0, 0, 0]], "middle": [[0, 0, 1]], "top": [[0, 0, 2]]}))
    assert call("plan", "soma", "--cells", cells, "--collapse", "strict", "--json") == 0
    assert json.loads(capsys.readouterr().out)["plan"] == ["top", "middle", "bottom"]


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("{", "Expected JSON"),
        ("[1, 2]", "something else"),
        ('{"a": 3}', "something else"),
        ('{"a": [[0, 0, 0]], "b": [[0, 0, 0]]}', "same solid"),
        ('{"a": [[0, 0, 0]], "b": [[0, 0, 2]]}', "floating"),
        ('{"a": [[0, 0]]}', "three integers"),
    ],
)
def test_a_bad_puzzle_is_refused_with_the_reason(content, complaint, tmp_path, capsys):
    (tmp_path / "puzzle.json").write_text(content)
    assert call("plan", "soma", "--cells", tmp_path / "puzzle.json") == 33
    assert complaint in capsys.readouterr().err


def test_the_same_seed_gives_the_same_plan(capsys):
    found = []
    for seed in (5, 5):
        assert call(*PLAN, "--planner", "swap-repair", "--seed", seed, "--json") == 0
        found.append({k: v for k, v in json.loads(capsys.readouterr().out).items() if k != "seconds"})
    assert found[0] == found[1]


def test_list_names_everything_registered(capsys):
    assert call("list", "--json") == 0
    listed = json.loads(capsys.readouterr().out)
    assert list(listed["domains"]) == ns.domain_names()
    assert list(listed["planners"]) == ns.planner_names()
    assert sorted(listed["priors"]) == ns.prior_names()
    assert listed["planners"]["best-first"]["complete"] is True
    assert listed["priors"]["random"].startswith("Believes in one random permutation")
    assert listed["priors"]["tcn-paper"].startswith("The paper's BC+TCN")
    files = (Path(learned_priors.__file__).parent / "weights").glob("*.safetensors")
    headers = [read_header(path) for path in files]
    assert {(d, p) for d, priors in listed["weights"].items() for p in priors} == {
        (header["domain"], header["prior"]) for header in headers
    }


def test_weights_of_one_domain_that_several_packages_have_are_all_listed(monkeypatch, capsys):
    monkeypatch.setattr("neurosym.planning.catalogue.weights_beside", lambda entry: {"soma": [entry.name]})
    assert call("list", "--json") == 0
    assert json.loads(capsys.readouterr().out)["weights"] == {"soma": ns.prior_names()}


def test_list_loads_no_network_library():
    code = "import sys, neurosym.cli as c\ntry: c.main(['list'])\nexcept SystemExit: print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"


@pytest.fixture(scope="module")
def demonstrations(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demos")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NEUROSYM_CACHE", str(folder / "cache"))
        assert call("demos", "soma", "--recipe", "paper", "--out", folder / "demos.npz") == 0
        yield folder / "demos.npz"


def test_demos_are_those_of_the_training_half(demonstrations):
    loaded = ns.Demonstrations.load(demonstrations)
    assert loaded.pictures.shape == (120, 4, 64, 64, 3)
    assert sorted(np.unique(loaded.groups)) == sorted(ns.load_domain("soma").numbers("train"))


def test_train_then_compare_with_the_file(demonstrations, tmp_path, capfd):
    weights = tmp_path / "mine.safetensors"
    arguments = ["train", "soma", "--prior", "sinkhorn-paper", "--demos", demonstrations, "--epochs", "3"]
    assert call(*arguments, "--out", weights) == 0
    said = capfd.readouterr()
    assert "held out" in said.err, "early figures"
    assert re.search(r"On 20 problems kept from training: \d\.\d+ refusals a plan, without a prior \d", said.err)
    assert str(weights) in said.out
    assert [p.name for p in tmp_path.iterdir()] == ["mine.safetensors"], "the checkpoint goes in the end"
    asked = ["--problems", "3", "--planner", "backtracking", "--prior", weights, "--json", "--workers", "1"]
    assert call("compare", "soma", *asked) == 0
    (row,) = json.loads(capfd.readouterr().out)["rows"]
    assert (row["prior"], row["solved"]) == (str(weights), 3)


def test_training_goes_on_after_a_kill(demonstrations, tmp_path, monkeypatch, capsys):
    weights = tmp_path / "mine.safetensors"
    arguments = ["train", "soma", "--prior", "tcn-paper", "--demos", demonstrations, "--epochs", "4", "--out", weights]
    assert call(*arguments) == 0
    whole = weights.read_bytes()
    weights.unlink()

    from learned_priors.network_prior import NetworkPrior

    def killed(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(NetworkPrior, "save", killed)
    assert call(*arguments) == INTERRUPTED
    monkeypatch.undo()
    capsys.readouterr()
    assert weights.with_suffix(".checkpoint").exists()
    assert call(*arguments) == 0
    assert "Going on from" in capsys.readouterr().err
    again = ns.load_prior(weights)
    weights.write_bytes(whole)
    pictures = ns.Demonstrations.load(demonstrations).pictures[0]
    assert np.array_equal(again.read(pictures).log_prob, ns.load_prior(weights).read(pictures).log_prob)


def test_options_of_a_family_reach_its_problems(capsys):
    assert call("plan", "soma", "--problem", "3", "--option", 'removed=["V"]', "--json") == 0
    assert "V" not in json.loads(capsys.readouterr().out)["plan"]
    for wrong, says in (("removed", "KEY=VALUE"), ("colour=red", "colour")):
        assert call("compare", "soma", "--problems", "1", "--prior", "none", "--option", wrong) == BAD_INPUT
        assert says in capsys.readouterr().err
    assert call("demos", "soma", "--out", "x.npz", "--option", "colour=red") == BAD_INPUT
    assert "colour" in capsys.readouterr().err


@pytest.mark.parametrize("extra", [("--paths", "any"), ("--option", "nonsense=1")])
@pytest.mark.parametrize("which", ["number", "cells"])
def test_options_that_a_domain_does_not_take_are_refused_by_name(which, extra, tmp_path, capsys):
    cells = tmp_path / "own.json"
    cells.write_text('{"a": [[0, 0, 0]], "b": [[0, 0, 1]]}')
    given = ("--problem", 17) if which == "number" else ("--cells", cells)
    assert call("plan", "soma", *given, *extra) == BAD_INPUT
    said = capsys.readouterr().err
    assert "collapse" in said
    assert extra[-1].partition("=")[0] in said or "paths" in said


def test_options_are_all_but_what_names_the_problem():
    def problem(number, variant="a", *, seed=0): ...

    assert options_of(problem) == {"variant": "a", "seed": 0}
    check_options(problem, ["variant"], "x")
    with pytest.raises(ns.InputError, match="among variant, seed; got number"):
        check_options(problem, ["number"], "x")
    with pytest.raises(ns.InputError, match="no option"):
        check_options(lambda number: number, ["seed"], "x")
    check_options(lambda number, **options: number, ["anything"], "x")
