"""The common grid of an assembly whose parts are unions of its cells, in any pose."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.shapes import Box
from neurosym.support.arrays import Array, Numbers

#: More cells than this in all are no puzzle: `cells_of` answers None.
MAX_GRID_CELLS = 100_000


@dataclass(frozen=True, eq=False)
class GridCells:
    """Parts as sets of cells of one grid; masks of parts number their bits as the assembly does.

    Attributes:
        cells: int64 (n_i, 3) for each part, each cell once.
        pitch: float64 (3,): a cell's edge lengths along the grid's axes; all equal for cubes.
        frame: float64 (3, 3): columns are the grid's axes, in the world; a rotation.
        origin: float64 (3,): the world's position of the corner of cell (0, 0, 0) from which all its edges go up.
    """

    names: tuple[str, ...]
    cells: tuple[Numbers, ...]
    pitch: Array
    frame: Array
    origin: Array

    def __len__(self) -> int:
        return len(self.cells)

    def shift(self, steps: Numbers) -> Array:
        """The translation, float64 (3,) in the world, of so many steps along each of the grid's axes."""
        return np.asarray(self.frame @ (np.asarray(steps) * self.pitch))

    def lowest(self, part: int) -> float:
        """Height (z, world) of the lowest point of a part."""
        corners = np.array(list(product((0, 1), repeat=3)))
        heights = (self.cells[part][:, None] + corners) * self.pitch @ self.frame[2]
        return float(heights.min() + self.origin[2])


def cells_of(assembly: Assembly) -> GridCells | None:
    """The parts as cells of the coarsest grid that holds them all, or None where there is no such grid.

    There is one when every body is a box, all boxes are turned alike up to quarter turns, and their faces lie, within
    the touching tolerance, at whole multiples of one length an axis, with no cell in two parts. The lengths need not
    be equal: bricks have a grid, too.
    """
    if not assembly.bodies.all_boxes:
        return None
    frame = assembly.X_WB[0][:3, :3]
    turns = np.einsum("ji,njk->nik", frame, assembly.X_WB[:, :3, :3])
    whole = np.round(turns)
    if np.abs(turns - whole).max() > 10 * assembly.tolerances.parallel:
        return None
    size = np.array([b.shape.size for b in assembly.bodies if isinstance(b.shape, Box)])
    half = np.einsum("nik,nk->ni", np.abs(whole), size) / 2
    middle = assembly.bounds.mean(axis=0)
    centre = (assembly.X_WB[:, :3, 3] - middle) @ frame
    low, high = centre - half, centre + half
    start = low.min(axis=0)
    pitch = np.zeros(3)
    for axis in range(3):
        found = _pitch(np.concatenate([low[:, axis], high[:, axis]]) - start[axis], assembly.touch)
        if found is None:
            return None
        pitch[axis] = found
    first, last = (np.round((edge - start) / pitch).astype(np.int64) for edge in (low, high))
    if (last - first).prod(axis=1).sum() > MAX_GRID_CELLS:
        return None
    of_part: list[list[tuple[int, ...]]] = [[] for _ in assembly.parts]
    for owner, a, b in zip(assembly.owners, first, last):
        of_part[owner].extend(product(*(range(int(i), int(j)) for i, j in zip(a, b))))
    # A part may cover a cell with two of its boxes; two parts may not.
    sets = [set(cells) for cells in of_part]
    if len(set().union(*sets)) != sum(map(len, sets)):
        return None
    return GridCells(
        assembly.names,
        tuple(np.array(sorted(cells), dtype=np.int64) for cells in sets),
        pitch,
        frame,
        middle + frame @ start,
    )


def _pitch(edges: Array, touch: float) -> float | None:
    """The largest length of which all `edges` (n,), one of them 0, are whole multiples within `touch`; or None."""
    levels = np.sort(edges)
    levels = levels[np.concatenate([[True], np.diff(levels) > 2 * touch])]
    smallest = float(np.diff(levels).min())
    for parts in (1, 2, 3):
        counts = np.round(levels * parts / smallest)
        # Refined by least squares: the smallest gap carries the rounding of two edges only.
        pitch = float(levels @ counts / (counts @ counts))
        if np.abs(edges - np.round(edges / pitch) * pitch).max() <= touch:
            return pitch
    return None
