"""Parts made of unit cells, as people write them down."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.shapes import Part, boxes_part

#: Cells farther from the origin than this are refused: lengths would lose their last digits.
MAX_COORDINATE = 1_000_000


def parts_from_cells(cells: Mapping[str, Iterable[Sequence[int]]], size: float) -> tuple[Part, ...]:
    """See `Assembly.from_cells`."""
    if not np.isfinite(size) or size <= 0:
        raise AssemblyError(f"Expected a cell size above 0; got {size!r}.")
    if not isinstance(cells, Mapping):
        raise AssemblyError(f"Expected parts as {{name: [(x, y, z), ...]}}; got {cells!r}.")
    owner: dict[tuple[int, int, int], str] = {}
    parts = []
    for name, given in cells.items():
        if not isinstance(name, str) or not name:
            raise AssemblyError(f"Expected names of parts that are text; got {name!r}.")
        if not isinstance(given, Iterable):
            raise AssemblyError(f"Part {name!r}: expected a list of cells (x, y, z); got {given!r}.")
        triples = [_cell(name, c) for c in given]
        if not triples:
            raise AssemblyError(f"Expected part {name!r} to have at least one cell; it is empty.")
        for cell in triples:
            if cell in owner:
                other = owner[cell]
                if other != name and {c for c, own in owner.items() if own == other} == set(triples):
                    same = f"Parts {other!r} and {name!r} are the same solid in the same place."
                    raise AssemblyError(f"{same} Take one of them away.")
                fault = "comes twice" if other == name else f"belongs to {other!r} too: the parts overlap"
                raise AssemblyError(f"Part {name!r}: the cell {cell} {fault}. Give each cell to one part, once.")
            owner[cell] = name
        parts.append(boxes_part(name, (np.array(triples) + 0.5) * size, np.full(3, size)))
    return tuple(parts)


def _cell(name: str, cell: Sequence[int]) -> tuple[int, int, int]:
    try:
        array = np.asarray(cell)
        whole = array.shape == (3,) and bool(np.isfinite(array).all() and (array == np.round(array)).all())
    except (TypeError, ValueError):
        whole = False
    if not whole:
        raise AssemblyError(f"Part {name!r}: expected cells (x, y, z) of three integers; got {cell!r}.")
    if np.abs(array).max() > MAX_COORDINATE:
        raise AssemblyError(f"Part {name!r}: expected cells within {MAX_COORDINATE:,} of the origin; got {cell!r}.")
    x, y, z = (int(v) for v in array)
    return x, y, z
