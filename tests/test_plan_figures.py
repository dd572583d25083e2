"""Figures of assemblies, searches, scores and training: they say what was found, and fit a column."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import matplotlib.colors
import numpy as np
import pytest
from matplotlib.text import Text

import neurosym as ns
from neurosym.plotting import (
    COLUMN,
    blocking_figure,
    contact_figure,
    learning_figure,
    save,
    scores_figure,
    search_figure,
)
from neurosym.plotting.layers import box_width, in_layers
from neurosym.plotting.routes import bends, curve
from neurosym.plotting.search import MOST_REFUSALS, ON_PLAN, REFUSED
from neurosym.plotting.style import shortened
from neurosym.testing.toys import NumberLine

STOOL = {"seat": [(x, 0, 1) for x in range(3)], "left": [(0, 0, 0)], "right": [(2, 0, 0)]}
HOOKED = {"hook": [(0, 0, 0), (1, 0, 0), (1, 0, 1)], "eye": [(0, 0, 1), (0, 0, 2), (1, 0, 2), (2, 0, 2), (2, 0, 1)]}


def texts(figure):
    return [t.get_text() for t in figure.findobj(lambda artist: hasattr(artist, "get_text"))]


def places(figure):
    """Where the names are, in inches: the last text of a name is its box."""
    return {t.get_text(): t.get_position() for t in figure.axes[0].texts if t.get_bbox_patch() is not None}


def same_colour(a, b):
    return matplotlib.colors.same_color(a, b)


# -- what blocks, what touches --------------------------------------------------------------------------------


def test_what_is_free_is_drawn_above_what_it_blocks():
    figure = blocking_figure(ns.Assembly.from_cells(STOOL), "+z", title="stool")
    where = places(figure)
    assert where["seat"][1] > where["left"][1] == where["right"][1]
    arrows = [t for t in figure.axes[0].texts if getattr(t, "arrow_patch", None) is not None]
    assert {(tuple(a.xyann), tuple(a.xy)) for a in arrows} == {
        (where[leg], where["seat"]) for leg in ("left", "right")
    }  # a leg moved up hits the seat


def test_parts_that_leave_only_together_are_in_a_frame():
    from matplotlib.patches import FancyBboxPatch

    def frames(directions):
        axis = blocking_figure(ns.Assembly.from_cells(HOOKED), directions).axes[0]
        return [p for p in axis.patches if isinstance(p, FancyBboxPatch)]

    (frame,) = frames("+x")  # the hook's upper cell is between the eye's legs
    assert frame.get_width() > box_width("hook") + box_width("eye")
    assert frames("+y") == []  # sideways both are free


def test_opposite_directions_share_a_panel_and_the_title_says_n():
    said = " | ".join(texts(blocking_figure(ns.Assembly.from_cells(STOOL), title="stool")))
    for piece in ("stool", "n = 3 parts, 3 directions with their opposites", "along +z", "into the ground", "along +y"):
        assert piece in said


def test_contacts_have_their_areas_and_the_ground_is_below():
    assembly = ns.Assembly.from_cells(STOOL, size=2.0)
    figure = contact_figure(assembly, title="stool")
    where = places(figure)
    assert where["seat"][1] > where["left"][1] > where["the ground"][1]
    said = " | ".join(texts(figure))
    assert "n = 3 parts, 4 contacts" in said
    assert "area 4" in said  # 2 x 2


@pytest.mark.parametrize("draw", [blocking_figure, contact_figure])
def test_many_parts_become_a_matrix_that_holds_every_pair(draw):
    column = ns.Assembly.from_cells({f"block {z}": [(0, 0, z)] for z in range(20)})
    figure = draw(column)
    images = [image.get_array() for axis in figure.axes for image in axis.images]
    if draw is blocking_figure:
        up, *sideways = images
        assert np.count_nonzero(up) == 20 * 19 / 2
        assert np.array_equal(up, np.tril(np.ones((20, 20)), -1))  # the free one first
        assert not any(np.count_nonzero(image) for image in sideways)
    else:
        assert np.count_nonzero(np.nan_to_num(images[0].filled(0))) == 2 * 20  # 19 joints and the ground, both ways
    assert figure.get_figwidth() == COLUMN


def test_layers_that_are_too_wide_are_staggered_and_no_box_lies_on_another():
    names = [f"a long name {k}" for k in range(12)]
    layout = in_layers([names[:10], names[10:]], [(names[0], names[11])], 3.2)
    boxes = [(x - box_width(n) / 2, x + box_width(n) / 2, y) for n, (x, y) in layout.places.items()]
    assert all(left >= 0 and right <= 3.2 and 0 <= y <= layout.height for left, right, y in boxes)
    for i, (left, right, y) in enumerate(boxes):
        for other_left, other_right, other_y in boxes[:i]:
            assert abs(y - other_y) > 0.15 or right < other_left or other_right < left


def test_no_line_runs_through_the_box_of_another():
    rng = np.random.default_rng(0)
    for count in (3, 7, 12):
        row = {f"p{k}": (0.2 + 3.0 * k / count, 1.0 + 0.7 * float(rng.integers(2))) for k in range(count)}
        pairs = [(a, b) for a in row for b in row if a < b]
        for (a, b), bend in zip(pairs, bends(pairs, row, (0.0, 0.0, 3.4, 2.7))):
            line = curve(row[a], row[b], bend)
            assert line.min() >= 0
            assert (line <= (3.4, 2.7)).all()
            for name, (x, y) in row.items():
                inside = (abs(line[:, 0] - x) < box_width(name) / 2) & (abs(line[:, 1] - y) < 0.075)
                assert name in (a, b) or not inside.any()


def test_a_line_with_nothing_in_its_way_is_straight():
    assert bends([("a", "b")], {"a": (1.0, 1.0), "b": (2.0, 1.0)}, (0.0, 0.0, 3.0, 3.0)) == [0.0]


@pytest.mark.parametrize("count", [20, 30, 45])
def test_rows_of_matrices_bear_names_that_can_be_read_or_numbers(count):
    column = ns.Assembly.from_cells({f"block {z}": [(0, 0, z)] for z in range(count)})
    figure = contact_figure(column)
    figure.draw_without_rendering()
    axis = figure.axes[0]
    said = [t.get_text() for t in axis.get_yticklabels()]
    assert said[:2] == (["block 0", "block 1"] if count <= 30 else ["1", "10"])
    assert {t.get_fontsize() for t in axis.get_yticklabels()} <= {6.0, 7.0}
    row = axis.get_window_extent().height / (count + 1) * 72 / figure.dpi
    assert row >= 6 or count > 30  # points: letters of one row do not lie on the next
    assert "20 free" in " ".join(
        texts(blocking_figure(ns.Assembly.from_cells({f"{x}": [(x, 0, 0)] for x in range(20)})))
    )


def test_a_long_name_keeps_both_ends():
    assert shortened("short") == "short"
    names = {shortened(f"left_front_bracket_{k}") for k in range(20)}
    assert len(names) == 20
    assert all(len(name) == 14 and name.startswith("left") for name in names)
    assert [shortened("abcdef", k) for k in (1, 2, 3)] == ["…", "a…", "a…f"]


# -- searches -------------------------------------------------------------------------------------------------


def marks(figure, marker, colour=None):
    return [
        line
        for line in figure.axes[0].lines
        if line.get_marker() == marker and (colour is None or same_colour(line.get_color(), colour))
    ]


def test_every_refusal_is_a_cross_at_its_step_and_the_plan_a_line():
    result = ns.solve(ns.load_domain("soma").problem(17, collapse="strict"), planner="swap-repair", rng=3)
    assert result.blame
    figure = search_figure(result, title="Soma 17")
    crosses = sorted(int(line.get_xdata()[0]) for line in marks(figure, "x", REFUSED))
    assert crosses == sorted(len(r.after) + 1 for r in result.blame)
    assert sorted(int(line.get_xdata()[0]) for line in marks(figure, "o", ON_PLAN)) == list(range(8))
    said = " | ".join(texts(figure))
    assert "solved" in said
    assert f"n = {result.attempts} attempts, {result.iterations} iterations" in said


def test_a_search_without_a_plan_has_no_line_of_one():
    result = ns.load_planner("backtracking").plan(NumberLine([2, 4], 7))
    figure = search_figure(result)
    assert marks(figure, "o", ON_PLAN) == []
    assert result.status.name.lower().replace("_", " ") in " ".join(texts(figure))


def test_of_a_long_search_the_first_refusals_are_drawn_and_it_says_so():
    refusals = tuple(ns.Rejection("no", action=f"take(p{k})") for k in range(MOST_REFUSALS + 50))
    result = ns.PlanResult(ns.Status.GAVE_UP, None, 350, 1, 350, 0.1, blame=refusals)
    figure = search_figure(result)
    assert len(marks(figure, "x")) == MOST_REFUSALS
    assert f"the first {MOST_REFUSALS} of {MOST_REFUSALS + 50} refusals" in " ".join(texts(figure))


def names_at(figure):
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    return {t: t.get_window_extent(renderer) for t in figure.axes[0].texts if t.get_text()}


@pytest.mark.parametrize("steps", [3, 12, 30])
def test_names_of_a_search_are_inside_and_not_on_one_another_and_it_says_how_many_are_left_out(steps):
    plan = tuple(f"take({100 + k})" for k in range(steps))
    blame = tuple(ns.Rejection("no", action=f"take({200 + k})", after=plan[:k]) for k in range(steps))
    figure = search_figure(ns.PlanResult(ns.Status.SOLVED, plan, steps, steps, 2 * steps, 0.1, blame=blame))
    names = names_at(figure)
    refused = {t.get_text() for t in names if same_colour(t.get_color(), REFUSED)}
    assert refused == {str(200 + k) for k in range(steps)}  # all of them, whole
    for text, box in names.items():
        assert box.x0 >= 0, text
        assert box.x1 <= figure.bbox.x1, text
        assert not any(box.overlaps(other) for t, other in names.items() if t is not text), text
    accepted = {t.get_text() for t in names} - refused
    left_out = steps - len(accepted)
    assert accepted <= {str(100 + k) for k in range(steps)}
    assert (left_out == 0) == (steps < 30)
    assert (f"{left_out} names are left out" in " ".join(texts(figure))) == (left_out > 0)


def test_steps_and_kinds_that_are_there_are_named():
    plan = tuple(f"take({k})" for k in range(42))
    figure = search_figure(ns.PlanResult(ns.Status.SOLVED, plan, 0, 42, 42, 0.1))
    ticks = [int(t) for t in figure.axes[0].get_xticks()]
    assert len(ticks) <= 10
    assert ticks[0] == 0
    assert {t.get_text() for t in figure.legends[0].get_texts()} == {"the plan"}
    assert "0 iterations, 42 expansions" in " ".join(texts(figure))


def test_names_lose_what_all_of_them_share():
    blame = (ns.Rejection("no", action="take(b)", after=("take(a)",)),)
    result = ns.PlanResult(ns.Status.SOLVED, ("take(a)", "take(c)", "take(b)"), 1, 3, 4, 0.1, blame=blame)
    said = texts(search_figure(result))
    assert {"a", "b", "c"} <= set(said)
    assert not any("take" in piece for piece in said)


# -- scores ---------------------------------------------------------------------------------------------------


def test_frames_are_the_likeliest_order_and_dots_the_plan():
    scores = ns.OrderScores.from_order([2, 0, 1], ["a", "b", "c"], confidence=0.9)
    figure = scores_figure(scores, plan=["a", "c", "b"])
    axis = figure.axes[0]
    assert np.allclose(axis.images[0].get_array(), np.exp(scores.log_prob))
    squares = [(round(p.get_x() + 0.5), round(p.get_y() + 0.5)) for p in axis.patches]
    assert squares == [(2, 0), (0, 1), (1, 2)]
    dots = [(round(float(line.get_xdata()[0])), round(float(line.get_ydata()[0]))) for line in axis.lines]
    assert dots == [(0, 0), (2, 1), (1, 2)]
    assert "n = 3 steps × 3 actions" in " ".join(texts(figure))


def test_scores_of_several_priors_and_of_unsure_lengths(tmp_path):
    names = [f"tile {k}" for k in range(30)]
    unsure = ns.OrderScores(np.zeros((4, 30)), tuple(names), np.log([0.01, 0.09, 0.4, 0.4, 0.1]))
    figure = scores_figure({"uniform": unsure, "sure": ns.OrderScores.from_order([0, 1, 2, 3], names)})
    assert "40% ends" in texts(figure)
    assert figure.get_figwidth() == COLUMN
    assert save(figure, tmp_path / "scores.png").stat().st_size > 1000


@pytest.mark.parametrize("count", [3, 8, 28, 42])
def test_letters_of_scores_can_be_read_and_lie_on_no_others(count):
    names = [f"remove({100 + k})" for k in range(count)]
    scores = ns.OrderScores.from_order(list(range(count)), names, confidence=0.5)
    figure = scores_figure({"one": scores, "two": scores}, plan=names)
    figure.draw_without_rendering()
    assert min(t.get_fontsize() for t in figure.findobj(Text) if t.get_text()) >= 6
    below = [axis for axis in figure.axes if any(t.get_text() for t in axis.get_xticklabels()) and axis.images]
    for axis in below:
        labels = [t for t in axis.get_xticklabels() if t.get_text()]
        boxes = [t.get_window_extent() for t in labels]
        assert not any(a.overlaps(b) for a, b in itertools.pairwise(boxes))
        if count <= 30:
            assert [t.get_text() for t in labels] == [str(100 + k) for k in range(count)]
    assert ("action (number)" in texts(figure)) == (count > 30)


# -- training -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Epoch:
    epoch: int
    train_loss: float
    held_out_loss: float | None = None
    held_out_whole_order_accuracy: float | None = None


def test_learning_is_drawn_above_and_what_is_right_below():
    epochs = [Epoch(k, 2.0 / k, 2.2 / k, k / 10) for k in range(1, 10)]
    figure = learning_figure("Soma", {"sinkhorn": epochs, "tcn": epochs[:4]}, held_out=24)
    above, below = figure.axes
    assert list(below.lines[0].get_ydata()) == [k / 10 for k in range(1, 10)]
    assert [line.get_linestyle() for line in above.lines] == [":", "-", ":", "-"]
    said = " | ".join(texts(figure))
    for piece in ("nats a step", "held-out orders", "n = 24 demonstrations held out", "sinkhorn", "tcn", "epoch"):
        assert piece in said


def test_losses_of_different_kinds_have_a_panel_each_and_the_legend_lies_on_no_curve():
    epochs = [Epoch(k, 2.0 / k, 2.2 / k, k / 10) for k in range(1, 10)]
    kinds = {"sinkhorn-paper": "squared error", "tcn": "loss (nats a step)"}
    figure = learning_figure("Soma", dict.fromkeys(kinds, epochs), loss=kinds, trained=96, held_out=24)
    assert [axis.get_ylabel() for axis in figure.axes[:2]] == list(kinds.values())
    assert [len(axis.lines) for axis in figure.axes] == [2, 2, 2]
    assert all(axis.get_legend() is None for axis in figure.axes)
    assert all(axis.get_ylim()[0] <= 0 for axis in figure.axes)
    assert "n = 96 demonstrations to learn from, 24 held out" in " ".join(texts(figure))
    with pytest.raises(ns.InputError, match=r"name of each method's loss; got none of tcn"):
        learning_figure("Soma", dict.fromkeys(kinds, epochs), loss={"sinkhorn-paper": "squared error"})


def test_nothing_held_out_leaves_the_loss_alone():
    figure = learning_figure("Soma", {"sinkhorn": [Epoch(1, 1.0), Epoch(2, 0.5)]}, held_out=24)
    assert len(figure.axes) == 1
    assert "held out" not in " ".join(texts(figure))
    with pytest.raises(ns.InputError, match="at least one epoch"):
        learning_figure("Soma", {"sinkhorn": []})
