"""Conditions read off all reachable states, for predicates that have no formula."""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from neurosym.errors import InputError
from neurosym.language.problem import Problem
from neurosym.language.search_problem import Rejection
from neurosym.language.terms import Atom, Derived, Literal
from neurosym.support.arrays import Truths

#: More states than this are not written down.
MAX_STATES = 20_000


@dataclass(frozen=True)
class Table:
    """Action primitive -> conjunctions (`ways`), and how many `states` were looked at.

    In a reachable state in which its fluents allow it, the action can be done exactly when one of them holds. Actions
    that can never be done are left out.
    """

    ways: Mapping[str, tuple[frozenset[Literal], ...]]
    states: int


def ways_from_table(problem: Problem, seconds: float | None = None) -> Table:
    """Look at every reachable state, and at every answer there.

    Raises InputError: more than `MAX_STATES`, no time left, or a refusal that proves nothing.
    """
    end = None if seconds is None else time.monotonic() + seconds
    ground = problem.symbols
    numbers: dict[Atom, int] = {}
    yes: dict[int, set[int]] = {}
    no: dict[int, set[int]] = {}
    first = ground.initial, 0
    waiting, seen = [first], {first}
    while waiting:
        if len(seen) > MAX_STATES or (end is not None and time.monotonic() > end):
            raise InputError(
                f"Expected to write {problem.name!r} as PDDL: {len(seen):,} states were reached and there are more, "
                f"and its predicates ({', '.join(_silent(problem))}) can be written as facts only by looking at each. "
                "Ask for straight paths, or take a smaller problem."
            )
        state, used = waiting.pop()
        for action in ground.candidates(state):
            if used >> action & 1:
                continue
            answer = ground.attempt(state, action)
            if isinstance(answer, Rejection):
                if not answer.proved:
                    raise InputError(
                        f"Expected answers that are certain, to write {problem.name!r} as PDDL; got: {answer.reason} "
                        "A search for a path that ended without one proves nothing. Ask for straight paths."
                    )
                no.setdefault(action, set()).add(state)
                continue
            yes.setdefault(action, set()).add(state)
            after = answer.state, used | (1 << action & ground.remembered)
            if after not in seen:
                seen.add(after)
                waiting.append(after)
    states = sorted({s for s, _ in seen})
    for state in states:
        for atom in ground.atoms(state):
            numbers.setdefault(atom, len(numbers))
    rows = np.zeros((len(states), len(numbers)), dtype=bool)
    row = {state: k for k, state in enumerate(states)}
    for state, k in row.items():
        rows[k, [numbers[a] for a in ground.atoms(state)]] = True
    atoms = list(numbers)
    ways = {}
    for action, good in yes.items():
        bad = rows[[row[s] for s in sorted(no.get(action, ()))]]
        cover = _cover(rows[[row[s] for s in sorted(good)]], bad)
        ways[ground.actions[action]] = tuple(frozenset(Literal(atoms[c], is_so) for c, is_so in way) for way in cover)
    return Table(ways, len(states))


def _cover(good: Truths, bad: Truths) -> list[list[tuple[int, bool]]]:
    """Conjunctions of (column, value) that hold in each row of `good`, (n, c), one of them at least; none in `bad`."""
    left, found = good, []
    while len(left):
        state = left[0]
        differs = bad != state
        chosen: list[int] = []
        while len(differs):
            best = int(differs.sum(axis=0).argmax())
            chosen.append(best)
            differs = differs[~differs[:, best]]
        found.append([(c, bool(state[c])) for c in sorted(chosen)])
        left = left[(left[:, chosen] != state[chosen]).any(axis=1)] if chosen else left[:0]
    return found


def _silent(problem: Problem) -> list[str]:
    conditions = (p for a in problem.domain.actions for p in a.pre)
    return sorted({str(p.atom.predicate) for p in conditions if isinstance(p.atom.predicate, Derived)})
