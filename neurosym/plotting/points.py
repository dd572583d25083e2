"""Methods one below the other, a panel a figure of merit: each seed, the mean, and what the paper prints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes

from neurosym.plotting.style import COLUMN, SMALL, TITLE, Figure, add_legend, look_of, mark, papers_mark, tidy

#: Height of a row (inches).
ROW = 0.19


@dataclass(frozen=True)
class Panel:
    """One figure of merit.

    Attributes:
        title: with its unit.
        values: row -> a value a seed; rows without values stay empty.
        paper: row -> mean and deviation that the paper prints; a deviation of 0 draws no bar.
        limits: of the axis; None lets it begin at 0 and end where the values do.
    """

    title: str
    values: Mapping[str, Sequence[float]]
    paper: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    limits: tuple[float, float] | None = (0.0, 1.0)


def points_figure(title: str, rows: Sequence[str], panels: Sequence[Panel], *, each: str = "one seed") -> Figure:
    """Rows from the top down, panels side by side: open dots are values, full ones their mean, diamonds the paper's.

    Made for a column of `COLUMN` inches. `each` says what an open dot is.
    """
    figure = Figure(figsize=(COLUMN, 0.95 + ROW * len(rows)), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axis, panel in zip(axes, panels):
        _draw(axis, rows, panel)
    axes[0].set_yticks(range(len(rows)), rows[::-1], fontsize=SMALL)
    axes[0].set_ylim(-0.6, len(rows) - 0.4)
    figure.suptitle(title, fontsize=TITLE)
    marks = [mark("o", each, ms=3.2, mfc="none", mec="0.3"), mark("o", "mean", ms=5, mfc="0.3", mec="white")]
    if any(set(panel.paper) & set(rows) for panel in panels):
        marks.append(papers_mark("the paper's", ms=3.8))
    add_legend(figure, marks, columns=3)
    return figure


def _draw(axis: Axes, rows: Sequence[str], panel: Panel) -> None:
    for position, row in enumerate(rows[::-1]):
        own, colour = list(panel.values.get(row, ())), look_of(row, position).colour
        axis.axhline(position, color="0.9", lw=0.6, zorder=0)
        if own:
            axis.plot(own, [position] * len(own), "o", ms=3.2, mfc="none", mec=colour, mew=0.7, zorder=2, clip_on=False)
            axis.plot(np.mean(own), position, "o", ms=5, mfc=colour, mec="white", mew=0.6, zorder=3, clip_on=False)
        if row in panel.paper:
            mean, deviation = panel.paper[row]
            if deviation:
                axis.plot([mean - deviation, mean + deviation], [position + 0.24] * 2, color="0.4", lw=0.8, zorder=1)
            axis.plot(mean, position + 0.24, "D", ms=3.8, mfc="white", mec="black", mew=0.8, zorder=4, clip_on=False)
    axis.set_title(panel.title, fontsize=SMALL, pad=3)
    axis.set_xlim(*(panel.limits or (0, None)))
    if panel.limits == (0.0, 1.0):
        axis.set_xticks([0, 0.5, 1], ["0", ".5", "1"])
    else:
        axis.locator_params(axis="x", nbins=2)
    tidy(axis, sides=("top", "right", "left"))
    axis.tick_params(axis="y", length=0)
