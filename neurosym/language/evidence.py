"""Whether a condition holds, and what decided it: verdicts of atoms joined through and, or and quantifiers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from neurosym.errors import ContractError, InputError
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.conditions import And, Condition, Or
from neurosym.language.search_problem import Verdict
from neurosym.language.terms import Atom, Derived, Literal


class Refused(NamedTuple):
    """A derived predicate, or a condition with some in it, that does not allow an action.

    `positive`: whether it had to hold; a condition always has to.
    """

    named: str
    positive: bool
    verdict: Verdict

    @property
    def sentence(self) -> str:
        """Why."""
        return self.verdict.reason or f"{self.named} {'does not hold' if self.positive else 'holds'}."


def decide(condition: Condition, ask: Callable[[Literal], Verdict]) -> Verdict:
    """The verdict of an expanded condition; `ask` gives that of a literal.

    Of an `And` the first part that does not hold decides; of an `Or` that does not hold all parts do, and what all of
    them promise is promised.
    """
    if isinstance(condition, Literal):
        return ask(condition)
    assert isinstance(condition, And | Or)
    motion: StepMotion | None = None
    refused: list[Verdict] = []
    for part in sorted(condition.parts, key=asks_world):
        verdict = decide(part, ask)
        if verdict.holds is isinstance(condition, Or):
            return verdict
        refused.append(verdict)
        if verdict.motion is not None:
            motion = verdict.motion if motion is None else motion.joined(verdict.motion)
    if isinstance(condition, And):
        return Verdict(True, motion=motion)
    return Verdict(
        False,
        tuple(dict.fromkeys(name for verdict in refused for name in verdict.because)),
        " ".join(dict.fromkeys(verdict.reason for verdict in refused if verdict.reason)) or "Nothing makes it hold.",
        _joined([verdict.until for verdict in refused]),
        unconditional=all(verdict.unconditional for verdict in refused),
        proved=all(verdict.proved for verdict in refused),
        decided_by=_joined([v.until if v.decided_by is None and v.unconditional else v.decided_by for v in refused]),
    )


def of_literal(literal: Literal, holds: bool) -> Verdict:
    """The verdict of a fluent, or of its negation."""
    if holds:
        return Verdict(True)
    atom = literal.atom
    return Verdict(False, tuple(map(str, atom.args)), f"{literal} is not true.", (atom,), unconditional=True)


def of_derived(literal: Literal, verdict: Verdict) -> Verdict:
    """The verdict of a literal of a derived predicate, from that of its atom."""
    if literal.positive:
        return verdict if verdict.motion is None else replace(verdict, motion=as_motion(literal.atom, verdict.motion))
    # A promise speaks of a verdict that stays false; it says nothing of one that must become false.
    return Verdict(not verdict.holds, verdict.because, verdict.reason if verdict.holds else "")


def asks_world(condition: Condition) -> bool:
    """Whether a derived predicate is in it."""
    return any(isinstance(literal.atom.predicate, Derived) for literal in condition.literals())


def as_motion(atom: Atom | Derived, given: Any) -> StepMotion:
    """What a predicate says of how parts move; a direction will do."""
    try:
        return given if isinstance(given, StepMotion) else StepMotion.along((), given)
    except InputError:
        raise ContractError(
            f"Expected the derived predicate {atom} to answer with a StepMotion as motion, or with a direction of "
            f"three numbers; got {given!r}."
        ) from None


def _joined(promises: Sequence[tuple[Atom, ...] | None]) -> tuple[Atom, ...] | None:
    atoms: dict[Atom, None] = {}
    for promise in promises:
        if promise is None:
            return None
        atoms.update(dict.fromkeys(promise))
    return tuple(atoms)
