"""`neurosym inspect`, `count` and `export`: an assembly as it was understood, before any plan."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from neurosym.commands.common import (
    AsJson,
    AssemblyPath,
    FileOptions,
    RemovalOptions,
    print_json,
    problem_at,
    progress_bar,
    to_write,
)
from neurosym.commands.spent import Spent
from neurosym.errors import InputError
from neurosym.support.words import counted as numbered
from neurosym.support.words import joined

if TYPE_CHECKING:
    from neurosym.language.problem import Problem
    from neurosym.planning.inspection import Inspection

#: Lines of one kind that are printed; --json has all.
MOST_LINES = 40

#: Default limits: a minute, and as many states as fit into a few hundred megabytes.
SECONDS, EXPANSIONS = 60.0, 1_000_000


def inspect(
    path: AssemblyPath,
    files: FileOptions,
    removal: RemovalOptions,
    margin: Annotated[bool, typer.Option("--margin", help="How far it may be tilted before it falls.")] = False,
    as_json: AsJson = False,
) -> None:
    """Say what an assembly is: parts, volumes, contacts, what is free, what is interlocked and why, if it stands.

    Free and interlocked are meant for straight lines. With --paths any, and parts that are all made of cells, the
    least number of moves to the first separation (the level) is found, too.
    """
    from neurosym.planning.inspection import inspect_problem

    problem = problem_at(path, files, replace(removal, paths=None).given())
    with progress_bar(f"looking at {problem.name}", after=1.0):
        inspection = inspect_problem(problem, margin=margin)
        level = _level(problem) if removal.paths == "any" else None
    if as_json:
        answer = {"path": str(path), "units": problem.world.units, **inspection.as_json()}
        print_json(answer if removal.paths != "any" else {**answer, "level": level})
        return
    _show(problem, inspection)
    if removal.paths == "any":
        print("No level is known: no moves of groups separate it." if level is None else f"Level {level}.")


def count(
    path: AssemblyPath,
    files: FileOptions,
    removal: RemovalOptions,
    seconds: Annotated[float, typer.Option(help="Budget: wall-clock time.")] = SECONDS,
    expansions: Annotated[int, typer.Option(help="Budget: states looked at.")] = EXPANSIONS,
    as_json: AsJson = False,
) -> None:
    """Count the orders in which everything that is not fixed can be taken out: exactly, by dynamic programming.

    Where the budget ends first there is no number, and the exit code says so.
    """
    from neurosym.pipeline import count_orders
    from neurosym.planning.budget import Budget
    from neurosym.planning.result import OrderCount, Status
    from neurosym.support.deadline import OutOfTime, within

    spent, counted = Spent(), OrderCount(None, False, 0, 0.0)
    with contextlib.suppress(OutOfTime), within(seconds):
        with spent.on("reading and geometry"):
            problem = problem_at(path, files, removal.given())
        with progress_bar(f"counting orders of {problem.name}", after=1.0), spent.on("counting"):
            budget = Budget(seconds=seconds, expansions=expansions).less(spent.seconds)
            counted = count_orders(problem, budget=budget)
    counted = replace(counted, seconds=spent.seconds)
    if as_json:
        print_json({"path": str(path), **counted.as_json()})
    elif counted.orders is None:
        looked = f"{numbered(counted.states, 'state')} in {spent}"
        print(f"The budget ended after {looked}, so there is no number. Give more: --seconds, --expansions.")
    else:
        least = "" if counted.exact else "At least "
        states = numbered(counted.states, "state")
        print(f"{least}{numbered(counted.orders, 'order')} ({states}, {counted.seconds:.2f} s)")
        if counted.told_apart not in (None, counted.orders):
            print(f"Equal parts that may be swapped count as one; told apart, {counted.told_apart:,} orders.")
    if not counted.exact or counted.orders is None:
        raise typer.Exit((Status.OUT_OF_BUDGET if counted.orders is None else Status.GAVE_UP).exit_code)


def export(
    path: AssemblyPath,
    *,
    pddl: Annotated[Path | None, typer.Option(metavar="DIR", help="Write domain.pddl and problem.pddl there.")] = None,
    graph: Annotated[
        Path | None,
        typer.Option(metavar="FILE", callback=to_write, help="What blocks and touches what: .graphml, .dot or .json."),
    ] = None,
    files: FileOptions,
    removal: RemovalOptions,
    seconds: Annotated[
        float | None,
        typer.Option(help=f"With --pddl: time to look for all that can fall; default {SECONDS:g}."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write what the geometry found as PDDL for classical planners, or as a graph.

    With gravity, the PDDL lists what falls without what. Where the time ends before the list is known to be whole, the
    command and the file say so: then a planner's plan should be replayed.
    """
    if pddl is None and graph is None:
        raise InputError("Expected --pddl DIR or --graph FILE, or both; got neither.")
    if seconds is not None and (pddl is None or not seconds >= 0):
        raise InputError(f"Expected --seconds as a number, 0 or more, and with --pddl DIR; got {seconds:g}.")
    if pddl is not None and pddl.exists() and not pddl.is_dir():
        raise InputError(f"Expected --pddl to be a folder; {pddl} is a file.")
    problem = problem_at(path, files, removal.given())
    written: list[Path] = []
    facts: dict[str, Any] = {}
    if graph is not None:
        from neurosym.geometry.blocking.export import assembly_graph, write_graph

        geometry = problem.geometry
        assert geometry is not None
        with progress_bar(f"looking at {problem.name}", after=1.0):
            write_graph(assembly_graph(geometry.blocking(problem.details["directions"]), geometry.contacts), graph)
        written.append(graph)
    if pddl is not None:
        from neurosym.pddl.export import as_pddl

        with progress_bar(f"looking for what falls in {problem.name}", after=1.0):
            task = as_pddl(problem, seconds=SECONDS if seconds is None else seconds)
        written += task.write(pddl)
        facts = {"sound": task.sound, "notes": list(task.notes), "actions": dict(task.actions)}
    if as_json:
        print_json({"written": [str(file) for file in written], **facts})
    else:
        for line in (*written, *facts.get("notes", ())):
            print(line)


