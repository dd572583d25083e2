"""Confusion matrices: which colour or letter was read for which, all steps of all test pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from neurosym.experiments.order_accuracy import NONE, Counts
from neurosym.plotting.style import COLUMN, SMALL, TITLE, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: With more classes than these no share is written into its cell, and letters are smaller.
WRITTEN = 8


def confusion_figure(title: str, counts: Mapping[str, Counts]) -> Figure:
    """A matrix a method: rows are what was demonstrated, and add up to 100%; columns what was read.

    Steps that are not there are called "none"; they have a row and a column where some were demonstrated or read.
    Shades grow with the square root of the share, so that rare confusions are seen.
    """
    from matplotlib.colors import PowerNorm
    from matplotlib.figure import Figure

    first = next(iter(counts.values()))
    many = len(first.labels) > WRITTEN
    # The same rows and columns for all methods, or panels could not be compared.
    ends = any(int(c.confusion[-1].sum() + c.confusion[:, -1].sum()) for c in counts.values())
    columns = 1 if many else min(len(counts), 2 if len(first.labels) + ends > 4 else 3)
    rows = -(-len(counts) // columns)
    side = (COLUMN - 0.6) / columns  # what the names of the rows leave
    figure = Figure(figsize=(COLUMN, rows * (side + 0.2) + 0.95), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    norm = PowerNorm(0.5, vmin=0, vmax=1)
    for k, axis in enumerate(axes):
        if k >= len(counts):
            axis.remove()
            continue
        method, own = list(counts.items())[k]
        labels = [*own.labels, NONE] if ends else list(own.labels)
        shares = _by_row(own.confusion[: len(labels), : len(labels)])
        axis.imshow(shares, cmap="Blues", norm=norm)
        _dress(axis, labels, many, first_column=k % columns == 0, last_row=k + columns >= len(counts))
        axis.set_title(method, fontsize=6.5, pad=3)
        if not many:
            _write(axis, shares)
    figure.suptitle(title, fontsize=TITLE)
    figure.supxlabel("read", fontsize=TITLE)
    figure.supylabel("demonstrated", fontsize=TITLE)
    return figure


def _by_row(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Shares; a row without counts is NaN, and stays white."""
    totals = counts.sum(axis=1, keepdims=True).astype(float)
    totals[totals == 0] = np.nan
    shares: NDArray[np.float64] = counts / totals
    return shares


def _dress(axis: Axes, labels: list[str], many: bool, *, first_column: bool, last_row: bool) -> None:
    size = 6 if many else SMALL
    places = range(len(labels))
    axis.set_xticks(places, labels if last_row else [""] * len(labels), fontsize=size, rotation=0 if many else 45)
    axis.set_yticks(places, labels if first_column else [""] * len(labels), fontsize=size)
    if many and last_row and labels[-1] == NONE:
        axis.get_xticklabels()[-1].set_rotation(90)  # wider than a letter
    tidy(axis, sides=("top", "right", "left", "bottom"))
    axis.tick_params(length=0, labelsize=size, pad=1)


def _write(axis: Axes, shares: NDArray[np.float64]) -> None:
    for i, row in enumerate(shares):
        for j, share in enumerate(row):
            if share >= 0.005:  # what rounds to 0% is left out
                said = f"{100 * share:.0f}"
                axis.text(j, i, said, ha="center", va="center", fontsize=6, color="white" if share > 0.3 else "black")
