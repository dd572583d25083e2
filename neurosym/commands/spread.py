"""Options that several commands share, written once: a dataclass whose fields are the options.

A command takes such a dataclass as one parameter. On the command line, and in `--help`, its fields stand in its place.
"""

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, get_type_hints


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose parameters that are dataclasses are replaced by their fields, each with its own default.

    What the command line calls takes keyword arguments only, and hands each dataclass over made. All fields have
    defaults, and no two options share a name.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, tuple[type[Any], list[str]]] = {}
    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(command).parameters.values():
        kind = hints[parameter.name]
        if isinstance(kind, type) and is_dataclass(kind):
            own = _options(kind)
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


def _options(kind: type[Any]) -> list[inspect.Parameter]:
    hints, options = get_type_hints(kind, include_extras=True), []
    for field in fields(kind):
        if field.default is MISSING:
            raise TypeError(f"Expected a default for every option of {kind.__name__}; {field.name} has none.")
        annotation, keyword = hints[field.name], inspect.Parameter.KEYWORD_ONLY
        options.append(inspect.Parameter(field.name, keyword, default=field.default, annotation=annotation))
    return options
