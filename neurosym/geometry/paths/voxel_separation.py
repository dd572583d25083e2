"""What a block of voxel parts falls into, by which moves; and the motions that these moves are."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from neurosym.geometry.paths.grid import GridCells
from neurosym.geometry.step_motion import StepMotion, Track
from neurosym.support.arrays import Numbers
from neurosym.support.bitsets import bits

#: The six directions, opposite ones side by side: ``d ^ 1`` is the opposite of ``d``.
DIRECTIONS = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))

#: Whole cells along each of the grid's axes, from a part's assembled place.
Offset = tuple[int, int, int]


@dataclass(frozen=True)
class Move:
    """A group of parts, a bitset, moved along one of `DIRECTIONS` by so many cells, or without end (None)."""

    group: int
    direction: Offset
    steps: int | None


@dataclass(frozen=True)
class Separation:
    """A block falls into two.

    Attributes:
        moves: the least number of moves there is; the last one is without end, and its group leaves.
        group: a bitset of the parts that leave.
        rest: the parts of the block that stay.
        start: the offset (x, y, z) of each part, in cells, before the moves: part number -> offset.
        explored: states that the search visited.
    """

    moves: tuple[Move, ...]
    group: int
    rest: int
    start: dict[int, Offset] = field(repr=False)
    explored: int

    @property
    def level(self) -> int:
        """How many moves it takes, the leaving one included."""
        return len(self.moves)

    @property
    def offsets(self) -> dict[int, Offset]:
        """Where each part of the block is when the last move begins."""
        at = {part: np.array(offset) for part, offset in self.start.items()}
        for move in self.moves[:-1]:
            for part in bits(move.group):
                at[part] = at[part] + np.array(move.direction) * (move.steps or 0)
        return {part: (int(x), int(y), int(z)) for part, (x, y, z) in at.items()}


@dataclass(frozen=True)
class Stuck:
    """The parts of a block, a bitset, stay together, after so many states were visited.

    `proved`: all states were, so no motion by translations separates anything.
    """

    proved: bool
    explored: int
    block: int


def separation_path(cells: GridCells, separation: Separation, *, home: bool = True) -> StepMotion:
    """The motions of a separation; the parts that leave come first among its tracks.

    Args:
        home: whether each half, once they are apart, goes back to the shape it had at the start: then its own next
            separation can start from assembled places. Undoing moves among the parts of one half meets nothing.
    """
    block = separation.group | separation.rest
    parts = bits(block)
    at = {p: np.array(separation.start.get(p, (0, 0, 0)), dtype=np.int64) for p in parts}
    keys = [dict(at)]
    for move in separation.moves[:-1]:
        for p in bits(move.group):
            at[p] = at[p] + np.array(move.direction) * (move.steps or 0)
        keys.append(dict(at))
    last = separation.moves[-1]
    away = np.array(last.direction) * _way_out(cells, keys, parts)
    for p in bits(last.group):
        at[p] = at[p] + away
    keys.append(dict(at))
    if home:
        leaves = {p: away if last.group >> p & 1 else 0 * away for p in parts}
        keys.extend({p: before[p] + leaves[p] for p in parts} for before in reversed(keys[:-2]))
    order = [*bits(separation.group), *bits(separation.rest)]
    together: dict[bytes, list[int]] = {}
    for p in order:
        steps = np.array([key[p] for key in keys])
        if steps.any():
            together.setdefault(steps.tobytes(), []).append(p)
    tracks = []
    for same in together.values():
        poses = np.tile(np.eye(4), (len(keys), 1, 1))
        poses[:, :3, 3] = [cells.shift(key[same[0]]) for key in keys]
        own = np.concatenate([cells.cells[p] for p in same]) + 0.5
        centre = cells.origin + cells.frame @ (own.mean(axis=0) * cells.pitch)
        tracks.append(Track(tuple(cells.names[p] for p in same), poses, centre))
    leaving = tuple(cells.names[p] for p in bits(separation.group))
    return StepMotion(leaving, tracks=tuple(tracks), kind="moves", moves=separation.level)


def _way_out(cells: GridCells, keys: list[dict[int, Numbers]], parts: list[int]) -> int:
    """Cells to go until two halves are clear of one another, at rest and while each goes back to its shape."""
    spots = [cells.cells[p] + key[p] for p in parts for key in keys]
    low, high = np.min([s.min(axis=0) for s in spots], axis=0), np.max([s.max(axis=0) for s in spots], axis=0)
    return int((high - low).max()) + 2
