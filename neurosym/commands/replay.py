"""`neurosym replay`: a plan from a file, done in PyBullet, and whether the rest stood still."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from neurosym.commands.common import AsJson, console, print_json, write_json
from neurosym.exit_codes import UNWELL

if TYPE_CHECKING:
    from neurosym.simulation.replay_report import ReplayReport


class Bodies(StrEnum):
    """What moves as one."""

    rigid = "rigid"
    cubes = "cubes"


PlanPath = Annotated[Path, typer.Argument(metavar="PLAN", help="What `neurosym plan --out` wrote.")]


def replay(
    path: PlanPath,
    gui: Annotated[bool, typer.Option("--gui", help="Show it in PyBullet's window, in real time.")] = False,
    pull: Annotated[
        bool, typer.Option("--pull", help="Drag parts by a grip, against friction, instead of taking them by hand.")
    ] = False,
    bodies: Annotated[
        Bodies | None, typer.Option("--bodies", help="Rigid parts, or independent cubes. Default: the problem's rule.")
    ] = None,
    friction: Annotated[
        float | None, typer.Option("--friction", min=0.0, help="Between any two parts. Default: the problem's.")
    ] = None,
    threshold: Annotated[
        float | None,
        typer.Option("--threshold", min=0.0, help="Displacement that counts as moved. Default: 0.2 of a typical body."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Keep the report as JSON.")] = None,
    as_json: AsJson = False,
) -> None:
    """Do a plan in PyBullet, with gravity: did the rest stand still at each step, and by how much did it move?"""
    from neurosym.plan_files import read_plan
    from neurosym.simulation.replay import replay_plan

    saved = read_plan(path)
    report = replay_plan(
        saved.problem,
        saved.plan,
        saved.how,
        pulled=pull,
        bodies=None if bodies is None else bodies.value,
        friction=friction,
        threshold=threshold,
        window=gui,
    )
    answer = {"plan": str(path), "problem": saved.problem.name, **report.as_json()}
    if out is not None:
        write_json(answer, out)
    if as_json:
        print_json(answer)
    else:
        _show(saved.problem.name, report)
    raise typer.Exit(0 if report.ok else UNWELL)


def _show(name: str, report: ReplayReport) -> None:
    from rich.table import Table

    way = "pulled along by a grip" if report.pulled else "taken by hand"
    what = "rigid parts" if report.bodies == "rigid" else "independent cubes"
    table = Table(title=f"{name}: {what}, {way}", title_justify="left")
    for heading, justify in (("step", "right"), ("action", "left"), ("largest displacement", "right")):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    for heading in ("of the smallest part", "the rest"):
        table.add_column(heading, justify="right" if heading.startswith("of") else "left")
    for number, step in enumerate((report.start, *report.steps)):
        said = "stood still" if step.stood_still and not step.moved else step.reason
        table.add_row(str(number), step.action, f"{step.displacement:.3g}", f"{step.share:.2%}", said)
    console(table).print(table)
    failed = report.failed_at
    if failed is None:
        print(f"The rest stood still at all {len(report.steps)} steps (what goes by {report.threshold:.3g} has moved).")
    elif failed < 0:
        print(f"The assembly does not stand before the first step. {report.start.reason}")
    else:
        print(f"Step {failed + 1}, {report.steps[failed].action}: {report.steps[failed].reason}")
