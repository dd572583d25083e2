"""How precision is distributed: over seeds, as the paper's Fig. 4 has it, and over single sequences."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from neurosym.plotting.style import COLUMN, SMALL, TITLE, Figure, add_legend, look_of, mark, narrow, papers_mark, tidy
from neurosym.support.arrays import Array, Numbers

#: Least width of the Gaussian kernels: a hundred test pictures do not tell shares further apart.
LEAST_WIDTH = 0.01
#: Height of a row (inches).
ROW = 0.33


def density_figure(
    title: str,
    seeds: Mapping[str, Sequence[float]],
    right: Mapping[str, Numbers],
    paper: Mapping[str, float] | None = None,
) -> Figure:
    """A row a method. Left: kernel density of the share of whole sequences over seeds, each curve to one height;
    right: shares of the test sequences by their number of right steps.

    Args:
        title: of the figure.
        seeds: method -> share of whole sequences, a value a seed.
        right: method -> int64 (T + 1, T + 1), test sequences by the number of steps and of those that are right.
        paper: method -> the paper's mean over seeds, a diamond.
    """
    methods = list(seeds)
    figure = Figure(figsize=(COLUMN, 1.0 + ROW * len(methods)), layout="constrained")
    over_seeds, over_sequences = figure.subplots(1, 2, sharey=True)
    grid = np.linspace(0, 1, 401)
    for level, method in enumerate(reversed(methods)):
        colour = look_of(method, level).colour
        curve = kernel_density(seeds[method], grid)
        over_seeds.fill_between(grid, level, level + 0.8 * curve / curve.max(), color=colour, alpha=0.4, lw=0, zorder=2)
        over_seeds.plot(seeds[method], [level + 0.08] * len(seeds[method]), "|", ms=6, mew=1, color=colour, zorder=3)
        if paper and method in paper:
            look = {"ms": 4, "mfc": "white", "mec": "black", "mew": 0.8, "zorder": 4, "clip_on": False}
            over_seeds.plot(paper[method], level + 0.3, "D", **look)
        _steps(over_sequences, level, right[method], colour)
        for axis in (over_seeds, over_sequences):
            axis.axhline(level, color="0.75", lw=0.5, zorder=1)
    middles = [level + 0.3 for level in range(len(methods))]
    over_seeds.set_yticks(middles, [narrow(m) for m in methods[::-1]], fontsize=SMALL)
    over_seeds.set_ylim(-0.1, len(methods))
    over_seeds.set_xlim(-0.02, 1.02)
    over_seeds.set_xticks([0, 0.5, 1], ["0", ".5", "1"])
    over_seeds.set_title("over seeds: density\n(each to one height)", fontsize=SMALL, pad=3)
    over_sequences.set_title("over sequences: share\n(full row: 100%)", fontsize=SMALL, pad=3)
    over_seeds.set_xlabel("share right as a whole", fontsize=SMALL)
    over_sequences.set_xlabel("steps right", fontsize=SMALL)
    for axis in (over_seeds, over_sequences):
        tidy(axis, sides=("top", "right", "left"))
        axis.tick_params(axis="y", length=0)
    figure.suptitle(title, fontsize=TITLE)
    marks = [mark("|", "one seed", ms=6, color="0.3"), *([papers_mark()] if paper else [])]
    add_legend(figure, marks)
    return figure


def kernel_density(values: ArrayLike, grid: Array) -> Array:
    """Gaussian kernel density on a grid; width by Silverman's rule, at least `LEAST_WIDTH`."""
    own = np.asarray(values, dtype=np.float64)
    width = max(1.06 * float(own.std()) * len(own) ** -0.2, LEAST_WIDTH)
    kernels = np.exp(-0.5 * ((grid[:, None] - own) / width) ** 2) / (width * np.sqrt(2 * np.pi))
    return np.asarray(kernels.mean(axis=1))


def _steps(axis: Axes, level: int, right: Numbers, colour: str) -> None:
    shares = right.sum(axis=0) / right.sum()
    steps = np.arange(len(shares))
    axis.bar(steps, 0.85 * shares, width=0.8, bottom=level, color=colour, zorder=2)
    axis.set_xticks(steps)
