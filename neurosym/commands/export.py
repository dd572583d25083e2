"""`neurosym export`: what the geometry found, for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from neurosym.commands.assemblies import (
    AssemblyPath,
    Directions,
    Fixed,
    Gravity,
    Groups,
    Held,
    PathsOption,
    Units,
    problem_at,
    removal_options,
)
from neurosym.commands.common import AsJson, print_json
from neurosym.errors import InputError


def export(
    path: AssemblyPath,
    pddl: Annotated[
        Path | None, typer.Option("--pddl", metavar="DIR", help="Write domain.pddl and problem.pddl there.")
    ] = None,
    graph: Annotated[
        Path | None,
        typer.Option("--graph", metavar="FILE", help="What blocks and touches what: .graphml, .dot or .json."),
    ] = None,
    units: Units = None,
    directions: Directions = None,
    paths: PathsOption = None,
    groups: Groups = None,
    gravity: Gravity = None,
    held: Held = None,
    fixed: Fixed = None,
    as_json: AsJson = False,
) -> None:
    """Write what the geometry found as PDDL for classical planners, or as a graph."""
    if pddl is None and graph is None:
        raise InputError("Expected --pddl DIR or --graph FILE, or both; got neither.")
    if pddl is not None and pddl.exists() and not pddl.is_dir():
        raise InputError(f"Expected --pddl to be a folder; {pddl} is a file.")
    problem = problem_at(path, units, removal_options(directions, paths, groups, gravity, held, fixed))
    written: list[Path] = []
    if graph is not None:
        from neurosym.graphs import assembly_graph, write_graph

        write_graph(assembly_graph(problem.world, problem.details["directions"]), graph)
        written.append(graph)
    if pddl is not None:
        from neurosym.language.pddl import write_pddl

        written += write_pddl(problem, pddl)
    if as_json:
        print_json({"written": [str(file) for file in written]})
    else:
        for file in written:
            print(file)
