"""How precision is distributed: over seeds, as the paper's Fig. 4 has it, and over single sequences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from neurosym.experiments.order_accuracy import Counts
from neurosym.plotting.style import COLUMN, SMALL, TITLE, look_of, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Least width of the Gaussian kernels: a hundred test pictures do not tell shares further apart.
LEAST_WIDTH = 0.01
#: Height of a row (inches).
ROW = 0.33


def density_figure(
    title: str,
    seeds: Mapping[str, Sequence[float]],
    counts: Mapping[str, Counts],
    paper: Mapping[str, float] | None = None,
) -> Figure:
    """A row a method. Left: kernel density of the share of whole sequences over seeds, each curve to one height;
    right: shares of the test sequences by their number of right steps.

    Args:
        title: of the figure.
        seeds: method -> share of whole sequences, a value a seed.
        counts: method -> all its test sequences.
        paper: method -> the paper's mean over seeds, a diamond.
    """
    from matplotlib.figure import Figure

    methods = list(seeds)
    figure = Figure(figsize=(COLUMN, 1.0 + ROW * len(methods)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    grid = np.linspace(0, 1, 401)
    for level, method in enumerate(reversed(methods)):
        colour = look_of(method, level).colour
        curve = kernel_density(seeds[method], grid)
        left.fill_between(grid, level, level + 0.8 * curve / curve.max(), color=colour, alpha=0.4, lw=0, zorder=2)
        left.plot(seeds[method], [level + 0.08] * len(seeds[method]), "|", ms=6, mew=1, color=colour, zorder=3)
        if paper and method in paper:
            left.plot(paper[method], level + 0.3, "D", ms=4, mfc="white", mec="black", mew=0.8, zorder=4, clip_on=False)
        _steps(right, level, counts[method], colour)
        for axis in (left, right):
            axis.axhline(level, color="0.75", lw=0.5, zorder=1)
    left.set_yticks([level + 0.3 for level in range(len(methods))], methods[::-1], fontsize=SMALL)
    left.set_ylim(-0.1, len(methods))
    left.set_xlim(-0.02, 1.02)
    left.set_xticks([0, 0.5, 1], ["0", ".5", "1"])
    left.set_title("over seeds: density\n(each to one height)", fontsize=SMALL, pad=3)
    right.set_title("over sequences: share\n(full row: 100%)", fontsize=SMALL, pad=3)
    left.set_xlabel("share right as a whole", fontsize=SMALL)
    right.set_xlabel("steps right", fontsize=SMALL)
    for axis in (left, right):
        tidy(axis, sides=("top", "right", "left"))
        axis.tick_params(axis="y", length=0)
    figure.suptitle(title, fontsize=TITLE)
    _legend(figure, with_paper=bool(paper))
    return figure


def _legend(figure: Figure, *, with_paper: bool) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], ls="", marker="|", ms=6, color="0.3", label="one seed")]
    if with_paper:
        handles.append(Line2D([], [], ls="", marker="D", ms=4, mfc="white", mec="black", label="mean in the paper"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=SMALL, frameon=False)


def kernel_density(values: ArrayLike, grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gaussian kernel density on a grid; width by Silverman's rule, at least `LEAST_WIDTH`."""
    own = np.asarray(values, dtype=np.float64)
    width = max(1.06 * float(own.std()) * len(own) ** -0.2, LEAST_WIDTH)
    kernels = np.exp(-0.5 * ((grid[:, None] - own) / width) ** 2) / (width * np.sqrt(2 * np.pi))
    density: NDArray[np.float64] = kernels.mean(axis=1)
    return density


def _steps(axis: Axes, level: int, counts: Counts, colour: str) -> None:
    shares = counts.right.sum(axis=0) / counts.right.sum()
    steps = np.arange(len(shares))
    axis.bar(steps, 0.85 * shares, width=0.8, bottom=level, color=colour, zorder=2)
    axis.set_xticks(steps)
