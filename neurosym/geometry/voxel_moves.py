"""Taking voxel puzzles apart by translating groups of parts: exact, complete, and with the least number of moves.

A state is the offset of each part of a block, in whole cells. A move translates a group of parts together, by one or
more cells along one axis, with the other parts at rest; a group pushed over several cells in one direction is one
move, as in BurrTools. The breadth-first search over moves ends where a group can leave the others without end, so the
level (moves to the first separation, the leaving move included) is the true minimum.

Which groups can move. Let ``gap[i][j]`` be the number of cells that part i can go along a direction before it hits
part j. A group G can go s cells exactly when ``gap[i][j] >= s`` for every i in G and j outside: G is closed under the
relation "i drives j", ``gap[i][j] < s``. The closed groups are the unions of the closures of single parts, so these
and their unions are all the moves of s cells there are. (BurrTools closes the matrix of gaps by shortest paths,
which is the same relation.) Moving G one way or the others the other way leaves the same relative offsets, so
groups without one reference part, in all six directions, cover everything; fixed parts are that reference.

Why nothing is lost by whole cells. Take any motion of the parts by translations, fractional, slanting, all parts at
once. Add a constant phase in [0, 1) to each axis and round all offsets down: two cells that are at least 1 apart along
some axis stay so, hence no overlap appears. For almost every phase the rounded motion changes at each moment along one
axis and in one direction only (the free configurations form a polyhedral complex, so a motion may be taken piecewise
linear, and crossings coincide for a finite number of phases unless parts travel together), and what changes then is a
group that moves one cell. So when the search ends without a separation, no motion by translations separates anything.

Rotations are not searched.
"""

from __future__ import annotations

import time
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from neurosym.errors import InputError
from neurosym.geometry.blocking import bits
from neurosym.geometry.grid import GridCells
from neurosym.geometry.paths import Path, Track

#: The six directions, opposite ones side by side: ``d ^ 1`` is the opposite of ``d``.
DIRECTIONS = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))

#: No obstacle ahead, however far.
ENDLESS = 1 << 30

#: Up to so many parts, pairs and closures are looked at one by one, which is quicker than arrays are.
FEW = 24

#: An offset (x, y, z) is one number, x + y * RADIX + z * RADIX**2: differences of offsets are differences of numbers.
RADIX = 1 << 16
UNITS = tuple(x + y * RADIX + z * RADIX**2 for x, y, z in DIRECTIONS)

Offset = tuple[int, int, int]


@dataclass(frozen=True)
class Move:
    """A group of parts translated together.

    Attributes:
        group: a bitset of parts.
        direction: one of `DIRECTIONS`, along the grid's axes.
        steps: how many cells; None for without end.
    """

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
        found = {part: np.array(offset) for part, offset in self.start.items()}
        for move in self.moves[:-1]:
            for part in bits(move.group):
                found[part] = found[part] + np.array(move.direction) * (move.steps or 0)
        return {part: (int(x), int(y), int(z)) for part, (x, y, z) in found.items()}


@dataclass(frozen=True)
class Stuck:
    """No separation was found.

    Attributes:
        proved: whether all states were visited: then no motion by translations separates anything.
        explored: states that the search visited.
        block: a bitset of the parts that stay together.
    """

    proved: bool
    explored: int
    block: int


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
    return _Search(cells, among, fixed & among, ground, start or {}, accept).run(max_states, seconds)


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


def separation_path(cells: GridCells, separation: Separation, *, home: bool = True) -> Path:
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
    return Path("moves", tuple(tracks), tuple(cells.names[p] for p in bits(separation.group)))


def _way_out(cells: GridCells, keys: list[dict[int, NDArray[np.int64]]], parts: list[int]) -> int:
    """Cells to go until two halves are clear of one another, at rest and while each goes back to its shape."""
    spots = [cells.cells[p] + key[p] for p in parts for key in keys]
    low, high = np.min([s.min(axis=0) for s in spots], axis=0), np.max([s.max(axis=0) for s in spots], axis=0)
    return int((high - low).max()) + 2


