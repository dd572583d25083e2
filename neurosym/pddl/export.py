"""PDDL: a problem, with what the geometry found written out, for any classical planner.

The files ask for ``:strips`` and ``:typing`` only: no negative, disjunctive or conditional anything. Every order of
actions that is a plan of the problem is one of the PDDL, and, as long as `PddlTask.sound`, the other way round: the
planner's plan, read back by `PddlTask.order`, passes `neurosym.validate`, and what the planner proves unsolvable is. A
sequence of PDDL actions is not one to one an order, for a part that can leave in two ways has two actions.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from neurosym.errors import InputError, UnknownNameError
from neurosym.language.problem import Problem
from neurosym.language.terms import Type
from neurosym.pddl.facts import Fact, Mark, Names, Strips
from neurosym.pddl.strips import strips
from neurosym.support.files import write_text

#: Time for what has to be searched: the falls under gravity, or the states of a domain without formulas (seconds).
SECONDS = 60.0


@dataclass(frozen=True)
class PddlTask:
    """A problem in PDDL.

    Attributes:
        domain, problem: the texts of the two files.
        actions: name of a PDDL action -> name of the action primitive; None for one that is only a note.
        sound: whether each plan of the PDDL is one of the problem. False where the time ended before all falls under
            gravity were found: then it should be replayed (`neurosym.validate`).
        notes: sentences on what was written, and how it was found.
    """

    domain: str
    problem: str
    actions: Mapping[str, str | None]
    sound: bool
    notes: tuple[str, ...]

    def order(self, plan: str | Iterable[str]) -> tuple[str, ...]:
        """Names of action primitives, from a planner's plan: names of PDDL actions, or a plan file's text.

        Raises UnknownNameError: a name that is no action of the domain file.
        """
        lines = plan.splitlines() if isinstance(plan, str) else plan
        names = (line.partition(";")[0].strip().strip("()").strip().lower() for line in lines)
        order = []
        for name in filter(None, names):
            if name not in self.actions:
                raise UnknownNameError("PDDL action", name, self.actions)
            action = self.actions[name]
            if action is not None:
                order.append(action)
        return tuple(order)

    def write(self, directory: str | Path) -> tuple[Path, Path]:
        """Write ``domain.pddl`` and ``problem.pddl``, each whole or not at all."""
        folder = Path(directory)
        files = folder / "domain.pddl", folder / "problem.pddl"
        for file, text in zip(files, (self.domain, self.problem)):
            write_text(file, text)
        return files


def write_pddl(problem: Problem, directory: str | Path, *, seconds: float | None = SECONDS) -> tuple[Path, Path]:
    """Write a problem as ``domain.pddl`` and ``problem.pddl``; see `as_pddl`."""
    return as_pddl(problem, seconds=seconds).write(directory)


def as_pddl(problem: Problem, *, seconds: float | None = SECONDS, refuted: Sequence[Sequence[str]] = ()) -> PddlTask:
    """A problem in PDDL.

    Args:
        seconds: for what has to be searched. When it ends before all falls under gravity were found, the task is not
            sound; when it ends before all states of a domain without formulas were seen, there is no task.
        refuted: orders that `neurosym.validate` refused for what falls in them, of a task that is not sound. In the new
            task none of them is a plan: solve, replay and write again, until the replay agrees.

    Raises:
        InputError: a problem with rules of its own (groups), or one that is no finite list of facts of bearable length.
    """
    if problem.ground() is not problem.symbols:
        raise InputError(
            f"Expected a problem whose actions change fluents, to write it as PDDL; {problem.name!r} has rules of its "
            "own (groups of parts that leave together). Ask for single parts."
        )
    return _Writer(problem, strips(problem, seconds=seconds, refuted=refuted)).task()


class _Writer:
    def __init__(self, problem: Problem, compiled: Strips) -> None:
        self.given, self.compiled = problem, compiled
        self.names = Names()
        self.title = self.names.fresh(problem.domain.name)
        self.types = {kind: self.names.fresh(kind.name) for kind in types_of(problem)}
        self.objects = {name: self.names.fresh(name) for name in problem.type_of}
        self.predicates: dict[tuple[str, bool] | Mark, str] = {}
        self.typed: dict[str, tuple[Type, ...]] = {}
        for fact in compiled.facts:
            if isinstance(fact, Mark):
                self.predicates[fact] = self.names.fresh(f"{fact.kind} {fact.label}")
                self.typed[self.predicates[fact]] = ()
                continue
            predicate = fact.atom.predicate
            key = predicate.name, fact.positive
            if key not in self.predicates:
                name = self.names.fresh(predicate.name if fact.positive else f"not {predicate.name}")
                self.predicates[key], self.typed[name] = name, predicate.types
        self.actions: dict[str, str | None] = {}

    def task(self) -> PddlTask:
        domain = "\n".join(self._domain()) + "\n"
        return PddlTask(domain, "\n".join(self._problem()) + "\n", self.actions, self.compiled.sound, self._notes())

    def _notes(self) -> tuple[str, ...]:
        if self.compiled.sound:
            scope = "Exact: an order of removal is a plan here exactly when it is one for neurosym."
        else:
            scope = "Not all falls are known: every valid order is a plan here, but replay what a planner finds."
        return (*self.compiled.notes, scope if self.compiled.operators else "No action can ever be done.")

    def _domain(self) -> Iterator[str]:
        yield f"; {json.dumps(self.given.name)}, written by neurosym."
        yield from (f"; {note}" for note in self._notes())
        renamed = [(old, new) for old, new in self.objects.items() if old != new]
        if renamed:
            yield "; Names that PDDL does not allow:"
            yield from (f";   {new} is {json.dumps(old)}" for old, new in renamed)
        yield f"(define (domain {self.title})"
        yield "  (:requirements :strips :typing)"
        yield "  (:types"
        for kind, name in self.types.items():
            yield f"    {name} - {self.types[kind.parent] if kind.parent else 'object'}"
        yield "  )"
        yield "  (:constants"
        yield from (f"    {self.objects[o]} - {self.types[kind]}" for o, kind in self.given.type_of.items())
        yield "  )"
        yield "  (:predicates"
        for name, kinds in self.typed.items():
            yield f"    ({' '.join([name, *(f'?x{k} - {self.types[kind]}' for k, kind in enumerate(kinds))])})"
        yield "  )"
        for operator in self.compiled.operators:
            name = self.names.fresh(" ".join(filter(None, (operator.name, operator.how))))
            self.actions[name] = operator.action
            what = "a note" if operator.action is None else json.dumps(operator.action)
            yield f"  (:action {name} ; {' '.join(filter(None, (what, operator.how)))}"
            yield "    :parameters ()"
            yield f"    :precondition {self._and(operator.pre)}"
            removed = [f"(not {f})" for f in self._sorted(operator.delete)]
            yield f"    :effect (and {' '.join([*self._sorted(operator.add), *removed])}))"
        yield ")"

    def _problem(self) -> Iterator[str]:
        yield f"; {json.dumps(self.given.name)}, written by neurosym. See the domain's file for what it says."
        yield f"(define (problem {self.names.fresh(self.given.name)})"
        yield f"  (:domain {self.title})"
        yield "  (:init"
        yield from (f"    {fact}" for fact in self._sorted(self.compiled.init))
        yield "  )"
        yield f"  (:goal {self._and(self.compiled.goal)})"
        yield ")"

    def _and(self, facts: Iterable[Fact]) -> str:
        return f"(and {' '.join(self._sorted(facts))})"

    def _sorted(self, facts: Iterable[Fact]) -> list[str]:
        return sorted(map(self._fact, facts))

    def _fact(self, fact: Fact) -> str:
        if isinstance(fact, Mark):
            return f"({self.predicates[fact]})"
        name = self.predicates[fact.atom.predicate.name, fact.positive]
        return f"({' '.join([name, *(self.objects[str(a)] for a in fact.atom.args)])})"


def types_of(problem: Problem) -> list[Type]:
    """All types, parents first."""
    types: dict[Type, None] = {}

    def add(kind: Type) -> None:
        if kind.parent is not None:
            add(kind.parent)
        types[kind] = None

    params = (p.type for action in problem.domain.actions for p in action.params)
    for kind in (*problem.objects, *(k for f in problem.domain.fluents for k in f.types), *params):
        add(kind)
    return list(types)


__all__ = ["PddlTask", "as_pddl", "types_of", "write_pddl"]
