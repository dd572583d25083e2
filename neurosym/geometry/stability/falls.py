"""Which parts fall without which: everything that gravity says about a task of removal, as a finite list.

Equilibrium is a linear program, so whether a set of parts stands follows no formula of bounded size. Only the sets that
removals can lead to matter, though, and a fall is local: the parts that move in it do so as long as all of them are
there and those that would resist are not, whatever else is there or not.
"""

from __future__ import annotations

import functools
import itertools
import random
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from neurosym.geometry.stability.standing import Stability
from neurosym.support.bitsets import bits

#: So many random removals in a row that met nothing new end the search for what falls.
QUIET = 40

#: Of so many lost neighbours, at the most, single parts are asked.
MOST_GONE = 2


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
        sets: connected sets of parts looked at one after the other.
    """

    falls: tuple[Fall, ...]
    complete: bool
    sets: int


def find_falls(
    stability: Stability,
    initial: int,
    moves: Mapping[int, Sequence[int]],
    *,
    held: int = 0,
    refuted: Iterable[Sequence[int]] = (),
    seconds: float | None = None,
) -> Falls:
    """The falls that a task of removal can meet, each removal leaving only what stands.

    Movable parts that do not touch one another stand or fall by themselves. So it is connected sets that are looked at,
    not states: each removal splits one of them, and independent stacks add up where their states would multiply. Parts
    elsewhere are taken as gone when it comes to who is in the way; this reaches too many sets, never too few.

    Where half the time does not do for all sets, the other half goes to what an order is likeliest to meet: falls of
    single parts, which are few questions, and random removals.

    Args:
        stability: of the assembly.
        initial: bitset of the parts that are there at first.
        moves: number of a part -> for each way out a bitset of parts that must be gone before. Others never leave.
        held: how many parts may be held; with any, sets do not stand by themselves, and whole states are looked at.
        refuted: orders of parts in which something falls; what it is will be among the falls.
        seconds: when to stop.
    """
    start = time.monotonic()
    search = _Search(stability, initial, held, moves)
    if search.exhaust(None if seconds is None else start + seconds / 2):
        return Falls(search.least(), True, search.sets)
    for order in refuted:
        there = initial
        for part in order:
            there &= ~(1 << part)
            search.learn(there)
    assert seconds is not None
    end = start + seconds
    search.look_at_single_parts(end)
    rng = random.Random(0)
    quiet = 0
    while quiet < QUIET and time.monotonic() < end:
        quiet = 0 if search.walk(rng, end) else quiet + 1
    return Falls(search.least(), False, search.sets)


class _Search:
    """The falls found so far, and the questions that find more."""

    def __init__(self, stability: Stability, initial: int, held: int, moves: Mapping[int, Sequence[int]]) -> None:
        self.moves, self.stability = moves, stability
        self.initial, self.held = initial, held
        self.fixed = stability.assembly.fixed_mask & initial
        self.loose = initial & ~self.fixed
        self.falls: list[Fall] = []
        self.stood: set[int] = set()
        self.sets = 0

    def exhaust(self, end: float | None) -> bool:
        """Look at every connected set that removals can lead to; whether there was time for all."""
        order = random.Random(0)
        first = self.split(self.loose)
        waiting, seen = list(first), set(first)
        while waiting:
            if end is not None and time.monotonic() > end:
                return False
            group = waiting.pop()
            self.sets += 1
            # What falls is never left behind; but what falls at first may be taken apart so that the rest stands.
            if not self.stands(group) and group not in first:
                continue
            parts = self.free(group)
            order.shuffle(parts)
            for part in parts:
                found = [g for g in self.split(group & ~(1 << part)) if g not in seen]
                seen.update(found)
                waiting += found
        return True

    def look_at_single_parts(self, end: float) -> None:
        """Find which neighbours each part cannot lose, all others being immovable, the fewest first."""
        if self.held:
            return
        for part in bits(self.loose):
            around = self._around(1 << part) & self.initial
            near = [p for p in bits(around) if p in self.moves]
            for count in range(min(len(near), MOST_GONE) + 1):
                for some in itertools.combinations(near, count):
                    if time.monotonic() > end:
                        return
                    gone = sum(1 << p for p in some)
                    there = around & ~gone
                    known = any(f.happens(there | 1 << part) for f in self.falls if f.moving == 1 << part)
                    if not known and not self.stability.standing(there | 1 << part, there).stands:
                        self.falls.append(Fall(1 << part, gone))

    def walk(self, rng: random.Random, end: float) -> bool:
        """Take out one part after the other as chance has it; whether a fall was met that was not known."""
        there, known = self.loose, len(self.falls)
        while time.monotonic() < end:
            rest = [there & ~(1 << p) for p in self.free(there)]
            rest = [r for r in rest if not any(f.happens(r | self.fixed) for f in self.falls)]
            if not rest:
                break
            choice = rng.choice(rest)
            if not self.learn(choice):
                there = choice
        return len(self.falls) > known

    def free(self, there: int) -> list[int]:
        """Numbers of the parts that nothing among those in a bitset keeps."""
        return [p for p in bits(there) if any(not way & there for way in self.moves.get(p, ()))]

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
        if group in self.stood:
            return True
        if any(fall.happens(there) for fall in self.falls):
            return False
        answer = self.stability.standing_when_held(there, self.held)
        if not answer.stands:
            self.falls.append(self._least(answer.moving, there))
        else:
            self.stood.add(group)
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