class _Search:
    """One breadth-first search; parts are renumbered from 0, the reference (a part, or all fixed ones) is number 0."""

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
        self.bodies = [
            np.concatenate([cells.cells[p] + np.array(self.start[p], dtype=np.int64) for p in bits(mask)])
            for mask in self.masks
        ]
        every = np.concatenate(self.bodies)
        self.across = int(np.ptp(every, axis=0).max()) + 1
        if self.across * 8 >= RADIX:
            raise InputError(f"Expected a block of fewer than {RADIX // 8} cells across; got {self.across}.")
        self.count = len(self.masks)
        self.all = (1 << self.count) - 1
        self.pairs = [(i, j) for i in range(self.count) for j in range(i + 1, self.count)]
        self.lines: dict[tuple[int, int], _Lines] = {}
        self.bounds = [(b.min(axis=0), b.max(axis=0) + 1) for b in self.bodies]
        self.low, self.high = (np.array(ends) for ends in zip(*self.bounds))
        # What a step along each direction adds to a height, and how far above the ground each part begins.
        self.rise = [float(cells.shift(np.array(d))[2]) for d in DIRECTIONS]
        self.clearance: list[float] | None = None
        if fixed and ground is not None:
            slack = 1e-3 * float(cells.pitch.min())
            self.clearance = [
                min(cells.lowest(p) + float(cells.shift(np.array(self.start[p]))[2]) for p in bits(mask))
                - ground
                + slack
                for mask in self.masks
            ]

    def run(self, max_states: int, seconds: float | None) -> Separation | Stuck:
        begin = (0,) * self.count
        deadline = None if seconds is None else time.monotonic() + seconds
        came: dict[tuple[int, ...], tuple[tuple[int, ...], int, int, int] | None] = {begin: None}
        layer = [begin]
        while layer:
            # A whole layer is asked before it is expanded, so that the smallest group of the least level leaves.
            edges = []
            best: tuple[int, int, tuple[int, ...], int, int] | None = None
            for number, state in enumerate(layer):
                if deadline is not None and number % 64 == 0 and time.monotonic() > deadline:
                    return Stuck(False, len(came), self.among)
                edges.append(self._drives(state))
                for d, group in self._leaving(edges[-1]):
                    outside = self._parts(group)
                    if best is None or (outside.bit_count(), outside) < best[:2]:
                        best = (outside.bit_count(), outside, state, d, group)
            if best is not None:
                return self._separation(came, best[2], best[3], best[4])
            following = []
            for state, drives in zip(layer, edges):
                for d, steps, group in self._moves(drives):
                    unit = UNITS[d] * steps
                    reached = tuple(at + unit if group >> i & 1 else at for i, at in enumerate(state))
                    if reached in came or (self.accept is not None and self._out(reached)):
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
        return self.clearance is None or any(abs(abs(self.cells.frame[2, k]) - 1) < 1e-6 for k in range(3))

    def _drives(self, state: tuple[int, ...]) -> list[list[tuple[int, int, int]]]:
        """For each direction: (gap, i, j) wherever part i, going that way, meets part j."""
        found: list[list[tuple[int, int, int]]] = [[], [], [], [], [], []]
        for pair in self.pairs if self.count <= FEW else self._facing(state):
            i, j = pair
            lines = self.lines.get(pair)
            if lines is None:
                lines = self.lines[pair] = _Lines(self.bodies[i], self.bodies[j])
            for d, gap in lines.gaps(state[j] - state[i]):
                found[d].append((gap, i, j))
                found[d ^ 1].append((gap, j, i))
        if self.clearance is not None:
            for d, rise in enumerate(self.rise):
                if rise < -1e-9:
                    for i in range(1, self.count):
                        height = self.clearance[i] + float(self.cells.shift(np.array(_decoded(state[i])))[2])
                        found[d].append((int(height / -rise), i, 0))
        return found

    def _facing(self, state: tuple[int, ...]) -> list[tuple[int, int]]:
        """Pairs whose bounds, seen along some axis, cover one another: no others can meet along it."""
        offsets = np.array([_decoded(at) for at in state])
        low, high = self.low + offsets, self.high + offsets
        across = (low[:, None] < high[None]) & (high[:, None] > low[None])
        first, second = np.nonzero(np.triu(across.sum(axis=2) >= 2, 1))
        return list(zip(first.tolist(), second.tolist()))

    def _closures(self, drives: list[tuple[int, int, int]], steps: int, reference: int) -> Iterator[int]:
        """Of each part outside `reference`, the parts that go along when it goes `steps`; those that drive the
        reference left out, each group once."""
        along = [0] * self.count
        into = [0] * self.count
        for gap, i, j in drives:
            if gap < steps:
                along[i] |= 1 << j
                into[j] |= 1 << i
        held, new = reference, reference
        while new:
            before = 0
            for i in bits(new):
                before |= into[i]
            new = before & ~held
            held |= new
        seen = set()
        for i in bits(self.all & ~held):
            group, new = 1 << i, along[i]
            while new:
                group |= new
                after = 0
                for j in bits(new):
                    after |= along[j]
                new = after & ~group
            if group not in seen:
                seen.add(group)
                yield group

    def _leaving(self, edges: list[list[tuple[int, int, int]]]) -> Iterator[tuple[int, int]]:
        """(direction, group) for the smallest groups that can leave; all of them move relative to fixed parts."""
        for d in range(6):
            few = self.count <= FEW or self.accept is not None
            groups = self._closures(edges[d], ENDLESS, 1 if self.fixed else 0) if few else self._last(edges[d])
            for group in groups:
                if group != self.all and (self.accept is None or self.accept(self._parts(group))):
                    yield d, group

    def _last(self, drives: list[tuple[int, int, int]]) -> Iterator[int]:
        """The strongly connected groups that drive no others: the smallest closure of any direction is one of them."""
        rows, columns = np.array([i for _, i, _ in drives], dtype=int), np.array([j for _, _, j in drives], dtype=int)
        graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(self.count, self.count))
        number, label = connected_components(graph, connection="strong")
        drivers = set(label[rows][label[rows] != label[columns]].tolist())
        groups = dict.fromkeys(range(number), 0)
        for part, of in enumerate(label.tolist()):
            groups[of] |= 1 << part
        for of, group in groups.items():
            if of not in drivers and not (self.fixed and group & 1):
                yield group

    def _moves(self, edges: list[list[tuple[int, int, int]]]) -> Iterator[tuple[int, int, int]]:
        """(direction, steps, group) for all moves: unions of closures."""
        for d in range(6):
            drives = edges[d]
            # What can go farther than any finite gap can leave. Where other groups are wanted, it may only make way.
            farthest = max((gap for gap, _, _ in drives), default=0)
            for steps in range(1, 1 + (farthest if self.accept is None else self.across)):
                closures = list(self._closures(drives, steps, 1))
                if not closures:
                    break
                unions = {0}
                for group in closures:
                    unions |= {group | known for known in unions}
                for group in sorted(unions - {0}):
                    yield d, steps, group

    def _out(self, state: tuple[int, ...]) -> bool:
        """Whether a layer of cells across one of the axes is empty between parts on both sides."""
        offsets = [_decoded(at) for at in state]
        for axis in range(3):
            spans = sorted((int(b[0][axis]) + o[axis], int(b[1][axis]) + o[axis]) for b, o in zip(self.bounds, offsets))
            top = spans[0][1]
            for low, high in spans[1:]:
                if low > top:
                    return True
                top = max(top, high)
        return False

    def _parts(self, group: int) -> int:
        return sum(self.masks[i] for i in bits(group))

    def _separation(
        self,
        came: dict[tuple[int, ...], tuple[tuple[int, ...], int, int, int] | None],
        state: tuple[int, ...],
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


class _Lines:
    """How far one part can go before it meets another, for any relative offset; answers are kept."""

    def __init__(self, a: NDArray[np.int64], b: NDArray[np.int64]) -> None:
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
            known = self._known[offset] = list(self._asked(_decoded(offset)))
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


def _decoded(number: int) -> Offset:
    """(x, y, z) of an offset written as one number."""
    half = RADIX // 2
    x = (number + half) % RADIX - half
    number = (number - x) // RADIX
    y = (number + half) % RADIX - half
    return x, y, (number - y) // RADIX


def cells_said(cells: GridCells, mask: int) -> str:
    """The names of the parts in a bitset, for messages."""
    return ", ".join(cells.names[p] for p in bits(mask)) or "none"
