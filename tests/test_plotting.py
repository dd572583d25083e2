"""Figures: returned, not shown; legible at column width; without matplotlib's global state."""

import subprocess
import sys

import numpy as np
import pytest

import neurosym as ns
from neurosym.experiments.benchmark import Comparison, Outcome, Run
from neurosym.experiments.order_accuracy import Counts
from neurosym.experiments.reporting import figure_of
from neurosym.plotting import (
    COLOURS,
    COLUMN,
    Curves,
    classes_figure,
    curves_figure,
    repeats_figure,
    save,
)


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
    said = " | ".join(texts(figure_of(outcome())))
    for piece in ("iterations (refusals", "30 problems × 2 seeds", "no prior", "sinkhorn", "swap-repair", "best-first"):
        assert piece in said


def test_it_fits_a_column():
    assert figure_of(outcome()).get_figwidth() == COLUMN


def test_a_long_name_of_a_prior_leaves_room_for_the_bars():
    figure = figure_of(outcome(priors=("none", "runs/" + "a-long-name-" * 6 + "7.safetensors")))
    figure.draw_without_rendering()
    assert all(axis.get_window_extent().width > 0.5 * figure.bbox.width for axis in figure.axes)
    said = [t.get_text() for t in figure.axes[0].get_yticklabels()]
    assert said[0] == "no prior"
    assert (said[1][:6], said[1][-1]) == ("a-long", "7")


def test_bars_are_shares_of_all_runs():
    axis = figure_of(outcome(priors=("none",), planners=("swap-repair",))).axes[0]
    heights = sum(patch.get_height() for patch in axis.patches)
    assert heights == pytest.approx(0.82)


def test_the_published_mean_is_marked_where_there_is_one():
    def diamonds(given):
        return [line for axis in figure_of(given).axes for line in axis.lines if line.get_marker() == "D"]

    assert [line.get_xdata()[0] for line in diamonds(outcome())] == [5.35]
    assert diamonds(outcome(priors=("sinkhorn",), planners=("best-first",))) == []


def test_colours_are_different_and_enough():
    assert len(set(COLOURS)) == len(COLOURS) >= 5


def test_a_single_run_and_many_priors_can_be_drawn(tmp_path):
    assert save(figure_of(outcome(n=1, seeds=1)), tmp_path / "one.png").stat().st_size > 1000
    many = tuple(f"p{i}" for i in range(12))
    assert save(figure_of(outcome(priors=many, n=2)), tmp_path / "deep" / "many.pdf").exists()
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_pyplot_is_never_loaded():
    code = (
        "import sys; sys.path.insert(0, 'tests'); from test_plotting import *;"
        "figure_of(outcome(n=3)); assert 'matplotlib' in sys.modules;"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=str(__import__("pathlib").Path(__file__).parents[1]))


# -- what methods do not hide from one another ----------------------------------------------------------------


def counts_of(wrong):
    """Two classes of two actions; `wrong` of four steps are read as the other class."""
    wanted = np.array([[0, 1, 2, 3]] * 5)
    read = wanted.copy()
    read[0, :wrong] = (read[0, :wrong] + 2) % 4
    pictures = np.zeros((5, 1, 1, 1, 3), np.uint8)
    return Counts.of(read, ns.Demonstrations(pictures, wanted, ("a1", "a2", "b1", "b2"), classes=(0, 0, 1, 1)))


def test_equal_shares_of_methods_stand_side_by_side():
    same = counts_of(1)
    axis = classes_figure("letters", same.labels, {"tcn": same.confusion, "sinkhorn": same.confusion}).axes[0]
    places = [tuple(x) for line in axis.lines for x in line.get_xydata().round(6)]
    assert len(set(places)) == len(places) == 4
    assert all(abs(x - round(x)) < 0.4 for x, _ in places)  # still at their own class


def test_markers_at_both_ends_are_whole():
    for axis in repeats_figure("letters", {"tcn": counts_of(1).repeats}).axes:
        low, high = axis.get_ylim()
        values = np.concatenate([line.get_ydata() for line in axis.lines])
        assert low < min(0, values.min())
        assert high > 1.04 * values.max()


def test_bands_are_explained_where_there_are_some():
    def said(seeds):
        panel = Curves("steps right", {"tcn": {10: [0.5] * seeds, 20: [0.7] * seeds}})
        return " ".join(texts(curves_figure("tower", "demonstrations", [panel])))

    assert "bands: least to greatest" in said(2)
    assert "bands" not in said(1)
