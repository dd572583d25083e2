"""Terms: types, variables, fluents, derived predicates, functions, and the atoms and literals made of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from neurosym.errors import DefinitionError
from neurosym.language.conditions import Condition, Equality, ObjectsOf
from neurosym.language.search_problem import Verdict
from neurosym.language.travel import reduced

if TYPE_CHECKING:
    from neurosym.language.formulas import Formula


@dataclass(frozen=True)
class Type:
    """A type of objects, as in PDDL; calling it makes a variable: ``part("p")``."""

    name: str
    parent: Type | None = None

    def __post_init__(self) -> None:
        _check_name("type", self.name)

    def __call__(self, name: str) -> Variable:
        return Variable(name, self)

    def is_a(self, other: Type) -> bool:
        """Whether this is `other` or a descendant of it."""
        kind: Type | None = self
        while kind is not None:
            if kind == other:
                return True
            kind = kind.parent
        return False

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, eq=False)
class Variable:
    """A parameter of an action: a name with a type. ``p != q`` is a condition: that they are two objects."""

    name: str
    type: Type

    def __post_init__(self) -> None:
        _check_name("variable", self.name)

    def __eq__(self, other: object) -> Equality:  # type: ignore[override]
        return Equality(self, other) if isinstance(other, Variable | str) else NotImplemented

    def __ne__(self, other: object) -> Equality:  # type: ignore[override]
        return Equality(self, other, False) if isinstance(other, Variable | str) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.name, self.type))

    def __str__(self) -> str:
        return self.name


#: What an atom is made of: a variable in an action, the name of an object elsewhere.
Term = Variable | str


class Predicate:
    """What fluents and derived predicates share: a name, argument types, and being called."""

    __slots__ = ("name", "types")

    def __init__(self, name: str, types: Sequence[Type]) -> None:
        _check_name("predicate", name)
        for position, kind in enumerate(types):
            if not isinstance(kind, Type):
                raise DefinitionError(
                    f"In {name!r}: expected a Type for argument {position}; got {kind!r}. Make one with ns.Type(...)."
                )
        self.name = name
        self.types = tuple(types)

    def __call__(self, *args: Term) -> Atom:
        if len(args) != len(self.types):
            expected = ", ".join(map(str, self.types)) or "none"
            raise DefinitionError(
                f"In {self.name}({', '.join(map(str, args))}): expected {len(self.types)} arguments ({expected}); "
                f"got {len(args)}."
            )
        for arg, kind in zip(args, self.types):
            if isinstance(arg, Variable):
                if not arg.type.is_a(kind):
                    raise DefinitionError(
                        f"In {self.name}({', '.join(map(str, args))}): expected a {kind}; "
                        f"the variable {arg} is a {arg.type}."
                    )
            elif not isinstance(arg, str):
                raise DefinitionError(
                    f"In {self.name}(...): expected a variable or the name of an object; got {arg!r}."
                )
        return Atom(self, args)

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {', '.join(map(str, self.types))})"


class Fluent(Predicate):
    """A fact that actions change: ``present = Fluent("present", part)``, then ``present("a")``, ``~present(p)``."""

    __slots__ = ("_hash",)

    def __init__(self, name: str, *types: Type) -> None:
        super().__init__(name, types)
        self._hash = hash((name, types))

    # A copy that came from another process is the same fluent.
    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Fluent) and (self.name, self.types) == (other.name, other.types))

    def __hash__(self) -> int:
        return self._hash

    def __reduce__(self) -> tuple[Any, ...]:
        return Fluent, (self.name, *self.types)


class Derived(Predicate):
    """A predicate that is computed from the world and the state, not changed by effects.

    Its function takes the world (of an `Assembly` its `AssemblyGeometry`), the state and the names of the objects, and
    answers with a `Verdict`.

    Args:
        check: for answers that are found by a search and say a motion: takes the world, the state, the motion of a step
            and the names of the objects, and answers whether it may be done so. Replays of a plan with motions ask it
            instead of `function`: what was found once need not be found again, but must hold.
        formula: takes the world and the names of the objects, and says for all states at once when it holds (None: it
            cannot say). Whoever writes the problem down for other programs asks it.
        after: a predicate of no objects that holds in the state after an action exactly when this one, as a
            precondition, held before it. A search from the goal asks it of a state once, not of each action that may
            lead there.
    """

    __slots__ = ("after", "check", "formula", "function", "made_by")

    def __init__(
        self,
        name: str,
        types: Sequence[Type],
        function: Callable[..., Verdict],
        *,
        check: Callable[..., Verdict] | None = None,
        formula: Callable[..., Formula | None] | None = None,
        after: Derived | None = None,
    ) -> None:
        super().__init__(name, types)
        self.function = function
        self.check = check
        self.formula = formula
        self.after = after
        #: The call that made it, where that is how it travels: see `neurosym.language.travel`.
        self.made_by: tuple[Callable[..., Derived], tuple[Any, ...], dict[str, Any]] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced(self)


def derived(*types: Type) -> Callable[[Callable[..., Verdict]], Derived]:
    """Make a predicate of one's own from a function ``(world, state, *names) -> Verdict``:

        @ns.derived(part)
        def light_enough(world, state, p): ...
    """

    def decorate(function: Callable[..., Verdict]) -> Derived:
        return Derived(function.__name__, types, function)

    return decorate


@dataclass(frozen=True, slots=True)
class Atom(Condition):
    """A predicate with its arguments. ``~atom`` is its negation."""

    predicate: Predicate
    args: tuple[Term, ...]

    def __invert__(self) -> Literal:
        return Literal(self, False)

    def bind(self, binding: Mapping[str, str]) -> Atom:
        """The atom with its variables replaced by objects."""
        return Atom(self.predicate, bound(self.args, binding))

    def expanded(self, objects: ObjectsOf) -> Literal:
        return Literal(self)

    def literals(self) -> Iterator[Literal]:
        return iter((Literal(self),))

    def variables(self) -> Iterator[Variable]:
        return (arg for arg in self.args if isinstance(arg, Variable))

    def __str__(self) -> str:
        return f"{self.predicate}({', '.join(map(str, self.args))})"


@dataclass(frozen=True, slots=True)
class Literal(Condition):
    """An atom, or its negation."""

    atom: Atom
    positive: bool = True

    def __invert__(self) -> Literal:
        return Literal(self.atom, not self.positive)

    def bind(self, binding: Mapping[str, str]) -> Literal:
        return Literal(self.atom.bind(binding), self.positive)

    def expanded(self, objects: ObjectsOf) -> Literal:
        return self

    def literals(self) -> Iterator[Literal]:
        return iter((self,))

    def variables(self) -> Iterator[Variable]:
        return self.atom.variables()

    def __str__(self) -> str:
        return str(self.atom) if self.positive else f"not {self.atom}"


def bound(args: Sequence[Term], binding: Mapping[str, str]) -> tuple[Term, ...]:
    """Arguments with variables replaced by objects, as far as they are bound."""
    return tuple([binding.get(a.name, a) if isinstance(a, Variable) else a for a in args])


def as_condition(given: Any, place: str) -> Condition:
    """A condition, an atom as a literal; anything else is refused, naming the place."""
    if isinstance(given, Atom):
        return Literal(given)
    if isinstance(given, Condition):
        return given
    raise DefinitionError(
        f"In {place}: expected an atom such as present(p), or ~present(p), a | b, p != q; got {given!r}."
    )


def _check_name(kind: str, name: object) -> None:
    if not isinstance(name, str) or not name or name != name.strip():
        raise DefinitionError(f"Expected a {kind} name that is a non-empty text without outer spaces; got {name!r}.")
