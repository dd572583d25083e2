"""`neurosym export`: what the geometry found, for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from neurosym.commands.assemblies import AssemblyPath, FileOptions, RemovalOptions, problem_at
from neurosym.commands.common import AsJson, print_json
from neurosym.errors import InputError

#: Default time to look for all falls under gravity.
SECONDS = 60.0


def export(
    path: AssemblyPath,
    *,
    pddl: Annotated[
        Path | None, typer.Option("--pddl", metavar="DIR", help="Write domain.pddl and problem.pddl there.")
    ] = None,
    graph: Annotated[
        Path | None,
        typer.Option("--graph", metavar="FILE", help="What blocks and touches what: .graphml, .dot or .json."),
    ] = None,
    files: FileOptions,
    removal: RemovalOptions,
    seconds: Annotated[
        float, typer.Option("--seconds", help="With --pddl: time to look for all that can fall.")
    ] = SECONDS,
    as_json: AsJson = False,
) -> None:
    """Write what the geometry found as PDDL for classical planners, or as a graph.

    With gravity, the PDDL lists what falls without what. Where the time ends before the list is known to be whole, the
    command and the file say so: then a planner's plan should be replayed.
    """
    if pddl is None and graph is None:
        raise InputError("Expected --pddl DIR or --graph FILE, or both; got neither.")
    if pddl is not None and pddl.exists() and not pddl.is_dir():
        raise InputError(f"Expected --pddl to be a folder; {pddl} is a file.")
    problem = problem_at(path, files, removal.given())
    written: list[Path] = []
    said: dict[str, Any] = {}
    if graph is not None:
        from neurosym.geometry.blocking.export import assembly_graph, write_graph

        geometry = problem.geometry
        assert geometry is not None
        write_graph(assembly_graph(geometry.blocking(problem.details["directions"]), geometry.contacts), graph)
        written.append(graph)
    if pddl is not None:
        from neurosym.pddl.export import as_pddl

        task = as_pddl(problem, seconds=seconds)
        written += task.write(pddl)
        said = {"sound": task.sound, "notes": list(task.notes), "actions": dict(task.actions)}
    if as_json:
        print_json({"written": [str(file) for file in written], **said})
    else:
        for line in (*written, *said.get("notes", ())):
            print(line)
