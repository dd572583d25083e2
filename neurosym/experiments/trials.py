"""One trial of a study: a network is trained on demonstrations, and its own orders are compared with others."""

from __future__ import annotations

from typing import Any

from neurosym.experiments.order_accuracy import Counts, averages, classes_of, compare_orders, seen_in
from neurosym.experiments.order_baselines import BASELINES
from neurosym.experiments.studies import Study, Trial
from neurosym.registry import load_domain, load_prior


def run_trial(trial: Trial, given: Study, epochs: int | None = None) -> dict[str, Any]:
    """Train and test one network, or calculate a baseline.

    Returns:
        What a journal keeps: ``"figures"``, metric -> mean over the test pictures, and ``"counts"``, as
        `Counts.to_json` gives them (None for a baseline).
    """
    family = load_domain(given.domain)
    learner: Any = None if trial.method in BASELINES else load_prior(trial.method)
    common: dict[str, Any] = {"split": trial.seed, "style": trial.pictures, "seed": trial.seed}
    recipe = "paper" if learner is None else getattr(learner, "labels", "full")
    train = family.demonstrations("train", recipe=recipe, **common, **given.options(trial.n))
    test = family.demonstrations(given.part, recipe="paper", **common, **given.test(trial.n))
    seen = seen_in(train, test)
    if learner is None:
        return {"figures": averages(BASELINES[trial.method](train, test), seen), "counts": None}
    changes = given.train.get(trial.method)
    learner.fit(train, seed=trial.seed, epochs=epochs, **({"settings": changes} if changes else {}))
    orders = learner.predict(test.pictures)
    figures = averages(compare_orders(orders, test, classes_of(test)), seen)
    figures["training_seconds"] = float(learner.header["training"]["seconds"])
    return {"figures": figures, "counts": Counts.of(orders, test).to_json()}
