"""What commands share: options, consoles and progress bars."""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from neurosym.errors import InputError
from neurosym.language.problem_family import ProblemFamily, Progress
from neurosym.support.files import write_text

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

class Oracle(StrEnum):
    """What answers attempts."""

    geometry = "geometry"
    physics = "physics"


class Pictures(StrEnum):
    """Style of the pictures a prior reads."""

    clean = "clean"
    varied = "varied"


DomainName = Annotated[str, typer.Argument(metavar="DOMAIN", help="Problem family; `neurosym list` names them.")]
PriorNames = Annotated[
    list[str] | None,
    typer.Option("--prior", metavar="Q", help="Name of a prior, a weights file, or `none`. May be repeated."),
]
CollapseRule = Annotated[
    str | None, typer.Option("--collapse", metavar="RULE", help="Rule of collapse (soma: cubes, strict, rigid).")
]
OracleName = Annotated[Oracle, typer.Option("--oracle", help="What answers attempts.")]
PictureStyle = Annotated[Pictures, typer.Option("--pictures", help="Style of the pictures.")]
Split = Annotated[int, typer.Option("--split", min=0, metavar="S", help="Which random split into train and test.")]
FamilyOptions = Annotated[
    list[str] | None,
    typer.Option("--option", metavar="KEY=VALUE", help="An option of the family's problems. May be repeated."),
]
# The help is rich's markup, in which a bracket that is meant as one is escaped.
Cells = Annotated[
    Path | None,
    typer.Option("--cells", metavar="FILE", help='A puzzle of yours: JSON {"name": [\\[x,y,z], ...]}.'),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object to stdout, and nothing else.")]


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
    taken = inspect.signature(family.problem).parameters
    found = {}
    for name, value in wanted.items():
        if value is not None:
            found[name] = value
        elif name in taken and taken[name].default is not inspect.Parameter.empty:
            found[name] = taken[name].default
    return found


def family_options(given: Sequence[str] | None) -> dict[str, Any]:
    """``KEY=VALUE`` as the family's own options: a value that is JSON (a number, true, a list) is read as such."""
    found: dict[str, Any] = {}
    for text in given or ():
        key, equals, value = text.partition("=")
        if not equals or not key.isidentifier():
            raise InputError(f"Expected an option as KEY=VALUE, for instance variant=unique; got {text!r}.")
        try:
            found[key] = json.loads(value)
        except ValueError:
            found[key] = value
    return found


def taken_by(function: Callable[..., Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the options that a function takes by name."""
    return {k: v for k, v in options.items() if k in inspect.signature(function).parameters}


@contextmanager
def progress_bar(what: str) -> Iterator[Progress]:
    """A bar on stderr that goes away when it is done; nothing where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    err = Console(stderr=True)
    # The time left is judged by the last hour: a training may take minutes.
    with Bars(
        *columns, console=err, transient=True, disable=not err.is_terminal, speed_estimate_period=3600
    ) as bars:
        task = bars.add_task(what, total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)


def print_json(given: Any) -> None:
    """One JSON object on stdout."""
    print(json.dumps(given, indent=2, default=_plain), flush=True)


def write_json(given: Any, path: Path) -> None:
    """Write JSON, whole or not at all."""
    write_text(path, json.dumps(given, indent=2, default=_plain) + "\n")


def _plain(value: Any) -> Any:
    """Arrays and numpy's numbers as JSON knows them; anything else as text."""
    return value.tolist() if hasattr(value, "tolist") else str(value)