def _level(problem: Problem) -> int | None:
    """Moves of groups, at the least, to the first separation; None: there is none, or it was not found."""
    from neurosym.geometry.paths.voxel_search import first_separation
    from neurosym.geometry.paths.voxel_separation import Separation

    geometry, world = problem.geometry, problem.world
    if geometry is None or geometry.cells is None or len(world) < 2:
        return None
    ground = world.ground if world.has_table else None
    first = first_separation(geometry.cells, (1 << len(world)) - 1, fixed=world.fixed_mask, ground=ground)
    return first.level if isinstance(first, Separation) else None


def _show(problem: Problem, inspection: Inspection) -> None:
    unit = problem.world.units or "units"
    pairs = f"{numbered(len(inspection.contacts), 'pair')} in contact"
    counts = f"{numbered(len(inspection.parts), 'part')}, {pairs}"
    print(f"{problem.name}: {counts}; lengths in {unit}")
    _lines([f"{p.name}: volume {p.volume:.4g}{', fixed' if p.fixed else ''}" for p in inspection.parts], "parts")
    _lines([f"Kept together: {joined(own)}" for own in inspection.kept], "groups")
    _lines([f"Need not be separated: {joined(own)}" for own in inspection.piece_groups], "groups")
    _lines([f"Sub-assembly {name}: {joined(own)}" for name, own in inspection.subassemblies.items()], "sub-assemblies")
    print("Contacts:")
    _lines([f"{c.a} and {c.b}: area {c.area:.4g}" for c in inspection.contacts], "contacts")
    print("Free along a straight line:" if inspection.free else "No part is free along a straight line.")
    _lines([f"{name}: {', '.join(ways)}" for name, ways in inspection.free_along.items()], "parts")
    if inspection.why is None:
        what = "all that must" if inspection.piece_groups else "all that is not fixed"
        print(f"Nothing is interlocked: along straight lines {what} comes apart, gravity aside.")
    else:
        print(f"Interlocked: {', '.join(inspection.interlocked)}.")
        _lines(list(inspection.why.sentences), "reasons")
    if not problem.details["gravity"]:
        print("Without gravity nothing falls.")
    elif inspection.stands:
        print(f"It stands{f' while {chr(44).join(inspection.held)} are held' if inspection.held else ''}.")
    else:
        print(f"It does not stand: {', '.join(inspection.falls)} would fall.")
        _lines(list(inspection.movements), "parts move")
        print(f"{'Some' if inspection.balanced else 'No'} forces would balance it (limit analysis).")
    if inspection.margin is not None:
        print(f"It bears a tilt of {inspection.margin:.1f} degrees.")
    if inspection.notes:
        print("Loading:")
        _lines(list(inspection.notes), "notes")


def _lines(lines: list[str], what: str) -> None:
    for line in lines[:MOST_LINES]:
        print(f"  {line}")
    if len(lines) > MOST_LINES:
        print(f"  and {len(lines) - MOST_LINES} more {what}; --json has all.")
