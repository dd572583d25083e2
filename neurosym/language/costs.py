"""What actions cost: a number, or a function of objects. Functions do not change: they are no numeric fluents."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

from neurosym.errors import DefinitionError
from neurosym.language.terms import Atom, Predicate, Term, Type, bound


class Function(Predicate):
    """A number for objects, by which actions cost: ``distance = Function("distance", place, place)``."""

    __slots__ = ()

    def __init__(self, name: str, *types: Type) -> None:
        super().__init__(name, types)

    def __call__(self, *args: Term) -> Value:  # type: ignore[override]
        return Value(self, super().__call__(*args).args)


def _refuse(self: Value, *_: object) -> NoReturn:
    raise DefinitionError(
        f"Expected {self} as the cost of an action, alone: numbers that are compared, added or changed (numeric "
        "fluents, durations) are not part of this language. Write what has to be told apart as fluents."
    )


@dataclass(frozen=True, slots=True)
class Value:
    """A function with its arguments."""

    function: Function
    args: tuple[Term, ...]

    def bind(self, binding: Mapping[str, str]) -> Value:
        return Value(self.function, bound(self.args, binding))

    def __str__(self) -> str:
        return str(Atom(self.function, self.args))

    __lt__ = __le__ = __gt__ = __ge__ = __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _refuse
    __truediv__ = __neg__ = __invert__ = __iadd__ = __isub__ = _refuse


Cost = float | Value


def checked_cost(given: Any, place: str) -> Cost:
    """A cost that an action may have. Raises DefinitionError: it is none."""
    if isinstance(given, Value) or _is_cost(given):
        return given if isinstance(given, Value) else float(given)
    raise DefinitionError(
        f"In {place}: expected a cost of 0 or more, or a Function of the action's parameters such as distance(p, q); "
        f"got {given!r}."
    )


def cost_of(cost: Cost, binding: Mapping[str, str], values: Mapping[Value, float], place: str) -> float:
    """The number. Raises DefinitionError: the problem has no value for the function."""
    if not isinstance(cost, Value):
        return cost
    asked = cost.bind(binding)
    if asked not in values:
        raise DefinitionError(f"In {place}: expected a value of {asked} among the problem's values; there is none.")
    return values[asked]


def checked_values(given: Mapping[Value, float], place: str) -> dict[Value, float]:
    """Values that a problem gives to functions. Raises DefinitionError: one that is no cost."""
    for value, number in given.items():
        if not isinstance(value, Value) or not _is_cost(number):
            raise DefinitionError(
                f"In {place}, values: expected {{distance('a', 'b'): 3}}, of 0 or more; got {value}: {number!r}."
            )
    return {value: float(number) for value, number in given.items()}


def _is_cost(given: Any) -> bool:
    return isinstance(given, int | float) and not isinstance(given, bool) and math.isfinite(given) and given >= 0
