"""How far voxel parts can go before they meet one another, or the ground."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.paths.grid import GridCells
from neurosym.geometry.paths.voxel_separation import DIRECTIONS, Offset
from neurosym.support.arrays import Numbers
from neurosym.support.bitsets import bits

#: An offset (x, y, z) is one number, x + y * RADIX + z * RADIX**2: differences of offsets are differences of numbers.
RADIX = 1 << 16
UNITS = tuple(x + y * RADIX + z * RADIX**2 for x, y, z in DIRECTIONS)

#: (gap, i, j): part i can go so many cells, and then meets part j.
Meeting = tuple[int, int, int]

#: The offset of each part, each as one number.
State = tuple[int, ...]


class Gaps:
    """What is ahead of each part of a block, in any state; `InputError` for parts too far from one another.

    Args:
        masks: for each part, a bitset of the parts of the grid that move as one with it; the first holds the fixed ones
            where there is a ground.
        start: offset of each part of the grid in the state (0, ..., 0).
        ground: height (z, world) of a plane that no part but the first goes through; meeting it is meeting the first.
        one_by_one: whether pairs are looked at one by one, which is quicker where parts are few.
    """

    def __init__(
        self,
        cells: GridCells,
        masks: Sequence[int],
        start: Mapping[int, Offset],
        ground: float | None,
        one_by_one: bool,
    ) -> None:
        self._cells, self._count, self._one_by_one = cells, len(masks), one_by_one
        self._bodies = [
            np.concatenate([cells.cells[p] + np.array(start[p], dtype=np.int64) for p in bits(mask)]) for mask in masks
        ]
        every = np.concatenate(self._bodies)
        self.across = int(np.ptp(every, axis=0).max()) + 1  # the longest side of the block's bounds, in cells
        if self.across * 8 >= RADIX:
            raise InputError(f"Expected a block of fewer than {RADIX // 8} cells across; got {self.across}.")
        self._pairs = [(i, j) for i in range(self._count) for j in range(i + 1, self._count)]
        self._lines: dict[tuple[int, int], _Lines] = {}
        self._bounds = [(b.min(axis=0), b.max(axis=0) + 1) for b in self._bodies]
        self._low, self._high = (np.array(ends) for ends in zip(*self._bounds))
        # What a step along each direction adds to a height, and how far above the ground each part begins.
        self._rise = [float(cells.shift(np.array(d))[2]) for d in DIRECTIONS]
        self._clearance: list[float] | None = None
        if ground is not None:
            slack = 1e-3 * float(cells.pitch.min())
            self._clearance = [
                min(cells.lowest(p) + float(cells.shift(np.array(start[p]))[2]) for p in bits(mask)) - ground + slack
                for mask in masks
            ]

    def meetings(self, state: State) -> list[list[Meeting]]:
        """For each direction: (gap, i, j) wherever part i, going that way, meets part j."""
        met: list[list[Meeting]] = [[], [], [], [], [], []]
        for i, j in self._pairs if self._one_by_one else self._facing(state):
            lines = self._lines.get((i, j))
            if lines is None:
                lines = self._lines[i, j] = _Lines(self._bodies[i], self._bodies[j])
            for d, gap in lines.gaps(state[j] - state[i]):
                met[d].append((gap, i, j))
                met[d ^ 1].append((gap, j, i))
        if self._clearance is not None:
            for d, rise in enumerate(self._rise):
                if rise < -1e-9:
                    for i in range(1, self._count):
                        height = self._clearance[i] + float(self._cells.shift(np.array(decoded(state[i])))[2])
                        met[d].append((int(height / -rise), i, 0))
        return met

    def are_divided(self, state: State) -> bool:
        """Whether a layer of cells across one of the axes is empty between parts on both sides."""
        placed = list(zip(self._bounds, map(decoded, state)))
        for axis in range(3):
            spans = sorted((int(low[axis]) + o[axis], int(high[axis]) + o[axis]) for (low, high), o in placed)
            top = spans[0][1]
            for low, high in spans[1:]:
                if low > top:
                    return True
                top = max(top, high)
        return False

    def _facing(self, state: State) -> list[tuple[int, int]]:
        """Pairs whose bounds, seen along some axis, cover one another: no others can meet along it."""
        offsets = np.array([decoded(at) for at in state])
        low, high = self._low + offsets, self._high + offsets
        across = (low[:, None] < high[None]) & (high[:, None] > low[None])
        first, second = np.nonzero(np.triu(across.sum(axis=2) >= 2, 1))
        return list(zip(first.tolist(), second.tolist()))


class _Lines:
    """How far one part can go before it meets another, for any relative offset; answers are kept."""

    def __init__(self, a: Numbers, b: Numbers) -> None:
        differences = {(x, y, z) for x, y, z in (b[None] - a[:, None]).reshape(-1, 3).tolist()}
        self._ahead: list[dict[tuple[int, int], list[int]]] = [{}, {}, {}]
        for x, y, z in sorted(differences):
            self._ahead[0].setdefault((y, z), []).append(x)
            self._ahead[1].setdefault((x, z), []).append(y)
            self._ahead[2].setdefault((x, y), []).append(z)
        self._known: dict[int, list[tuple[int, int]]] = {}

    def gaps(self, offset: int) -> list[tuple[int, int]]:
        """(direction, cells) for each direction in which the first part meets the second, `offset` farther on."""
        known = self._known.get(offset)
        if known is None:
            known = self._known[offset] = list(self._asked(decoded(offset)))
        return known

    def _asked(self, offset: Offset) -> Iterator[tuple[int, int]]:
        x, y, z = offset
        for axis, (line, here) in enumerate((((-y, -z), -x), ((-x, -z), -y), ((-x, -y), -z))):
            # Sorted, since the differences were: x first, then y, then z.
            at = self._ahead[axis].get(line)
            if at is None:
                continue
            after, before = bisect_right(at, here), bisect_left(at, here)
            if after < len(at):
                yield 2 * axis, at[after] - here - 1
            if before:
                yield 2 * axis + 1, here - at[before - 1] - 1


def decoded(number: int) -> Offset:
    """(x, y, z) of an offset written as one number."""
    half = RADIX // 2
    x = (number + half) % RADIX - half
    number = (number - x) // RADIX
    y = (number + half) % RADIX - half
    return x, y, (number - y) // RADIX
