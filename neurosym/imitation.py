"""Studies in which an order is read from a picture, and no planner helps: the paper's tower and Scrabble experiments.

A study is a grid of trials (pictures x method x n x seed). Each trains one network on demonstrations and compares
its own orders (`predict`) with those of pictures it never saw. Finished trials are kept in a journal.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from neurosym import __version__
from neurosym.demonstrations import Demonstrations
from neurosym.errors import InputError, UnknownNameError
from neurosym.files import write_text
from neurosym.journal import Journal, key_of
from neurosym.registry import load_domain, load_prior
from neurosym.reproduce import Record, write_records

#: Called with one line about what is going on.
Say = Callable[[str], None]

#: Raise it whenever the same trial would give other figures, so that no journal answers for it.
TRIALS_VERSION = 1


@dataclass(frozen=True)
class Trial:
    """One network: trained on `n` demonstrations (or, for Scrabble, with `n` actions), tested on others."""

    study: str
    pictures: str
    method: str
    n: int
    seed: int


@dataclass(frozen=True)
class Study:
    """A grid of trials.

    Attributes:
        name: on the command line.
        domain: the family.
        methods: what is compared, the paper's first, ours last.
        sizes: values of n.
        what: what n counts, for tables.
        options: n -> options of the training demonstrations.
        test: n -> options of the test demonstrations.
        part: of the problems, on which is tested ("test", or "all" where the paper tests on everything).
        published: method -> the paper's figures, by metric.
        pictures: styles.
        seeds: how often; each seed is another split and another training.
    """

    name: str
    domain: str
    methods: tuple[str, ...]
    sizes: tuple[int, ...]
    what: str
    options: Callable[[int], dict[str, Any]]
    test: Callable[[int], dict[str, Any]]
    part: str = "test"
    published: Mapping[str, Mapping[str, float]] | None = None
    pictures: tuple[str, ...] = ("hard",)
    seeds: int = 3

    def trials(self) -> list[Trial]:
        return [
            Trial(self.name, style, method, n, seed)
            for style in self.pictures
            for n in self.sizes
            for method in self.methods
            for seed in range(self.seeds)
        ]


_PAPER_FIVE = ("bc", "bc+hungarian", "tcn-paper", "tcn-paper+hungarian", "sinkhorn-paper")


def _demonstrations(variant: str) -> Callable[[int], dict[str, Any]]:
    return lambda n: {"variant": variant, "count": n}


def _studies() -> dict[str, Study]:
    tower = Study(
        "tower",
        "tower",
        (*_PAPER_FIVE, "sinkhorn"),
        (200,),
        "demonstrations",
        _demonstrations("colours"),
        lambda _: {"variant": "colours", "count": 100},
        published={
            "bc": {"whole_sequence": 0.46, "re_use": 0.46},
            "bc+hungarian": {"whole_sequence": 0.53, "re_use": 0.0},
            "tcn-paper": {"whole_sequence": 0.63, "re_use": 0.53},
            "tcn-paper+hungarian": {"whole_sequence": 0.68, "re_use": 0.0},
            "sinkhorn-paper": {"whole_sequence": 0.72, "re_use": 0.0},
        },
        pictures=("easy", "hard"),
    )
    by_sequence = replace(
        tower,
        name="tower-by-sequence",
        options=lambda n: {"variant": "colours", "count": n, "by": "sequence"},
        test=lambda _: {"variant": "colours", "count": 100, "by": "sequence"},
        published=None,
        pictures=("hard",),
    )
    unseen = Study(
        "unseen",
        "tower",
        ("tcn-paper", "sinkhorn-paper", "sinkhorn"),
        (50, 100, 200, 400),
        "demonstrations",
        _demonstrations("unique"),
        lambda _: {"variant": "unique"},
        part="all",
    )
    variable = Study(
        "variable",
        "tower",
        ("tcn-paper+hungarian", "sinkhorn-paper", "sinkhorn"),
        (100, 200, 400, 800),
        "demonstrations",
        _demonstrations("heights"),
        lambda _: {"variant": "heights", "count": 500},
    )
    scrabble = Study(
        "scrabble",
        "scrabble",
        ("tcn-paper+hungarian", "sinkhorn-paper", "sinkhorn"),
        (6, 26, 50, 98),
        "actions",
        lambda n: {"tiles": n, "count": 10_000},
        lambda n: {"tiles": n, "count": 2_000},
        pictures=("easy",),
        seeds=1,
    )
    return {s.name: s for s in (tower, by_sequence, unseen, variable, scrabble)}


def study_names() -> list[str]:
    """Names that `study` takes."""
    return sorted(_studies())


def study(name: str) -> Study:
    """The study of that name, at its quick scale: change it with `dataclasses.replace`."""
    known = _studies()
    if name not in known:
        raise UnknownNameError("study", name, known)
    return known[name]


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


def reproduce_study(
    given: Study, out: Path, *, workers: int = 1, epochs: int | None = None, say: Say = lambda _: None
) -> list[Record]:
    """Run the trials that are not done yet; write results.csv and report.md into `out`."""
    journal = Journal(out / "trials.jsonl")
    trials = given.trials()
    keys = {t: _key(given, t, epochs) for t in trials}
    missing = [t for t in trials if keys[t] not in journal]
    say(f"{len(trials) - len(missing)} of {len(trials)} trials are done already.")
    for done, (trial, figures) in enumerate(_run_all(missing, given, epochs, workers)):
        journal.add({keys[trial]: figures})
        say(
            f"[{done + 1}/{len(missing)}] {trial.method}, {trial.pictures} pictures, n = {trial.n}, seed {trial.seed}: "
            f"{figures['whole_sequence']:.2f} whole, {figures['per_step']:.2f} a step"
        )
    records = [
        Record(t.study, t.pictures, t.method, t.n, t.seed, metric, value)
        for t in trials
        for metric, value in sorted(journal[keys[t]].items())
    ]
    write_records(records, out / "results.csv")
    write_text(out / "report.md", report(given, records))
    return records


def _key(given: Study, trial: Trial, epochs: int | None) -> str:
    """A digest of all that decides a trial."""
    data = [given.domain, given.part, given.options(trial.n), given.test(trial.n)]
    return key_of({"trial": asdict(trial), "data": data, "epochs": epochs, "version": [__version__, TRIALS_VERSION]})


def _run_all(
    missing: Sequence[Trial], given: Study, epochs: int | None, workers: int
) -> Iterable[tuple[Trial, dict[str, float]]]:
    if workers <= 1 or len(missing) <= 1:
        return ((t, run_trial(t, given, epochs)) for t in missing)
    from joblib import Parallel, delayed

    def run(trial: Trial) -> tuple[Trial, dict[str, float]]:
        return trial, run_trial(trial, given, epochs)

    finished: Iterable[tuple[Trial, dict[str, float]]] = Parallel(n_jobs=workers, return_as="generator_unordered")(
        delayed(run)(t) for t in missing
    )
    return finished


def report(given: Study, records: Sequence[Record]) -> str:
    """A page of Markdown: means over seeds with their deviation, the paper's figures beside them."""
    metrics = ["whole_sequence", "whole_sequence_seen", "whole_sequence_unseen", "per_step", "per_step_unseen"]
    metrics += ["stop_accuracy", "re_use", "training_seconds"]
    said = f"Mean over {given.seeds} seeds ± deviation; a sequence is seen when it, colours or letters, was trained on."
    lines = [f"# {given.name}", "", said]
    for style in given.pictures:
        head = [given.what, "method", *(m.replace("_", " ") for m in metrics), "paper"]
        lines += ["", f"## {style} pictures", "", f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
        for n in given.sizes:
            for method in given.methods:
                own = [r for r in records if (r.pictures, r.method, r.n) == (style, method, n)]
                row = [_mean([r.value for r in own if r.metric == m]) for m in metrics]
                paper = (given.published or {}).get(method, {})
                beside = ", ".join(f"{m.replace('_', ' ')} {v:.2f}" for m, v in paper.items())
                lines.append(f"| {n} | {method} | {' | '.join(row)} | {beside} |")
    machine = f"Python {platform.python_version()}, {os.cpu_count()} processors"
    return "\n".join([*lines, "", f"neurosym {__version__}, {machine}; seeds 0 to {given.seeds - 1}.", ""])


def _mean(values: Sequence[float]) -> str:
    if not values:
        return ""
    return f"{np.mean(values):.2f}" + (f" ± {np.std(values):.2f}" if len(values) > 1 else "")
