"""What commands share: options, how a user's own assembly is read and taken apart, consoles and progress bars."""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from neurosym.errors import InputError
from neurosym.language.options import read_options
from neurosym.language.problem_family import ProblemFamily, Progress
from neurosym.support.documents import read_json
from neurosym.support.files import write_text
from neurosym.support.progress import heard_by, silent

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.progress import Progress as Bars

    from neurosym.geometry.assembly import Assembly
    from neurosym.geometry.readers.references import Reading
    from neurosym.language.problem import Problem

Style = Literal["clean", "varied", "cluttered"]
#: Typer takes a list of these, and none of literals.
PictureStyles = StrEnum("PictureStyles", ["clean", "varied", "cluttered"])
DomainName = Annotated[str, typer.Argument(metavar="DOMAIN", help="Problem family; `neurosym list` names them.")]
PriorNames = Annotated[
    list[str] | None, typer.Option(metavar="Q", help="Name of a prior, a weights file, or `none`. May be repeated.")
]
CollapseRule = Annotated[
    str | None, typer.Option(metavar="RULE", help="Rule of collapse (soma: cubes, strict, rigid).")
]
OracleName = Annotated[Literal["geometry", "physics"], typer.Option(help="What answers attempts.")]
PictureStyle = Annotated[Style, typer.Option(help="Style of the pictures.")]
Split = Annotated[int, typer.Option(min=0, metavar="S", help="Which random split into train and test.")]
FamilyOptions = Annotated[
    list[str] | None, typer.Option(metavar="KEY=VALUE", help="An option of the family's problems. May be repeated.")
]
AssemblyPath = Annotated[
    Path,
    typer.Argument(
        metavar="PATH", help="A folder with one mesh a part, a scene, a robot, a puzzle, an assembly's JSON."
    ),
]


def to_write(path: Path | None) -> Path | None:
    """A file that is to be written, known to have a name before anything long begins."""
    if path is not None and (not path.name or path.is_dir()):
        raise typer.BadParameter(f"Expected the name of a file to write; got the folder {str(path)!r}.")
    return path


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object to stdout, and nothing else.")]


@dataclass(frozen=True)
class SearchOptions:
    """What is planned and what with: the options that `plan` and `view` share."""

    # The help is rich's markup, in which a bracket that is meant as one is escaped.
    cells: Annotated[
        Path | None, typer.Option(metavar="FILE", help='A puzzle of yours: JSON {"name": [\\[x,y,z], ...]}.')
    ] = None
    prior: Annotated[
        str | None,
        typer.Option(
            metavar="Q",
            help="Name of a prior, a weights file, or `none`. Default none; for an assembly outermost-first.",
        ),
    ] = None
    option: FamilyOptions = None
    collapse: CollapseRule = None
    before: Annotated[
        list[str] | None, typer.Option(metavar="A,B", help="A must come before B. May be repeated.")
    ] = None
    removed: Annotated[list[str] | None, typer.Option(metavar="V", help="Is gone already. May be repeated.")] = None
    oracle: OracleName = "geometry"
    seed: Annotated[int, typer.Option(min=0, help="Breaks ties; the same seed gives the same plan.")] = 0
    seconds: Annotated[float | None, typer.Option(help="Budget: wall-clock time.")] = None
    attempts: Annotated[int | None, typer.Option(help="Budget: questions to the oracle.")] = None

    def of_problem(self) -> dict[str, Any]:
        """Options of the problem by name; None where one was not given."""
        before = [pair_of(text) for text in self.before] if self.before else None
        return {"collapse": self.collapse, "before": before, "removed": self.removed or None}

    def own_cells(self) -> dict[str, Any] | None:
        """The user's puzzle, {name: [[x, y, z], ...]}, if there is one. Raises InputError: a file that has none."""
        if self.cells is None:
            return None
        what = 'JSON {"name": [[x, y, z], ...]}'
        given = read_json(self.cells, what, InputError)
        if not isinstance(given, dict) or not all(isinstance(own, list) for own in given.values()):
            raise InputError(f"Expected {what} in {self.cells}; got something else.")
        return given


def pair_of(text: str) -> tuple[str, str]:
    """The two names of ``A,B``."""
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2 or not all(names):
        raise InputError(f"Expected --before A,B: two names with a comma between; got {text!r}.")
    return names[0], names[1]


@dataclass(frozen=True)
class FileOptions:
    """How an assembly's files are read, where they leave it open."""

    units: Annotated[
        str | None, typer.Option(metavar="U", help="What a length of 1 is in the files: mm, m, in, ...")
    ] = None
    up: Annotated[Literal["y", "z"] | None, typer.Option(help="What is up in the files; default z, in glTF y.")] = None
    touch: Annotated[
        str | None,
        typer.Option(
            metavar="SHARE|auto",
            help="Faces so near, or overlapping so little, touch: a share of the smallest part's extent. "
            "Default 0.001, raised where mating faces overlap; auto: raised to the play of parts, too.",
        ),
    ] = None
    friction: Annotated[
        float | None, typer.Option(metavar="MU", min=0.0, help="Coulomb's coefficient; default 0.5.")
    ] = None
    puzzle: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Which problem of a puzzle's file; default 1.")
    ] = None
    solution: Annotated[int | None, typer.Option(metavar="N", min=1, help="Which of its solutions; default 1.")] = None
    meshes: Annotated[
        Literal["visual", "collision"] | None,
        typer.Option(help="Of a robot: what links look like (default), or collide as."),
    ] = None
    joint: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Of a robot: where a joint is; default 0. May be repeated."),
    ] = None

    def reading(self) -> Reading:
        """As the library takes them."""
        from neurosym.geometry.readers.references import Reading

        touch = self.touch if self.touch in (None, "auto") else _share(str(self.touch))
        return Reading(**{**vars(self), "touch": touch, "joint": dict(map(_joint_value, self.joint or [])) or None})


