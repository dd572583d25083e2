"""Studies in which an order is read from a picture, and no planner helps: the paper's tower and Scrabble experiments.

A study is a grid of trials (pictures x method x n x seed). Each trains one network on demonstrations and compares
its own orders (`predict`) with those of pictures it never saw. Finished trials are kept in a journal.
"""

from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from neurosym import __version__
from neurosym.experiments.baselines import BASELINES
from neurosym.experiments.engines import run_tasks
from neurosym.experiments.journal import Journal, key_of
from neurosym.experiments.order_accuracy import Counts, averages, classes_of, compare_orders, seen_in
from neurosym.experiments.studies import study, study_names
from neurosym.experiments.study_grid import Results, Study, Trial
from neurosym.experiments.study_report import report, write_results
from neurosym.language.problem_family import Progress
from neurosym.registry import load_domain, load_prior

__all__ = ["Results", "Study", "Trial", "report", "reproduce_study", "run_trial", "study", "study_names"]
#: Raise it whenever the same trial would give other figures, so that no journal answers for it.
TRIALS_VERSION = 4


def reproduce_study(
    given: Study,
    out: Path,
    *,
    epochs: int | None = None,
    say: Callable[[str], None] = lambda _: None,
    progress: Progress = lambda done, total: None,
    **where: Any,
) -> Results:
    """Run the trials that are not done yet; write results.csv, report.md and figures into `out`.

    `epochs`: None takes each recipe's. `say`: called with a line about what is going on. `progress`: called with (done,
    total) trials. `where`: workers, engine and address: where trials run, see `neurosym.experiments.engines.run_tasks`.
    """
    journal = Journal(out / "trials.jsonl")
    keys = {trial: _key(given, trial, epochs) for trial in given.trials()}
    missing = [trial for trial, key in keys.items() if key not in journal]
    before, total = len(keys) - len(missing), len(keys)
    say(f"{before} of {total} trials are done already.")
    progress(before, total)
    for done, (trial, result) in enumerate(
        run_tasks(lambda trial: run_trial(trial, given, epochs), missing, **where), before + 1
    ):
        journal.add({keys[trial]: result})
        progress(done, total)
        what = f"{trial.method}, {trial.pictures} pictures, n = {trial.n}, seed {trial.seed}"
        shares = "{whole_sequence:.2f} whole, {per_step:.2f} a step".format(**result["figures"])
        say(f"[{done}/{total}] {what}: {shares}")
    results = Results.of(given, {trial: journal[key] for trial, key in keys.items()})
    write_results(results, out)
    return results


def run_trial(trial: Trial, given: Study, epochs: int | None = None) -> dict[str, Any]:
    """Train and test one network, or calculate a baseline.

    Returns what a journal keeps: ``"figures"``, metric -> mean over the test pictures, and ``"counts"``, as
    `Counts.to_json` gives them (None for a baseline).
    """
    family = load_domain(given.domain)
    name, changes = given.training(trial.method)
    learner: Any = None if trial.method in BASELINES else load_prior(name)
    common: dict[str, Any] = {"split": trial.seed, "style": trial.pictures, "seed": trial.seed}
    recipe = "paper" if learner is None else getattr(learner, "labels", "full")
    configuration = _configuration(given, trial, epochs)
    *_, to_learn, to_test = configuration["data"]
    train = family.demonstrations("train", recipe=recipe, **common, **to_learn)
    test = family.demonstrations(given.part, recipe="paper", **common, **to_test)
    seen = seen_in(train, test)
    if learner is None:
        return {"figures": averages(BASELINES[trial.method](train, test), seen), "counts": None}
    # What reads the same network in another way (with an assignment, without) has it from the shelf.
    shared = {"trained_as": getattr(learner, "trained_as", name), **configuration}
    kept = Path(_shelf().name) / f"{key_of({**shared, 'recipe': None, 'method': None})}.safetensors"
    if kept.exists():
        learner = load_prior(name, weights=kept)
    else:
        learner.fit(train, seed=trial.seed, epochs=epochs, **({"settings": changes} if changes else {}))
        learner.save(kept)
    orders = learner.predict(test.pictures)
    figures = averages(compare_orders(orders, test, classes_of(test)), seen)
    if len(set(test.lengths)) > 1:
        given_lengths = learner.predict(test.pictures, lengths=test.lengths)
        own = compare_orders(given_lengths, test, classes_of(test))["per_step"]
        figures["per_step_given_length"] = float(own.mean())
    training = learner.header["training"]
    figures |= {"training_seconds": float(training["seconds"]), "epochs": float(training["epochs"])}
    return {"figures": figures, "counts": Counts.of(orders, test).to_json()}


def _key(given: Study, trial: Trial, epochs: int | None) -> str:
    """A digest of all that decides a trial."""
    return key_of(_configuration(given, trial, epochs))


def _configuration(given: Study, trial: Trial, epochs: int | None) -> dict[str, Any]:
    name, changes = given.training(trial.method)
    return {
        **asdict(trial),
        "data": [given.domain, given.part, given.options(trial.n), given.test(trial.n)],
        "recipe": _settings(name),
        "changes": [changes, epochs],
        "version": [__version__, TRIALS_VERSION],
    }


@cache
def _shelf() -> TemporaryDirectory[str]:
    """Where this process keeps the networks that it trained."""
    return TemporaryDirectory(prefix="neurosym-")


@cache
def _settings(method: str) -> Any:
    """How a method trains, where it tells: one that was tuned is another."""
    return None if method in BASELINES else getattr(load_prior(method), "settings", None)
