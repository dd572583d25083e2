"""The seven pieces of the Soma cube, and its 240 solutions.

Pieces by Piet Hein; letters and the count of 240 as in Berlekamp, Conway, Guy, "Winning Ways", vol. 2.
"""

import hashlib
import warnings
from functools import cache

import numpy as np
from numpy.typing import NDArray

from neurosym.support import disk_cache
from neurosym.support.arrays import Numbers

Cell = tuple[int, int, int]
#: Letter -> cells. A and B are mirror images of each other.
PIECES: dict[str, tuple[Cell, ...]] = {
    "V": ((0, 0, 0), (1, 0, 0), (0, 1, 0)),
    "L": ((0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)),
    "T": ((0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0)),
    "Z": ((0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0)),
    "A": ((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 1)),
    "B": ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 1)),
    "P": ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
}

LETTERS: tuple[str, ...] = tuple(PIECES)
#: A mirror turns A into B; all other pieces are their own mirror images.
MIRRORED: dict[str, str] = {"A": "B", "B": "A"}


@cache
def symmetries() -> Numbers:
    """int64 (48, 3, 3): the symmetries of the cube as matrices; the 24 rotations first, the identity first of all."""
    found = []
    for permutation in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)):
        for signs in np.ndindex(2, 2, 2):
            matrix = np.zeros((3, 3), dtype=np.int64)
            matrix[np.arange(3), permutation] = 1 - 2 * np.array(signs)
            found.append(matrix)
    return np.array(sorted(found, key=lambda m: -round(np.linalg.det(m))))


def turned(cells: dict[str, tuple[Cell, ...]], symmetry: Numbers, side: int = 3) -> dict[str, tuple[Cell, ...]]:
    """A cube's pieces under a symmetry of the cube; under a reflection A and B change names."""
    mirrored = np.linalg.det(symmetry) < 0
    found = {}
    for name, own in cells.items():
        centred = (2 * np.array(own) - (side - 1)) @ symmetry.T
        moved = (centred + side - 1) // 2
        found[MIRRORED.get(name, name) if mirrored else name] = tuple(sorted(map(tuple, moved.tolist())))
    return {name: found[name] for name in cells}


def _placements(cells: tuple[Cell, ...], side: int) -> list[Numbers]:
    """Every way to put a piece into the cube, as sorted indices of cells."""
    seen = set()
    for rotation in symmetries()[:24]:
        shape = np.array(cells) @ rotation.T
        shape -= shape.min(axis=0)
        for shift in np.ndindex(*(side - shape.max(axis=0))):
            x, y, z = (shape + shift).T
            seen.add(tuple(sorted((side * side * x + side * y + z).tolist())))
    return [np.array(s) for s in sorted(seen)]


#: Every way to fill the cube: 240 cubes in 48 poses (Berlekamp, Conway, Guy).
N_COVERS = 11_520


@cache
def _covers() -> NDArray[np.int8]:
    """int8 (11520, 27): every way to fill the 3 x 3 x 3 cube; entries are numbers of pieces. Kept on disk."""
    digest = hashlib.sha256(repr(("covers", 1, PIECES)).encode()).hexdigest()
    path = disk_cache.cache_folder() / "covers" / digest
    covers = np.empty((N_COVERS, 27), dtype=np.int8)
    if not disk_cache.load(path, covers):
        covers = exact_covers()
        disk_cache.store(path, covers)
    return covers


def exact_covers() -> NDArray[np.int8]:
    """The same, searched: importing the solver takes longer than a plan."""
    rows, owner = [], []
    for number, cells in enumerate(PIECES.values()):
        for placement in _placements(cells, 3):
            row = np.zeros(27 + len(PIECES), dtype=bool)
            row[placement] = True
            row[27 + number] = True  # each piece once
            rows.append(row)
            owner.append(number)
    matrix = np.array(rows)
    with warnings.catch_warnings():
        # Of numba, when it first compiles xcover, about a hash in there, in bold; it is not the user's business.
        warnings.filterwarnings("ignore", message=".*unsafe cast from uint64")
        from xcover import covers_bool

        covers = list(covers_bool(matrix))
    filled = np.zeros((len(covers), 27), dtype=np.int8)
    for cube, cover in zip(filled, covers):
        for row_number in cover:
            cube[matrix[row_number, :27]] = owner[row_number]
    return filled


#: Where the T lies in every listed solution: flat at the bottom, its bar along an edge.
T_AT_THE_BOTTOM: tuple[Cell, ...] = ((0, 0, 0), (0, 1, 0), (0, 2, 0), (1, 1, 0))


@cache
def solutions() -> tuple[dict[str, tuple[Cell, ...]], ...]:
    """The 240 cubes, each {letter: cells}, up to rotation and reflection, in a fixed order.

    In every solution the T lies with its bar along an edge of the cube, so a cube can be turned until the T lies
    as in `T_AT_THE_BOTTOM`. That leaves it and its image in the mirror y -> 2 - y; the lesser of the two is
    listed. Order counts depend on the pose (z is up): published facts refer to this one.
    """
    grid = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    covers = _covers()
    t_cells = np.array([9 * x + 3 * y + z for x, y, z in T_AT_THE_BOTTOM])
    covers = covers[(covers[:, t_cells] == LETTERS.index("T")).all(axis=1)]
    swap = np.array([LETTERS.index(MIRRORED.get(name, name)) for name in LETTERS], dtype=np.int8)
    mirrored = swap[covers.reshape(-1, 3, 3, 3)[:, :, ::-1, :].reshape(-1, 27)]
    listed = sorted({min(tuple(a), tuple(b)) for a, b in zip(covers.tolist(), mirrored.tolist())})
    return tuple(
        {name: tuple(map(tuple, grid[np.array(cube) == n].tolist())) for n, name in enumerate(LETTERS)}
        for cube in listed
    )
