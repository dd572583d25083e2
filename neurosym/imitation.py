"""Studies in which an order is read from a picture, and no planner helps: the paper's tower and Scrabble experiments.

A study is a grid of trials (pictures x method x n x seed). Each trains one network on demonstrations and compares
its own orders (`predict`) with those of pictures it never saw. Finished trials are kept in a journal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from neurosym import __version__
from neurosym.imitation_report import report, write_results
from neurosym.journal import Journal, key_of
from neurosym.studies import Study, Trial, study, study_names
from neurosym.study_results import Results
from neurosym.trials import run_trial

__all__ = ["Results", "Study", "Trial", "report", "reproduce_study", "run_trial", "study", "study_names"]

#: Called with one line about what is going on.
Say = Callable[[str], None]

#: Raise it whenever the same trial would give other figures, so that no journal answers for it.
TRIALS_VERSION = 2


def reproduce_study(
    given: Study, out: Path, *, workers: int = 1, epochs: int | None = None, say: Say = lambda _: None
) -> Results:
    """Run the trials that are not done yet; write results.csv, report.md and figures into `out`."""
    journal = Journal(out / "trials.jsonl")
    trials = given.trials()
    keys = {t: _key(given, t, epochs) for t in trials}
    missing = [t for t in trials if keys[t] not in journal]
    say(f"{len(trials) - len(missing)} of {len(trials)} trials are done already.")
    for done, (trial, found) in enumerate(_run_all(missing, given, epochs, workers)):
        journal.add({keys[trial]: found})
        figures = found["figures"]
        say(
            f"[{done + 1}/{len(missing)}] {trial.method}, {trial.pictures} pictures, n = {trial.n}, seed {trial.seed}: "
            f"{figures['whole_sequence']:.2f} whole, {figures['per_step']:.2f} a step"
        )
    results = Results.of(given, {t: journal[keys[t]] for t in trials})
    write_results(results, out)
    return results


def _key(given: Study, trial: Trial, epochs: int | None) -> str:
    """A digest of all that decides a trial."""
    data = [given.domain, given.part, given.options(trial.n), given.test(trial.n)]
    return key_of({"trial": asdict(trial), "data": data, "epochs": epochs, "version": [__version__, TRIALS_VERSION]})


def _run_all(
    missing: Sequence[Trial], given: Study, epochs: int | None, workers: int
) -> Iterable[tuple[Trial, dict[str, Any]]]:
    if workers <= 1 or len(missing) <= 1:
        return ((t, run_trial(t, given, epochs)) for t in missing)
    from joblib import Parallel, delayed

    def run(trial: Trial) -> tuple[Trial, dict[str, Any]]:
        return trial, run_trial(trial, given, epochs)

    finished: Iterable[tuple[Trial, dict[str, Any]]] = Parallel(n_jobs=workers, return_as="generator_unordered")(
        delayed(run)(t) for t in missing
    )
    return finished
