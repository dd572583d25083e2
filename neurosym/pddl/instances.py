"""Ground actions on their way to operators: in which ways each can be done.

A way is a conjunction of facts. Ways follow from what `Derived.formula` says, or, where it is silent, from a walk
through all reachable states (`pddl_table`).
"""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from neurosym.language.formulas import AnyOf, Formula
from neurosym.language.problem import Problem
from neurosym.language.terms import Atom, Derived, Literal
from neurosym.pddl.facts import Fact, Mark
from neurosym.pddl.table import ways_from_table

T = TypeVar("T")


@dataclass
class Instance:
    """A ground action.

    Attributes:
        title: the action and its objects, in words.
        needs: its preconditions that are fluents.
        derived: its other preconditions.
        add, delete: its effects.
        ways: (in words, conditions): it can be done exactly when all conditions of one of them hold.
        marks: what it adds besides.
        once: whether it can be used once only.
    """

    name: str
    title: str
    needs: frozenset[Literal]
    derived: list[Literal]
    add: frozenset[Atom]
    delete: frozenset[Atom]
    ways: list[tuple[str, frozenset[Fact]]] = field(default_factory=list)
    marks: set[Mark] = field(default_factory=set)
    once: bool = False


def ground_instances(problem: Problem) -> list[Instance]:
    """The ground actions that are among the problem's action primitives, without ways."""
    reachable, found = set(problem.actions), []
    for action in problem.domain.actions:
        for binding in problem.bindings(action):
            name = action.ground_name(binding)
            if name not in reachable:
                continue
            pre = [p.bind(binding) for p in action.pre]
            eff = [e.bind(binding) for e in action.eff]
            found.append(
                Instance(
                    name,
                    " ".join([action.name, *(binding[p.name] for p in action.params)]),
                    frozenset(p for p in pre if not isinstance(p.atom.predicate, Derived)),
                    [p for p in pre if isinstance(p.atom.predicate, Derived)],
                    frozenset(e.atom for e in eff if e.positive),
                    frozenset(e.atom for e in eff if not e.positive),
                    once=action.once,
                )
            )
    return found


def formulas_of(problem: Problem, instance: Instance) -> list[Formula] | None:
    """What its derived preconditions say; None where one is silent."""
    formulas = []
    for literal in instance.derived:
        predicate = literal.atom.predicate
        assert isinstance(predicate, Derived)
        of = predicate.formula
        formula = of(problem.predicate_world, *literal.atom.args) if of and literal.positive else None
        if formula is None:
            return None
        formulas.append(formula)
    return formulas


def with_formulas(
    problem: Problem, instances: Sequence[Instance], formulas: Sequence[Sequence[Formula] | None]
) -> list[Instance]:
    """The instances with their ways, as formulas tell them; those without any are left out."""
    for instance, own in zip(instances, formulas):
        instance.ways = [("", frozenset(instance.needs))]
        for formula in own or ():
            if isinstance(formula, AnyOf):
                instance.ways = least(
                    (" ".join(filter(None, (name, way.name))), known | frozenset(way.literals))
                    for (name, known), way in itertools.product(instance.ways, formula.ways)
                )
    return _settle(problem, instances)


def with_table(problem: Problem, instances: Sequence[Instance], seconds: float | None) -> tuple[list[Instance], str]:
    """The instances with their ways, read off all reachable states, and a sentence on it."""
    silent = {str(p.atom.predicate) for i in instances for p in i.derived}
    table = ways_from_table(problem, seconds)
    for instance in instances:
        instance.ways = [("", instance.needs | way) for way in table.ways.get(instance.name, ())]
    note = f"Conditions ({', '.join(sorted(silent))}) were read off all {table.states:,} reachable states."
    return _settle(problem, [i for i in instances if i.ways]), note


def _settle(problem: Problem, instances: Sequence[Instance]) -> list[Instance]:
    """Ways without what is always true, or ever false; instances without a way are dropped, which may settle more."""
    initial, left, count = frozenset(problem.init), list(instances), -1
    while count != len(left):
        count = len(left)
        settled = _settled(left, initial)
        for instance in left:
            instance.ways = least(
                (name, frozenset(p for p in way if not (isinstance(p, Literal) and settled.get(p))))
                for name, way in instance.ways
                if not any(isinstance(p, Literal) and (settled.get(p) is False or ~p in way) for p in way)
            )
        left = [i for i in left if i.ways]
    return left


def _settled(instances: Sequence[Instance], initial: frozenset[Atom]) -> dict[Literal, bool]:
    """Literals that are true, or false, in every state."""
    made = {a for i in instances for a in i.add}
    unmade = {a for i in instances for a in i.delete}
    named = {p.atom for i in instances for _, way in i.ways for p in way if isinstance(p, Literal)}
    settled = {}
    for atom in named | {p.atom for i in instances for p in i.needs}:
        now = atom in initial
        if atom not in (unmade if now else made):
            settled[Literal(atom)], settled[~atom] = now, not now
    return settled


def least(ways: Iterable[tuple[T, frozenset[Fact]]]) -> list[tuple[T, frozenset[Fact]]]:
    """The ways without those that ask for all that another one asks for; of equal ones the first is kept, in order."""
    given = list(ways)
    kept: list[int] = []
    for k in sorted(range(len(given)), key=lambda k: (len(given[k][1]), k)):
        if not any(given[j][1] <= given[k][1] for j in kept):
            kept.append(k)
    return [given[k] for k in sorted(kept)]
