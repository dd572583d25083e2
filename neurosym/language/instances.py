"""Ground actions before they have bits: which there are, and which some sequence of actions may reach."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

from neurosym.errors import DefinitionError, UnknownNameError
from neurosym.language.terms import Atom, Derived, Fluent, Literal

if TYPE_CHECKING:
    from neurosym.language.problem import Problem


class Instance:
    """A ground action before it has bits."""

    def __init__(self, name: str, pre: Sequence[Literal], eff: Sequence[Literal]) -> None:
        self.name = name
        self.fluents = [p for p in pre if not isinstance(p.atom.predicate, Derived)]
        self.derived = [p for p in pre if isinstance(p.atom.predicate, Derived)]
        self.eff = eff


def instantiate(problem: Problem) -> tuple[list[Instance], list[str]]:
    """The ground actions whose static fluents hold, and the names of all of them."""
    changed = {e.atom.predicate for a in problem.domain.actions for e in a.eff}
    initial = set(problem.init)
    instances: list[Instance] = []
    seen: dict[str, str] = {}
    for action in problem.domain.actions:
        for binding in problem.bindings(action):
            name = action.ground_name(binding)
            if name in seen:
                raise DefinitionError(
                    f"In problem {problem.name!r}: two ground actions are called {name!r} "
                    f"({seen[name]} and {action.name} {binding}); give the action a label over all its parameters."
                )
            seen[name] = f"{action.name} {binding}"
            pre = [p.bind(binding) for p in action.pre]
            static = [p for p in pre if isinstance(p.atom.predicate, Fluent) and p.atom.predicate not in changed]
            if all((p.atom in initial) is p.positive for p in static):
                pre = [p for p in pre if p not in static]
                instances.append(Instance(name, pre, [e.bind(binding) for e in action.eff]))
    return instances, list(seen)


def reachable_instances(initial: set[Atom], instances: Sequence[Instance]) -> list[Instance]:
    """Instances that some sequence of actions may reach, when nothing that was ever true or false is lost."""
    true = set(initial)
    untrue_possible = {e.atom for i in instances for e in i.eff if not e.positive}
    waiting, found = list(instances), []
    while True:
        now = [
            i
            for i in waiting
            if all(
                p.atom in true if p.positive else p.atom not in initial or p.atom in untrue_possible for p in i.fluents
            )
        ]
        if not now:
            break
        found.extend(now)
        taken = set(map(id, now))
        waiting = [i for i in waiting if id(i) not in taken]
        for i in now:
            true.update(e.atom for e in i.eff if e.positive)
    order = {id(i): k for k, i in enumerate(instances)}
    return sorted(found, key=lambda i: order[id(i)])


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
