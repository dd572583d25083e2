"""Conditions made of others: and, or, not, for all, exists, equal; and effects that happen only under a condition.

Written with ``&``, ``|``, ``~``, `forall`, `exists`, `implies`, and ``p == q`` or ``p != q`` of variables. ``~`` moves
inwards at once, so that only atoms are ever negated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from neurosym.errors import DefinitionError

if TYPE_CHECKING:
    from neurosym.language.terms import Literal, Term, Type, Variable

#: Names of the objects of a type.
ObjectsOf = Callable[["Type"], tuple[str, ...]]


class Condition:
    """What may hold in a state or not."""

    __slots__ = ()

    def __invert__(self) -> Condition:
        raise NotImplementedError

    def __and__(self, other: Condition) -> Condition:
        return And((self, _condition(other, "&")))

    def __or__(self, other: Condition) -> Condition:
        return Or((self, _condition(other, "|")))

    def __bool__(self) -> bool:
        raise DefinitionError(
            f"Expected a & b, a | b or ~a to make a condition of {self}: Python's own and, or, not and if ask whether "
            "it is true, which only a state can tell."
        )

    def bind(self, binding: Mapping[str, str]) -> Condition:
        """The condition with variables, by their names, replaced by objects."""
        raise NotImplementedError

    def expanded(self, objects: ObjectsOf) -> Condition:
        """The same of literals, `And` and `Or` only, without variables; ``And(())`` is true, ``Or(())`` false."""
        raise NotImplementedError

    def literals(self) -> Iterator[Literal]:
        """Every literal in it."""
        raise NotImplementedError

    def variables(self) -> Iterator[Variable]:
        """Variables that no quantifier in it binds."""
        raise NotImplementedError

    def compared(self) -> Iterator[str]:
        """Names of objects in equalities."""
        parts: tuple[object, ...] = getattr(self, "parts", (getattr(self, "body", None),))
        return (name for part in parts if isinstance(part, Condition) for name in part.compared())


@dataclass(frozen=True, slots=True)
class And(Condition):
    """All of them."""

    parts: tuple[Condition, ...]

    def __invert__(self) -> Condition:
        return Or(tuple(~part for part in self.parts))

    def bind(self, binding: Mapping[str, str]) -> Condition:
        return And(tuple(part.bind(binding) for part in self.parts))

    def expanded(self, objects: ObjectsOf) -> Condition:
        parts = _flat(And, self.parts, objects)
        return FALSE if any(part is FALSE for part in parts) else _one_or(And, parts)

    def literals(self) -> Iterator[Literal]:
        return (literal for part in self.parts for literal in part.literals())

    def variables(self) -> Iterator[Variable]:
        return (variable for part in self.parts for variable in part.variables())

    def __str__(self) -> str:
        return f"({' & '.join(map(str, self.parts))})" if self.parts else "true"


@dataclass(frozen=True, slots=True)
class Or(Condition):
    """One of them at least."""

    parts: tuple[Condition, ...]

    def __invert__(self) -> Condition:
        return And(tuple(~part for part in self.parts))

    def bind(self, binding: Mapping[str, str]) -> Condition:
        return Or(tuple(part.bind(binding) for part in self.parts))

    def expanded(self, objects: ObjectsOf) -> Condition:
        parts = _flat(Or, self.parts, objects)
        return TRUE if any(part is TRUE for part in parts) else _one_or(Or, parts)

    def literals(self) -> Iterator[Literal]:
        return (literal for part in self.parts for literal in part.literals())

    def variables(self) -> Iterator[Variable]:
        return (variable for part in self.parts for variable in part.variables())

    def __str__(self) -> str:
        return f"({' | '.join(map(str, self.parts))})" if self.parts else "false"


TRUE, FALSE = And(()), Or(())


@dataclass(frozen=True, slots=True, eq=False)
class Equality(Condition):
    """Two terms are one object (or, not `positive`, two). Truthy when they are one term, as Python's ``==`` must be."""

    left: Term
    right: Term
    positive: bool = True

    def __invert__(self) -> Equality:
        return Equality(self.left, self.right, not self.positive)

    def __bool__(self) -> bool:
        left, right = self.left, self.right
        if isinstance(left, str) or isinstance(right, str):
            same = isinstance(left, str) and isinstance(right, str) and left == right
        else:
            same = left.name == right.name and left.type == right.type
        return same is self.positive

    def bind(self, binding: Mapping[str, str]) -> Equality:
        left, right = (t if isinstance(t, str) else binding.get(t.name, t) for t in (self.left, self.right))
        return Equality(left, right, self.positive)

    def expanded(self, objects: ObjectsOf) -> Condition:
        return TRUE if self else FALSE

    def literals(self) -> Iterator[Literal]:
        return iter(())

    def variables(self) -> Iterator[Variable]:
        return (term for term in (self.left, self.right) if not isinstance(term, str))

    def compared(self) -> Iterator[str]:
        return (term for term in (self.left, self.right) if isinstance(term, str))

    def __str__(self) -> str:
        return f"{self.left} {'==' if self.positive else '!='} {self.right}"


