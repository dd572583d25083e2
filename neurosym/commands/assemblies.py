"""What the commands about a user's own assemblies share: where it is, and how it may be taken apart."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from neurosym.errors import InputError

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly
    from neurosym.language.domain import Problem


class Paths(StrEnum):
    """Which ways out are looked for."""

    straight = "straight"
    any = "any"


AssemblyPath = Annotated[
    Path, typer.Argument(metavar="PATH", help="A folder with one mesh a part, a scene, a puzzle, an assembly's JSON.")
]
Units = Annotated[
    str | None, typer.Option("--units", metavar="U", help="What a length of 1 is in the files: mm, m, in, ...")
]
Directions = Annotated[
    str | None,
    typer.Option("--directions", metavar="D", help="Straight ways out: +z,-x or axes (default), contacts, a number."),
]
PathsOption = Annotated[
    Paths | None, typer.Option("--paths", help="Straight lines only (default), or any path where none is free.")
]
Groups = Annotated[bool | None, typer.Option("--groups", help="Let parts leave together, and come apart later.")]
Gravity = Annotated[
    bool | None, typer.Option("--gravity/--no-gravity", help="Whether what stays must stand by itself (default).")
]
Held = Annotated[int | None, typer.Option("--held", metavar="K", help="Parts that may be held meanwhile; default 0.")]
Fixed = Annotated[
    list[str] | None, typer.Option("--fixed", metavar="NAME", help="A part that stays. May be repeated.")
]


def removal_options(
    directions: str | None,
    paths: Paths | None,
    groups: bool | None,
    gravity: bool | None,
    held: int | None,
    fixed: list[str] | None,
) -> dict[str, Any]:
    """The options that were given, as `problem` of the domain "assembly" takes them."""
    given = {
        "directions": directions,
        "paths": None if paths is None else paths.value,
        "groups": groups,
        "gravity": gravity,
        "held": held,
        "fixed": fixed or None,
    }
    return {name: value for name, value in given.items() if value is not None}


def load_assembly(path: Path, units: str | None) -> Assembly:
    """The assembly in a file or folder.

    Raises:
        InputError: there is nothing at that path, or it cannot be used.
    """
    from neurosym.geometry.assembly import Assembly

    if not path.exists():
        raise InputError(f"Expected a file or a folder with an assembly; there is nothing at {path}.")
    return Assembly.load(path, units=units)


def problem_at(path: Path, units: str | None, options: dict[str, Any]) -> Problem:
    """The problem of taking apart the assembly at a path."""
    from neurosym.registry import load_domain

    return load_domain("assembly").problem(load_assembly(path, units), name=path.resolve().name, **options)
