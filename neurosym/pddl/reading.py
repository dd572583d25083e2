"""PDDL, and problems of unified-planning, as problems of ours. Files are read by unified-planning (extra ``pddl``)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from neurosym.errors import InputError, MissingDependencyError
from neurosym.language.actions import Action, Effect
from neurosym.language.conditions import And, Condition, Equality, Or, exists, forall, implies, when
from neurosym.language.costs import Cost, Function, Value
from neurosym.language.domain import Domain
from neurosym.language.problem import Problem
from neurosym.language.terms import Atom, Fluent, Predicate, Term, Type, Variable
from neurosym.pddl.lifted import to_pddl


def from_pddl(domain: str | Path, problem: str | Path) -> Problem:
    """The problem in two PDDL files, given as paths or as texts.

    STRIPS, typing, negative and disjunctive conditions, equality, quantifiers, conditional effects, action costs.

    Raises:
        InputError: files that are no PDDL, or ask for more: numeric fluents, durations, axioms, preferences.
        MissingDependencyError: unified-planning is not installed.
    """
    texts = [given if isinstance(given, str) and "(" in given else _text(Path(given)) for given in (domain, problem)]
    return from_unified_planning(_parsed(*texts))


def to_unified_planning(problem: Problem) -> Any:
    """A problem as one of unified-planning, by way of `to_pddl`.

    Raises MissingDependencyError: unified-planning is not installed; InputError: see `to_pddl`.
    """
    task = to_pddl(problem)
    return _parsed(task.domain, task.problem)


def from_unified_planning(given: Any) -> Problem:
    """A classical problem of unified-planning. Raises InputError: it asks for more than `from_pddl` takes."""
    return _Reader(given).problem()


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"Expected a PDDL file at {path}; got: {error}.") from None


def _parsed(domain: str, problem: str) -> Any:
    try:
        from unified_planning.exceptions import UPException
        from unified_planning.io import PDDLReader
    except ImportError:
        raise MissingDependencyError(
            "Expected unified-planning, which reads PDDL; it is not installed. pip install 'neurosym-assembly[pddl]'."
        ) from None
    try:
        return PDDLReader().parse_problem_string(domain, problem)
    except Exception as error:  # its grammar raises those of its parser, too
        kind = "" if isinstance(error, UPException) else f"{type(error).__name__}: "
        raise InputError(f"Expected two texts in PDDL, a domain and its problem; got {kind}{error}") from None


class _Reader:
    def __init__(self, given: Any) -> None:
        self.given = given
        self.types: dict[Any, Type] = {}
        for kind in given.user_types:
            self._type(kind)
        booleans = [f for f in given.fluents if f.type.is_bool_type()]
        numbers = [f for f in given.fluents if f.type.is_int_type() or f.type.is_real_type()]
        if len(booleans) + len(numbers) < len(given.fluents):
            raise _beyond("fluents that are neither true nor false")
        self.fluents: dict[str, Predicate] = {f.name: Fluent(f.name, *self._signature(f)) for f in booleans}
        self.functions = {f.name: Function(f.name, *self._signature(f)) for f in numbers}
        for what, there in {
            "trajectory constraints": getattr(given, "trajectory_constraints", ()),
            "timed goals and effects": [*getattr(given, "timed_goals", ()), *getattr(given, "timed_effects", ())],
            "axioms": getattr(given, "axioms", ()),
        }.items():
            if there:
                raise _beyond(what)
        self.costs = self._costs()

    def problem(self) -> Problem:
        given = self.given
        name = re.sub(r"\s+", "-", given.name or "problem")
        domain = Domain(name, fluents=self._all_fluents(), actions=[self._action(a) for a in given.actions])
        objects: dict[Type, list[str]] = {kind: [] for kind in self.types.values()}
        for each in given.all_objects:
            objects[self._type(each.type)].append(each.name)
        init, values = [], {}
        defaults = [value for value in given.fluents_defaults.values() if value is not None]
        mostly_false = all(value.is_bool_constant() and value.is_false() for value in defaults)
        explicit = given.explicit_initial_values if mostly_false else given.initial_values
        for fact, value in explicit.items():
            if fact.fluent().name in self.functions:
                values[self._value(fact, {})] = float(value.constant_value())
            elif value.is_true():
                init.append(self._atom(fact, {}))
        goal = [self._condition(g, {}) for g in given.goals]
        return domain.problem(objects=objects, init=init, goal=goal, values=values, name=name, reachable=False)

    def _all_fluents(self) -> list[Fluent]:
        return [f for f in self.fluents.values() if isinstance(f, Fluent)]

    def _type(self, kind: Any) -> Type:
        if kind not in self.types:
            self.types[kind] = Type(kind.name, None if kind.father is None else self._type(kind.father))
        return self.types[kind]

    def _signature(self, fluent: Any) -> list[Type]:
        return [self._type(p.type) for p in fluent.signature]

    def _costs(self) -> Any:
        """Action -> its cost, if plans are to be cheap."""
        metrics = list(self.given.quality_metrics)
        kinds = {type(m).__name__ for m in metrics}
        if kinds - {"MinimizeActionCosts", "MinimizeSequencePlanLength"}:
            raise _beyond("a metric other than the sum of what actions cost")
        priced = [m for m in metrics if hasattr(m, "get_action_cost")]
        return priced[0].get_action_cost if priced else None

    def _action(self, action: Any) -> Action:
        if not hasattr(action, "preconditions"):
            raise _beyond("durations")
        names = [re.sub(r"\W", "_", p.name) for p in action.parameters]
        if len(set(names)) < len(names) or any(not name.isidentifier() for name in names):
            names = [f"p{k}" for k in range(len(names))]
        params = [self._type(p.type)(name) for p, name in zip(action.parameters, names)]
        scope = {p.name: variable for p, variable in zip(action.parameters, params)}
        pre = [self._condition(c, scope) for c in action.preconditions]
        eff = [self._effect(e, scope) for e in action.effects]
        cost = None
        if self.costs is not None:
            expression = self.costs(action)
            cost = 0.0 if expression is None else self._cost(expression, scope)
        return Action(action.name, *params, pre=pre, eff=eff, cost=cost)

    def _cost(self, expression: Any, scope: Mapping[str, Variable]) -> Cost:
        if expression.is_constant():
            return float(expression.constant_value())
        if expression.is_fluent_exp():
            return self._value(expression, scope)
        raise _beyond(f"the cost {expression}, which is neither a number nor a function of objects")

    def _effect(self, effect: Any, scope: Mapping[str, Variable]) -> Effect:
        bound = [self._type(v.type)(v.name) for v in effect.forall]
        inner = {**scope, **{v.name: own for v, own in zip(effect.forall, bound)}}
        if not effect.is_assignment() or not effect.value.is_bool_constant():
            raise _beyond(f"the effect {effect}, which makes a fluent neither true nor false")
        atom = self._atom(effect.fluent, inner)
        literal: Condition = atom if effect.value.is_true() else ~atom
        made = when(self._condition(effect.condition, inner), literal) if effect.is_conditional() else literal
        return forall(*bound, made) if bound else made

    def _condition(self, node: Any, scope: Mapping[str, Variable]) -> Condition:
        if node.is_fluent_exp():
            return self._atom(node, scope)
        if node.is_bool_constant():
            return And(()) if node.is_true() else Or(())
        if node.is_exists() or node.is_forall():
            bound = [self._type(v.type)(v.name) for v in node.variables()]
            inner = {**scope, **{v.name: own for v, own in zip(node.variables(), bound)}}
            body = self._condition(node.arg(0), inner)
            return (forall if node.is_forall() else exists)(*bound, body)
        if node.is_equals():
            left, right = (self._term(arg, scope) for arg in node.args)
            return Equality(left, right)
        parts = tuple(self._condition(arg, scope) for arg in node.args)
        if node.is_not():
            return ~parts[0]
        if node.is_and() or node.is_or():
            return And(parts) if node.is_and() else Or(parts)
        if node.is_implies():
            return implies(*parts)
        if node.is_iff():
            return implies(*parts) & implies(*parts[::-1])
        raise _beyond(f"the condition {node}")

    def _atom(self, node: Any, scope: Mapping[str, Variable]) -> Atom:
        name = node.fluent().name
        if name not in self.fluents:
            raise _beyond(f"the numeric fluent {name}")
        return self.fluents[name](*(self._term(arg, scope) for arg in node.args))

    def _value(self, node: Any, scope: Mapping[str, Variable]) -> Value:
        return self.functions[node.fluent().name](*(self._term(arg, scope) for arg in node.args))

    def _term(self, node: Any, scope: Mapping[str, Variable]) -> Term:
        if node.is_object_exp():
            name: str = node.object().name
            return name
        if node.is_parameter_exp() or node.is_variable_exp():
            return scope[(node.parameter() if node.is_parameter_exp() else node.variable()).name]
        raise _beyond(f"the term {node}")


def _beyond(what: str) -> InputError:
    return InputError(
        f"Expected classical planning (STRIPS, types, formulas, conditional effects, action costs); got {what}. "
        "Numeric fluents, durations, axioms and preferences are not part of this language."
    )