@dataclass(frozen=True, slots=True)
class Quantified(Condition):
    """A condition, or (of `forall`) an effect, of all objects of the variables' types; not `universal`, of one."""

    universal: bool
    bound: tuple[Variable, ...]
    body: Condition | When

    def __invert__(self) -> Condition:
        return Quantified(not self.universal, self.bound, ~self._condition)

    @property
    def _condition(self) -> Condition:
        return _condition(self.body, "forall or exists")

    def bind(self, binding: Mapping[str, str]) -> Quantified:
        own = {variable.name for variable in self.bound}
        free = {name: choice for name, choice in binding.items() if name not in own}
        return Quantified(self.universal, self.bound, self.body.bind(free))

    def bodies(self, objects: ObjectsOf) -> Iterator[Condition | When]:
        """The body, once for each choice of objects."""
        bodies: list[Condition | When] = [self.body]
        for variable in self.bound:
            names = objects(variable.type)
            bodies = [body.bind({variable.name: name}) for body in bodies for name in names]
        return iter(bodies)

    def expanded(self, objects: ObjectsOf) -> Condition:
        parts = tuple(_condition(body, "forall or exists") for body in self.bodies(objects))
        return (And(parts) if self.universal else Or(parts)).expanded(objects)

    def literals(self) -> Iterator[Literal]:
        return self.body.literals()

    def variables(self) -> Iterator[Variable]:
        own = {variable.name for variable in self.bound}
        return (variable for variable in self.body.variables() if variable.name not in own)

    def __str__(self) -> str:
        return f"{'forall' if self.universal else 'exists'}({', '.join(map(str, self.bound))}: {self.body})"


@dataclass(frozen=True, slots=True)
class When:
    """Effects that happen where a condition holds in the state before the action."""

    condition: Condition
    effects: tuple[Condition, ...]

    def bind(self, binding: Mapping[str, str]) -> When:
        return When(self.condition.bind(binding), tuple(effect.bind(binding) for effect in self.effects))

    def literals(self) -> Iterator[Literal]:
        return And((self.condition, *self.effects)).literals()

    def variables(self) -> Iterator[Variable]:
        return And((self.condition, *self.effects)).variables()

    def __str__(self) -> str:
        return f"when({self.condition}, {', '.join(map(str, self.effects))})"


def forall(*terms: Variable | Condition | When) -> Quantified:
    """``forall(q, body)``: of all objects of the types of the variables. Also of effects."""
    return _quantified(True, terms)


def exists(*terms: Variable | Condition) -> Quantified:
    """``exists(q, body)``: of one object at least."""
    return _quantified(False, terms)


def implies(given: Condition, then: Condition) -> Condition:
    """Where `given` holds, `then` does."""
    return ~_condition(given, "implies") | _condition(then, "implies")


def when(condition: Condition, *effects: Condition) -> When:
    """``when(condition, effect, ...)``: effects that happen where the condition holds before the action."""
    if not effects:
        raise DefinitionError(f"In when({condition}): expected at least one effect after the condition; got none.")
    return When(_condition(condition, "when"), tuple(_condition(effect, "when") for effect in effects))


def _quantified(universal: bool, terms: tuple[Any, ...]) -> Quantified:
    name = "forall" if universal else "exists"
    *bound, body = terms or (None,)
    wrong = [term for term in bound if not hasattr(term, "type")]
    if wrong or not bound or not (isinstance(body, Condition) or (universal and isinstance(body, When))):
        raise DefinitionError(
            f"In {name}({', '.join(map(str, terms))}): expected variables, then a condition, for instance "
            f'{name}(part("q"), ~on(q)).'
        )
    return Quantified(universal, tuple(bound), body)


def _condition(given: object, place: str) -> Condition:
    if not isinstance(given, Condition):
        raise DefinitionError(
            f"In {place}: expected a condition, such as present(p), ~present(p) or p != q; got {given!r}."
        )
    return given


def _flat(kind: type[And | Or], parts: tuple[Condition, ...], objects: ObjectsOf) -> tuple[Condition, ...]:
    flat: dict[Condition, None] = {}
    for part in parts:
        whole = part.expanded(objects)
        flat.update(dict.fromkeys(whole.parts if isinstance(whole, kind) else (whole,)))
    return tuple(flat)


def _one_or(kind: type[And | Or], parts: tuple[Condition, ...]) -> Condition:
    if not parts:
        return TRUE if kind is And else FALSE
    return parts[0] if len(parts) == 1 else kind(parts)
