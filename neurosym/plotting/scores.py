"""What priors believe: the probability of each action at each step, and the order that was chosen."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import PowerNorm
from matplotlib.patches import Rectangle

from neurosym.planning.order_scores import OrderScores
from neurosym.plotting.errors import write_shares
from neurosym.plotting.style import (
    COLOURS,
    COLUMN,
    SMALL,
    TITLE,
    Figure,
    add_legend,
    mark,
    shortened,
    tidy,
    without_common,
)

#: With more actions than these no probability is written into its cell, and then no names beside it.
WRITTEN, MOST_NAMES = 8, 30
#: Smallest letters (points).
_LETTERS = 6


def scores_figure(
    scores: Mapping[str, OrderScores] | OrderScores, *, plan: Sequence[str] = (), title: str = "order scores"
) -> Figure:
    """A matrix a prior: rows are steps, columns actions, shades probabilities, which add up to one in a row.

    Frames are the likeliest order, dots the plan that was found. Shades grow with the square root, so that what is
    unlikely is seen. Where the number of steps is unsure, its probability stands at the right of the last step.

    `scores`: of one prior, or name -> scores, all of the same actions. `plan`: names of actions in order. `title`: what
    the pictures show, or the problem's name.
    """
    given = {"": scores} if isinstance(scores, OrderScores) else dict(scores)
    first = next(iter(given.values()))
    columns = 2 if len(given) > 1 and first.n_actions <= 20 else 1
    rows = -(-len(given) // columns)
    side = (COLUMN - 0.9) / columns
    tall = min(max(side * first.n_steps / max(first.n_actions, 1), 0.4), 4.0)
    figure = Figure(figsize=(COLUMN, rows * (tall + 0.3) + 0.85), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    norm = PowerNorm(0.5, vmin=0, vmax=1)
    for axis in axes[len(given) :]:
        axis.remove()
    for k, (axis, (name, own)) in enumerate(zip(axes, given.items())):
        axis.imshow(np.exp(own.log_prob), cmap="Blues", norm=norm, aspect="auto")
        _mark(axis, own, plan)
        _dress(axis, own, first_column=k % columns == 0, last_row=k + columns >= len(given))
        axis.set_title(name, fontsize=SMALL, pad=3)
        if own.n_actions <= WRITTEN:
            write_shares(axis, np.exp(own.log_prob), _LETTERS if columns > 1 else 6.5)
    bar = figure.colorbar(ScalarMappable(norm, "Blues"), ax=list(axes[: len(given)]), aspect=30, pad=0.02)
    bar.ax.tick_params(labelsize=SMALL)
    bar.set_ticks([0, 0.1, 0.5, 1], labels=["0", ".1", ".5", "1"])
    bar.set_label("probability", fontsize=SMALL)
    figure.suptitle(f"{title}: n = {first.n_steps} steps × {first.n_actions} actions", fontsize=TITLE)
    named = first.actions and first.n_actions <= MOST_NAMES
    for axis in axes[: len(given)][-columns:]:
        axis.set_xlabel("action" if named else "action (number)", fontsize=TITLE)
    figure.supylabel("step", fontsize=TITLE)
    marks = [mark("s", "likeliest order", mfc="none", mec=COLOURS[3], mew=1.3, ms=6)]
    marks += [mark("o", "the plan", ms=3, mfc="white", mec="black")] if plan else []
    add_legend(figure, marks)
    return figure


def _mark(axis: Axes, own: OrderScores, plan: Sequence[str]) -> None:
    for step, action in enumerate(own.order()):
        square = Rectangle((action - 0.5, step - 0.5), 1, 1, fill=False, ec=COLOURS[3], lw=1.3, clip_on=False, zorder=3)
        axis.add_patch(square)
    for step, name in enumerate(plan):
        if name in own.actions and step < own.n_steps:
            place = (own.actions.index(name) + 0.32, step - 0.32)
            axis.plot(*place, "o", ms=2.6, mfc="white", mec="black", mew=0.7, zorder=4)


def _dress(axis: Axes, own: OrderScores, *, first_column: bool, last_row: bool) -> None:
    n = own.n_actions
    short = without_common(own.actions)
    names = [shortened(short[name]) for name in own.actions] or [str(i) for i in range(n)]
    if n <= MOST_NAMES:
        long = max(map(len, names), default=0) > 2
        axis.set_xticks(range(n), names if last_row else [""] * n, rotation=90 if long else 0)
    every = max(1, -(-own.n_steps // 15))
    steps = range(0, own.n_steps, every)
    axis.set_yticks(steps, [str(s + 1) for s in steps] if first_column else [""] * len(steps))
    tidy(axis, sides=("top", "right", "left", "bottom"))
    axis.tick_params(length=0, pad=1)
    axis.tick_params(axis="x", labelsize=SMALL if n <= 20 else _LETTERS)
    if own.log_length is not None:
        for step, log in enumerate(own.log_length[1:]):
            text = f"{100 * np.exp(log):.0f}% ends"
            axis.text(n - 0.4, step, text, fontsize=_LETTERS, va="center", ha="left", color="0.3")
