"""`neurosym inspect`: an assembly as it was understood, before any plan."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from neurosym.commands.assemblies import AssemblyPath, FileOptions, Paths, RemovalOptions, problem_at
from neurosym.commands.common import AsJson, print_json

if TYPE_CHECKING:
    from neurosym.language.problem import Problem
    from neurosym.planning.inspection import Inspection

#: Lines of one kind that are shown; --json has all.
SHOWN = 40


def inspect(
    path: AssemblyPath,
    files: FileOptions,
    removal: RemovalOptions,
    as_json: AsJson = False,
) -> None:
    """Say what an assembly is: parts, volumes, contacts, what is free, what is interlocked and why, if it stands.

    Free and interlocked are meant for straight lines. With --paths any, and parts that are all made of cells, the
    least number of moves to the first separation (the level) is found, too.
    """
    from neurosym.planning.inspection import inspect_problem

    problem = problem_at(path, files, replace(removal, paths=None).given())
    found = inspect_problem(problem)
    level = _level(problem) if removal.paths is Paths.any else None
    if as_json:
        said = {"path": str(path), "units": problem.world.units, **found.as_json()}
        print_json(said if removal.paths is not Paths.any else {**said, "level": level})
        return
    _show(problem, found)
    if removal.paths is Paths.any:
        print("No level is known: no moves of groups separate it." if level is None else f"Level {level}.")


def _level(problem: Problem) -> int | None:
    """Moves of groups, at the least, to the first separation; None: there is none, or it was not found."""
    from neurosym.geometry.paths.voxel_search import first_separation
    from neurosym.geometry.paths.voxel_separation import Separation

    geometry, world = problem.geometry, problem.world
    if geometry is None or geometry.cells is None or len(world) < 2:
        return None
    ground = world.ground if world.has_table else None
    found = first_separation(geometry.cells, (1 << len(world)) - 1, fixed=world.fixed_mask, ground=ground)
    return found.level if isinstance(found, Separation) else None


def _show(problem: Problem, found: Inspection) -> None:
    unit = problem.world.units or "units"
    print(f"{problem.name}: {len(found.parts)} parts, {len(found.contacts)} pairs in contact; lengths in {unit}")
    _lines([f"{p.name}: volume {p.volume:.4g}{', fixed' if p.fixed else ''}" for p in found.parts], "parts")
    print("Contacts:")
    _lines([f"{c.a} and {c.b}: area {c.area:.4g}" for c in found.contacts], "contacts")
    print("Free along a straight line:" if found.free else "No part is free along a straight line.")
    _lines([f"{name}: {', '.join(ways)}" for name, ways in found.free_along.items()], "parts")
    if found.why is None:
        print("Nothing is interlocked: along straight lines all that is not fixed comes apart, gravity aside.")
    else:
        print(f"Interlocked: {', '.join(found.interlocked)}.")
        _lines(list(found.why.sentences), "reasons")
    if not problem.details["gravity"]:
        print("Without gravity nothing falls.")
    elif found.stands:
        print(f"It stands{f' while {chr(44).join(found.held)} are held' if found.held else ''}.")
    else:
        print(f"It does not stand: {', '.join(found.falls)} would fall.")
    if found.notes:
        print("Loading:")
        _lines(list(found.notes), "notes")


def _lines(lines: list[str], what: str) -> None:
    for line in lines[:SHOWN]:
        print(f"  {line}")
    if len(lines) > SHOWN:
        print(f"  and {len(lines) - SHOWN} more {what}; --json has all.")
