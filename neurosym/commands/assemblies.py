"""What the commands about a user's own assemblies share: where it is, and how it may be taken apart."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from neurosym.errors import InputError

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly
    from neurosym.geometry.readers.references import Reading
    from neurosym.language.problem import Problem


AssemblyPath = Annotated[
    Path, typer.Argument(metavar="PATH", help="A folder with one mesh a part, a scene, a puzzle, an assembly's JSON.")
]


@dataclass(frozen=True)
class FileOptions:
    """How an assembly's files are read, where they leave it open."""

    units: Annotated[
        str | None, typer.Option(metavar="U", help="What a length of 1 is in the files: mm, m, in, ...")
    ] = None
    up: Annotated[Literal["y", "z"] | None, typer.Option(help="What is up in the files; default z, in glTF y.")] = None
    touch: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE",
            min=1e-6,
            max=0.5,
            help="Faces so near, or overlapping so little, touch: a share of the smallest part's extent. "
            "Default 0.001, raised where mating faces overlap.",
        ),
    ] = None
    friction: Annotated[
        float | None, typer.Option(metavar="MU", min=0.0, help="Coulomb's coefficient; default 0.5.")
    ] = None
    puzzle: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Which problem of a puzzle's file; default 1.")
    ] = None
    solution: Annotated[int | None, typer.Option(metavar="N", min=1, help="Which of its solutions; default 1.")] = None

    def reading(self) -> Reading:
        """As the library takes them."""
        from neurosym.geometry.readers.references import Reading

        return Reading(**vars(self))


@dataclass(frozen=True)
class RemovalOptions:
    """How an assembly may be taken apart."""

    directions: Annotated[
        str | None, typer.Option(metavar="D", help="Straight ways out: +z,-x or axes (default), contacts, a number.")
    ] = None
    paths: Annotated[
        Literal["straight", "any"] | None,
        typer.Option(help="Straight lines only (default), or any path where none is free."),
    ] = None
    groups: Annotated[
        bool | None, typer.Option("--groups", help="Let several parts leave together, and come apart later.")
    ] = None
    gravity: Annotated[
        bool | None, typer.Option("--gravity/--no-gravity", help="Whether what stays must stand by itself (default).")
    ] = None
    held: Annotated[int | None, typer.Option(metavar="K", help="Parts that may be held meanwhile; default 0.")] = None
    fixed: Annotated[list[str] | None, typer.Option(metavar="NAME", help="A part that stays. May be repeated.")] = None

    def given(self) -> dict[str, Any]:
        """Those that were given, as `problem` of the domain "assembly" takes them."""
        return {name: value for name, value in vars(self).items() if value is not None and value != []}


def load_assembly(path: Path, files: FileOptions) -> Assembly:
    """The assembly in a file or folder.

    Raises:
        InputError: there is nothing at that path, or it cannot be used.
    """
    if not path.exists():
        raise InputError(f"Expected a file or a folder with an assembly; there is nothing at {path}.")
    return files.reading().load(path)


def problem_at(path: Path, files: FileOptions, options: dict[str, Any]) -> Problem:
    """The problem of taking apart the assembly at a path."""
    from neurosym.registry import load_domain

    return load_domain("assembly").problem(load_assembly(path, files), name=path.resolve().name, **options)
