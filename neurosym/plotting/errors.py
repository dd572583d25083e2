"""What was read wrong: confusion matrices, errors by letter, and by how many letters repeat (the paper's Fig. 8)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm

from neurosym.plotting.style import COLUMN, SMALL, TITLE, Figure, add_legend, look_of, narrow, tidy
from neurosym.support.arrays import Array, Numbers

Counts = Mapping[str, Numbers]
#: How a step that is not there is called.
NONE = "none"
#: With more classes than these no share is written into its cell, and letters are smaller.
WRITTEN = 8
#: The axis of errors ends there or above (%), so that no errors look like none.
LEAST_TOP = 1.0
#: How much of a class's width its methods share.
DODGE = 0.7


def confusion_figure(title: str, labels: Sequence[str], confusion: Counts) -> Figure:
    """A matrix a method: rows are what was demonstrated, and add up to 100%; columns what was read.

    Shades grow with the square root of the share, so that rare confusions are seen.

    `title`: of the figure. `labels`: names of the K classes. `confusion`: method -> int64 (K + 1, K + 1), steps by the
    class demonstrated and the class read. The last are steps that are not there, which are drawn where there are some.
    """
    many = len(labels) > WRITTEN
    # The same rows and columns for all methods, or panels could not be compared.
    ends = any(int(own[-1].sum() + own[:, -1].sum()) for own in confusion.values())
    names = [*labels, NONE] if ends else list(labels)
    columns = 1 if many else min(len(confusion), 2 if len(names) > 4 else 3)
    rows = -(-len(confusion) // columns)
    side = (COLUMN - 0.6) / columns  # what the names of the rows leave
    figure = Figure(figsize=(COLUMN, rows * (side + 0.2) + 0.95), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis in axes[len(confusion) :]:
        axis.remove()
    for k, (axis, (method, own)) in enumerate(zip(axes, confusion.items())):
        shares = _by_row(own[: len(names), : len(names)])
        axis.imshow(shares, cmap="Blues", norm=PowerNorm(0.5, vmin=0, vmax=1))
        _name_classes(axis, names, many, first_column=k % columns == 0, last_row=k + columns >= len(confusion))
        axis.set_title(narrow(method), fontsize=6.5, pad=3)
        if not many:
            write_shares(axis, shares)
    figure.suptitle(title, fontsize=TITLE)
    figure.supxlabel("read", fontsize=TITLE)
    figure.supylabel("demonstrated", fontsize=TITLE)
    return figure


def classes_figure(title: str, labels: Sequence[str], confusion: Counts) -> Figure:
    """The share of each class's demonstrated steps that were read as another; arguments as of `confusion_figure`."""
    figure = Figure(figsize=(COLUMN, 2.3), layout="constrained")
    axis, k = figure.subplots(), len(labels)
    for position, (method, own) in enumerate(confusion.items()):
        total = own[:k].sum(axis=1)
        there = np.flatnonzero(total)
        wrong = 1 - own.diagonal()[:k][there] / total[there]
        # Side by side, or equal shares would hide one another.
        beside = there + DODGE * (position - (len(confusion) - 1) / 2) / len(confusion)
        look = look_of(method, position)
        dots: dict[str, Any] = {"color": look.colour, "ms": 3.6, "mew": 0.4, "mec": "white"}
        axis.plot(beside, 100 * wrong, look.marker or ".", label=method, **dots)
    axis.set_xticks(range(k), labels, rotation=90)
    axis.set_xlim(-0.7, k - 0.3)
    axis.set_ylabel("steps wrong (%)", fontsize=TITLE)
    axis.grid(axis="x", color="0.93", lw=0.5)
    _finish(figure, [axis], title)
    return figure


def repeats_figure(title: str, repeats: Counts) -> Figure:
    """The share of steps and of sequences read wrong, by how many of a sequence's actions repeat an earlier class.

    `title`: of the figure. `repeats`: method -> int64 (T, 4), by the number of repetitions: steps, wrong steps,
    pictures, wrong pictures.
    """
    figure = Figure(figsize=(COLUMN, 3.3), layout="constrained")
    steps, sequences = figure.subplots(2, 1, sharex=True)
    pictures = next(iter(repeats.values()))[:, 2]
    shown = np.flatnonzero(pictures)
    for position, (method, own) in enumerate(repeats.items()):
        look = look_of(method, position)
        for axis, (total, wrong) in ((steps, (0, 1)), (sequences, (2, 3))):
            share = 100 * own[shown, wrong] / own[shown, total]
            axis.plot(shown, share, look.line, marker=look.marker, color=look.colour, ms=4, lw=1.1, label=method)
            axis.grid(axis="y", color="0.9", lw=0.6)
    steps.set_ylabel("steps wrong (%)", fontsize=TITLE)
    sequences.set_ylabel("sequences\nwrong (%)", fontsize=TITLE)
    sequences.set_xticks(shown, [f"{r}\n({pictures[r]:,})" for r in shown])
    sequences.set_xlabel("repetitions in the sequence (pictures)", fontsize=TITLE)
    _finish(figure, [steps, sequences], title)
    return figure


def write_shares(axis: Axes, shares: Array, size: float = 6) -> None:
    """Each share of a matrix into its cell, in per cent; what rounds to 0% is left out."""
    for i, row in enumerate(shares):
        for j, share in enumerate(row):
            if share >= 0.005:
                colour = "white" if share > 0.3 else "black"
                axis.text(j, i, f"{100 * share:.0f}", ha="center", va="center", fontsize=size, color=colour)


def _by_row(counts: Numbers) -> Array:
    """Shares; a row without counts is NaN, and stays white."""
    totals = counts.sum(axis=1, keepdims=True).astype(float)
    totals[totals == 0] = np.nan
    return np.asarray(counts / totals)


def _name_classes(axis: Axes, names: list[str], many: bool, *, first_column: bool, last_row: bool) -> None:
    size, places, blank = 6 if many else SMALL, range(len(names)), [""] * len(names)
    axis.set_xticks(places, names if last_row else blank, fontsize=size, rotation=0 if many else 45)
    axis.set_yticks(places, names if first_column else blank, fontsize=size)
    if many and last_row and names[-1] == NONE:
        axis.get_xticklabels()[-1].set_rotation(90)  # wider than a letter
    tidy(axis, sides=("top", "right", "left", "bottom"))
    axis.tick_params(length=0, labelsize=size, pad=1)


def _finish(figure: Figure, axes: Sequence[Axes], title: str) -> None:
    for axis in axes:
        tidy(axis)
        top = max(axis.get_ylim()[1], LEAST_TOP)
        axis.set_ylim(-0.05 * top, 1.05 * top)  # markers at both ends are seen whole
        axis.tick_params(axis="x", length=0)
    figure.suptitle(title, fontsize=TITLE)
    add_legend(figure, axes[0].get_legend_handles_labels()[0])
