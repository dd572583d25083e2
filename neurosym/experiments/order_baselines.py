"""What can be had without reading pictures: a memoriser and the best fixed answers. A network must beat both.

Both are calculated, not trained, and give what `compare_orders` gives: metric -> float64 (M,), a value a test picture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from neurosym.experiments.order_accuracy import classes_of, kinds, seen_in
from neurosym.language.demonstrations import Demonstrations

Figures = dict[str, NDArray[np.float64]]


def memoriser(train: Demonstrations, test: Demonstrations) -> Figures:
    """Perfect on sequences, of classes, that were demonstrated; in others a random order of the right length.

    The dashed line of the paper's Fig. 5 and 6 (Burke, Subr, Ramamoorthy, RA-L 2021, Sec. IV-B). These are
    expectations: with n_c of the N actions in class c, a step is right with probability n_c / N, and the whole order
    with the product of (n_c - used so far) / (N - steps so far). That it knows the length flatters it.
    """
    classes = classes_of(test)
    members = np.bincount(classes)
    wanted = kinds(test.sequences, classes)
    whole, step = np.ones(len(wanted)), np.ones(len(wanted))
    for i in np.flatnonzero(~seen_in(train, test)):
        row = wanted[i][wanted[i] >= 0]
        step[i] = members[row].mean() / len(classes)
        left = members.copy()
        for done, kind in enumerate(row):
            whole[i] *= left[kind] / (len(classes) - done)
            left[kind] -= 1
    return {"whole_sequence": whole, "per_step": step, "re_use": np.zeros(len(wanted))}


def blind(train: Demonstrations, test: Demonstrations) -> Figures:
    """The same answer to every picture: for each metric the answer that does best on the training demonstrations.

    `whole_sequence`: the most frequent sequence of classes; `per_step`: the assignment of actions to steps that is
    right in most; `stop_accuracy`: the most frequent length.
    """
    classes = np.array(classes_of(train))
    known, wanted = kinds(train.sequences, tuple(classes)), kinds(test.sequences, classes_of(test))
    rows, counts = np.unique(known, axis=0, return_counts=True)
    share = 1 / train.lengths[:, None, None]  # a step of a short order weighs more, as in `compare_orders`
    gain = ((known[:, :, None] == classes) * share).sum(axis=0)
    steps, actions = linear_sum_assignment(gain, maximize=True)
    order = np.full(known.shape[1], -1)
    order[steps] = classes[actions]
    taken = wanted >= 0
    return {
        "whole_sequence": (wanted == rows[counts.argmax()]).all(axis=1).astype(float),
        "per_step": ((wanted == order) & taken).sum(axis=1) / test.lengths,
        "re_use": np.zeros(len(wanted)),
        "stop_accuracy": (test.lengths == np.bincount(train.lengths).argmax()).astype(float),
    }


#: By their names in tables.
BASELINES: Mapping[str, Callable[[Demonstrations, Demonstrations], Figures]] = MappingProxyType(
    {"memoriser": memoriser, "blind": blind}
)
