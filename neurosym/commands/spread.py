"""Options that several commands share, written once: a dataclass whose fields are the options.

A command takes such a dataclass as one parameter. On the command line, and in `--help`, its fields stand in its place.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, get_type_hints


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose parameters that are dataclasses are replaced by their fields, each with its own default.

    Args:
        command: a function; its dataclasses have defaults for all fields, and no two of its options share a name.

    Returns:
        What the command line calls: it takes keyword arguments only, and hands each dataclass over made.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, tuple[type[Any], list[str]]] = {}
    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(command).parameters.values():
        kind = hints[parameter.name]
        if isinstance(kind, type) and is_dataclass(kind):
            own = [_option(kind, field.name) for field in fields(kind)]
            groups[parameter.name] = kind, [option.name for option in own]
            parameters += own
        else:
            parameters.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[parameter.name]))

    @functools.wraps(command)
    def spread_out(**given: Any) -> None:
        made = {name: kind(**{key: given.pop(key) for key in keys}) for name, (kind, keys) in groups.items()}
        command(**given, **made)

    del spread_out.__wrapped__  # whoever looks through it would miss the fields
    spread_out.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    spread_out.__annotations__ = {p.name: p.annotation for p in parameters}
    return spread_out


def _option(kind: type[Any], name: str) -> inspect.Parameter:
    field = next(f for f in fields(kind) if f.name == name)
    if field.default is MISSING:
        raise TypeError(f"Expected a default for every option of {kind.__name__}; {name} has none.")
    annotation = get_type_hints(kind, include_extras=True)[name]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=annotation)
