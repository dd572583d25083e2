"""Tiles in space: flat on a table, side by side in their slots, each laid from above."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from domains.scrabble_drawing import tile_face
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.rigid_motions import shifted
from neurosym.geometry.shapes import boxes_part
from neurosym.geometry.staging import Staging, building

#: A tile: its edges, and from the middle of one slot to that of the next (edges of a tile).
SIZE, PITCH = (1.0, 1.0, 0.22), 1.04

#: Wood, RGB in 0..1.
WOOD = (0.87, 0.72, 0.50)


def laid_out(start: Sequence[str], plan: Sequence[str]) -> Staging:
    """The tiles that lie already, and those of a plan, from the first slot on.

    Raises AssemblyError: there is no tile at all.
    """
    names = (*start, *plan)
    parts = []
    for slot, name in enumerate(names):
        at = shifted((PITCH * slot, 0.0, SIZE[2] / 2))
        parts.append(boxes_part(name, np.zeros((1, 3)), np.array(SIZE), at))
    staging = building(Assembly(tuple(parts), table=0.0), tuple(start), plan, dict.fromkeys(names, WOOD))
    return replace(staging, tops={name: tile_face(name[0]) for name in names})
