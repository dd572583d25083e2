"""Figures: returned, not shown; legible at column width; without matplotlib's global state."""

import subprocess
import sys

import numpy as np
import pytest

from neurosym.benchmark import Comparison, Outcome, Run
from neurosym.plotting import COLOURS, COLUMN, iterations_figure, save


def outcome(priors=("none", "sinkhorn"), planners=("swap-repair", "best-first"), seeds=2, n=30) -> Outcome:
    comparison = Comparison("soma", tuple(range(n)), planners, priors, {"collapse": "cubes"}, seeds=seeds)
    rng = np.random.default_rng(0)
    runs = []
    for planner, prior, seed in comparison.cells:
        for number in comparison.numbers:
            count = int(rng.poisson(5 if prior == "none" else 0.2))
            runs.append(Run(planner, prior, seed, number, "SOLVED", count, 7, 7 + count, 0.001, count > 0))
    return Outcome(comparison, tuple(runs))


def texts(figure):
    return [t.get_text() for t in figure.findobj(lambda artist: hasattr(artist, "get_text"))]


def test_it_says_what_is_drawn_with_units_and_n():
    said = " | ".join(texts(iterations_figure(outcome())))
    for piece in ("iterations (refusals", "30 problems × 2 seeds", "no prior", "sinkhorn", "swap-repair", "best-first"):
        assert piece in said


def test_it_fits_a_column():
    assert iterations_figure(outcome()).get_figwidth() == COLUMN


def test_bars_are_shares_of_all_runs():
    axis = iterations_figure(outcome(priors=("none",), planners=("swap-repair",))).axes[0]
    heights = sum(patch.get_height() for patch in axis.patches)
    assert heights == pytest.approx(0.82)


def test_the_published_mean_is_marked_where_there_is_one():
    def diamonds(given):
        return [line for axis in iterations_figure(given).axes for line in axis.lines if line.get_marker() == "D"]

    assert [line.get_xdata()[0] for line in diamonds(outcome())] == [5.35]
    assert diamonds(outcome(priors=("sinkhorn",), planners=("best-first",))) == []


def test_colours_are_different_and_enough():
    assert len(set(COLOURS)) == len(COLOURS) >= 5


def test_a_single_run_and_many_priors_can_be_drawn(tmp_path):
    assert save(iterations_figure(outcome(n=1, seeds=1)), tmp_path / "one.png").stat().st_size > 1000
    many = tuple(f"p{i}" for i in range(12))
    assert save(iterations_figure(outcome(priors=many, n=2)), tmp_path / "deep" / "many.pdf").exists()
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_pyplot_is_never_loaded():
    code = (
        "import sys; sys.path.insert(0, 'tests'); from test_plotting import *;"
        "iterations_figure(outcome(n=3)); assert 'matplotlib' in sys.modules;"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=str(__import__("pathlib").Path(__file__).parents[1]))
