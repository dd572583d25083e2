"""A study without a planner: a grid of trials, each a network that is trained and tested, and their results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass, field
from functools import cached_property
from typing import Any

import pandas as pd

from neurosym.experiments.order_accuracy import Counts
from neurosym.experiments.reporting import RECORD, values_by

Options = Callable[[int], dict[str, Any]]


@dataclass(frozen=True)
class Trial:
    """One network: trained on `n` demonstrations (or, for Scrabble, with `n` actions), tested on others."""

    study: str
    pictures: str
    method: str
    n: int
    seed: int


@dataclass(frozen=True)
class Control:
    """A method with one thing changed: settings of its training that are put upon the method's own in the study."""

    of: str
    settings: Mapping[str, Any]


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
        train: method -> settings of its training that differ here from its recipe's.
        controls: by what is changed; they are trained and tested as methods are, and have a table of their own.
        families: title -> methods whose order is set against the paper's; empty: all that have the paper's figures.
        baselines: names in `neurosym.experiments.baselines.BASELINES`; calculated for each style, n and seed.
        ours: which of the methods is not the paper's.
        about: what is asked, in a sentence.
        figures: kinds of figures, see `neurosym.experiments.study_report`.
    """

    name: str
    domain: str
    methods: tuple[str, ...]
    sizes: tuple[int, ...]
    what: str
    options: Options
    test: Options
    part: str = "test"
    published: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    pictures: tuple[str, ...] = ("hard",)
    seeds: int = 3
    train: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    controls: Mapping[str, Control] = field(default_factory=dict)
    families: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    baselines: tuple[str, ...] = ("memoriser", "blind")
    ours: str = "sinkhorn"
    about: str = ""
    figures: tuple[str, ...] = ()

    @property
    def rows(self) -> tuple[str, ...]:
        """Methods and baselines, as tables and figures have them."""
        return (*self.methods, *self.baselines)

    def trials(self) -> list[Trial]:
        return [
            Trial(self.name, style, method, n, seed)
            for style in self.pictures
            for n in self.sizes
            for method in (*self.rows, *self.controls)
            for seed in range(self.seeds)
        ]

    def training(self, method: str) -> tuple[str, dict[str, Any]]:
        """What a method or control trains: the name of a prior, and the settings that differ from its recipe's."""
        control = self.controls.get(method)
        if control is None:
            return method, dict(self.train.get(method, {}))
        return control.of, {**self.train.get(control.of, {}), **control.settings}


@dataclass(frozen=True, eq=False)
class Results:
    """All trials of a study.

    Attributes:
        records: the lines of results.csv, with the columns `RECORD`.
        counts: (pictures, method, n) -> those of all seeds, added up; baselines have none.
    """

    study: Study
    records: pd.DataFrame
    counts: Mapping[tuple[str, str, int], Counts]

    @classmethod
    def of(cls, study: Study, trials: Mapping[Trial, Mapping[str, Any]]) -> Results:
        """From what `run_trial` gave for each trial of the study."""
        rows: list[tuple[Any, ...]] = []
        counts: dict[tuple[str, str, int], list[Counts]] = {}
        for trial in study.trials():
            rows += [(*astuple(trial), *figure) for figure in sorted(trials[trial]["figures"].items())]
            if trials[trial]["counts"] is not None:
                cell = (trial.pictures, trial.method, trial.n)
                counts.setdefault(cell, []).append(Counts.from_json(trials[trial]["counts"]))
        records = pd.DataFrame(rows, columns=RECORD)
        return cls(study, records, {cell: Counts.pooled(own) for cell, own in counts.items()})

    def values(self, pictures: str, method: str, n: int, metric: str) -> list[float]:
        """A value a seed; empty where there is none (no test sequence was seen, say)."""
        return self._values.get((pictures, method, n, metric), [])

    def mean(self, pictures: str, method: str, n: int, metric: str) -> float | None:
        """Over the seeds; None where there is no value."""
        own = self.values(pictures, method, n, metric)
        return sum(own) / len(own) if own else None

    def means(self, pictures: str, method: str, metric: str) -> dict[int, float]:
        """n -> mean over the seeds, where there is one."""
        means = {n: self.mean(pictures, method, n, metric) for n in self.study.sizes}
        return {n: mean for n, mean in means.items() if mean is not None}

    @property
    def lengths_vary(self) -> bool:
        """Whether the test sequences differ in length, so that where to stop is a question."""
        return any(int((own.right.sum(axis=1) > 0).sum()) > 1 for own in self.counts.values())

    @cached_property
    def _values(self) -> dict[tuple[Any, ...], list[float]]:
        return values_by(self.records, "pictures", "method", "n", "metric")
