"""Errors by letter, and by how many letters repeat: the paper's Fig. 8."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from neurosym.experiments.order_accuracy import Counts
from neurosym.plotting.style import COLUMN, SMALL, TITLE, look_of, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The axis of errors ends there or above (%), so that no errors look like none.
LEAST_TOP = 1.0
#: How much of a class's width its methods share.
DODGE = 0.7


def classes_figure(title: str, counts: Mapping[str, Counts]) -> Figure:
    """The share of each class's demonstrated steps that were read as another; in brackets, how many actions it has."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(COLUMN, 2.3), layout="constrained")
    axis = figure.subplots()
    for position, (method, own) in enumerate(counts.items()):
        look, k = look_of(method, position), len(own.labels)
        total = own.confusion[:k].sum(axis=1)
        there = np.flatnonzero(total)
        wrong = 1 - own.confusion.diagonal()[:k][there] / total[there]
        # Side by side, or equal shares would hide one another.
        beside = there + DODGE * (position - (len(counts) - 1) / 2) / len(counts)
        axis.plot(
            beside, 100 * wrong, look.marker or ".", color=look.colour, ms=3.6, mew=0.4, mec="white", label=method
        )
    first = next(iter(counts.values()))
    names = [f"{label} ({n})" for label, n in zip(first.labels, first.members)]
    axis.set_xticks(range(len(names)), names, rotation=90)
    axis.set_xlim(-0.7, len(names) - 0.3)
    axis.set_ylabel("steps wrong (%)", fontsize=TITLE)
    axis.grid(axis="x", color="0.93", lw=0.5)
    _finish(figure, [axis], title)
    return figure


def repeats_figure(title: str, counts: Mapping[str, Counts]) -> Figure:
    """The share of steps and of sequences read wrong, by how many of a sequence's actions repeat an earlier class."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(COLUMN, 3.3), layout="constrained")
    steps, sequences = figure.subplots(2, 1, sharex=True)
    first = next(iter(counts.values()))
    shown = np.flatnonzero(first.repeats[:, 2])
    for position, (method, own) in enumerate(counts.items()):
        look = look_of(method, position)
        for axis, (total, wrong) in ((steps, (0, 1)), (sequences, (2, 3))):
            share = 100 * own.repeats[shown, wrong] / own.repeats[shown, total]
            axis.plot(shown, share, look.line, marker=look.marker, color=look.colour, ms=4, lw=1.1, label=method)
            axis.grid(axis="y", color="0.9", lw=0.6)
    steps.set_ylabel("steps wrong (%)", fontsize=TITLE)
    sequences.set_ylabel("sequences\nwrong (%)", fontsize=TITLE)
    sequences.set_xticks(shown, [f"{r}\n({first.repeats[r, 2]:,})" for r in shown])
    sequences.set_xlabel("repetitions in the sequence (pictures)", fontsize=TITLE)
    _finish(figure, [steps, sequences], title)
    return figure


def _finish(figure: Figure, axes: Sequence[Axes], title: str) -> None:
    for axis in axes:
        tidy(axis)
        top = max(axis.get_ylim()[1], LEAST_TOP)
        axis.set_ylim(-0.05 * top, 1.05 * top)  # markers at both ends are seen whole
        axis.tick_params(axis="x", length=0)
    figure.suptitle(title, fontsize=TITLE)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=SMALL, frameon=False)
