"""Options of functions that make problems: which there are, and a refusal, by name, of those that there are not."""

import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from neurosym.errors import InputError

T = TypeVar("T")


def options_of(make: Callable[..., Any]) -> dict[str, Any] | None:
    """The options that a function takes, with their defaults (`inspect.Parameter.empty` for none); None: any.

    Its first parameter, where that can be given by position, says which problem, and is none of them.
    """
    parameters = [*inspect.signature(make).parameters.values()]
    if any(p.kind is p.VAR_KEYWORD for p in parameters):
        return None
    if parameters and parameters[0].kind is parameters[0].POSITIONAL_OR_KEYWORD:
        parameters = parameters[1:]
    return {p.name: p.default for p in parameters if p.kind in (p.KEYWORD_ONLY, p.POSITIONAL_OR_KEYWORD)}


def check_options(make: Callable[..., Any], given: Iterable[str], whose: str) -> None:
    """Refuse names of options that a function does not take.

    Raises InputError: there are such; the message has those that it takes.
    """
    known = options_of(make)
    wrong = [] if known is None else [name for name in given if name not in known]
    if known is not None and wrong:
        takes = f"options of {whose!r} among {', '.join(known)}" if known else f"no option for {whose!r}"
        raise InputError(f"Expected {takes}; got {', '.join(wrong)}.")


def made(make: Callable[..., T], *given: Any, options: Mapping[str, Any], whose: str) -> T:
    """What a function makes of options. Raises InputError: options that it does not take, together or at all."""
    check_options(make, options, whose)
    try:
        return make(*given, **options)
    except TypeError as error:
        raise InputError(f"Expected options that problems of {whose!r} take; {error}.") from None


def read_options(texts: Iterable[str], expected: str) -> dict[str, Any]:
    """Options that somebody typed as ``key=value``: a value that is JSON is read as such, anything else is text.

    Raises InputError: a text is something else; the message says what was `expected`.
    """
    options: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.isidentifier():
            raise InputError(f"Expected {expected}; got {text!r}.")
        try:
            options[key] = json.loads(value)
        except ValueError:
            options[key] = value
    return options
