"""Rebuild an experiment of the paper: train on each split, test on its other half, and say what came beside the paper.

Every finished training and comparison is kept, so a run that was killed goes on where it was.
"""

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from neurosym import __version__
from neurosym.errors import InputError, UnknownNameError
from neurosym.experiments import benchmark
from neurosym.experiments.benchmark import Comparison, Outcome
from neurosym.experiments.engines import connection, cores, run_tasks
from neurosym.experiments.planning_report import BLIND, report, write_results
from neurosym.experiments.reporting import RECORD
from neurosym.language.problem_family import Progress
from neurosym.registry import load_domain, load_prior
from neurosym.support.files import write_text, written_whole

__all__ = ["Cell", "Experiment", "report", "reproduce", "soma_experiment", "train_cell"]
#: Called with one line about what is going on.
Say = Callable[[str], None]
#: What a scale changes; the paper splits the cubes 100 times.
SCALES: Mapping[str, Mapping[str, Any]] = {"quick": {"splits": 3}, "paper": {"splits": 100}}


@dataclass(frozen=True)
class Cell:
    """One training: a method on a style of pictures and a split."""

    style: str
    method: str
    split: int

    def path(self, out: Path) -> Path:
        return out / "weights" / f"{self.style}-{self.method}-split{self.split}.safetensors"


@dataclass(frozen=True)
class Experiment:
    """What is rebuilt.

    Attributes:
        splits: random splits into train and test, 0 .. splits - 1; each is trained and tested once.
        styles: styles of pictures; trained and tested on the same style.
        methods, planners: priors that are trained, and planners that use them.
        repeats: how often each test problem is planned.
        seed: of pictures and training.
        epochs: None takes each recipe's.
        tests: how many problems of each test half are planned; None plans all.
    """

    domain: str
    splits: int = 5
    styles: tuple[str, ...] = ("clean", "varied")
    methods: tuple[str, ...] = ("sinkhorn", "tcn", "sinkhorn-paper", "tcn-paper")
    planners: tuple[str, ...] = ("swap-repair", "backtracking", "best-first")
    repeats: int = 5
    seed: int = 0
    epochs: int | None = None
    tests: int | None = None

    def __post_init__(self) -> None:
        if self.splits < 1 or not (self.styles and self.methods and self.planners):
            raise InputError("Expected at least one split, style, method and planner; got none of one.")

    @property
    def cells(self) -> list[Cell]:
        splits = range(self.splits)
        return [Cell(style, method, split) for split in splits for style in self.styles for method in self.methods]


def soma_experiment(scale: str = "quick") -> Experiment:
    """The paper's Table II: change it with `dataclasses.replace`.

    `scale`: ``"quick"``, within 15 minutes on two cores, or ``"paper"``, as large as the paper's.
    """
    if scale not in SCALES:
        raise UnknownNameError("scale", scale, SCALES)
    return Experiment("soma", **SCALES[scale])


def reproduce(
    experiment: Experiment,
    out: Path,
    *,
    engine: str = "local",
    address: str | None = None,
    say: Say = lambda _: None,
    progress: Progress = lambda done, total: None,
    **where: Any,
) -> pd.DataFrame:
    """Train what is not trained yet, compare, and write results.csv, report.md and figures into `out`.

    `engine, address, where`: where networks are trained and problems solved, see `engines.run_tasks`. `say`: called
    with a line about what is going on. `progress`: called with (done, total) trainings and comparisons. Returns the
    lines of results.csv.
    """
    _same_experiment(experiment, out)
    cells = experiment.cells
    total = len(cells) + experiment.splits * len(experiment.styles)
    missing = [cell for cell in cells if not cell.path(out).exists()]
    done = len(cells) - len(missing)
    say(f"{done} of {len(cells)} networks are trained already.")
    progress(done, total)
    outcomes: dict[tuple[str, int], Outcome] = {}
    where |= {"engine": engine, "address": address}
    with connection(engine, address):
        if engine == "local":
            _make_demonstrations(experiment, missing, say)
        for line in _train_all(experiment, missing, out, partial(run_tasks, **where), keep=engine == "local"):
            done += 1
            say(f"[{done}/{len(cells)}] {line}")
            progress(done, total)
        for style in experiment.styles:
            for split in range(experiment.splits):
                outcomes[style, split] = _compare(experiment, style, split, out, **where)
                say(f"{style} pictures, split {split}: compared.")
                progress(len(cells) + len(outcomes), total)
    lines = [line for (style, split), each in outcomes.items() for line in _lines(experiment, each, style, split, out)]
    records = pd.DataFrame(lines, columns=RECORD)
    write_results(experiment, records, outcomes, out)
    return records


