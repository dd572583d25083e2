"""`neurosym reproduce`: rebuild an experiment of the paper, beside the paper's figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from neurosym.commands.common import Pictures, say
from neurosym.engines import cores
from neurosym.errors import UnknownNameError

ExperimentName = Annotated[
    str, typer.Argument(metavar="NAME", help="soma, tower, tower-by-sequence, unseen, variable or scrabble.")
]


def reproduce(
    name: ExperimentName,
    seeds: Annotated[int | None, typer.Option("--seeds", min=1, metavar="K", help="Splits, 0 to K - 1.")] = None,
    pictures: Annotated[
        list[Pictures] | None, typer.Option("--pictures", help="soma: style; may be repeated. Default both.")
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option("--prior", metavar="Q", help="What is trained; may be repeated. Default all."),
    ] = None,
    epochs: Annotated[int | None, typer.Option("--epochs", min=1, help="Default each recipe's.")] = None,
    repeats: Annotated[int, typer.Option("--repeats", min=1, help="soma: how often each problem is planned.")] = 5,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, metavar="N", help="Default: one a processor.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Default out/reproduce-NAME.")] = None,
) -> None:
    """Rebuild an experiment of the paper; writes results.csv, report.md and figures. A killed run goes on."""
    from neurosym.imitation import study_names

    folder = out or Path("out") / f"reproduce-{name}"
    processes = workers or cores()
    if name in study_names():
        page = _study(name, seeds, prior, epochs, processes, folder)
    elif name == "soma":
        page = _planning(name, seeds or 5, pictures, prior, epochs, repeats, processes, folder)
    else:
        raise UnknownNameError("experiment", name, ["soma", *study_names()])
    print(page)  # a table of Markdown: rendered, its columns would not fit a terminal
    say(f"{folder}: results.csv and report.md")


def _study(
    name: str, seeds: int | None, prior: list[str] | None, epochs: int | None, workers: int, folder: Path
) -> str:
    from neurosym.imitation import report, reproduce_study, study

    given = study(name)
    given = replace(given, seeds=seeds or given.seeds, methods=tuple(prior or given.methods))
    return report(reproduce_study(given, folder, workers=workers, epochs=epochs, say=say))


def _planning(
    name: str,
    seeds: int,
    pictures: list[Pictures] | None,
    prior: list[str] | None,
    epochs: int | None,
    repeats: int,
    workers: int,
    folder: Path,
) -> str:
    from neurosym.reproduce import Experiment, report
    from neurosym.reproduce import reproduce as rebuild

    styles = tuple(p.value for p in pictures) if pictures else ("clean", "varied")
    experiment = Experiment(name, splits=seeds, styles=styles, epochs=epochs, repeats=repeats)
    if prior:
        experiment = replace(experiment, methods=tuple(prior))
    return report(experiment, rebuild(experiment, folder, workers=workers, say=say))
