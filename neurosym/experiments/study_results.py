"""What came out of a study: its numbers, a line each, and the counts that figures are drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import Any

import pandas as pd

from neurosym.experiments.order_accuracy import Counts
from neurosym.experiments.reporting import RECORD, values_by
from neurosym.experiments.studies import Study, Trial


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
