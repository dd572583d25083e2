"""What is measured without a planner: the paper's tower and Scrabble experiments, each a grid of trials."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from neurosym.errors import UnknownNameError
from neurosym.experiments.study_scales import SCALES


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
        train: method -> settings of its training that differ here from its recipe's.
        baselines: names in `neurosym.experiments.order_baselines.BASELINES`; calculated for each style, n and seed.
        ours: which of the methods is not the paper's.
        about: what is asked, in a sentence.
        figures: kinds of figures, see `neurosym.experiments.study_figures`.
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
    train: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    baselines: tuple[str, ...] = ("memoriser", "blind")
    ours: str = "sinkhorn"
    about: str = ""
    figures: tuple[str, ...] = ()

    def trials(self) -> list[Trial]:
        return [
            Trial(self.name, style, method, n, seed)
            for style in self.pictures
            for n in self.sizes
            for method in (*self.methods, *self.baselines)
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
            "bc": {"whole_sequence": 0.46, "whole_sequence_std": 0.08, "re_use": 0.46},
            "bc+hungarian": {"whole_sequence": 0.53, "whole_sequence_std": 0.07, "re_use": 0.0},
            "tcn-paper": {"whole_sequence": 0.63, "whole_sequence_std": 0.05, "re_use": 0.53},
            "tcn-paper+hungarian": {"whole_sequence": 0.68, "whole_sequence_std": 0.05, "re_use": 0.0},
            "sinkhorn-paper": {"whole_sequence": 0.72, "whole_sequence_std": 0.05, "re_use": 0.0},
        },
        pictures=("easy", "hard"),
        about="Towers of six blocks, two each in three colours (the paper's Sec. IV-A, Table I and Fig. 4).",
        figures=("shares", "density", "confusion"),
    )
    by_sequence = replace(
        tower,
        name="tower-by-sequence",
        options=lambda n: {"variant": "colours", "count": n, "by": "sequence"},
        test=lambda _: {"variant": "colours", "count": 100, "by": "sequence"},
        published=None,
        pictures=("hard",),
        about="The same towers, split so that no colour sequence of the test was ever demonstrated.",
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
        about="Six blocks of six colours, tested on all 720 towers, seen ones too (the paper's Sec. IV-B, Fig. 5).",
        figures=("curves", "confusion"),
    )
    variable = Study(
        "variable",
        "tower",
        ("tcn-paper+hungarian", "sinkhorn-paper", "sinkhorn"),
        (100, 200, 400, 800),
        "demonstrations",
        _demonstrations("heights"),
        lambda _: {"variant": "heights", "count": 500},
        about="Towers of two to six of the blocks in three colours (the paper's Sec. IV-C, Fig. 6).",
        figures=("curves", "confusion"),
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
        about="Words of three to six of the first n tiles (the paper's Sec. IV-E, Fig. 8 and 9).",
        figures=("curves", "classes", "repeats", "confusion"),
    )
    return {s.name: s for s in (tower, by_sequence, unseen, variable, scrabble)}


def study_names() -> list[str]:
    """Names that `study` takes."""
    return sorted(_studies())


def study(name: str, scale: str = "quick") -> Study:
    """The study of that name: change it with `dataclasses.replace`.

    Args:
        scale: ``"quick"``, within 15 minutes on two cores, or ``"paper"``, as large as the paper's.
    """
    known = _studies()
    if name not in known:
        raise UnknownNameError("study", name, known)
    if scale not in SCALES:
        raise UnknownNameError("scale", scale, SCALES)
    return replace(known[name], **SCALES[scale].get(name, {}))
