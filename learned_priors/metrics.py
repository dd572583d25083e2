"""Early figures: how well order scores match demonstrations. Whether an order holds, a planner or oracle decides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from neurosym.prior import OrderScores


def decoded(log_prob: ArrayLike, classes: Sequence[int] = ()) -> NDArray[np.int64]:
    """The likeliest orders: (M, T, N) log-probabilities -> int64 (M, T), by the Hungarian algorithm."""
    tables = np.asarray(log_prob, dtype=np.float64)
    orders = [OrderScores(table, classes=tuple(classes)).order() for table in tables]
    return np.array(orders, dtype=np.int64).reshape(tables.shape[:2])


def step_matches(
    orders: NDArray[np.int64], sequences: NDArray[np.int64], classes: Sequence[int] = ()
) -> NDArray[np.bool_]:
    """bool (M, T): the step names an action of the demonstrated one's class, or is not taken. Both int64 (M, T)."""
    taken = sequences >= 0
    label = np.asarray(classes) if classes else np.arange(max(int(orders.max()), int(sequences.max())) + 1)
    matches: NDArray[np.bool_] = (label[orders] == label[np.maximum(sequences, 0)]) | ~taken
    return matches


def whole_order_accuracy(
    log_prob: ArrayLike,
    sequences: NDArray[np.int64],
    *,
    marginals: NDArray[np.float32] | None = None,
    classes: Sequence[int] = (),
) -> float:
    """Share of pictures whose whole decoded order matches (what the paper's tower table calls precision).

    Against marginals, where many orders are right: the share whose every step is one that some valid order has. That
    is necessary for a valid order, not sufficient.
    """
    orders = decoded(log_prob, classes)
    if marginals is None:
        return float(step_matches(orders, sequences, classes).all(axis=1).mean())
    possible = np.take_along_axis(marginals, orders[..., None], axis=2)[..., 0] > 0
    return float((possible | (sequences < 0)).all(axis=1).mean())


def per_step_accuracy(log_prob: ArrayLike, sequences: NDArray[np.int64], *, classes: Sequence[int] = ()) -> float:
    """Share of demonstrated steps whose decoded action is of the right class."""
    taken = sequences >= 0
    matches = step_matches(decoded(log_prob, classes), sequences, classes)
    return float(matches[taken].mean()) if taken.any() else 1.0
