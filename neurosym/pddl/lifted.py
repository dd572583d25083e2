"""A problem without geometry as PDDL with parameters, formulas, conditional effects and costs, as it was written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from neurosym.errors import InputError
from neurosym.language.actions import Action, ConditionalEffect
from neurosym.language.conditions import And, Condition, Equality, Or, Quantified
from neurosym.language.costs import Cost, Value
from neurosym.language.problem import Problem
from neurosym.language.terms import Atom, Derived, Literal, Predicate, Term, Type, Variable
from neurosym.pddl.export import PddlTask, as_pddl, types_of
from neurosym.pddl.facts import Names


def to_pddl(problem: Problem) -> PddlTask:
    """A problem in PDDL: as it was written where symbols say all of it, else ground, with what geometry found.

    Raises InputError: see `as_pddl`.
    """
    conditions = [*problem.goal, *problem.goal_conditions]
    literals = [x for a in problem.domain.actions for _, x in a.every_literal()] + [
        x for c in conditions for x in c.literals()
    ]
    if problem.before or any(isinstance(x.atom.predicate, Derived) for x in literals):
        return as_pddl(problem)
    if problem.ground() is not problem.symbols:
        raise InputError(f"Expected a problem whose rules are its symbols, to write it as PDDL; got {problem!r}.")
    return _Writer(problem).task()


class _Writer:
    def __init__(self, problem: Problem) -> None:
        self.given, names = problem, Names()
        self.title = names.fresh(problem.domain.name)
        self.instance = names.fresh(problem.name)
        self.types = {kind: names.fresh(kind.name) for kind in types_of(problem)}
        self.objects = {name: names.fresh(name) for name in problem.type_of}
        self.predicates: dict[Predicate, str] = {f: names.fresh(f.name) for f in problem.domain.fluents}
        self.functions: dict[Predicate, str] = {}
        for value in problem.values:
            if value.function not in self.functions:
                self.functions[value.function] = names.fresh(value.function.name)
        self.actions = {action: names.fresh(action.name) for action in problem.domain.actions}
        ground = problem.symbols
        meanings = [(i, name, m) for i, name in enumerate(ground.actions) if (m := problem.meant_by(name))]
        told = {action for i, _, (action, _) in meanings if ground.remembered >> i & 1}
        #: Of actions that can be done once though no fluent says so: the predicate that says it.
        self.unused = {action: names.fresh(f"unused {action.name}") for action in self.actions if action in told}
        self.ground = {
            " ".join([self.actions[action], *(self.objects[b] for b in binding.values())]): name
            for _, name, (action, binding) in meanings
        }

    def task(self) -> PddlTask:
        notes = ("Exact: the plans are those of the problem.",)
        return PddlTask("\n".join(self._domain()) + "\n", "\n".join(self._problem()) + "\n", self.ground, True, notes)

    def _domain(self) -> Iterator[str]:
        costs = " :action-costs" if self.given.domain.has_costs else ""
        yield f"(define (domain {self.title})"
        yield f"  (:requirements :strips :typing :adl{costs})"
        parents = [(name, self.types[kind.parent] if kind.parent else "object") for kind, name in self.types.items()]
        yield from _section("types", [f"{name} - {parent}" for name, parent in parents])
        typed = [f"{name} - {self.types[self.given.type_of[own]]}" for own, name in self.objects.items()]
        yield from _section("constants", typed)
        yield "  (:predicates"
        yield from (f"    ({self._signature(name, p.types)})" for p, name in self.predicates.items())
        yield from (f"    ({self._signature(n, [p.type for p in a.params])})" for a, n in self.unused.items())
        yield "  )"
        if costs:
            yield "  (:functions (total-cost) - number"
            yield from (f"    ({self._signature(name, p.types)}) - number" for p, name in self.functions.items())
            yield "  )"
        for action in self.given.domain.actions:
            yield from self._action(action)
        yield ")"

    def _signature(self, name: str, types: Iterable[Type]) -> str:
        return " ".join([name, *(f"?x{k} - {self.types[kind]}" for k, kind in enumerate(types))])

    def _action(self, action: Action) -> Iterator[str]:
        names = {p.name: f"?x{k}" for k, p in enumerate(action.params)}
        pre = [self._condition(c, names) for c in (*action.pre, *action.conditions)]
        eff = [self._condition(e, names) for e in action.eff]
        eff += [self._conditional(e, names) for e in action.conditional]
        if action in self.unused:
            marked = f"({' '.join([self.unused[action], *names.values()])})"
            pre, eff = [*pre, marked], [*eff, f"(not {marked})"]
        if action.cost is not None:
            eff.append(f"(increase (total-cost) {self._cost(action.cost, names)})")
        yield f"  (:action {self.actions[action]}"
        yield f"    :parameters ({' '.join(f'{names[p.name]} - {self.types[p.type]}' for p in action.params)})"
        yield f"    :precondition (and {' '.join(pre)})"
        yield f"    :effect (and {' '.join(eff)}))"

    def _problem(self) -> Iterator[str]:
        problem, names = self.given, dict[str, str]()
        yield f"(define (problem {self.instance})"
        yield f"  (:domain {self.title})"
        yield "  (:init"
        yield from (f"    {self._atom(atom, names)}" for atom in problem.init)
        for action, unused in self.unused.items():
            for binding in problem.bindings(action):
                yield f"    ({' '.join([unused, *(self.objects[o] for o in binding.values())])})"
        if problem.domain.has_costs:
            yield "    (= (total-cost) 0)"
            yield from (f"    (= {self._cost(v, names)} {_number(n)})" for v, n in problem.values.items())
        yield "  )"
        goal = " ".join(self._condition(c, names) for c in (*problem.goal, *problem.goal_conditions))
        yield f"  (:goal (and {goal}))"
        if problem.domain.has_costs:
            yield "  (:metric minimize (total-cost))"
        yield ")"

    def _cost(self, cost: Cost, names: Mapping[str, str]) -> str:
        if isinstance(cost, Value):
            return f"({' '.join([self.functions[cost.function], *(self._term(a, names) for a in cost.args)])})"
        return _number(cost)

    def _conditional(self, effect: ConditionalEffect, names: Mapping[str, str]) -> str:
        inner, bound = self._bound(effect.bound, names)
        text = self._condition(effect.effect, inner)
        if effect.condition != And(()):
            text = f"(when {self._condition(effect.condition, inner)} {text})"
        return f"(forall ({bound}) {text})" if bound else text

    def _bound(self, variables: Iterable[Variable], names: Mapping[str, str]) -> tuple[dict[str, str], str]:
        inner = dict(names)
        for variable in variables:
            inner[variable.name] = f"?x{len(inner)}-{len(names)}"
        return inner, " ".join(f"{inner[v.name]} - {self.types[v.type]}" for v in variables)

    def _condition(self, condition: Condition, names: Mapping[str, str]) -> str:
        if isinstance(condition, Literal):
            text = self._atom(condition.atom, names)
            return text if condition.positive else f"(not {text})"
        if isinstance(condition, Atom):
            return self._atom(condition, names)
        if isinstance(condition, Equality):
            text = f"(= {self._term(condition.left, names)} {self._term(condition.right, names)})"
            return text if condition.positive else f"(not {text})"
        if isinstance(condition, Quantified):
            inner, bound = self._bound(condition.bound, names)
            assert isinstance(condition.body, Condition)
            word = "forall" if condition.universal else "exists"
            return f"({word} ({bound}) {self._condition(condition.body, inner)})"
        assert isinstance(condition, And | Or)
        word = "and" if isinstance(condition, And) else "or"
        return f"({' '.join([word, *(self._condition(part, names) for part in condition.parts)])})"

    def _atom(self, atom: Atom, names: Mapping[str, str]) -> str:
        return f"({' '.join([self.predicates[atom.predicate], *(self._term(a, names) for a in atom.args)])})"

    def _term(self, term: Term, names: Mapping[str, str]) -> str:
        return self.objects[term] if isinstance(term, str) else names[term.name]


def _section(name: str, lines: list[str]) -> Iterator[str]:
    if lines:
        yield f"  (:{name}"
        yield from (f"    {line}" for line in lines)
        yield "  )"


def _number(number: float) -> str:
    return str(int(number)) if number == int(number) else repr(number)