def train_cell(experiment: Experiment, cell: Cell, checkpoint: Path | None) -> tuple[bytes, float]:
    """Train one network: the content of its weights file, and the seconds it took.

    `checkpoint`: lets a training that was killed go on; it stays. None begins anew.
    """
    learner: Any = load_prior(cell.method)
    given = load_domain(experiment.domain).demonstrations(
        "train", split=cell.split, recipe=_recipe(cell.method), style=cell.style, seed=experiment.seed
    )
    learner.fit(given, seed=experiment.seed, epochs=experiment.epochs, checkpoint=checkpoint)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "weights.safetensors"
        learner.save(path, notes={"split": cell.split, "pictures": cell.style, "seed": experiment.seed})
        return path.read_bytes(), float(learner.header["training"]["seconds"])


def _train_all(
    experiment: Experiment, missing: Sequence[Cell], out: Path, run: Callable[..., Any], *, keep: bool
) -> Iterator[str]:
    """Train, and write each network's weights here, whoever trained it; a line about each."""

    def checkpoint(cell: Cell) -> Path | None:
        return cell.path(out).absolute().with_suffix(".checkpoint") if keep else None

    (out / "weights").mkdir(parents=True, exist_ok=True)
    for cell, (weights, seconds) in run(lambda c: train_cell(experiment, c, checkpoint(c)), missing):
        with written_whole(cell.path(out)) as file:
            file.write(weights)
        cell.path(out).with_suffix(".checkpoint").unlink(missing_ok=True)
        yield f"{cell.method}, {cell.style} pictures, split {cell.split}: {seconds:.0f} s"


def _make_demonstrations(experiment: Experiment, missing: Sequence[Cell], say: Say) -> None:
    """Pictures and labels are kept on disk by the family; made first, each is made once, on all processors."""
    family = load_domain(experiment.domain)
    for style, split, recipe in sorted({(c.style, c.split, _recipe(c.method)) for c in missing}):
        say(f"demonstrations: {style} pictures, split {split}, recipe {recipe}")
        family.demonstrations("train", split=split, recipe=recipe, style=style, seed=experiment.seed)


def _recipe(method: str) -> str:
    """The recipe of demonstrations that a method learns from."""
    return str(getattr(load_prior(method), "labels", "full"))


def _compare(
    experiment: Experiment, style: str, split: int, out: Path, *, workers: int | None = 1, **where: Any
) -> Outcome:
    family = load_domain(experiment.domain)
    comparison = Comparison(
        domain=experiment.domain,
        numbers=tuple(family.numbers("test", split=split))[: experiment.tests],
        planners=experiment.planners,
        priors=("random", *experiment.methods),
        options={"pictures": style, "seed": experiment.seed},
        seeds=experiment.repeats,
    )
    trained = {method: load_prior(Cell(style, method, split).path(out)) for method in experiment.methods}
    scores = benchmark.ask_priors(comparison, workers=min(workers or cores(), cores()), loaded=trained)
    journal = out / f"runs-{style}-{split}.jsonl"
    runs = benchmark.run(comparison, scores, workers=workers, journal=journal, **where)
    return Outcome(comparison, runs, *benchmark.image_blind(comparison, split=split))


def _lines(experiment: Experiment, outcome: Outcome, style: str, split: int, out: Path) -> Iterator[tuple[Any, ...]]:
    """The lines of results.csv of one comparison."""
    figures: dict[tuple[str, str], float] = {}
    for method, runs in pd.DataFrame(list(outcome.runs)).groupby("prior", sort=False):
        figures[method, "initial_failures"] = runs["first_order_failed"].mean()
        for planner, counts in runs.groupby("planner", sort=False)["iterations"]:
            figures[method, f"iterations {planner}"] = counts.mean()
            figures[method, f"iterations_std {planner}"] = counts.std(ddof=0)
        if method in experiment.methods:
            header = load_prior(Cell(style, method, split).path(out)).header  # type: ignore[attr-defined]
            figures[method, "training_seconds"] = header["training"]["seconds"]
    if outcome.image_blind is not None:
        figures[BLIND, "initial_failures"] = outcome.image_blind
    for (method, metric), value in figures.items():
        yield experiment.domain, style, method, len(outcome.comparison.numbers), split, metric, float(value)


def _same_experiment(experiment: Experiment, out: Path) -> None:
    """A folder belongs to one experiment: what another left there would be taken for finished."""
    fixed = {"domain": experiment.domain, "seed": experiment.seed, "epochs": experiment.epochs, "version": __version__}
    path, own = out / "experiment.json", json.dumps(fixed)
    known = path.read_text().strip() if path.exists() else own
    if known != own:
        raise InputError(f"Expected {out} to be empty or of this experiment, {own}; it holds {known}. Name another.")
    write_text(path, f"{own}\n")
