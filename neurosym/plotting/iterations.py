"""How many iterations planners need with each prior."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from neurosym.experiments.benchmark import NO_PRIOR, Outcome, Run
from neurosym.experiments.reporting import published
from neurosym.plotting.labels import shortened
from neurosym.plotting.style import COLOURS, COLUMN, LOOKS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Counts above this share one bar: the tail of a planner without a prior would squeeze all others.
LAST_BAR = 12
#: Longest name of a prior: bars need the room.
MOST_LETTERS = 20


def iterations_figure(outcome: Outcome) -> Figure:
    """How many iterations each planner needs with each prior: a histogram a prior, a panel a planner.

    Bars are shares of runs at 0, 1, 2, ... iterations; a dot marks the mean, a diamond the paper's. Made for a
    column of `COLUMN` inches; save it with ``figure.savefig(path, dpi=300)``.
    """
    from matplotlib.figure import Figure

    comparison = outcome.comparison
    planners, priors = comparison.planners, comparison.priors
    last = min(LAST_BAR, max(1, *(r.iterations for r in outcome.runs)))
    height = 0.75 + len(planners) * (0.28 + 0.30 * len(priors))
    figure = Figure(figsize=(COLUMN, height), layout="constrained")
    axes = figure.subplots(len(planners), 1, sharex=True, squeeze=False)[:, 0]
    marked = False
    for axis, planner in zip(axes, planners):
        for position, prior in enumerate(priors):
            runs = [r for r in outcome.runs if (r.planner, r.prior) == (planner, prior)]
            _histogram(axis, len(priors) - 1 - position, runs, _colour(prior, position), last)
            paper = published(comparison.domain, planner, prior)
            if paper and paper.get("iterations"):
                at = min(float(paper["iterations"][0]), last + 0.45)
                level = len(priors) - 1 - position + 0.13
                axis.plot(at, level, "D", ms=4, mfc="white", mec="black", mew=0.9, zorder=4)
                marked = True
        _dress(axis, planner, priors, last)
    axes[-1].set_xlabel("iterations (refusals before the plan)", fontsize=8)
    counts = f"{len(comparison.numbers)} problems" + (f" × {comparison.seeds} seeds" if comparison.seeds > 1 else "")
    rule = str(comparison.options.get("collapse") or "")
    said = ", ".join(filter(None, [comparison.domain, rule, comparison.oracle]))
    figure.suptitle(f"{said}: n = {counts}\nbars: share of runs (a full row is 100%)", fontsize=8)
    _legend(figure, marked)
    return figure


def _histogram(axis: Axes, level: int, runs: Sequence[Run], colour: str, last: int) -> None:
    iterations = np.array([r.iterations for r in runs])
    shares = np.bincount(np.minimum(iterations, last), minlength=last + 1) / len(iterations)
    # A bar that holds every run is as tall as a row allows.
    axis.bar(np.arange(last + 1), shares * 0.82, width=0.84, bottom=level, color=colour, zorder=2)
    axis.axhline(level, color="0.75", lw=0.5, zorder=1)
    mean = float(iterations.mean())
    axis.plot(min(mean, last + 0.45), level + 0.13, "o", ms=4, mfc="black", mec="white", mew=0.7, zorder=5)
    axis.text(last + 0.75, level + 0.1, f"{mean:.2f}", fontsize=7, va="bottom", ha="left", zorder=3)


def _colour(prior: str, position: int) -> str:
    """That of the prior in all figures, or one by position."""
    return LOOKS[prior].colour if prior in LOOKS else COLOURS[position % len(COLOURS)]


def _dress(axis: Axes, planner: str, priors: Sequence[str], last: int) -> None:
    files = [p.rsplit("/", 1)[-1].removesuffix(".safetensors") for p in priors]
    names = ["no prior" if p == NO_PRIOR else shortened(name, MOST_LETTERS) for p, name in zip(priors, files)]
    axis.set_yticks([len(priors) - 1 - i + 0.3 for i in range(len(priors))], names, fontsize=7)
    axis.set_ylim(-0.08, len(priors))
    axis.set_xlim(-0.65, last + 2.4)
    ticks = list(range(0, last + 1, 2 if last > 6 else 1))
    labels = [str(t) for t in ticks]
    if last == LAST_BAR:
        labels[-1] += "+"
    axis.set_xticks(ticks, labels, fontsize=7)
    axis.set_title(planner, fontsize=8, loc="left", fontweight="bold", pad=2)
    axis.tick_params(axis="y", length=0)
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    axis.text(last + 0.75, len(priors) - 0.02, "mean", fontsize=7, va="bottom", ha="left", color="0.35")


def _legend(figure: Figure, with_paper: bool) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], ls="", marker="o", ms=4, mfc="black", mec="white", label="mean")]
    if with_paper:
        handles.append(Line2D([], [], ls="", marker="D", ms=4, mfc="white", mec="black", label="mean in the paper"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=7, frameon=False, handletextpad=0.4)
