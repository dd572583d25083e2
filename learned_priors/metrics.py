"""Early figures: how well order scores match demonstrations. Whether an order holds, a planner or oracle decides."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from neurosym.planning.order_scores import OrderScores
from neurosym.support.arrays import Numbers, Truths


def decoded(log_prob: ArrayLike, classes: Sequence[int] = (), *, log_length: ArrayLike | None = None) -> Numbers:
    """The likeliest orders, by the Hungarian algorithm: no action twice.

    With unsure lengths, the likeliest number of steps is taken first, then the best assignment to these steps (the
    paper's masking, Sec. IV-B).

    `log_prob`: (M, T, N), log-probability of each action at each step. `classes`: one integer an action; the
    probabilities of one class are summed. `log_length`: (M, T + 1), log-probability of 0 .. T steps; None where there
    are always T. Returns int64 (M, T), -1 after the last step.
    """
    tables = np.asarray(log_prob, dtype=np.float64)
    orders = np.full(tables.shape[:2], -1, dtype=np.int64)
    lengths = np.full(len(tables), tables.shape[1]) if log_length is None else np.asarray(log_length).argmax(axis=1)
    for order, table, n in zip(orders, tables, lengths):
        costs = OrderScores(table, classes=tuple(classes)).costs
        order[:n] = linear_sum_assignment(costs[:n])[1]
    return orders


def step_matches(orders: Numbers, sequences: Numbers, classes: Sequence[int] = ()) -> Truths:
    """bool (M, T): the step names an action of the demonstrated one's class, or is not taken. Both int64 (M, T)."""
    label = np.asarray(classes) if classes else np.arange(max(int(orders.max()), int(sequences.max())) + 1)
    same = label[np.maximum(orders, 0)] == label[np.maximum(sequences, 0)]
    matches: Truths = (same & (orders >= 0)) | (sequences < 0)
    return matches


def whole_order_accuracy(
    log_prob: ArrayLike,
    sequences: Numbers,
    *,
    log_length: ArrayLike | None = None,
    marginals: NDArray[np.float32] | None = None,
    classes: Sequence[int] = (),
) -> float:
    """Share of pictures whose whole decoded order matches (what the paper's tower table calls precision).

    Against marginals, where many orders are right: the share whose every step is one that some valid order has. That
    is necessary for a valid order, not sufficient. With unsure lengths, the length is to be right, too.

    Shapes: log_prob (M, T, N); sequences int64 (M, T), -1 where a step is not taken; the others as for `decoded`.
    """
    orders = decoded(log_prob, classes, log_length=log_length)
    if marginals is None:
        matches = step_matches(orders, sequences, classes)
    else:
        share = np.take_along_axis(marginals, np.maximum(orders, 0)[..., None], axis=2)[..., 0]
        matches = (share > 0) | (sequences < 0)
    right = matches.all(axis=1)
    if log_length is not None:
        right &= (orders >= 0).sum(axis=1) == (sequences >= 0).sum(axis=1)
    return float(right.mean())
