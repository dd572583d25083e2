"""Problems: a domain, a world, and what holds at first and at last. Data; `Domain.problem` makes it."""

from __future__ import annotations

import dataclasses
import itertools
import re
import string
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any
from typing import Literal as OneOf

import numpy as np

from neurosym.errors import DefinitionError, InputError, UnknownNameError
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.language.actions import Action
from neurosym.language.conditions import Condition
from neurosym.language.costs import Value
from neurosym.language.semantics import Semantics
from neurosym.language.terms import Atom, Derived, Literal, Type, Variable
from neurosym.support.arrays import Pixels
from neurosym.support.html import table
from neurosym.support.words import counted, listed

if TYPE_CHECKING:
    from neurosym.language.domain import Domain
    from neurosym.language.grounding import GroundProblem
    from neurosym.language.search_problem import SearchProblem

@dataclass(frozen=True)
class Simulation:
    """How a physics simulation would judge a problem: what moves as one body, and what each action removes.

    Attributes:
        bodies: ``"cubes"`` (every unit cube by itself, the paper's rule) or ``"rigid"`` (every part one body).
        removes: name of an action -> name of the part that it takes away.
        absent: parts of the world that are gone when the problem begins.
    """

    bodies: OneOf["cubes", "rigid"]
    removes: Mapping[str, str]
    absent: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Problem:
    """A problem: a domain, a world, and what holds at first and at last. Made by `Domain.problem`.

    `world`: whatever the domain is about, for instance an `Assembly`. `geometry`: the object that answers questions
    about a world that is an `Assembly`; None for others. `goal`: the literals of the goal; `goal_conditions`: the rest
    of it. `values`: of functions by which actions cost. `reachable`: whether a goal out of reach is a mistake.
    """

    domain: Domain
    world: Any
    objects: Mapping[Type, tuple[str, ...]]
    init: tuple[Atom, ...]
    goal: tuple[Literal, ...]
    before: tuple[tuple[str, str], ...] = ()
    interchangeable: tuple[tuple[str, ...], ...] = ()
    name: str = ""
    family: str | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    simulation: Simulation | None = None
    semantics: Semantics = field(default_factory=Semantics)
    pictures: Pixels | None = None
    geometry: AssemblyGeometry | None = None
    goal_conditions: tuple[Condition, ...] = ()
    values: Mapping[Value, float] = field(default_factory=dict)
    reachable: bool = True

    def __post_init__(self) -> None:
        place = f"problem {self.name!r} of domain {self.domain.name!r}"
        seen: dict[str, Type] = {}
        for kind, names in self.objects.items():
            if not isinstance(kind, Type):
                raise DefinitionError(f"In {place}, objects: expected a Type as key; got {kind!r}.")
            for name in names:
                if not isinstance(name, str) or not name:
                    raise DefinitionError(f"In {place}, objects of {kind}: expected names; got {name!r}.")
                if name in seen:
                    raise DefinitionError(f"In {place}, objects: expected each name once; {name!r} comes twice.")
                seen[name] = kind
        for i, atom in enumerate(self.init):
            if not isinstance(atom, Atom) or isinstance(atom.predicate, Derived):
                raise DefinitionError(f"In {place}, init[{i}]: expected a fluent of objects; got {atom!s}.")
            self._check_atom(atom, f"{place}, init[{i}]")
        for i, goal in enumerate((*self.goal, *self.goal_conditions)):
            if free := list(goal.variables()):
                raise DefinitionError(
                    f"In {place}, goal[{i}]: expected names of objects; got the variable {free[0]} in {goal}. Bind it "
                    "with forall or exists."
                )
            for literal in goal.literals():
                self._check_atom(literal.atom, f"{place}, goal[{i}]", bound=True)
            self._check_compared(goal, f"{place}, goal[{i}]")
        for action in self.domain.actions:
            for condition in (*action.conditions, *(effect.condition for effect in action.conditional)):
                self._check_compared(condition, f"{place}, action {action.name!r}")
            for where, literal in action.every_literal():
                if any(isinstance(a, str) for a in literal.atom.args):
                    self._check_args(literal.atom, f"{place}, action {action.name!r}, {where}")

    def _check_atom(self, atom: Atom, place: str, *, bound: bool = False) -> None:
        if not isinstance(atom.predicate, Derived) and atom.predicate not in self.domain.fluents:
            known = ", ".join(f.name for f in self.domain.fluents)
            raise DefinitionError(f"In {place}: the fluent {atom.predicate} is not the domain's; expected {known}.")
        if not bound and any(isinstance(a, Variable) for a in atom.args):
            raise DefinitionError(f"In {place}: expected names of objects; got the variable in {atom}.")
        self._check_args(atom, place)

    def _check_compared(self, condition: Condition, place: str) -> None:
        for name in condition.compared():
            if name not in self.type_of:
                known = UnknownNameError("object", name, self.type_of)
                raise DefinitionError(f"In {place}: {condition}: unknown object. {known}")

    def _check_args(self, atom: Atom, place: str) -> None:
        for arg, kind in zip(atom.args, atom.predicate.types):
            if isinstance(arg, Variable):
                continue
            actual = self.type_of.get(arg)
            if actual is None:
                known = UnknownNameError("object", arg, self.type_of)
                raise DefinitionError(f"In {place}: {atom}: unknown object. {known}")
            if not actual.is_a(kind):
                raise DefinitionError(f"In {place}: {atom}: expected a {kind}; {arg!r} is a {actual}.")

    @property
    def predicate_world(self) -> Any:
        """What derived predicates are given: `geometry` where there is one, else the world as it is."""
        return self.geometry or self.world

    @cached_property
    def type_of(self) -> dict[str, Type]:
        """Object -> its type."""
        return {name: kind for kind, names in self.objects.items() for name in names}

    def objects_of(self, kind: Type) -> tuple[str, ...]:
        """Names of the objects of a type or of a type below it, in the problem's order."""
        if kind not in self._objects_of:
            self._objects_of[kind] = tuple(name for name, actual in self.type_of.items() if actual.is_a(kind))
        return self._objects_of[kind]

    @cached_property
    def _objects_of(self) -> dict[Type, tuple[str, ...]]:
        return {}

    def bindings(self, action: Action) -> Iterator[dict[str, str]]:
        """Every type-consistent way to fill an action's parameters."""
        names = [p.name for p in action.params]
        choices = itertools.product(*(self.objects_of(p.type) for p in action.params))
        return (dict(zip(names, objects)) for objects in choices)

    def meant_by(self, name: str) -> tuple[Action, dict[str, str]] | None:
        """The action and the objects that the name of a ground action means; None: no action has that name."""
        for action, pattern in self._patterns:
            if pattern is None:
                binding = next((b for b in self.bindings(action) if action.ground_name(b) == name), None)
                if binding is not None:
                    return action, binding
            elif match := pattern.fullmatch(name):
                return action, {p.name: match[p.name] for p in action.params}
        return None

    @cached_property
    def _patterns(self) -> list[tuple[Action, re.Pattern[str] | None]]:
        """Of each action what its labels look like; None where a label does not say what all parameters are."""
        patterns = []
        for action in self.domain.actions:
            types, text, seen = {p.name: p.type for p in action.params}, "", set[str]()
            for literal, field_, spec, conversion in string.Formatter().parse(action.label):
                text += re.escape(literal)
                if field_ is not None and not (spec or conversion):
                    names = "|".join(map(re.escape, self.objects_of(types[field_])))
                    text += f"(?P={field_})" if field_ in seen else f"(?P<{field_}>{names})"
                    seen.add(field_)
            whole = seen == set(types) and all(name.isidentifier() for name in seen)
            patterns.append((action, re.compile(text) if whole else None))
        return patterns

    @cached_property
    def symbols(self) -> GroundProblem:
        """The symbols as bitsets. Done once."""
        from neurosym.language.grounding import GroundProblem

        return GroundProblem(self)

    @cached_property
    def _search_problem(self) -> SearchProblem[Any]:
        return self.semantics.search(self)

    def ground(self) -> SearchProblem[Any]:
        """The problem as planners see it. Done once."""
        return self._search_problem

    @property
    def actions(self) -> tuple[str, ...]:
        """Names of the action primitives, in the order in which priors score them."""
        return self.symbols.actions

    @property
    def classes(self) -> tuple[int, ...]:
        """One integer an action primitive; equal ones are interchangeable."""
        return self.symbols.classes

    @cached_property
    def observation(self) -> Pixels | None:
        """The pictures, uint8 (V, H, W, 3), taken when first asked for; None when there are none."""
        return self.semantics.observe(self) if self.pictures is None else self.pictures

    def with_pictures(self, pictures: Pixels) -> Problem:
        """The same problem behind other pictures."""
        array = np.asarray(pictures)
        if array.dtype != np.uint8 or array.ndim != 4 or array.shape[-1] != 3:
            raise InputError(f"Expected pictures as uint8 (V, H, W, 3); got {array.dtype} of shape {array.shape}.")
        return dataclasses.replace(self, pictures=array)

    def __getstate__(self) -> dict[str, Any]:
        """What travels: the data, without what was grounded or answered."""
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}

    def __repr__(self) -> str:
        return f"Problem({self.name!r}, {len(self.type_of)} objects, {len(self.actions)} actions)"

    def _repr_html_(self) -> str:
        kinds = ((str(kind), len(names), listed(names)) for kind, names in self.objects.items())
        wanted = listed([str(literal) for literal in self.goal])
        after = f"{counted(len(self.actions), 'action')}: {listed(self.actions)}.\nGoal: {wanted}."
        title = f"Problem {self.name} of the domain {self.domain.name}"
        return table(("type", "objects", ""), kinds, title=title, after=after)


def as_names(given: Any, what: str) -> tuple[str, ...]:
    """A collection of names, checked; one text is no collection of names, though it is one of letters."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise InputError(f"Expected {what} as a list of names; got {given!r}.")
    names = tuple(given)
    strange = [n for n in names if not isinstance(n, str)]
    if strange:
        raise InputError(f"Expected {what} as a list of names; got {strange[0]!r} in it.")
    return names


def checked_pairs(given: Any, place: str) -> tuple[tuple[str, str], ...]:
    advice = f"In {place}, before: expected pairs of names of actions, for instance [('a', 'b')]"
    if isinstance(given, str | Mapping) or not isinstance(given, Iterable):
        raise DefinitionError(f"{advice}; got {given!r}.")
    pairs = []
    for pair in given:
        if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
            raise DefinitionError(f"{advice}; got {pair!r} in it.")
        pairs.append((pair[0], pair[1]))
    return tuple(pairs)
