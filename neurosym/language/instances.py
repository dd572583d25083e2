"""Ground actions before they have bits: which there are, and which some sequence of actions may reach."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

from neurosym.errors import DefinitionError, UnknownNameError
from neurosym.language.conditions import FALSE, TRUE, And, Condition, Equality, Or
from neurosym.language.costs import cost_of
from neurosym.language.terms import Atom, Derived, Fluent, Literal, Predicate, Variable, bound

if TYPE_CHECKING:
    from neurosym.language.actions import Action
    from neurosym.language.problem import Problem

#: More ground actions than this are refused: the definition wants a static fluent that narrows its parameters.
MAX_GROUND_ACTIONS = 1_000_000


class Instance:
    """A ground action before it has bits: literals (`fluents`, `derived`), other `conditions`, and effects."""

    def __init__(self, action: Action, binding: Mapping[str, str], name: str, pre: Condition, problem: Problem) -> None:
        self.name, self.once = name, action.once
        parts = pre.parts if isinstance(pre, And) else (pre,)
        literals = [p for p in parts if isinstance(p, Literal)]
        self.fluents = [p for p in literals if not isinstance(p.atom.predicate, Derived)]
        self.derived = [p for p in literals if isinstance(p.atom.predicate, Derived)]
        self.conditions = [p for p in parts if not isinstance(p, Literal)]
        self.eff = [e.bind(binding) for e in action.eff]
        self.conditional = [
            pair for each in action.conditional for pair in each.ground(binding, problem.objects_of)
        ]
        place = f"problem {problem.name!r}, {name}"
        self.cost = 0.0 if action.cost is None else cost_of(action.cost, binding, problem.values, place)

    def effects(self) -> Iterator[Literal]:
        """All effects, conditional or not."""
        yield from self.eff
        yield from (effect for _, effect in self.conditional)

    def mentioned(self) -> Iterator[Literal]:
        """Every literal of a fluent in it."""
        yield from self.fluents
        yield from self.effects()
        for condition in (*self.conditions, *(c for c, _ in self.conditional)):
            yield from (p for p in condition.literals() if not isinstance(p.atom.predicate, Derived))


def instantiate(problem: Problem) -> list[Instance]:
    """The ground actions whose static fluents hold, in the order of the objects."""
    changed = {e.atom.predicate for a in problem.domain.actions for e in a.changed()}
    initial = set(problem.init)
    facts: dict[Predicate, set[tuple[object, ...]]] = {}
    for atom in initial:
        facts.setdefault(atom.predicate, set()).add(atom.args)

    def known(literal: Literal) -> bool | None:
        predicate = literal.atom.predicate
        static = isinstance(predicate, Fluent) and predicate not in changed
        return (literal.atom in initial) is literal.positive if static else None

    instances: list[Instance] = []
    seen: dict[str, str] = {}
    for action in problem.domain.actions:
        static = [p for p in action.pre if isinstance(p.atom.predicate, Fluent) and p.atom.predicate not in changed]
        rest = tuple(p for p in action.pre if p not in static)
        for binding in _bindings(problem, action, static, facts):
            name = action.ground_name(binding)
            if name in seen:
                raise DefinitionError(
                    f"In problem {problem.name!r}: two ground actions are called {name!r} "
                    f"({seen[name]} and {action.name} {binding}); give the action a label over all its parameters."
                )
            seen[name] = f"{action.name} {binding}"
            pre: Condition = And(tuple([p.bind(binding) for p in rest]))
            if action.conditions:
                whole = And((pre, *(c.bind(binding) for c in action.conditions)))
                pre = simplified(whole.expanded(problem.objects_of), known)
            if pre is FALSE:
                continue
            instances.append(Instance(action, binding, name, pre, problem))
            if action.conditional:
                made = instances[-1]
                settled = [(simplified(c, known), e) for c, e in made.conditional]
                made.eff += [e for c, e in settled if c is TRUE]
                made.conditional = [(c, e) for c, e in settled if c is not TRUE and c is not FALSE]
        if len(instances) > MAX_GROUND_ACTIONS:
            raise DefinitionError(
                f"In problem {problem.name!r}, action {action.name!r}: more than {MAX_GROUND_ACTIONS:,} ground "
                "actions. Give its parameters narrower types, or a fluent that no action changes and few objects have."
            )
    return instances


def _bindings(
    problem: Problem,
    action: Action,
    static: Sequence[Literal],
    facts: Mapping[Predicate, set[tuple[object, ...]]],
) -> Iterator[dict[str, str]]:
    """Ways to fill the parameters, each left as soon as what does not change, or an equality, rules it out."""
    level = {param.name: number for number, param in enumerate(action.params)}

    def last(variables: Iterable[Variable]) -> int:
        return max((level[v.name] for v in variables), default=-1)

    checks: list[list[Callable[[dict[str, str]], bool]]] = [[] for _ in range(len(action.params) + 1)]
    for literal in static:
        there = facts.get(literal.atom.predicate, set())
        checks[last(literal.variables()) + 1].append(
            lambda binding, args=literal.atom.args, there=there, sign=literal.positive: (  # type: ignore[misc]
                (bound(args, binding) in there) is sign
            )
        )
    for condition in action.conditions:
        if isinstance(condition, Equality):
            checks[last(condition.variables()) + 1].append(lambda b, c=condition: bool(c.bind(b)))  # type: ignore[misc]
    options = [problem.objects_of(param.type) for param in action.params]

    def extend(number: int, binding: dict[str, str]) -> Iterator[dict[str, str]]:
        if all(check(binding) for check in checks[number]):
            if number == len(options):
                yield binding
                return
            name = action.params[number].name
            for choice in options[number]:
                yield from extend(number + 1, {**binding, name: choice})

    return extend(0, {})


def simplified(condition: Condition, known: Callable[[Literal], bool | None]) -> Condition:
    """An expanded condition without the literals whose truth is known."""
    if isinstance(condition, Literal):
        truth = known(condition)
        return condition if truth is None else TRUE if truth else FALSE
    assert isinstance(condition, And | Or)
    parts = tuple(simplified(part, known) for part in condition.parts)
    return type(condition)(parts).expanded(lambda _: ())


def possible(condition: Condition, literal_is: Callable[[Literal], bool]) -> bool:
    """Whether an expanded condition may hold, when each of its literals is looked at by itself."""
    if isinstance(condition, Literal):
        return literal_is(condition)
    assert isinstance(condition, And | Or)
    found = (possible(part, literal_is) for part in condition.parts)
    return all(found) if isinstance(condition, And) else any(found)


class Reachability:
    """What some sequence of actions may reach when nothing that was ever true or false is lost.

    Derived predicates are taken as possible.
    """

    def __init__(self, initial: set[Atom], instances: Sequence[Instance]) -> None:
        self.initial, self.true = initial, set(initial)
        self.untrue = {e.atom for i in instances for e in i.effects() if not e.positive}
        waiting, reached = list(instances), set[int]()
        while now := [i for i in waiting if self._applicable(i)]:
            reached |= set(map(id, now))
            waiting = [i for i in waiting if id(i) not in reached]
            self.true.update(e.atom for i in now for e in i.effects() if e.positive)
        self.instances = [i for i in instances if id(i) in reached]
        self.untrue = {e.atom for i in self.instances for e in i.effects() if not e.positive}

    def _applicable(self, instance: Instance) -> bool:
        conditions = (*instance.fluents, *instance.conditions)
        return all(possible(condition, self.may_hold) for condition in conditions)

    def may_hold(self, literal: Literal) -> bool:
        atom = literal.atom
        if isinstance(atom.predicate, Derived):
            return True
        return atom in self.true if literal.positive else atom not in self.initial or atom in self.untrue


def all_names(problem: Problem) -> list[str]:
    """The names of all ground actions that types allow."""
    return [a.ground_name(binding) for a in problem.domain.actions for binding in problem.bindings(a)]


def check_precedence(before: Sequence[tuple[str, str]], names: Iterable[str], place: str) -> None:
    """Refuse precedence over unknown actions, and precedence in a circle (which is named)."""
    known = set(names)
    predecessors: dict[str, set[str]] = {}
    for i, (a, b) in enumerate(before):
        for action in (a, b):
            if action not in known:
                raise DefinitionError(f"In {place}, before[{i}]: {UnknownNameError('action', action, known)}")
        predecessors.setdefault(b, set()).add(a)
    try:
        TopologicalSorter(predecessors).prepare()
    except CycleError as error:
        circle = " before ".join(error.args[1])
        raise DefinitionError(f"In {place}: precedence in a circle, so no order can obey it: {circle}.") from None
