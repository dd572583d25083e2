"""A problem from its goal: the state in which all is done is where it starts, and each action in turn is undone.

It can be had where every action must be done and changes what no other one changes, so that one state alone reaches the
goal, and a state says which actions were done. Removals are of this kind: from the fixed parts alone part after part is
put back, and a part may be put back exactly where it could be removed from what is there then. A state from which
nothing more can be undone ends that branch, so what cannot be built up is refuted where little is there yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from neurosym.language.evidence import Refused
from neurosym.language.grounding import GroundProblem
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.language.state import BitState
from neurosym.language.terms import Derived


def reversed_problem(problem: SearchProblem[Any]) -> SearchProblem[Any] | None:
    """The problem from its goal, where it can be searched from there; else None."""
    if isinstance(problem, GroundProblem):
        changes = effects_once(problem)
        return None if changes is None else ReversedProblem(problem, changes)
    reverse = getattr(problem, "reversed", None)
    return None if reverse is None else reverse()


def effects_once(ground: GroundProblem) -> tuple[int, ...] | None:
    """What each action changes, a bitset each; None where the problem cannot be reversed.

    It can where no two actions change the same, all are asked for by the goal, which asks for nothing derived, and
    none are stated to be interchangeable. Nor may an action be done again.
    """
    if ground.repeating or ground.has_conditional_effects:
        return None
    changes = tuple((ground.initial ^ ground.apply(ground.initial, a)) for a in range(len(ground.actions)))
    final, seen = ground.initial, 0
    for change in changes:
        if change & seen or not change & ground.asked:
            return None
        seen |= change
        final ^= change
    alone = not ground.problem.interchangeable
    return changes if alone and ground.asks_fluents_only and ground.is_goal(final) else None


class ReversedProblem:
    """The `SearchProblem` from the goal of another one: `attempt` undoes an action, and says how it is done.

    Args:
        changes: see `effects_once`.
    """

    def __init__(self, ground: GroundProblem, changes: Sequence[int]) -> None:
        self.ground, self._changes = ground, changes
        self.actions, self.classes = ground.actions, ground.classes
        self.initial = ground.initial
        for change in changes:
            self.initial ^= change
        #: What all actions ask of the state in which they end: only the first state of the problem may lack it.
        everywhere = [{p.after for p in ground.derived_of(a) if p.after} for a in range(len(self.actions))]
        self._of_states: tuple[Derived, ...] = tuple(set.intersection(*everywhere)) if everywhere else ()
        self._deciding: dict[tuple[object, ...], tuple[int, ...]] = {}

    def is_goal(self, state: int) -> bool:
        """Whether nothing is done yet."""
        return state == self.ground.initial

    def candidates(self, state: int) -> list[int]:
        """Indices of the actions that were done, and whose fluents allow them in the state before."""
        done = state ^ self.ground.initial
        ground = self.ground
        return [a for a, c in enumerate(self._changes) if c & done and ground.is_applicable(state ^ c, a)]

    def apply(self, state: int, action: int) -> int:
        """The state before `action`, no question asked."""
        return state ^ self._changes[action]

    def attempt(self, state: int, action: int) -> Step[int] | Rejection:
        """Ask whether `action` may lead to `state`, and whether any other one may lead to the state before it."""
        before = self.apply(state, action)
        refused, motion = self.ground.ask(before, action)
        if refused is None:
            refused = self._unreachable(before)
        return Step(before, motion) if refused is None else self._rejection(before, action, refused)

    def _unreachable(self, state: int) -> Refused | None:
        """What no action that ends in `state` is allowed for."""
        if state != self.ground.initial:
            view = BitState(self.ground, state)
            for predicate in self._of_states:
                verdict = self.ground.judge(predicate, view)
                if not verdict.holds:
                    return Refused(f"{predicate}()", True, verdict)
        return None

    def _rejection(self, before: int, action: int, refused: Refused) -> Rejection:
        verdict, phrase = refused.verdict, refused.sentence
        atoms = verdict.decided_by
        if atoms is None and verdict.unconditional:
            atoms = verdict.until
        if not verdict.proved or not refused.positive or atoms is None:
            return Rejection(phrase, verdict.because, proved=verdict.proved)
        deciding = self._deciding.get(atoms)
        if deciding is None:
            touching = {a for atom in atoms for a in self.ground.touching(atom)}
            deciding = self._deciding[atoms] = tuple(sorted(touching))
        # Each atom changes with one action: those of what is undone already stay as they are.
        done = before ^ self.ground.initial
        others = [a for a in deciding if a != action]
        until = tuple(a for a in others if self._changes[a] & done)
        given = tuple(a for a in others if not self._changes[a] & done)
        return Rejection(phrase, verdict.because, until or (action,), unconditional=True, given=given)