def _share(text: str) -> float:
    try:
        share = float(text)
    except ValueError:
        share = -1.0
    if not 1e-6 <= share <= 0.5:
        raise InputError(f"Expected --touch as auto, or a share of the smallest extent, 1e-6 to 0.5; got {text!r}.")
    return share


def _joint_value(text: str) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"Expected a joint as NAME=VALUE, radians or metres; got {text!r}.") from None


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
    stability: Annotated[
        Literal["springs", "limit"] | None,
        typer.Option(help="What standing means: parts on springs rest (default), or some forces balance them."),
    ] = None
    pull: Annotated[
        bool | None, typer.Option("--pull", help="What stays must stand, too, while a part is drawn out by friction.")
    ] = None
    tilt: Annotated[
        float | None, typer.Option(metavar="DEG", help="What stays must stand however tilted by so many degrees.")
    ] = None
    fixed: Annotated[list[str] | None, typer.Option(metavar="NAME", help="A part that stays. May be repeated.")] = None
    keep: Annotated[
        list[str] | None,
        typer.Option(metavar="A,B", help="Parts, or a sub-assembly, that are one part throughout. May be repeated."),
    ] = None

    target: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Take out only what has to go before this part, and it. May be repeated."),
    ] = None

    def given(self) -> dict[str, Any]:
        """Those that were given, as `problem` of the domain "assembly" takes them."""
        options = vars(self) | {"keep": [[name.strip() for name in text.split(",")] for text in self.keep or []]}
        return {name: value for name, value in options.items() if value is not None and value != []}


def load_assembly(path: Path, files: FileOptions) -> Assembly:
    """The assembly in a file or folder. Raises InputError: there is nothing at that path, or it cannot be used."""
    if not path.exists():
        raise InputError(f"Expected a file or a folder with an assembly; there is nothing at {path}.")
    with progress_bar(f"reading {path.resolve().name}", after=1.0) as progress:
        return files.reading().load(path, progress)


def problem_at(path: Path, files: FileOptions, options: dict[str, Any]) -> Problem:
    """The problem of taking apart the assembly at a path."""
    from neurosym.registry import load_domain

    return load_domain("assembly").problem(load_assembly(path, files), name=path.resolve().name, **options)


def say(text: str) -> None:
    """A word to the user, on stderr: stdout belongs to the answer."""
    print(text, file=sys.stderr, flush=True)


def console(content: RenderableType = "") -> Console:
    """Stdout, as wide as the terminal, or as `content`: rich would cut columns off, a terminal wraps the lines."""
    from rich.console import Console

    out = Console(highlight=False)
    needed = out.measure(content, options=out.options.update(width=1000)).maximum
    return out if out.width >= needed else Console(highlight=False, width=needed)


def problem_options(family: ProblemFamily, **wanted: Any) -> dict[str, Any]:
    """The options that were given, and the family's defaults for those that were not, as far as it takes them.

    An option that was asked for is passed on even if the family does not take it, so that it is refused by name.
    """
    defaults = {name: p.default for name, p in inspect.signature(family.problem).parameters.items()}
    options = {name: defaults.get(name, inspect.Parameter.empty) if v is None else v for name, v in wanted.items()}
    return {name: value for name, value in options.items() if value is not inspect.Parameter.empty}


def family_options(given: Sequence[str] | None) -> dict[str, Any]:
    """``KEY=VALUE`` as the family's own options: a value that is JSON (a number, true, a list) is read as such."""
    return read_options(given or (), "an option as KEY=VALUE, for instance variant=unique")


def taken_by(function: Callable[..., Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the options that a function takes by name."""
    return {k: v for k, v in options.items() if k in inspect.signature(function).parameters}


@contextmanager
def progress_bar(what: str, after: float = 0.0) -> Iterator[Progress]:
    """A bar on stderr that goes away when it is done; nothing where stderr is no terminal.

    `after`: seconds until it is shown.
    """
    if not sys.stderr.isatty():
        yield silent
        return
    bars = progress_bars(transient=True)
    task = bars.add_task(what, total=None)
    start = Timer(after, bars.start)
    start.start()

    def heard(doing: str, done: int, total: int) -> None:
        bars.tasks[0].total = total or None  # an update to None would leave it
        bars.update(task, completed=done, description=f"{what}: {doing}" if doing else what)

    try:
        with heard_by(heard):
            yield lambda done, total: bars.update(task, completed=done, total=total)
    finally:
        start.cancel()
        start.join()
        bars.stop()


def progress_bars(*, transient: bool) -> Bars:
    """Bars on stderr, which go away when they are done if they are `transient`; none where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}", markup=False))
    err = Console(stderr=True)
    # The time left is judged by the last hour: a training may take minutes.
    return Bars(*columns, console=err, transient=transient, disable=not err.is_terminal, speed_estimate_period=3600)


def print_json(given: Any) -> None:
    """One JSON object on stdout."""
    print(json.dumps(given, indent=2, default=_plain), flush=True)


def write_json(given: Any, path: Path) -> None:
    """Write JSON, whole or not at all."""
    write_text(path, json.dumps(given, indent=2, default=_plain) + "\n")


def _plain(value: Any) -> Any:
    """Arrays and numpy's numbers as JSON knows them; anything else as text."""
    return value.tolist() if hasattr(value, "tolist") else str(value)
