"""How derived predicates travel to other processes: by their name in a module, or as the call that made them."""

from __future__ import annotations

import functools
import pickle
import sys
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, ParamSpec

from neurosym.errors import DefinitionError

if TYPE_CHECKING:
    from neurosym.language.terms import Derived

P = ParamSpec("P")


def remade(make: Callable[P, Derived]) -> Callable[P, Derived]:
    """A module's function whose predicates, closures as they are, are made anew where they arrive."""

    @functools.wraps(make)
    def made(*args: P.args, **options: P.kwargs) -> Derived:
        predicate = make(*args, **options)
        predicate.made_by = (made, args, options)
        return predicate

    return made


def reduced(predicate: Derived) -> tuple[Any, ...]:
    """What pickle keeps of a predicate. Raises DefinitionError: its function has no name that others could find."""
    if predicate.made_by is not None:
        return _call, predicate.made_by
    function = predicate.function
    place = getattr(function, "__module__", ""), getattr(function, "__qualname__", "")
    if place[0] in sys.modules and _at(*place) is predicate:
        return _at, place
    functions = {"function": function, "check": predicate.check, "formula": predicate.formula, "after": predicate.after}
    try:
        pickle.dumps(functions)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise DefinitionError(
            f"Expected the function of the derived predicate {predicate.name!r} at the top of a module, where other "
            f"processes find it; got {'.'.join(place)} ({error}). Move it there, or make the problem in each process."
        ) from None
    return _call, (type(predicate), (predicate.name, predicate.types), functions)


def _call(make: Callable[..., Derived], args: tuple[Any, ...], options: dict[str, Any]) -> Derived:
    return make(*args, **options)


def _at(module: str, name: str) -> Any:
    found: Any = import_module(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found
