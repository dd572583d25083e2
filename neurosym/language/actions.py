"""Action schemas: what an action needs and what it changes, over typed parameters."""

import string
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from neurosym.errors import DefinitionError
from neurosym.language.conditions import And, Condition, ObjectsOf, Quantified, When
from neurosym.language.costs import Cost, checked_cost
from neurosym.language.terms import Derived, Fluent, Literal, Variable, as_condition

#: What may be listed as an effect: a literal, several with ``&``, `forall` of such, or `when`.
Effect = Condition | When


@dataclass(frozen=True)
class ConditionalEffect:
    """An effect on each choice of objects for `bound`, where `condition` holds in the state before the action."""

    bound: tuple[Variable, ...]
    condition: Condition
    effect: Literal

    def ground(self, binding: Mapping[str, str], objects: ObjectsOf) -> Iterator[tuple[Condition, Literal]]:
        """Expanded conditions and ground effects."""
        body = When(self.condition, (self.effect,)).bind(binding)
        bodies = Quantified(True, self.bound, body).bodies(objects) if self.bound else iter((body,))
        for each in bodies:
            assert isinstance(each, When)
            assert isinstance(each.effects[0], Literal)
            yield each.condition.expanded(objects), each.effects[0]


class Action:
    """An action schema. Its ground actions may be done any number of times, unless `once` says otherwise.

    Args:
        name: as in PDDL.
        params: its typed parameters, made by ``part("p")``.
        pre: conditions that must hold; derived predicates are asked in this order, after all fluents.
        eff: fluents (made true) and negated fluents (made false); `when` and `forall` of such. Conditions are looked at
            before the action; what is made true and false at once is true.
        label: how its ground actions are named, for instance ``"{p}"``; default ``"name(p)"``.
        once: each of its ground actions can be done once in a plan: an action primitive, which priors can order.
        cost: 0 or more, or a `Function` of its parameters. Once an action of a domain has a cost, plans cost the sum;
            those without one cost nothing.

    Attributes:
        pre, eff: the literals among the conditions and effects.
        conditions, conditional: the others.
    """

    def __init__(
        self,
        name: str,
        *params: Variable,
        pre: Sequence[Condition] = (),
        eff: Sequence[Effect] = (),
        label: str | None = None,
        once: bool = False,
        cost: Cost | None = None,
        duration: object = None,
    ) -> None:
        for i, param in enumerate(params):
            if not isinstance(param, Variable):
                raise DefinitionError(f"In action {name!r}, parameter {i}: expected a variable; got {param!r}.")
        names = [p.name for p in params]
        if len(set(names)) != len(names):
            raise DefinitionError(f"In action {name!r}: expected parameters of different names; got {names}.")
        if duration is not None:
            raise DefinitionError(
                f"In action {name!r}: expected no duration, which is not part of this language; plans are orders of "
                "actions. Give it a cost, and the cheapest plan is the one whose actions take least in sum."
            )
        self.name = name
        self.params = tuple(params)
        self.once = once
        self.cost = None if cost is None else checked_cost(cost, f"action {name!r}, cost")
        if not isinstance(self.cost, float | None):
            used = [arg for arg in self.cost.args if isinstance(arg, Variable)]
            self._check_variables(used, f"action {name!r}, cost", cost)
        given = self._conditions("pre", pre)
        self.pre = tuple(c for c in given if isinstance(c, Literal))
        self.conditions = tuple(c for c in given if not isinstance(c, Literal))
        effects = [e for i, effect in enumerate(_effect_list(name, eff)) for e in self._effects((), And(()), effect, i)]
        self.eff = tuple(e.effect for e in effects if not e.bound and e.condition == And(()))
        self.conditional = tuple(e for e in effects if e.bound or e.condition != And(()))
        self.label = label if label is not None else f"{name}({', '.join(f'{{{p}}}' for p in names)})"
        if not effects:
            raise DefinitionError(f"In action {name!r}: expected at least one effect; got none.")
        contradiction = {lit.atom for lit in self.eff if lit.positive} & {x.atom for x in self.eff if not x.positive}
        if contradiction:
            raise DefinitionError(
                f"In action {name!r}: {next(iter(contradiction))} is both made true and made false; keep one."
            )
        try:
            fields = {f for _, f, _, _ in string.Formatter().parse(self.label) if f is not None}
        except ValueError as error:
            raise DefinitionError(f"In action {name!r}: the label {label!r} is no format string: {error}.") from None
        if not fields <= set(names):
            raise DefinitionError(f"In action {name!r}: expected a label over {names}; got {self.label!r}.")

    def _conditions(self, where: str, given: Sequence[Condition]) -> list[Condition]:
        if not isinstance(given, list | tuple):
            raise DefinitionError(f"In action {self.name!r}: expected {where} to be a list; got {given!r}.")
        conditions: list[Condition] = []
        for i, each in enumerate(given):
            place = f"action {self.name!r}, {where}[{i}]"
            condition = as_condition(each, place)
            self._check_variables(list(condition.variables()), place, condition)
            parts = condition.parts if isinstance(condition, And) else (condition,)
            conditions += [as_condition(part, place) for part in parts]
        return conditions

    def _check_variables(self, used: Sequence[Variable], place: str, whole: object) -> None:
        known = set(self.params)
        for variable in used:
            if variable not in known:
                raise DefinitionError(
                    f"In {place}: {whole} uses {variable} ({variable.type}), which is no parameter of the action; "
                    f"expected one of {', '.join(f'{p} ({p.type})' for p in self.params) or 'none'}."
                )

    def _effects(
        self, bound: tuple[Variable, ...], condition: Condition, effect: object, number: int
    ) -> Iterator[ConditionalEffect]:
        place = f"action {self.name!r}, eff[{number}]"
        if isinstance(effect, When) and condition == And(()):
            for each in effect.effects:
                yield from self._effects(bound, as_condition(effect.condition, place), each, number)
        elif isinstance(effect, Quantified) and effect.universal:
            yield from self._effects((*bound, *effect.bound), condition, effect.body, number)
        elif isinstance(effect, And) and effect.parts:
            for part in effect.parts:
                yield from self._effects(bound, condition, part, number)
        else:
            literal = as_condition(effect, place)
            if not isinstance(literal, Literal):
                raise DefinitionError(
                    f"In {place}: expected a fluent, its negation, when(condition, effect) or forall(variable, effect) "
                    f"as an effect; got {effect}. What may or may not happen is not part of this language."
                )
            if isinstance(literal.atom.predicate, Derived):
                raise DefinitionError(
                    f"In {place}: {literal.atom.predicate} is derived, computed from the world; an effect can only "
                    "change a fluent."
                )
            free = [v for v in (*literal.variables(), *condition.variables()) if v not in set(bound)]
            self._check_variables(free, place, literal)
            yield ConditionalEffect(bound, condition, literal)

    def every_literal(self) -> Iterator[tuple[str, Literal]]:
        """All literals, each with its place."""
        for where, conditions in (("pre", (*self.pre, *self.conditions)), ("eff", self.eff)):
            for i, condition in enumerate(conditions):
                yield from ((f"{where}[{i}]", literal) for literal in condition.literals())
        for each in self.conditional:
            yield from (("eff", literal) for literal in (each.effect, *each.condition.literals()))

    def changed(self) -> Iterator[Literal]:
        """The literals of all effects, conditional or not."""
        yield from self.eff
        yield from (each.effect for each in self.conditional)

    def ground_name(self, binding: Mapping[str, str]) -> str:
        """The name of the ground action, from the label."""
        return self.label.format(**binding)

    def __repr__(self) -> str:
        return f"Action({self.name!r}, {', '.join(map(str, self.params))})"


def _effect_list(name: str, eff: object) -> Sequence[object]:
    if isinstance(eff, list | tuple):
        return eff
    raise DefinitionError(f"In action {name!r}: expected eff to be a list; got {eff!r}.")


def moved_parts(
    effects: Sequence[Literal], names: Sequence[str], presence: Collection[Fluent] = ()
) -> tuple[tuple[str, ...], bool]:
    """Which of some names leave, by effects that only delete atoms of them; else which arrive, by such that only add.

    `presence`: fluents that say which parts are there; the others then say nothing of it. Empty: any may.

    Returns the names, and whether they arrive.
    """
    told = [e for e in effects if not presence or e.atom.predicate in presence]
    added, deleted = ({a for e in told if e.positive is sign for a in e.atom.args} for sign in (True, False))
    leaving = tuple(name for name in names if name in deleted - added)
    return (leaving, False) if leaving else (tuple(name for name in names if name in added - deleted), True)
