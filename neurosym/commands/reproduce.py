"""`neurosym reproduce` and `neurosym results`: rebuild the paper's experiments, and put their reports on one page."""

import os
import sys
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from neurosym.commands.common import PictureStyles, progress_bar, say
from neurosym.errors import UnknownNameError


def reproduce(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="soma, soma-published, tower, tower-easy, tower-by-sequence, unseen, variable, scrabble, robustness.",
        ),
    ],
    seeds: Annotated[int | None, typer.Option(min=1, metavar="K", help="Splits and trainings, 0 to K - 1.")] = None,
    scale: Annotated[
        Literal["quick", "paper"],
        typer.Option(help="Within 15 minutes on two cores, or of the paper's sizes and seeds."),
    ] = "quick",
    workers: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Most at a time. Default one a processor; ray: its own.")
    ] = None,
    engine: Annotated[
        Literal["local", "ray"], typer.Option(help="Processes here, or an existing Ray cluster.")
    ] = "local",
    address: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Of the Ray cluster. Default the one on this machine.")
    ] = None,
    pictures: Annotated[
        list[PictureStyles] | None, typer.Option(help="soma: style; may be repeated. Default clean and varied.")
    ] = None,
    prior: Annotated[
        list[str] | None, typer.Option(metavar="Q", help="What is trained; may be repeated. Default all.")
    ] = None,
    epochs: Annotated[int | None, typer.Option(min=1, help="Default each recipe's.")] = None,
    repeats: Annotated[int, typer.Option(min=1, help="soma: how often each problem is planned.")] = 5,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Default out/reproduce-NAME, for paper with -paper.")
    ] = None,
) -> None:
    """Rebuild an experiment of the paper; writes results.csv, report.md and figures.

    A run that was killed goes on where it was: give the same command again.
    """
    # Before any network's library starts its threads: as many here as in workers, so that figures agree.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from neurosym.experiments import imitation, robustness
    from neurosym.experiments import reproduce as planning

    folder = out or Path("out") / f"reproduce-{name}{'' if scale == 'quick' else f'-{scale}'}"
    given: dict[str, Any] = {"workers": workers, "engine": engine, "address": address, "say": say}
    names = (*planning.SOMA_EXPERIMENTS, *imitation.study_names(), robustness.NAME)
    if name not in names:
        raise UnknownNameError("experiment", name, names)
    # Ray says on stdout that a node is lost; stdout belongs to the answer.
    with redirect_stdout(sys.stderr):
        if name == robustness.NAME:
            with progress_bar("priors") as progress:
                where = {name: value for name, value in given.items() if name != "say"}
                page = robustness.report(robustness.reproduce(folder, progress=progress, **where))
        elif name in planning.SOMA_EXPERIMENTS:
            what = planning.soma_experiment(scale, name)
            styles = tuple(style.value for style in pictures or ()) or what.styles
            what = replace(what, splits=seeds or what.splits, styles=styles, methods=tuple(prior or what.methods))
            what = replace(what, epochs=epochs or what.epochs, repeats=repeats)
            with progress_bar("trainings and comparisons") as progress:
                page = planning.report(what, planning.reproduce(what, folder, progress=progress, **given))
        else:
            study = imitation.study(name, scale)
            study = replace(study, seeds=seeds or study.seeds, methods=tuple(prior or study.methods))
            with progress_bar("trials") as progress:
                results = imitation.reproduce_study(study, folder, epochs=epochs, progress=progress, **given)
            page = imitation.report(results)
    print(page)  # a table of Markdown: rendered, its columns would not fit a terminal
    say(f"{folder}: results.csv, report.md and figures")


def results(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[DIR]...", help="Folders of `neurosym reproduce`. Default all out/reproduce-*."),
    ] = None,
    to: Annotated[Path, typer.Option(metavar="FILE", help="The page; figures lie beside it.")] = Path(
        "docs/results.md"
    ),
) -> None:
    """Put the reports of finished experiments on one page, with small copies of their figures."""
    from neurosym.experiments.results_page import finished_runs, write_results_page

    runs = folders or finished_runs(Path("out"))
    write_results_page(runs, to)
    say(f"{to}: {len(runs)} experiment{'s' if len(runs) > 1 else ''}")
