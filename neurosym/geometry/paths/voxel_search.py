"""Taking voxel puzzles apart by translating groups of parts: exact, complete, and with the least number of moves.

A state is the offset of each part of a block, in whole cells. A move translates a group of parts together, by one or
more cells along one axis, with the other parts at rest; a group pushed over several cells in one direction is one
move, as in BurrTools. The breadth-first search over moves ends where a group can leave the others without end, so the
level (moves to the first separation, the leaving move included) is the true minimum. Which groups can move is in
`voxel_groups`, how far in `voxel_gaps`. Rotations are not searched.

Why nothing is lost by whole cells. Take any motion of the parts by translations, fractional, slanting, all parts at
once. Add a constant phase in [0, 1) to each axis and round all offsets down: two cells that are at least 1 apart along
some axis stay so, hence no overlap appears. For almost every phase the rounded motion changes at each moment along one
axis and in one direction only (the free configurations form a polyhedral complex, so a motion may be taken piecewise
linear, and crossings coincide for a finite number of phases unless parts travel together), and what changes then is a
group that moves one cell. So when the search ends without a separation, no motion by translations separates anything.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from neurosym.errors import InputError
from neurosym.geometry.paths.grid import GridCells
from neurosym.geometry.paths.voxel_gaps import UNITS, Gaps, Meeting, State
from neurosym.geometry.paths.voxel_groups import ENDLESS, closures, undriving, unions
from neurosym.geometry.paths.voxel_separation import DIRECTIONS, Move, Offset, Separation, Stuck
from neurosym.support.bitsets import bits
from neurosym.support.deadline import check
from neurosym.support.progress import tell

#: Up to so many parts, pairs and closures are looked at one by one, which is quicker than arrays are.
FEW = 24


def first_separation(
    cells: GridCells,
    among: int,
    *,
    fixed: int = 0,
    ground: float | None = None,
    start: dict[int, Offset] | None = None,
    accept: Callable[[int], bool] | None = None,
    max_states: int = 200_000,
    seconds: float | None = None,
) -> Separation | Stuck:
    """The first separation of a block of parts, with as few moves as can be.

    Of the groups that can leave after the same number of moves, the smallest leaves; of two halves, the smaller.

    Args:
        among: a bitset: the parts of the block, two or more.
        fixed: a bitset of parts that never move. They count as one, and never leave.
        ground: height (z, world) of a plane that no part goes through. Parts that nothing fixes can be lifted all
            together, so it matters only where there are fixed parts.
        start: offsets of parts that are not in their assembled places.
        accept: which groups are wanted; a group that leaves is the smallest that holds one of its parts. Other
            groups may make way, but stay by the block: states in which a plane with room about it divides the parts
            are left aside. That can be many states: give `max_states`.
        max_states, seconds: how many states may be visited, and for how long; where time ends a search, another run
            may go farther.

    Raises:
        InputError: fewer than two parts to tell apart, or parts too far from one another.
    """
    return _Search(cells, among, fixed & among, ground, start or {}, accept).run(max_states, seconds)


class _Search:
    """One search; parts are renumbered from 0, the reference (a part, or all fixed ones) is number 0."""

    def __init__(
        self,
        cells: GridCells,
        among: int,
        fixed: int,
        ground: float | None,
        start: dict[int, Offset],
        accept: Callable[[int], bool] | None,
    ) -> None:
        loose = bits(among & ~fixed)
        self.masks = ([fixed] if fixed else []) + [1 << p for p in loose]
        if len(self.masks) < 2:
            raise InputError(f"Expected two or more parts to separate; got {cells_said(cells, among)}.")
        self.cells, self.among, self.fixed, self.accept = cells, among, fixed, accept
        self.start = {p: start.get(p, (0, 0, 0)) for p in bits(among)}
        self.count = len(self.masks)
        self.all = (1 << self.count) - 1
        self.few = self.count <= FEW
        self.ground = ground if fixed else None
        self.gaps = Gaps(cells, self.masks, self.start, self.ground, self.few)

    def run(self, max_states: int, seconds: float | None) -> Separation | Stuck:
        """Layer by layer, until a group can leave, all states were visited, or a limit ends it."""
        begin = (0,) * self.count
        deadline = None if seconds is None else time.monotonic() + seconds
        came: dict[State, tuple[State, int, int, int] | None] = {begin: None}
        layer = [begin]
        while layer:
            # A whole layer is asked before it is expanded, so that the smallest group of the least level leaves.
            met = []
            best: tuple[int, int, State, int, int] | None = None
            for number, state in enumerate(layer):
                check()
                tell("moves of groups", number, len(layer))
                if deadline is not None and number % 64 == 0 and time.monotonic() > deadline:
                    return Stuck(False, len(came), self.among)
                met.append(self.gaps.meetings(state))
                for d, group in self._leaving(met[-1]):
                    outside = self._parts(group)
                    if best is None or (outside.bit_count(), outside) < best[:2]:
                        best = (outside.bit_count(), outside, state, d, group)
            if best is not None:
                return self._separation(came, best[2], best[3], best[4])
            following = []
            for state, ahead in zip(layer, met):
                for d, steps, group in self._moves(ahead):
                    unit = UNITS[d] * steps
                    reached = tuple(at + unit if group >> i & 1 else at for i, at in enumerate(state))
                    if reached in came or (self.accept is not None and self.gaps.are_divided(reached)):
                        continue
                    if len(came) >= max_states:
                        return Stuck(False, len(came), self.among)
                    came[reached] = (state, d, steps, group)
                    following.append(reached)
                if deadline is not None and time.monotonic() > deadline:
                    return Stuck(False, len(came), self.among)
            layer = following
        return Stuck(self._is_proof(), len(came), self.among)

    def _is_proof(self) -> bool:
        """Rounding keeps parts above a plane only where the plane is one of the grid's."""
        return self.ground is None or any(abs(abs(self.cells.frame[2, k]) - 1) < 1e-6 for k in range(3))

    def _leaving(self, ahead: list[list[Meeting]]) -> Iterator[tuple[int, int]]:
        """(direction, group) for the smallest groups that can leave; all of them move relative to fixed parts."""
        reference = 1 if self.fixed else 0
        for d in range(6):
            if self.few or self.accept is not None:
                groups = closures(ahead[d], self.count, ENDLESS, reference)
            else:
                groups = undriving(ahead[d], self.count, reference)
            for group in groups:
                if group != self.all and (self.accept is None or self.accept(self._parts(group))):
                    yield d, group

    def _moves(self, ahead: list[list[Meeting]]) -> Iterator[tuple[int, int, int]]:
        """(direction, steps, group) for all moves: unions of closures."""
        for d in range(6):
            # What can go farther than any finite gap can leave. Where other groups are wanted, it may only make way.
            farthest = max((gap for gap, _, _ in ahead[d]), default=0)
            check()
            for steps in range(1, 1 + (farthest if self.accept is None else self.gaps.across)):
                groups = unions(closures(ahead[d], self.count, steps, 1))
                if not groups:
                    break
                for group in groups:
                    yield d, steps, group

    def _parts(self, group: int) -> int:
        return sum(self.masks[i] for i in bits(group))

    def _separation(
        self,
        came: dict[State, tuple[State, int, int, int] | None],
        state: State,
        direction: int,
        group: int,
    ) -> Separation:
        leaving = self._parts(group)
        moves = [Move(leaving, DIRECTIONS[direction], None)]
        step = came[state]
        while step is not None:
            state, d, steps, moved = step
            parts = self._parts(moved)
            # The other half moving the other way is the same move: the one with fewer parts is easier to do.
            if not self.fixed and 2 * parts.bit_count() > self.among.bit_count():
                parts, d = self.among & ~parts, d ^ 1
            moves.append(Move(parts, DIRECTIONS[d], steps))
            step = came[state]
        return Separation(tuple(reversed(moves)), leaving, self.among & ~leaving, self.start, len(came))


def cells_said(cells: GridCells, mask: int) -> str:
    """The names of the parts in a bitset, for messages."""
    return ", ".join(cells.names[p] for p in bits(mask)) or "none"
