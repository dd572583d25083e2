"""Plans without steps that they do not need."""

from __future__ import annotations

from collections.abc import Sequence

from neurosym.errors import InputError
from neurosym.language.problem import Problem
from neurosym.language.search_problem import SearchProblem, Step
from neurosym.planning.result import Plan
from neurosym.planning.validation import validate


def without_needless(problem: Problem, order: Sequence[str]) -> Plan:
    """The plan less the steps without which it still reaches the goal.

    Each step in turn is left out with all those after it that can then not be done (a tool that is put down though it
    was not picked up); if the goal is reached all the same, they stay out. The number of questions is quadratic in the
    length. Nakhost and Mueller, "Action elimination and plan neighborhood graph search", ICAPS 2010.

    Raises InputError: `order` is no plan of the problem.
    """
    given = validate(problem, order)
    if not given.ok:
        raise InputError(f"Expected a plan of {problem.name!r}; got an order that is none: {given.reason}")
    search: SearchProblem[object] = problem.ground()
    number = {name: i for i, name in enumerate(search.actions)}
    best, at = [number[name] for name in order], 0
    while at < len(best):
        shorter = _applicable(search, best[:at], best[at + 1 :])
        if shorter is None:
            at += 1
        else:
            best = shorter
    plan = [search.actions[action] for action in best]
    motions, state = [], search.initial
    for action in best:
        step = search.attempt(state, action)
        assert isinstance(step, Step)  # it was asked before
        motions.append(step.motion)
        state = step.state
    return Plan(plan, motions)


def _applicable(search: SearchProblem[object], first: Sequence[int], then: Sequence[int]) -> list[int] | None:
    """The first actions, and of the others all that can be done after them; None: that misses the goal."""
    state, kept = search.initial, list[int]()
    for position, action in enumerate((*first, *then)):
        step = search.attempt(state, action) if action in search.candidates(state) else None
        if isinstance(step, Step):
            state = step.state
            kept.append(action)
        elif position < len(first):
            return None
    return kept if search.is_goal(state) else None
