"""Learning curves: loss, and the share of held-out orders right, epoch by epoch."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from neurosym.errors import InputError
from neurosym.plotting.style import COLUMN, TITLE, Figure, add_legend, look_of, mark, tidy


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
    title: str,
    runs: Mapping[str, Sequence[Epoch]],
    *,
    loss: str | Mapping[str, str] = "loss (nats a step)",
    trained: int | None = None,
    held_out: int | None = None,
) -> Figure:
    """Above the loss, dotted in training and full where held out; below the share of held-out orders that are right.

    Where nothing was held out there is only the loss in training. Losses of different kinds have a panel each.

    Args:
        title: of the figure.
        runs: method -> its epochs in order, as a list gathers them with ``fit(progress=list.append)``.
        loss: what the loss is, with its unit: of all methods, or method -> of that one. Of the methods here, those with
            the paper's loss (`sinkhorn-paper`) have squared errors, the others nats a step.
        trained: from how many demonstrations was learned, for the title.
        held_out: how many demonstrations are held out, for the title.

    Raises:
        InputError: nothing to draw, or a method without a name of its loss.
    """
    if not any(len(epochs) for epochs in runs.values()):
        raise InputError("Expected at least one epoch to draw; got none.")
    kinds = {method: loss if isinstance(loss, str) else loss.get(method, "") for method in runs}
    if unnamed := [method for method, kind in kinds.items() if not kind]:
        raise InputError(f"Expected the name of each method's loss; got none of {', '.join(unnamed)}.")
    measured = any(e.held_out_whole_order_accuracy is not None for epochs in runs.values() for e in epochs)
    panels = list(dict.fromkeys(kinds.values()))
    rows = len(panels) + measured
    figure = Figure(figsize=(COLUMN, 1.05 + 1.05 * rows), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for position, (method, epochs) in enumerate(runs.items()):
        look = look_of(method, position)
        every = max(1, len(epochs) // 8)
        line = {"color": look.colour, "lw": 1.2, "marker": look.marker, "ms": 3.5, "markevery": every}
        axis = axes[panels.index(kinds[method])]
        axis.plot([e.epoch for e in epochs], [e.train_loss for e in epochs], ":", **line)
        held = [e for e in epochs if e.held_out_loss is not None]
        axis.plot([e.epoch for e in held], [e.held_out_loss for e in held], "-", **line)
        if measured:
            held = [e for e in epochs if e.held_out_whole_order_accuracy is not None]
            axes[-1].plot([e.epoch for e in held], [e.held_out_whole_order_accuracy for e in held], "-", **line)
    for axis, kind in zip(axes, panels):
        axis.set_ylabel(kind, fontsize=TITLE)
        low, high = axis.get_ylim()
        axis.set_ylim(min(0.0, low), 1.05 * high if high > 0 else high)  # from 0 on: a small gain looks small
    if measured:
        axes[-1].set_ylabel("held-out orders\nright (share)", fontsize=TITLE)
        axes[-1].set_ylim(-0.03, 1.05)
        axes[-1].set_yticks([0, 0.5, 1], ["0", ".5", "1"])
    axes[-1].set_xlabel("epoch", fontsize=TITLE)
    for axis in axes:
        axis.grid(axis="y", color="0.9", lw=0.6)
        axis.set_axisbelow(True)
        tidy(axis)
    sizes = [f"{trained:,} demonstrations to learn from"] if trained else []
    sizes += [f"{held_out:,} {'' if sizes else 'demonstrations '}held out"] if held_out and measured else []
    figure.suptitle(f"{title}\nn = {', '.join(sizes)}" if sizes else title, fontsize=TITLE)
    looks = [(method, look_of(method, position)) for position, method in enumerate(runs)]
    marks = [mark(look.marker, method, ls="-", color=look.colour, lw=1.2, ms=3.5) for method, look in looks]
    marks.append(mark("", "in training", ls=":", color="0.3", lw=1.2))
    if measured:
        marks.append(mark("", "held out", ls="-", color="0.3", lw=1.2))
    add_legend(figure, marks, columns=3)
    return figure
