"""`neurosym results`: the reports of many runs of `neurosym reproduce`, on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from neurosym.commands.common import say


def results(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[DIR]...", help="Folders of `neurosym reproduce`. Default all out/reproduce-*."),
    ] = None,
    to: Annotated[Path, typer.Option("--to", metavar="FILE", help="The page; figures lie beside it.")] = Path(
        "docs/results.md"
    ),
) -> None:
    """Put the reports of finished experiments on one page, with small copies of their figures."""
    from neurosym.experiments.results_page import finished_runs, write_results_page

    found = folders or finished_runs(Path("out"))
    write_results_page(found, to)
    say(f"{to}: {len(found)} experiment{'s' if len(found) > 1 else ''}")
