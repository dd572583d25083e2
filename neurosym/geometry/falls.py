"""Which parts fall without which: everything that gravity says about a task of removal, as a finite list.

Equilibrium is a linear program, so whether a set of parts stands follows no formula of bounded size. Only the sets that
removals can lead to matter, though, and a fall is local: the parts that move in it do so as long as all of them are
there and those that would resist are not, whatever else is there or not.
"""

from __future__ import annotations

import functools
import random
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from neurosym.geometry.blocking import bits

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly


@dataclass(frozen=True)
class Fall:
    """In every set of parts that holds all of `moving` and none of `gone`, the moving ones fall.

    Attributes:
        moving, gone: bitsets of parts, disjoint. What is gone touches what moves.
    """

    moving: int
    gone: int

    def happens(self, there: int) -> bool:
        """Whether the parts in a bitset fall so."""
        return not self.moving & ~there and not self.gone & there


@dataclass(frozen=True)
class Falls:
    """What was found.

    Attributes:
        falls: none implies another.
        complete: whether every set that removals can lead to, and that does not stand, has one of them. False: the
            time ended first; each of them is true, but there may be more.
        sets: connected sets of parts looked at.
    """

    falls: tuple[Fall, ...]
    complete: bool
    sets: int


def find_falls(
    assembly: Assembly,
    initial: int,
    moves: Mapping[int, Sequence[int]],
    *,
    held: int = 0,
    seconds: float | None = None,
) -> Falls:
    """The falls that a task of removal can meet, each removal leaving only what stands.

    Movable parts that do not touch one another stand or fall by themselves. So it is connected sets that are looked at,
    not states: each removal splits one of them, and independent stacks add up where their states would multiply. Parts
    elsewhere are taken as gone when it comes to who is in the way; this reaches too many sets, never too few.

    Args:
        initial: bitset of the parts that are there at first.
        moves: number of a part -> for each way out a bitset of parts that must be gone before. Others never leave.
        held: how many parts may be held; with any, sets do not stand by themselves, and whole states are looked at.
        seconds: when to stop.
    """
    end = None if seconds is None else time.monotonic() + seconds
    search = _Search(assembly, initial, held)
    order = random.Random(0)
    first = search.split(search.loose)
    waiting, seen = list(first), set(first)
    while waiting:
        if end is not None and time.monotonic() > end:
            return Falls(search.least(), False, len(seen) - len(waiting))
        group = waiting.pop()
        # What falls is never left behind; but what falls at first may be taken apart so that the rest stands.
        if not search.stands(group) and group not in first:
            continue
        parts = bits(group)
        order.shuffle(parts)
        for part in parts:
            rest = group & ~(1 << part)
            if any(not way & rest for way in moves.get(part, ())):
                found = [g for g in search.split(rest) if g not in seen]
                seen.update(found)
                waiting += found
    return Falls(search.least(), True, len(seen))


class _Search:
    """The falls found so far, and the questions that find more."""

    def __init__(self, assembly: Assembly, initial: int, held: int) -> None:
        self.stability = assembly.stability()
        self.initial, self.held = initial, held
        self.fixed = assembly.fixed_mask & initial
        self.loose = initial & ~self.fixed
        self.falls: list[Fall] = []

    def split(self, parts: int) -> list[int]:
        """Bitsets of the parts that hang together by contacts."""
        if self.held:
            return [parts] if parts else []
        groups = []
        while parts:
            group = fresh = parts & -parts
            while fresh:
                fresh = self._touching(fresh) & parts & ~group
                group |= fresh
            groups.append(group)
            parts &= ~group
        return groups

    def stands(self, group: int) -> bool:
        """Whether a group stands, with the fixed parts; if not, a fall of it is known from now on."""
        there = group | self.fixed
        if any(fall.happens(there) for fall in self.falls):
            return False
        answer = self.stability.standing_when_held(there, self.held)
        if not answer.stands:
            self.falls.append(self._least(answer.moving, there))
        return answer.stands

    def learn(self, state: int) -> bool:
        """Whether a set of parts falls in a way not known before; it is known from now on."""
        known = len(self.falls)
        for group in self.split(state & self.loose):
            self.stands(group)
        return len(self.falls) > known

    def least(self) -> tuple[Fall, ...]:
        """The falls that no other one implies."""
        return tuple(
            f
            for i, f in enumerate(self.falls)
            if not any(
                not g.moving & ~f.moving and not g.gone & ~f.gone and (g != f or k < i)
                for k, g in enumerate(self.falls)
                if k != i
            )
        )

    def _least(self, moving: int, there: int) -> Fall:
        """A fall with little gone: what does not resist may as well be there. All others are taken as immovable."""
        gone = self._around(moving) & ~there & self.initial
        if not self.held:
            for part in bits(gone):
                if not gone >> part & 1:
                    continue
                around = self._around(moving) & self.initial & ~(gone & ~(1 << part))
                answer = self.stability.standing(moving | around, around)
                if not answer.stands:
                    moving = answer.moving
                    gone &= ~(1 << part) & self._around(moving)
        return Fall(moving, gone)

    def _around(self, parts: int) -> int:
        return self._touching(parts) & ~parts

    def _touching(self, parts: int) -> int:
        return functools.reduce(int.__or__, (self.stability.touching[p] for p in bits(parts)), 0)
