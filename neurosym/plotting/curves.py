"""Curves over the number of demonstrations or actions, as the paper's Fig. 5, 6 and 9."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from neurosym.plotting.style import COLUMN, SMALL, TITLE, Figure, add_legend, look_of, tidy
from neurosym.support.arrays import Numbers

#: Of an axis with many n only so many are named.
MOST_TICKS = 7


@dataclass(frozen=True)
class Curves:
    """One panel of curves.

    `title`: what is on the vertical axis, with its unit. `values`: method -> n -> a value a seed.
    """

    title: str
    values: Mapping[str, Mapping[int, Sequence[float]]]


@dataclass(frozen=True)
class Spread:
    """How single sequences come out with growing n, of one method.

    `method`: which. `right`: n -> int64 (T + 1, T + 1), pictures by the number of steps and of those that are right.
    """

    method: str
    right: Mapping[int, Numbers]


def curves_figure(
    title: str, across: str, panels: Sequence[Curves], *, spread: Spread | None = None, log: bool = False
) -> Figure:
    """Panels one above the other: a line is the mean over seeds, its band reaches from the least to the greatest.

    `title`: of the figure. `across`: what n counts. `panels`: what is drawn. `spread`: adds a panel: the area of a dot
    is the share of test sequences with that share of steps right. `log`: whether n is on a logarithmic axis.
    """
    total = len(panels) + (spread is not None)
    figure = Figure(figsize=(COLUMN, 0.9 + 1.1 * total), layout="constrained")
    axes = figure.subplots(total, 1, sharex=True, squeeze=False)[:, 0]
    for axis, panel in zip(axes, panels):
        for position, (method, values) in enumerate(panel.values.items()):
            _curve(axis, method, position, values)
        axis.set_ylabel(panel.title, fontsize=TITLE)
    if spread is not None:
        _bubbles(axes[-1], spread)
        axes[-1].set_ylabel("steps right in\none sequence", fontsize=TITLE)
    every = [values for panel in panels for values in panel.values.values()]
    for axis in axes:
        axis.set_ylim(-0.03, 1.05)
        axis.set_yticks([0, 0.5, 1], ["0", ".5", "1"])
        axis.grid(axis="y", color="0.9", lw=0.6)
        axis.set_axisbelow(True)
        tidy(axis)
    _across(axes[-1], sorted({n for values in every for n in values}), across, log)
    seeds = max((len(own) for values in every for own in values.values()), default=0)
    bands = "\nlines: means over seeds; bands: least to greatest" if seeds > 1 else ""
    figure.suptitle(f"{title}{bands}", fontsize=TITLE)
    add_legend(figure, axes[0].get_legend_handles_labels()[0])
    return figure


def _curve(axis: Axes, method: str, position: int, values: Mapping[int, Sequence[float]]) -> None:
    sizes = sorted(n for n in values if values[n])
    if not sizes:
        return
    look = look_of(method, position)
    mean = [float(np.mean(values[n])) for n in sizes]
    if any(len(values[n]) > 1 for n in sizes):
        low, high = [min(values[n]) for n in sizes], [max(values[n]) for n in sizes]
        axis.fill_between(sizes, low, high, color=look.colour, alpha=0.18, lw=0)
    # One n alone has no line: whatever has no marker gets one.
    marker = look.marker or ("_" if len(sizes) == 1 else "")
    axis.plot(sizes, mean, look.line, marker=marker, color=look.colour, ms=4, lw=1.3, label=method)


def _bubbles(axis: Axes, spread: Spread) -> None:
    look = look_of(spread.method)
    for n, counts in spread.right.items():
        shares: dict[float, float] = {}
        for length, right in zip(*np.nonzero(counts)):
            shares[right / length] = shares.get(right / length, 0) + counts[length, right] / counts.sum()
        areas = [90 * share for share in shares.values()]
        axis.scatter([n] * len(shares), list(shares), s=areas, color=look.colour, lw=0, clip_on=False)
    axis.set_title(f"{spread.method}, all seeds; area: share of sequences", fontsize=SMALL, loc="left", pad=5)


def _across(axis: Axes, sizes: Sequence[int], across: str, log: bool) -> None:
    if log:
        axis.set_xscale("log")
        axis.xaxis.set_minor_locator(NullLocator())
    shown = sizes[:: -(-len(sizes) // MOST_TICKS)]
    axis.set_xticks(shown, [str(n) for n in shown], fontsize=SMALL)
    axis.set_xlabel(f"n: {across}", fontsize=TITLE)
