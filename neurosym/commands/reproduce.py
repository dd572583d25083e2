"""`neurosym reproduce`: rebuild an experiment of the paper, beside the paper's figures."""

from __future__ import annotations

import os
import sys
from contextlib import redirect_stdout
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from neurosym.commands.common import Pictures, progress_bar, say
from neurosym.errors import UnknownNameError


class Scale(StrEnum):
    """How large."""

    quick = "quick"
    paper = "paper"


class EngineName(StrEnum):
    """Where the work is done."""

    local = "local"
    ray = "ray"


ExperimentName = Annotated[
    str, typer.Argument(metavar="NAME", help="soma, tower, tower-by-sequence, unseen, variable or scrabble.")
]


def reproduce(
    name: ExperimentName,
    seeds: Annotated[
        int | None, typer.Option("--seeds", min=1, metavar="K", help="Splits and trainings, 0 to K - 1.")
    ] = None,
    scale: Annotated[
        Scale, typer.Option("--scale", help="Within 15 minutes on two cores, or of the paper's sizes and seeds.")
    ] = Scale.quick,
    workers: Annotated[
        int | None,
        typer.Option("--workers", min=1, metavar="N", help="Most at a time. Default one a processor; ray: its own."),
    ] = None,
    engine: Annotated[
        EngineName, typer.Option("--engine", help="Processes here, or an existing Ray cluster.")
    ] = EngineName.local,
    address: Annotated[
        str | None,
        typer.Option("--address", metavar="HOST:PORT", help="Of the Ray cluster. Default the one on this machine."),
    ] = None,
    pictures: Annotated[
        list[Pictures] | None, typer.Option("--pictures", help="soma: style; may be repeated. Default both.")
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option("--prior", metavar="Q", help="What is trained; may be repeated. Default all."),
    ] = None,
    epochs: Annotated[int | None, typer.Option("--epochs", min=1, help="Default each recipe's.")] = None,
    repeats: Annotated[int, typer.Option("--repeats", min=1, help="soma: how often each problem is planned.")] = 5,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Default out/reproduce-NAME, for paper with -paper.")
    ] = None,
) -> None:
    """Rebuild an experiment of the paper; writes results.csv, report.md and figures.

    A run that was killed goes on where it was: give the same command again.
    """
    # Before any network's library starts its threads: as many here as in workers, so that figures agree.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from neurosym.experiments.studies import study_names

    folder = out or Path("out") / f"reproduce-{name}{'' if scale is Scale.quick else f'-{scale.value}'}"
    where = {"workers": workers, "engine": engine.value, "address": address}
    if name != "soma" and name not in study_names():
        raise UnknownNameError("experiment", name, ["soma", *study_names()])
    # Ray says on stdout that a node is lost; stdout belongs to the answer.
    with redirect_stdout(sys.stderr):
        if name == "soma":
            page = _planning(scale, seeds, pictures, prior, epochs, repeats, where, folder)
        else:
            page = _study(name, scale, seeds, prior, epochs, where, folder)
    print(page)  # a table of Markdown: rendered, its columns would not fit a terminal
    say(f"{folder}: results.csv, report.md and figures")


def _study(
    name: str,
    scale: Scale,
    seeds: int | None,
    prior: list[str] | None,
    epochs: int | None,
    where: dict[str, Any],
    folder: Path,
) -> str:
    from neurosym.experiments.imitation import report, reproduce_study, study

    given = study(name, scale.value)
    given = replace(given, seeds=seeds or given.seeds, methods=tuple(prior or given.methods))
    with progress_bar("trials") as progress:
        found = reproduce_study(given, folder, epochs=epochs, say=say, progress=progress, **where)
    return report(found)


def _planning(
    scale: Scale,
    seeds: int | None,
    pictures: list[Pictures] | None,
    prior: list[str] | None,
    epochs: int | None,
    repeats: int,
    where: dict[str, Any],
    folder: Path,
) -> str:
    from neurosym.experiments.reproduce import report, soma_experiment
    from neurosym.experiments.reproduce import reproduce as rebuild

    given = soma_experiment(scale.value)
    styles = tuple(p.value for p in pictures) if pictures else given.styles
    given = replace(given, splits=seeds or given.splits, styles=styles, methods=tuple(prior or given.methods))
    given = replace(given, epochs=epochs, repeats=repeats)
    with progress_bar("trainings and comparisons") as progress:
        return report(given, rebuild(given, folder, say=say, progress=progress, **where))
