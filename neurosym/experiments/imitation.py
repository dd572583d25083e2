"""Studies in which an order is read from a picture, and no planner helps: the paper's tower and Scrabble experiments.

A study is a grid of trials (pictures x method x n x seed). Each trains one network on demonstrations and compares
its own orders (`predict`) with those of pictures it never saw. Finished trials are kept in a journal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

from neurosym import __version__
from neurosym.experiments.engines import run_tasks
from neurosym.experiments.imitation_report import report, write_results
from neurosym.experiments.journal import Journal, key_of
from neurosym.experiments.order_baselines import BASELINES
from neurosym.experiments.studies import Study, Trial, study, study_names
from neurosym.experiments.study_results import Results
from neurosym.experiments.trials import run_trial
from neurosym.language.problem_family import Progress
from neurosym.registry import load_prior

__all__ = ["Results", "Study", "Trial", "report", "reproduce_study", "run_trial", "study", "study_names"]

#: Called with one line about what is going on.
Say = Callable[[str], None]

#: Raise it whenever the same trial would give other figures, so that no journal answers for it.
TRIALS_VERSION = 3


def reproduce_study(
    given: Study,
    out: Path,
    *,
    workers: int | None = 1,
    engine: str = "local",
    address: str | None = None,
    epochs: int | None = None,
    say: Say = lambda _: None,
    progress: Progress = lambda done, total: None,
) -> Results:
    """Run the trials that are not done yet; write results.csv, report.md and figures into `out`.

    Args:
        workers, engine, address: where trials run, see `neurosym.experiments.engines.run_tasks`.
        epochs: None takes each recipe's.
        say: told what is going on.
        progress: called with (done, total) trials.
    """
    journal = Journal(out / "trials.jsonl")
    trials = given.trials()
    keys = {t: _key(given, t, epochs) for t in trials}
    missing = [t for t in trials if keys[t] not in journal]
    say(f"{len(trials) - len(missing)} of {len(trials)} trials are done already.")
    progress(len(trials) - len(missing), len(trials))
    ran = run_tasks(lambda t: run_trial(t, given, epochs), missing, engine=engine, workers=workers, address=address)
    for done, (trial, found) in enumerate(ran, len(trials) - len(missing) + 1):
        journal.add({keys[trial]: found})
        progress(done, len(trials))
        figures = found["figures"]
        say(
            f"[{done}/{len(trials)}] {trial.method}, {trial.pictures} pictures, n = {trial.n}, seed {trial.seed}: "
            f"{figures['whole_sequence']:.2f} whole, {figures['per_step']:.2f} a step"
        )
    results = Results.of(given, {t: journal[keys[t]] for t in trials})
    write_results(results, out)
    return results


def _key(given: Study, trial: Trial, epochs: int | None) -> str:
    """A digest of all that decides a trial."""
    data = [given.domain, given.part, given.options(trial.n), given.test(trial.n)]
    training = [_settings(trial.method), dict(given.train.get(trial.method, {})), epochs]
    return key_of(
        {"trial": asdict(trial), "data": data, "training": training, "version": [__version__, TRIALS_VERSION]}
    )


@cache
def _settings(method: str) -> Any:
    """How a method trains, as far as it says: one that was tuned is another."""
    return None if method in BASELINES else getattr(load_prior(method), "settings", None)
