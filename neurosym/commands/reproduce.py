"""`neurosym reproduce`: rebuild an experiment of the paper, beside the paper's figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from neurosym.commands.common import DomainName, Pictures, cores, say


def reproduce(
    domain: DomainName,
    seeds: Annotated[int, typer.Option("--seeds", min=1, metavar="K", help="Random splits 0 to K - 1.")] = 5,
    pictures: Annotated[
        list[Pictures] | None, typer.Option("--pictures", help="Style; may be repeated. Default both.")
    ] = None,
    prior: Annotated[
        list[str] | None,
        typer.Option("--prior", metavar="Q", help="What is trained; may be repeated. Default all four."),
    ] = None,
    epochs: Annotated[int | None, typer.Option("--epochs", min=1, help="Default each recipe's.")] = None,
    repeats: Annotated[int, typer.Option("--repeats", min=1, help="How often each test problem is planned.")] = 5,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, metavar="N", help="Default: one a processor.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Default out/reproduce-DOMAIN.")] = None,
) -> None:
    """Train on each split, test on its other half; writes results.csv, report.md and figures. A killed run goes on."""
    from rich.markdown import Markdown

    from neurosym.commands.common import console
    from neurosym.reproduce import Experiment, report
    from neurosym.reproduce import reproduce as rebuild

    styles = tuple(p.value for p in pictures) if pictures else ("clean", "varied")
    experiment = Experiment(domain, splits=seeds, styles=styles, epochs=epochs, repeats=repeats)
    if prior:
        experiment = replace(experiment, methods=tuple(prior))
    folder = out or Path("out") / f"reproduce-{domain}"
    records = rebuild(experiment, folder, workers=workers or cores(), say=say)
    console().print(Markdown(report(experiment, records)))
    say(f"{folder}: results.csv, report.md and the figures")
