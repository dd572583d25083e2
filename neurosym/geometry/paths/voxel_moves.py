"""Taking voxel puzzles apart by translating groups of parts: exact, complete, and with the least number of moves.

A state is the offset of each part of a block, in whole cells. A move translates a group of parts together, by one or
more cells along one axis, with the other parts at rest; a group pushed over several cells in one direction is one
move, as in BurrTools. The breadth-first search over moves ends where a group can leave the others without end, so the
level (moves to the first separation, the leaving move included) is the true minimum.

When it ends without one, no motion by translations separates anything (`voxel_search` says why). Which groups can move
is in `voxel_groups`, how far in `voxel_gaps`. Rotations are not searched.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from neurosym.geometry.paths.grid import GridCells
from neurosym.geometry.paths.voxel_search import Search
from neurosym.geometry.paths.voxel_separation import DIRECTIONS as DIRECTIONS
from neurosym.geometry.paths.voxel_separation import Move as Move
from neurosym.geometry.paths.voxel_separation import Offset as Offset
from neurosym.geometry.paths.voxel_separation import Separation as Separation
from neurosym.geometry.paths.voxel_separation import Stuck as Stuck
from neurosym.geometry.paths.voxel_separation import separation_path as separation_path


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
        max_states: how many states may be visited.
        seconds: how long it may take; None: however long. Where this ends a search, another run may go farther.

    Raises:
        InputError: fewer than two parts to tell apart, or parts too far from one another.
    """
    return Search(cells, among, fixed & among, ground, start or {}, accept).run(max_states, seconds)


@dataclass(frozen=True)
class Disassembly:
    """What taking a block apart came to.

    Attributes:
        steps: the separations, in order; parts stay displaced from one to the next, as they do in one's hands.
        stuck: the first sub-assembly that does not come apart; None: all parts are single.
    """

    steps: tuple[Separation, ...]
    stuck: Stuck | None

    @property
    def levels(self) -> tuple[int, ...]:
        """The moves of each separation; BurrTools writes them 5.1.2 and calls the first one the level."""
        return tuple(step.level for step in self.steps)


def take_apart(
    cells: GridCells,
    among: int,
    *,
    fixed: int = 0,
    ground: float | None = None,
    max_states: int = 200_000,
    seconds: float | None = None,
) -> Disassembly:
    """Separate a block, then both halves, until every part is single (fixed parts count as one).

    Nothing is lost by taking the first separation that comes: what takes the whole apart takes every subset apart,
    and moves can be undone. So where a sub-assembly is stuck for good, the whole is. Arguments as above;
    `max_states` holds for each separation, `seconds` for the whole.
    """
    deadline = None if seconds is None else time.monotonic() + seconds
    steps: list[Separation] = []
    blocks: list[tuple[int, dict[int, Offset]]] = [(among, {})]
    while blocks:
        block, start = blocks.pop()
        if (block & ~fixed).bit_count() + bool(block & fixed) < 2:
            continue
        left = None if deadline is None else max(deadline - time.monotonic(), 0.0)
        found = first_separation(
            cells, block, fixed=fixed, ground=ground, start=start, max_states=max_states, seconds=left
        )
        if isinstance(found, Stuck):
            return Disassembly(tuple(steps), found)
        steps.append(found)
        offsets = found.offsets
        halves = (found.group, found.rest)
        blocks.extend((half, {p: o for p, o in offsets.items() if half >> p & 1}) for half in halves)
    return Disassembly(tuple(steps), None)
