"""Small assemblies of unit cells, and what becomes of them: by brute force on cells, without the library's own code."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping

import numpy as np
from scipy.optimize import linprog

Cell = tuple[int, int, int]
Cells = dict[str, list[Cell]]

AXES: tuple[Cell, ...] = ((0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, -1))


def random_cells(rng: np.random.Generator, parts: int, size: tuple[int, int, int], share: float = 1.0) -> Cells:
    """Connected parts that fill a block of cells, or a share of it: random neighbours are joined until few are left."""
    every = list(itertools.product(*map(range, size)))
    kept = sorted(rng.choice(len(every), max(parts, round(share * len(every))), replace=False).tolist())
    owner = {every[i]: i for i in kept}
    pairs = [(c, d) for c in owner for d in beside(c) if d in owner and c < d]
    rng.shuffle(pairs)
    left = len(owner)
    for a, b in pairs:
        a, b = tuple(a), tuple(b)
        one, two = owner[a], owner[b]
        if left > parts and one != two:
            owner.update({c: one for c, k in owner.items() if k == two})
            left -= 1
    groups = sorted(set(owner.values()))[:parts]
    cells = [c for c, k in owner.items() if k in groups]
    low = min(z for _, _, z in cells)
    return {f"p{n}": [(x, y, z - low) for x, y, z in cells if owner[x, y, z] == k] for n, k in enumerate(groups)}


def beside(cell: Cell) -> Iterator[Cell]:
    for axis in AXES:
        yield cell[0] + axis[0], cell[1] + axis[1], cell[2] + axis[2]


class Oracle:
    """What is true of an assembly of cells, by brute force.

    Args:
        cells: of each part.
        ground: whether nothing goes below z = 0.
        gravity: whether what is left must stand, by forces without friction; then there is ground.
        fixed: names of parts that stay. before: pairs of names.
    """

    def __init__(
        self,
        cells: Mapping[str, list[Cell]],
        *,
        gravity: bool = False,
        fixed: tuple[str, ...] = (),
        before: tuple[tuple[str, str], ...] = (),
    ) -> None:
        self.names = tuple(cells)
        self.cells = [frozenset(own) for own in cells.values()]
        self.gravity = gravity
        self.full = (1 << len(self.names)) - 1
        self.fixed = sum(1 << self.names.index(n) for n in fixed)
        self.before = [(self.names.index(a), self.names.index(b)) for a, b in before]
        reach = max(max(map(abs, c)) for own in self.cells for c in own) + 1
        self.reach = 2 * reach + 1
        n = len(self.names)
        #: blocks[axis][i]: bitset of the parts that part i would hit along an axis.
        self.blocks = [
            [sum(1 << j for j in range(n) if j != i and self._hits(i, j, axis)) for i in range(n)] for axis in AXES
        ]

    def _hits(self, i: int, j: int, axis: Cell) -> bool:
        return any(
            (x + k * axis[0], y + k * axis[1], z + k * axis[2]) in self.cells[j]
            for x, y, z in self.cells[i]
            for k in range(1, self.reach)
        )

    def leaves(self, parts: int, there: int) -> list[Cell]:
        """Along which axes some parts get out of the others."""
        others = there & ~parts
        free = []
        for axis, blocks in zip(AXES, self.blocks):
            if self.gravity and axis[2] < 0:
                continue
            if not any(blocks[i] & others for i in range(len(self.names)) if parts >> i & 1):
                free.append(axis)
        return free

    def in_words(self, there: int) -> str:
        return ", ".join(name for i, name in enumerate(self.names) if there >> i & 1)

    def removals(self, there: int) -> list[int]:
        """The parts that may be taken out next, by number."""
        if self.gravity and there == self.full and not self.stands(there):
            return []
        possible = []
        for i in range(len(self.names)):
            bit = 1 << i
            waits = any(b == i and there >> a & 1 for a, b in self.before)
            if not there & bit or self.fixed & bit or waits or not self.leaves(bit, there):
                continue
            if not self.gravity or self.stands(there & ~bit):
                possible.append(i)
        return possible

    def count(self) -> int:
        """How many orders take everything out that is not fixed."""

        @functools.cache
        def orders(there: int) -> int:
            if there == self.fixed:
                return 1
            return sum(orders(there & ~(1 << i)) for i in self.removals(there))

        return orders(self.full)

    def apart(self) -> bool:
        """Whether groups that leave together, to be taken apart afterwards, get everything apart; without gravity."""

        @functools.cache
        def splits(block: int) -> bool:
            if block.bit_count() == 1 or not block & ~self.fixed:
                return True
            part = (block - 1) & block
            while part:
                if not part & self.fixed and self.leaves(part, block) and splits(part) and splits(block & ~part):
                    return True
                part = (part - 1) & block
            return False

        return splits(self.full)

    @functools.cache  # noqa: B019
    def stands(self, there: int) -> bool:
        """Whether pushes between faces, and from the ground, can hold up all parts that are not fixed."""
        movable = [i for i in range(len(self.names)) if there >> i & 1 and not self.fixed >> i & 1]
        if not movable:
            return True
        row = {i: 6 * k for k, i in enumerate(movable)}
        columns = []
        owner = {c: i for i in range(len(self.names)) if there >> i & 1 for c in self.cells[i]}
        for cell, i in owner.items():
            for axis in AXES[:1] + AXES[1:2] + AXES[3:4] + AXES[5:]:
                other = (cell[0] + axis[0], cell[1] + axis[1], cell[2] + axis[2])
                j = owner.get(other)
                down = axis == (0, 0, -1)
                if (down and cell[2] > 0) or (j is None and not (down and cell[2] == 0)) or j == i:
                    continue
                for point in face_corners(cell, axis):
                    column = np.zeros(6 * len(movable))
                    for part, sign in ((i, -1.0), (j, 1.0)):
                        if part in row:
                            push = sign * np.array(axis, dtype=float)
                            column[row[part] : row[part] + 6] += np.concatenate([push, np.cross(point, push)])
                    columns.append(column)
        weight = np.zeros(6 * len(movable))
        for i in movable:
            for cell in self.cells[i]:
                pull = np.array([0.0, 0.0, -1.0])
                weight[row[i] : row[i] + 6] += np.concatenate([pull, np.cross(np.array(cell) + 0.5, pull)])
        if not columns:
            return False
        result = linprog(np.zeros(len(columns)), A_eq=np.array(columns).T, b_eq=-weight, method="highs")
        return result.status == 0


def face_corners(cell: Cell, axis: Cell) -> Iterator[np.ndarray]:
    """The four corners of the face of a cell that looks along an axis."""
    direction = np.array(axis)
    middle = np.array(cell) + 0.5 + 0.5 * direction
    u, v = (np.eye(3)[k] for k in range(3) if not direction[k])
    for a, b in itertools.product((-0.5, 0.5), repeat=2):
        yield middle + a * u + b * v


#: Halves of two parts each, by owner of the cells (x, y, z) of a block of 4 x 3 x 3, z fastest: pegs from one half into
#: the other, and hooks within each, let no part go alone, and each half as a whole.
HALVES = (
    "110000110100100111202133221222332322",
    "000001111231101103231233123333223222",
    "110110000311001200333021222223233233",
    "111011000122130110222230133233223233",
    "011001011112311000222333020233233223",
    "000100100213113000213233203332332222",
)


def interlocked_halves(rng: np.random.Generator) -> Cells:
    """One of `HALVES`, turned or mirrored."""
    code = HALVES[int(rng.integers(len(HALVES)))]
    axes, signs = rng.permutation(3), rng.choice([-1, 1], 3)
    places = np.array(list(itertools.product(range(4), range(3), range(3))))[:, axes] * signs
    places -= places.min(axis=0)
    order = rng.permutation(4)
    return {
        f"p{k}": [(int(x), int(y), int(z)) for (x, y, z), own in zip(places.tolist(), code) if own == str(part)]
        for k, part in enumerate(order)
    }
