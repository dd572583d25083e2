"""One trial of a study: a network is trained on demonstrations, and its own orders are compared with others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from neurosym.demonstrations import Demonstrations
from neurosym.errors import InputError
from neurosym.registry import load_domain, load_prior
from neurosym.studies import Study, Trial


def compare_orders(
    predicted: ArrayLike, truth: Demonstrations, classes: Sequence[int]
) -> dict[str, NDArray[np.float64]]:
    """How well orders agree with demonstrated ones, where interchangeable actions count as one.

    Args:
        predicted: int (M, T), -1 after the last step.
        truth: what was demonstrated, (M, T).
        classes: one integer an action; equal ones are interchangeable.

    Returns:
        float64 (M,) each: `whole_sequence` (every step right, and no step too many), `per_step` (share of the
        demonstrated steps that are right), `re_use` (an action comes twice), `stop_accuracy` (as many steps).
    """
    order = np.asarray(predicted, dtype=np.int64)
    wanted = truth.sequences
    if order.shape != wanted.shape:
        raise InputError(f"Expected predicted orders of shape {wanted.shape}; got {order.shape}.")
    right = _kinds(order, classes) == _kinds(wanted, classes)
    taken = wanted >= 0
    ordered = np.sort(order, axis=1)
    twice = ((ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] >= 0)).any(axis=1)
    return {
        "whole_sequence": right.all(axis=1).astype(float),
        "per_step": (right & taken).sum(axis=1) / taken.sum(axis=1),
        "re_use": twice.astype(float),
        "stop_accuracy": ((order >= 0).sum(axis=1) == taken.sum(axis=1)).astype(float),
    }


def _kinds(orders: NDArray[np.int64], classes: Sequence[int]) -> NDArray[np.int64]:
    """int64 (M, T): the classes of the actions; -1 where there is none."""
    kind = np.append(np.asarray(classes, dtype=np.int64), -1)  # index -1, no action, takes the last entry
    found: NDArray[np.int64] = kind[orders]
    return found


def run_trial(trial: Trial, given: Study, epochs: int | None = None) -> dict[str, float]:
    """Train and test one network: metric -> mean over the test pictures."""
    family = load_domain(given.domain)
    learner: Any = load_prior(trial.method)
    common: dict[str, Any] = {"split": trial.seed, "style": trial.pictures, "seed": trial.seed}
    recipe = getattr(learner, "labels", "full")
    train = family.demonstrations("train", recipe=recipe, **common, **given.options(trial.n))
    test = family.demonstrations(given.part, recipe="paper", **common, **given.test(trial.n))
    learner.fit(train, seed=trial.seed, epochs=epochs)
    classes = test.classes or tuple(range(len(test.actions)))
    figures = compare_orders(learner.predict(test.pictures), test, classes)
    known = {row.tobytes() for row in _kinds(train.sequences, classes)}
    seen = np.array([row.tobytes() in known for row in _kinds(test.sequences, classes)])
    found = {metric: float(values.mean()) for metric, values in figures.items()}
    for label, chosen in (("seen", seen), ("unseen", ~seen)):
        found[f"{label}_share"] = float(chosen.mean())
        if chosen.any():
            found[f"whole_sequence_{label}"] = float(figures["whole_sequence"][chosen].mean())
            found[f"per_step_{label}"] = float(figures["per_step"][chosen].mean())
    return {**found, "training_seconds": float(learner.header["training"]["seconds"])}
