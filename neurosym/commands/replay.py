"""`neurosym replay`: a plan from a file, done in PyBullet, and whether the rest stood still."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from neurosym.commands.common import AsJson, console, print_json, to_write, write_json
from neurosym.commands.exit_codes import UNWELL
from neurosym.support.words import joined, listed

if TYPE_CHECKING:
    from neurosym.simulation.replay_report import ReplayReport, StepReplay


def replay(
    path: Annotated[Path, typer.Argument(metavar="PLAN", help="What `neurosym plan --out` wrote.")],
    gui: Annotated[bool, typer.Option("--gui", help="Show it in PyBullet's window, in real time.")] = False,
    pull: Annotated[
        bool, typer.Option("--pull", help="Drag parts by a grip, against friction, instead of taking them by hand.")
    ] = False,
    bodies: Annotated[
        Literal["rigid", "cubes"] | None,
        typer.Option(help="Rigid parts, or independent cubes. Default: the problem's rule."),
    ] = None,
    friction: Annotated[
        float | None, typer.Option(min=0.0, help="Between any two parts. Default: the problem's.")
    ] = None,
    threshold: Annotated[
        float | None, typer.Option(min=0.0, help="Displacement that counts as moved. Default: 0.2 of a typical body.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", callback=to_write, help="Keep the report as JSON.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Do a plan in PyBullet, with gravity: did the rest stand still at each step, and by how much did it move?"""
    from neurosym.plan_files.reading import read_plan
    from neurosym.simulation.replay import replay_plan

    saved = read_plan(path)
    report = replay_plan(
        saved.problem,
        saved.plan,
        saved.motions,
        pulled=pull,
        bodies=bodies,
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
    from rich.markup import escape
    from rich.table import Table

    came = bool(report.steps) and all(step.arrives for step in report.steps)
    by = "pulled along by a grip" if report.pulled else f"{'placed' if came else 'taken'} by hand"
    what = "rigid parts" if report.bodies == "rigid" else "independent cubes"
    under = "" if report.gravity else ", no gravity"
    table = Table(title=escape(f"{name}: {what}, {by}{under}"), title_justify="left")
    table.add_column("step", justify="right")
    table.add_column("action")
    table.add_column(f"largest shift{f' ({report.unit})' if report.unit else ''}", justify="right")
    table.add_column("of the smallest part", justify="right")
    table.add_column("the rest")
    for number, step in enumerate((report.start, *report.steps)):
        # Less than this is what numbers are rounded to.
        shift = step.displacement if step.displacement > 1e-6 * report.threshold else 0.0
        table.add_row(str(number), escape(_did(step)), f"{shift:.2g}", f"{step.share:.2%}", escape(_rest(step)))
    console(table).print(table)
    limit = f"{report.threshold:.3g} {report.unit or ''}".strip()
    failed = report.failed_at
    fell = [number for number, step in enumerate((report.start, *report.steps)) if step.moved]
    if failed is None and fell:
        at = listed([str(number) if number else "the start" for number in fell])
        print(f"No more moved at any of {len(report.steps)} steps than this rule allows: one cube alone, at {at}.")
    elif failed is None:
        print(f"The rest stood still at all {len(report.steps)} steps: nothing went by {limit}, which counts as moved.")
    elif failed < 0:
        print(f"The assembly does not stand before the first step. {report.start.reason}")
    else:
        print(f"Step {failed + 1}, {report.steps[failed].action}: {report.steps[failed].reason} ({limit} counts.)")


def _did(step: StepReplay) -> str:
    """The action; whoever else moves; what is held."""
    others = [part for part in step.parts if part != step.action] if step.action in step.parts else []
    held = f" ({joined(step.held)} held)" if step.held else ""
    return f"{step.action}{f' with {joined(others)}' if others else ''}{held}"


def _rest(step: StepReplay) -> str:
    if step.in_hand:
        return "in the hand"
    if step.farthest is None and step.stood_still:
        return "nothing is left"
    return "stood still" if step.stood_still and not step.moved else step.reason
