"""Domains: fluents and actions, checked at once, with the place of every mistake named."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

from neurosym.errors import DefinitionError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.language.actions import Action
from neurosym.language.conditions import And, Condition
from neurosym.language.costs import Value, checked_values
from neurosym.language.problem import Problem, Simulation, checked_pairs
from neurosym.language.semantics import Semantics
from neurosym.language.terms import Atom, Derived, Fluent, Literal, Type, as_condition


class Domain:
    """A symbolic domain: fluents and actions. ``domain.problem(...)`` makes problems of it.

    Raises DefinitionError: two fluents or actions of one name, or an action over a fluent that is not declared.
    """

    def __init__(self, name: str, *, fluents: Sequence[Fluent], actions: Sequence[Action]) -> None:
        self.name = name
        self.fluents = tuple(fluents)
        self.actions = tuple(actions)
        for kind, names in (("fluent", [f.name for f in fluents]), ("action", [a.name for a in actions])):
            twice = sorted({n for n in names if names.count(n) > 1})
            if twice:
                raise DefinitionError(f"In domain {name!r}: expected {kind}s of different names; twice: {twice}.")
        if not self.actions:
            raise DefinitionError(f"In domain {name!r}: expected at least one action; got none.")
        declared = set(self.fluents)
        for action in self.actions:
            for where, literal in action.every_literal():
                predicate = literal.atom.predicate
                if not isinstance(predicate, Derived) and predicate not in declared:
                    raise DefinitionError(
                        f"In domain {name!r}, action {action.name!r}, {where}: the fluent {predicate} is not "
                        f"declared; expected one of {', '.join(f.name for f in fluents) or 'none'}."
                    )

    @property
    def has_costs(self) -> bool:
        """Whether an action says what it costs."""
        return any(action.cost is not None for action in self.actions)

    @cached_property
    def presence(self) -> frozenset[Fluent]:
        """The fluents that say which parts are there: those that its ready-made predicates were made from."""
        literals = (literal for action in self.actions for literal in action.pre)
        made = (p.made_by for literal in literals if isinstance(p := literal.atom.predicate, Derived) and p.made_by)
        return frozenset(a for _, args, options in made for a in (*args, *options.values()) if isinstance(a, Fluent))

    def problem(
        self,
        *,
        objects: Mapping[Type, Sequence[str]],
        init: Iterable[Atom],
        goal: Iterable[Condition],
        world: Any = None,
        before: Iterable[tuple[str, str]] = (),
        interchangeable: Iterable[Sequence[str]] = (),
        values: Mapping[Value, float] | None = None,
        name: str = "",
        family: str | None = None,
        details: Mapping[str, Any] | None = None,
        simulation: Simulation | None = None,
        semantics: Semantics | None = None,
        reachable: bool = True,
    ) -> Problem:
        """A problem of this domain, checked.

        Args:
            objects: names of the objects of each type.
            init: fluents that hold at first; all others do not. Any partial state will do.
            goal: conditions, derived predicates among them.
            world: what derived predicates are given; of an `Assembly` its `AssemblyGeometry`. Give that one yourself,
                and several problems share what it knows.
            before: pairs (a, b) of names of action primitives: b may be done only after a.
            interchangeable: groups of names of action primitives that may be swapped for one another.
            values: of functions by which actions cost: ``{distance("a", "b"): 3}``.
            family: the name of the problem family, by which priors find their weights.
            details: whatever the family wants to remember.
            simulation: how a physics oracle would judge it.
            semantics: what symbols cannot say of it: pictures, parts in space, a search of its own.
            reachable: refuse a goal that no action can reach, as a mistake; False leaves the proof to planners.

        Raises:
            DefinitionError: an unknown object, a wrong type, a goal that no action can reach, precedence in a circle.
        """
        place = f"problem {name!r}"
        geometry = AssemblyGeometry.of(world) if isinstance(world, Assembly | AssemblyGeometry) else None
        goals = [as_condition(g, f"{place}, goal[{i}]") for i, g in enumerate(goal)]
        goals = [as_condition(p, place) for g in goals for p in (g.parts if isinstance(g, And) else (g,))]
        problem = Problem(
            self,
            geometry.assembly if geometry else world,
            {kind: tuple(names) for kind, names in objects.items()},
            tuple(init),
            tuple(g for g in goals if isinstance(g, Literal)),
            checked_pairs(before, place),
            tuple(map(tuple, interchangeable)),
            name or self.name,
            family,
            dict(details or {}),
            simulation,
            semantics or Semantics(),
            geometry=geometry,
            goal_conditions=tuple(g for g in goals if not isinstance(g, Literal)),
            values=checked_values(values or {}, place),
            reachable=reachable,
        )
        problem.ground()
        return problem

    def __repr__(self) -> str:
        return f"Domain({self.name!r}, {len(self.fluents)} fluents, {len(self.actions)} actions)"
