"""Conditions and effects over states as bitsets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from neurosym.language.conditions import And, Condition, Or
from neurosym.language.terms import Atom, Derived, Literal

#: Whether a condition holds in a state.
Test = Callable[[int], bool]

#: From so many actions on, candidates are looked for with numpy.
_MANY = 100


def tested(condition: Condition, bits: Mapping[Atom, int]) -> Test:
    """The test of an expanded condition; derived predicates are taken to hold, and not to hold, as it needs."""
    if isinstance(condition, Literal):
        condition = And((condition,))
    assert isinstance(condition, And | Or)
    pos = neg = 0
    rest: list[Test] = []
    for part in condition.parts:
        if not isinstance(part, Literal):
            rest.append(tested(part, bits))
        elif isinstance(part.atom.predicate, Derived):
            if isinstance(condition, Or):
                return lambda state: True
        elif part.positive:
            pos |= 1 << bits[part.atom]
        else:
            neg |= 1 << bits[part.atom]
    if isinstance(condition, And):
        return lambda state: (state & pos) == pos and not state & neg and all(test(state) for test in rest)
    return lambda state: bool(state & pos or ~state & neg) or any(test(state) for test in rest)


class Effects:
    """What an action makes true and false: always, and (test, add, delete) where a test holds before it."""

    __slots__ = ("add", "conditional", "delete")

    def __init__(self, add: int, delete: int, conditional: Sequence[tuple[Test, int, int]]) -> None:
        self.add, self.delete, self.conditional = add, delete, conditional

    def after(self, state: int) -> int:
        """The state after it; what is made true and false at once is true."""
        if not self.conditional:
            return (state & ~self.delete) | self.add
        add, delete = self.add, self.delete
        for test, more, less in self.conditional:
            if test(state):
                add |= more
                delete |= less
        return (state & ~delete) | add


class Candidates:
    """Which actions are applicable: bitsets that must be set, or clear, and further tests, by numbers of actions."""

    def __init__(self, pos: Sequence[int], neg: Sequence[int], tests: Mapping[int, Sequence[Test]]) -> None:
        self.pos, self.neg, self.tests = pos, neg, tests
        self._bytes = (max((mask.bit_length() for mask in (*pos, *neg)), default=0) + 63) // 64 * 8

    @cached_property
    def _tables(self) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
        rows = [b"".join(mask.to_bytes(self._bytes, "little") for mask in masks) for masks in (self.pos, self.neg)]
        pos, neg = (np.frombuffer(row, dtype=np.uint64).reshape(len(self.pos), -1) for row in rows)
        return pos.T.copy(), neg.T.copy()

    def of(self, state: int) -> list[int]:
        """The applicable actions, by number."""
        if len(self.pos) < _MANY or not self._bytes:
            masks = zip(self.pos, self.neg)
            found = [i for i, (pos, neg) in enumerate(masks) if (state & pos) == pos and not state & neg]
        else:
            pos, neg = self._tables
            known = (state & ((1 << 8 * self._bytes) - 1)).to_bytes(self._bytes, "little")
            words = np.frombuffer(known, dtype=np.uint64)
            lacking = (pos & ~words[:, None]) | (neg & words[:, None])
            found = np.flatnonzero(~lacking.any(axis=0)).tolist()
        if self.tests:
            found = [i for i in found if all(test(state) for test in self.tests.get(i, ()))]
        return found

    def has(self, state: int, action: int) -> bool:
        """Whether one action is applicable."""
        pos = self.pos[action]
        applicable = (state & pos) == pos and not state & self.neg[action]
        return applicable and all(test(state) for test in self.tests.get(action, ()))
