"""How many iterations planners need with each prior."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from neurosym.plotting.style import (
    COLOURS,
    COLUMN,
    LOOKS,
    SMALL,
    TITLE,
    Figure,
    add_legend,
    mark,
    papers_mark,
    shortened,
    tidy,
)

#: Counts above this share one bar: the tail of a planner without a prior would squeeze all others.
LAST_BAR = 12
#: Longest name of a prior: bars need the room.
MOST_LETTERS = 20


def iterations_figure(
    title: str,
    iterations: Mapping[str, Mapping[str, ArrayLike]],
    *,
    paper: Mapping[tuple[str, str], float] | None = None,
) -> Figure:
    """How many iterations each planner needs with each prior: a histogram a prior, a panel a planner.

    Bars are shares of runs at 0, 1, 2, ... iterations; a dot marks the mean, a diamond the paper's. Made for a
    column of `COLUMN` inches.

    `title`: what was planned, with n. `iterations`: planner -> prior -> int64 (runs,); all planners have the same
    priors. "none" is no prior. `paper`: (planner, prior) -> the mean that is published.
    """
    runs = {planner: {name: np.asarray(own) for name, own in row.items()} for planner, row in iterations.items()}
    priors = list(next(iter(runs.values())))
    last = min(LAST_BAR, max(1, *(int(own.max()) for row in runs.values() for own in row.values())))
    figure = Figure(figsize=(COLUMN, 0.75 + len(runs) * (0.28 + 0.30 * len(priors))), layout="constrained")
    axes = figure.subplots(len(runs), 1, sharex=True, squeeze=False)[:, 0]
    marks = [mark("o", "mean", ms=4, mfc="black", mec="white")]
    for axis, (planner, row) in zip(axes, runs.items()):
        for position, prior in enumerate(priors):
            level = len(priors) - 1 - position
            colour = LOOKS[prior].colour if prior in LOOKS else COLOURS[position % len(COLOURS)]
            _histogram(axis, level, row[prior], colour, last)
            if (planner, prior) in (paper or {}):
                at = min(float((paper or {})[planner, prior]), last + 0.45)
                axis.plot(at, level + 0.13, "D", ms=4, mfc="white", mec="black", mew=0.9, zorder=4)
                marks[1:] = [papers_mark()]
        _dress(axis, planner, priors, last)
    axes[-1].set_xlabel("iterations (refusals before the plan)", fontsize=TITLE)
    figure.suptitle(f"{title}\nbars: share of runs (a full row is 100%)", fontsize=TITLE)
    add_legend(figure, marks, columns=3, handletextpad=0.4)
    return figure


def _histogram(axis: Axes, level: int, iterations: np.ndarray, colour: str, last: int) -> None:
    shares = np.bincount(np.minimum(iterations, last), minlength=last + 1) / len(iterations)
    # A bar that holds every run is as tall as a row allows.
    axis.bar(np.arange(last + 1), shares * 0.82, width=0.84, bottom=level, color=colour, zorder=2)
    axis.axhline(level, color="0.75", lw=0.5, zorder=1)
    mean = float(iterations.mean())
    axis.plot(min(mean, last + 0.45), level + 0.13, "o", ms=4, mfc="black", mec="white", mew=0.7, zorder=5)
    axis.text(last + 0.75, level + 0.1, f"{mean:.2f}", fontsize=SMALL, va="bottom", ha="left", zorder=3)


def _dress(axis: Axes, planner: str, priors: Sequence[str], last: int) -> None:
    files = [PurePath(prior).name.removesuffix(".safetensors") for prior in priors]
    names = ["no prior" if prior == "none" else shortened(file, MOST_LETTERS) for prior, file in zip(priors, files)]
    axis.set_yticks([len(priors) - 1 - i + 0.3 for i in range(len(priors))], names)
    axis.set_ylim(-0.08, len(priors))
    axis.set_xlim(-0.65, last + 2.4)
    ticks = list(range(0, last + 1, 2 if last > 6 else 1))
    labels = [str(tick) for tick in ticks]
    if last == LAST_BAR:
        labels[-1] += "+"
    axis.set_xticks(ticks, labels)
    axis.set_title(planner, fontsize=TITLE, loc="left", fontweight="bold", pad=2)
    axis.tick_params(axis="y", length=0)
    tidy(axis, sides=("top", "right", "left"))
    axis.text(last + 0.75, len(priors) - 0.02, "mean", fontsize=SMALL, va="bottom", ha="left", color="0.35")
