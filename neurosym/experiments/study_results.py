"""What a study found: its numbers, a line each, and the counts that figures are drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from neurosym.experiments.csv_lines import Record
from neurosym.experiments.order_accuracy import Counts
from neurosym.experiments.studies import Study, Trial


@dataclass(frozen=True)
class Results:
    """All trials of a study.

    Attributes:
        records: the lines of results.csv.
        counts: (pictures, method, n) -> those of all seeds, added up; baselines have none.
    """

    study: Study
    records: tuple[Record, ...]
    counts: Mapping[tuple[str, str, int], Counts]

    @classmethod
    def of(cls, study: Study, found: Mapping[Trial, Mapping[str, Any]]) -> Results:
        """From what `run_trial` gave for each trial of the study."""
        records: list[Record] = []
        counts: dict[tuple[str, str, int], list[Counts]] = {}
        for trial in study.trials():
            figures = found[trial]["figures"]
            records += [
                Record(study.name, trial.pictures, trial.method, trial.n, trial.seed, metric, value)
                for metric, value in sorted(figures.items())
            ]
            if found[trial]["counts"] is not None:
                cell = (trial.pictures, trial.method, trial.n)
                counts.setdefault(cell, []).append(Counts.from_json(found[trial]["counts"]))
        return cls(study, tuple(records), {cell: Counts.pooled(own) for cell, own in counts.items()})

    def values(self, pictures: str, method: str, n: int, metric: str) -> list[float]:
        """A value a seed; empty where there is none (no test sequence was seen, say)."""
        return self._index.get((pictures, method, n, metric), [])

    def mean(self, pictures: str, method: str, n: int, metric: str) -> float | None:
        """Over the seeds; None where there is no value."""
        own = self.values(pictures, method, n, metric)
        return sum(own) / len(own) if own else None

    @property
    def lengths_vary(self) -> bool:
        """Whether the test sequences differ in length, so that where to stop is a question."""
        return any(int((own.right.sum(axis=1) > 0).sum()) > 1 for own in self.counts.values())

    @cached_property
    def _index(self) -> dict[tuple[str, str, int, str], list[float]]:
        index: dict[tuple[str, str, int, str], list[float]] = {}
        for r in self.records:
            index.setdefault((r.pictures, r.method, r.n, r.metric), []).append(r.value)
        return index
