"""Learning curves: loss, and the share of held-out orders right, epoch by epoch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from neurosym.errors import InputError
from neurosym.plotting.style import COLUMN, SMALL, TITLE, look_of, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Epoch(Protocol):
    """What is drawn of an epoch: what `fit(progress=...)` reports has it."""

    @property
    def epoch(self) -> int: ...

    @property
    def train_loss(self) -> float: ...

    @property
    def held_out_loss(self) -> float | None: ...

    @property
    def held_out_whole_order_accuracy(self) -> float | None: ...


def learning_figure(
    title: str, runs: Mapping[str, Sequence[Epoch]], *, loss: str = "loss (nats a step)", held_out: int | None = None
) -> Figure:
    """Above the loss, dotted in training and full where held out; below the share of held-out orders that are right.

    Where nothing was held out there is only the loss in training.

    Args:
        title: of the figure.
        runs: method -> its epochs in order, as a list gathers them with ``fit(progress=list.append)``.
        loss: what the loss is, with its unit.
        held_out: how many demonstrations are held out, for the title.

    Raises:
        InputError: nothing to draw.
    """
    from matplotlib.figure import Figure

    if not any(len(epochs) for epochs in runs.values()):
        raise InputError("Expected at least one epoch to draw; got none.")
    measured = any(e.held_out_whole_order_accuracy is not None for epochs in runs.values() for e in epochs)
    figure = Figure(figsize=(COLUMN, 3.0 if measured else 2.1), layout="constrained")
    axes = figure.subplots(1 + measured, 1, sharex=True, squeeze=False)[:, 0]
    for position, (method, epochs) in enumerate(runs.items()):
        look = look_of(method, position)
        every = max(1, len(epochs) // 8)
        line = {"color": look.colour, "lw": 1.2, "marker": look.marker, "ms": 3.5, "markevery": every}
        axes[0].plot([e.epoch for e in epochs], [e.train_loss for e in epochs], ":", **line)
        losses = [(e.epoch, e.held_out_loss) for e in epochs]
        held = [(epoch, value) for epoch, value in losses if value is not None]
        axes[0].plot([x for x, _ in held], [y for _, y in held], "-", **line)
        if measured:
            shares = [(e.epoch, e.held_out_whole_order_accuracy) for e in epochs]
            right = [(epoch, value) for epoch, value in shares if value is not None]
            axes[1].plot([x for x, _ in right], [y for _, y in right], "-", **line)
    axes[0].set_ylabel(loss, fontsize=TITLE)
    if measured:
        axes[1].set_ylabel("held-out orders\nright (share)", fontsize=TITLE)
        axes[1].set_ylim(-0.03, 1.05)
        axes[1].set_yticks([0, 0.5, 1], ["0", ".5", "1"])
    axes[-1].set_xlabel("epoch", fontsize=TITLE)
    for axis in axes:
        axis.grid(axis="y", color="0.9", lw=0.6)
        axis.set_axisbelow(True)
        tidy(axis)
    said = f"\nn = {held_out} demonstrations held out" if held_out and measured else ""
    figure.suptitle(f"{title}{said}", fontsize=TITLE)
    _legends(figure, axes[0], list(runs), measured=measured)
    return figure


def _legends(figure: Figure, axis: Axes, methods: Sequence[str], *, measured: bool) -> None:
    from matplotlib.lines import Line2D

    kinds = [Line2D([], [], ls=":", color="0.3", lw=1.2, label="in training")]
    if measured:
        kinds.append(Line2D([], [], ls="-", color="0.3", lw=1.2, label="held out"))
    axis.legend(handles=kinds, fontsize=SMALL, frameon=False, loc="upper right")
    looks = [look_of(method, position) for position, method in enumerate(methods)]
    handles = [
        Line2D([], [], color=look.colour, lw=1.2, marker=look.marker, ms=3.5, label=method)
        for look, method in zip(looks, methods)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False)
