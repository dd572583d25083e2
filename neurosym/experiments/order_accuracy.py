"""How well orders read from pictures agree with demonstrated ones: shares for tables, counts for figures."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from neurosym.errors import InputError
from neurosym.language.demonstrations import Demonstrations
from neurosym.planning.order_scores import OrderScores
from neurosym.support.arrays import Array, Numbers, Truths


def compare_orders(predicted: ArrayLike, truth: Demonstrations, classes: Sequence[int]) -> dict[str, Array]:
    """How well orders agree with demonstrated ones, where interchangeable actions count as one.

    Args:
        predicted: int (M, T), -1 after the last step.
        truth: what was demonstrated, (M, T).
        classes: one integer an action; equal ones are interchangeable.

    Returns:
        float64 (M,) each: `whole_sequence` (every step right, and no step too many), `per_step` (share of the
        demonstrated steps that are right), `re_use` (an action comes twice), `stop_accuracy` (as many steps).
    """
    order = _checked(predicted, truth)
    right = classes_at(order, classes) == classes_at(truth.sequences, classes)
    taken = truth.sequences >= 0
    ordered = np.sort(order, axis=1)
    twice = ((ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] >= 0)).any(axis=1)
    return {
        "whole_sequence": right.all(axis=1).astype(float),
        "per_step": (right & taken).sum(axis=1) / taken.sum(axis=1),
        "re_use": twice.astype(float),
        "stop_accuracy": ((order >= 0).sum(axis=1) == taken.sum(axis=1)).astype(float),
    }


def classes_at(orders: Numbers, classes: Sequence[int]) -> Numbers:
    """int64 (M, T): the class of the action at each step; -1 where there is none."""
    # Index -1, no action, takes the last entry.
    return np.asarray(np.append(np.asarray(classes, dtype=np.int64), -1)[orders])


def classes_of(given: Demonstrations) -> tuple[int, ...]:
    """One integer an action, 0 to K - 1; actions of one class are interchangeable. Without classes, each is its own."""
    return tuple(int(c) for c in np.unique(given.classes or range(len(given.actions)), return_inverse=True)[1])


def seen_in(train: Demonstrations, test: Demonstrations) -> Truths:
    """bool (M,): which test sequences, of classes, are among those of the training."""
    known = {row.tobytes() for row in classes_at(train.sequences, classes_of(train))}
    return np.array([row.tobytes() in known for row in classes_at(test.sequences, classes_of(test))])


def averages(figures: Mapping[str, Array], seen: Truths) -> dict[str, float]:
    """Means over all pictures, and of `whole_sequence` and `per_step` over those seen in training and not, apart.

    `figures`: metric -> float64 (M,). `seen`: bool (M,).
    """
    means = {metric: float(values.mean()) for metric, values in figures.items()}
    for label, chosen in (("seen", seen), ("unseen", ~seen)):
        means[f"{label}_share"] = float(chosen.mean())
        if chosen.any():
            for metric in ("whole_sequence", "per_step"):
                means[f"{metric}_{label}"] = float(figures[metric][chosen].mean())
    return means


def calibration_error(scores: Sequence[OrderScores], shares: Sequence[Array], *, bins: int = 10) -> float:
    """Expected calibration error (Guo et al., ICML 2017, eq. 3) of each step's likeliest class of actions.

    The steps taken are sorted by their confidence into bins of equal width; it is the mean difference, weighted by
    the number of steps, of confidence and share of steps right. 0 is perfect.

    `shares`: for each of the `scores` float64 (steps, actions), the share of valid orders that have each action at each
    step (one-hot where one order is right); rows of zeros, or missing ones, are steps not taken.
    """
    sure, right = [], []
    for own, share in zip(scores, shares, strict=True):
        taken = np.flatnonzero(share.sum(axis=1) > 0)
        likeliest = own.costs[taken].argmin(axis=1)
        alike = np.asarray(own.classes) == np.asarray(own.classes)[likeliest][:, None]
        sure.append(np.exp(-own.costs[taken, likeliest]))
        right.append((share[taken] * alike).sum(axis=1))
    confidence, truth = np.concatenate(sure), np.concatenate(right)
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    gaps = np.abs(np.bincount(place, confidence, bins) - np.bincount(place, truth, bins))
    return float(gaps.sum() / max(len(place), 1))


@dataclass(frozen=True, eq=False)
class Counts:
    """What figures are drawn from: K classes of actions, orders of at most T steps.

    Attributes:
        labels: the K names of the classes: colours, letters.
        members: how many actions each has.
        confusion: int64 (K + 1, K + 1): steps by the class demonstrated and the class read; the last is no step.
        right: int64 (T + 1, T + 1): pictures by the number of steps and of those that are right.
        repeats: int64 (T, 4): by how many actions are of a class that came before in the sequence: steps, wrong
            steps, pictures, wrong pictures.
    """

    labels: tuple[str, ...]
    members: tuple[int, ...]
    confusion: Numbers
    right: Numbers
    repeats: Numbers

    @classmethod
    def of(cls, predicted: ArrayLike, truth: Demonstrations) -> Self:
        """Count orders, int (M, T), against the demonstrated ones."""
        order, classes = _checked(predicted, truth), classes_of(truth)
        labels = _class_names(truth.actions, classes)
        k, steps = len(labels), order.shape[1]
        read, wanted = classes_at(order, classes), classes_at(truth.sequences, classes)
        taken = wanted >= 0
        length = taken.sum(axis=1)
        correct = ((read == wanted) & taken).sum(axis=1)
        repeated = length - np.array([len(set(row[row >= 0])) for row in wanted])
        wrong = (read != wanted).any(axis=1)
        confusion, right = (np.zeros((size, size), dtype=np.int64) for size in (k + 1, steps + 1))
        repeats = np.zeros((steps, 4), dtype=np.int64)
        np.add.at(confusion, (wanted, read), 1)  # -1, no action, is the last
        np.add.at(right, (length, correct), 1)
        np.add.at(repeats, repeated, np.stack([length, length - correct, np.ones_like(length), wrong], axis=1))
        return cls(labels, tuple(int(n) for n in np.bincount(classes, minlength=k)), confusion, right, repeats)

    @classmethod
    def pooled(cls, trials: Sequence[Self]) -> Self:
        """Those of several trials, added up."""
        if len({(c.labels, c.members, c.right.shape) for c in trials}) > 1:
            raise InputError("Expected counts of the same classes and steps to add up; got different ones.")
        sums = (np.sum([getattr(c, name) for c in trials], axis=0) for name in ("confusion", "right", "repeats"))
        return cls(trials[0].labels, trials[0].members, *sums)

    def to_json(self) -> dict[str, Any]:
        return {name: np.asarray(value).tolist() for name, value in vars(self).items()}

    @classmethod
    def from_json(cls, given: Mapping[str, Any]) -> Self:
        arrays = (np.array(given[name], dtype=np.int64) for name in ("confusion", "right", "repeats"))
        return cls(tuple(given["labels"]), tuple(given["members"]), *arrays)


def _checked(predicted: ArrayLike, truth: Demonstrations) -> Numbers:
    order = np.asarray(predicted, dtype=np.int64)
    if order.shape != truth.sequences.shape:
        raise InputError(f"Expected predicted orders of shape {truth.sequences.shape}; got {order.shape}.")
    return order


def _class_names(actions: Sequence[str], classes: Sequence[int]) -> tuple[str, ...]:
    """What the names of a class's actions share once their numbers are cut off, if that tells the classes apart."""
    stems: list[set[str]] = [set() for _ in range(max(classes) + 1)]
    for action, kind in zip(actions, classes):
        stems[kind].add(re.sub(r"[-_ ]?\d+$", "", action) or action)
    names = [stem for own in stems if len(own) == 1 for stem in own]
    if len(set(names)) == len(stems):
        return tuple(names)
    return tuple(actions[classes.index(kind)] for kind in range(len(stems)))
