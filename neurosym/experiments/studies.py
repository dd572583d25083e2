"""What is measured without a planner: the paper's tower and Scrabble experiments, grids of trials with results."""

from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import pandas as pd

from neurosym.errors import UnknownNameError
from neurosym.experiments.order_accuracy import Counts
from neurosym.experiments.reporting import RECORD, values_by

Options = Callable[[int], dict[str, Any]]
#: `quick` finishes within 15 minutes on two cores, a study; `paper` has the paper's sizes and seeds.
SCALES = ("quick", "paper")


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
        methods: what is compared, the paper's first, ours last.
        sizes: values of n.
        what: what n counts, for tables.
        options: n -> options of the training demonstrations.
        test: n -> options of the test demonstrations.
        part: of the problems, on which is tested ("test", or "all" where the paper tests on everything).
        published: method -> the paper's figures, by metric.
        seeds: how often; each seed is another split and another training.
        train: method -> settings of its training that differ here from its recipe's.
        baselines: names in `neurosym.experiments.baselines.BASELINES`; calculated for each style, n and seed.
        ours: which of the methods is not the paper's.
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
            for method in self.rows
            for seed in range(self.seeds)
        ]


@dataclass(frozen=True, eq=False)
class Results:
    """All trials of a study.

    `records`: the lines of results.csv, with the columns `RECORD`. `counts`: (pictures, method, n) -> those of all
    seeds, added up; baselines have none.
    """

    study: Study
    records: pd.DataFrame
    counts: Mapping[tuple[str, str, int], Counts]

    @classmethod
    def of(cls, study: Study, trials: Mapping[Trial, Mapping[str, Any]]) -> Self:
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


def study_names() -> list[str]:
    """Names that `study` takes."""
    return sorted(_QUICK)


def study(name: str, scale: str = "quick") -> Study:
    """The study of that name: change it with `dataclasses.replace`.

    `scale`: ``"quick"``, within 15 minutes on two cores, or ``"paper"``, as large as the paper's.
    """
    if name not in _QUICK:
        raise UnknownNameError("study", name, _QUICK)
    if scale not in SCALES:
        raise UnknownNameError("scale", scale, SCALES)
    return replace(_QUICK[name], **(_PAPER[name] if scale == "paper" else {}))


def _options(**options: Any) -> Options:
    """These options; "n" stands for n."""
    return lambda n: {name: n if value == "n" else value for name, value in options.items()}


def _longer(*methods: str) -> dict[str, dict[str, Any]]:
    # A tower's picture is read better after more updates than 150 epochs of 200 demonstrations make: with the small
    # encoder, `sinkhorn-paper` got 34% of hard towers right after 1,050 updates, 41% after 4,000.
    return {method: {"least_steps": 4_000} for method in methods}


# 10,000 pictures of words: with batches of 64, as the paper's, and larger steps, the paper's networks need far fewer
# epochs than its 5,000 (98 tiles: 30 epochs of `tcn-paper+hungarian` read 99.9% of the letters).
_WORDS = {"batch": 64, "rate": 1e-3}

_PAPER_FIVE = ("bc", "bc+hungarian", "tcn-paper", "tcn-paper+hungarian", "sinkhorn-paper")

_TOWER = Study(
    "tower",
    "tower",
    (*_PAPER_FIVE, "sinkhorn"),
    (200,),
    "demonstrations",
    _options(variant="colours", count="n"),
    _options(variant="colours", count=100),
    published={
        "bc": {"whole_sequence": 0.46, "whole_sequence_std": 0.08, "re_use": 0.46},
        "bc+hungarian": {"whole_sequence": 0.53, "whole_sequence_std": 0.07, "re_use": 0.0},
        "tcn-paper": {"whole_sequence": 0.63, "whole_sequence_std": 0.05, "re_use": 0.53},
        "tcn-paper+hungarian": {"whole_sequence": 0.68, "whole_sequence_std": 0.05, "re_use": 0.0},
        "sinkhorn-paper": {"whole_sequence": 0.72, "whole_sequence_std": 0.05, "re_use": 0.0},
    },
    pictures=("easy", "hard"),
    train=_longer(*_PAPER_FIVE),
    about="Towers of six blocks, two each in three colours (the paper's Sec. IV-A, Table I and Fig. 4).",
    figures=("shares", "density", "confusion"),
)
_BY_SEQUENCE = replace(
    _TOWER,
    name="tower-by-sequence",
    options=_options(variant="colours", count="n", by="sequence"),
    test=_options(variant="colours", count=100, by="sequence"),
    published={},
    pictures=("hard",),
    about="The same towers, split so that no colour sequence of the test was ever demonstrated.",
)
_UNSEEN = Study(
    "unseen",
    "tower",
    ("tcn-paper", "sinkhorn-paper", "sinkhorn"),
    (50, 100, 200, 400),
    "demonstrations",
    _options(variant="unique", count="n"),
    _options(variant="unique"),
    part="all",
    train=_longer("tcn-paper", "sinkhorn-paper"),
    about="Six blocks of six colours, tested on all 720 towers, seen ones too (the paper's Sec. IV-B, Fig. 5).",
    figures=("curves", "confusion"),
)
_VARIABLE = Study(
    "variable",
    "tower",
    ("tcn-paper+hungarian", "sinkhorn-paper", "sinkhorn"),
    (100, 200, 400, 800),
    "demonstrations",
    _options(variant="heights", count="n"),
    _options(variant="heights", count=500),
    train=_longer("tcn-paper+hungarian", "sinkhorn-paper"),
    about="Towers of two to six of the blocks in three colours (the paper's Sec. IV-C, Fig. 6).",
    figures=("curves", "confusion"),
)
_SCRABBLE = Study(
    "scrabble",
    "scrabble",
    ("tcn-paper+hungarian", "sinkhorn-paper", "sinkhorn"),
    (6, 26, 50, 74, 98),
    "actions",
    _options(tiles="n", count=10_000),
    _options(tiles="n", count=2_000),
    pictures=("easy",),
    seeds=1,
    train={
        "tcn-paper+hungarian": {**_WORDS, "epochs": 30},
        # Five samples of 98 columns: an epoch takes four times as long, and the loss hardly falls after the tenth.
        "sinkhorn-paper": {**_WORDS, "epochs": 12},
    },
    about="Words of three to six of the first n tiles (the paper's Sec. IV-E, Fig. 8 and 9).",
    figures=("curves", "classes", "repeats", "confusion"),
)
_QUICK: Mapping[str, Study] = {study.name: study for study in (_TOWER, _BY_SEQUENCE, _UNSEEN, _VARIABLE, _SCRABBLE)}

#: What the paper's scale changes, by study.
_PAPER: Mapping[str, Mapping[str, Any]] = {
    # "repeated 20 times for models trained using different random seeds" (Sec. IV-A)
    "tower": {"seeds": 20},
    "tower-by-sequence": {"seeds": 20},
    # The paper says "increasing numbers"; ours go on to all that a split has to train on.
    "unseen": {"sizes": (25, 50, 100, 150, 200, 300, 400, 480), "seeds": 20},
    "variable": {
        "sizes": (50, 100, 200, 300, 400, 600, 800, 1000, 1300),
        "test": _options(variant="heights"),
        "seeds": 20,
    },
    # 10,000 pictures to learn from, 5,000 to test; "an increasingly large subset of the full tile set" (Sec. IV-E)
    "scrabble": {
        "sizes": (*range(6, 97, 5), 98),
        "test": _options(tiles="n", count=5_000),
        "train": {"tcn-paper+hungarian": _WORDS, "sinkhorn-paper": _WORDS},
    },
}
