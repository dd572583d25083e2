"""What a reader gives: meshes as they stand in the file, parts that are ready, and what the format says besides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from neurosym.geometry.notes import Note
from neurosym.geometry.shapes import Part
from neurosym.geometry.tolerances import Tolerances
from neurosym.support.arrays import Array, Numbers

#: From y up to z up, float64 (4, 4): x stays, y becomes z.
Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])

#: Rounding of coordinates stored in 32 and in 64 bits, as a share of their size.
FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53


@dataclass(frozen=True, eq=False)
class RawMesh:
    """A part's mesh as it stands in a file, unchecked.

    Attributes:
        name: of the part, as the file has it; perhaps empty, perhaps not unique.
        vertices, faces: float64 (n, 3), in the part's frame and the file's unit; int64 (m, 3), numbers of vertices.
        rounding: of the coordinates, as a share of their size.
        X_WP: float64 (4, 4), the part's pose; None: the part's frame is the world.
        density: mass per unit of volume.
    """

    name: str
    vertices: Array
    faces: Numbers
    rounding: float = FLOAT64
    X_WP: Array | None = None
    density: float = 1.0


@dataclass(frozen=True, eq=False)
class Contents:
    """What was read.

    Attributes:
        parts: meshes still to be looked at, and parts that are ready.
        units, fixed, table, friction, tolerances: as in `Assembly`; None where the file says nothing.
        notes: what was odd but harmless.
        separate: whether solids of one mesh are parts of their own.
        hint: what to try where parts cannot be used; empty: what each fault says.
    """

    parts: tuple[RawMesh | Part, ...]
    units: str | None = None
    fixed: tuple[str, ...] = ()
    table: float | None = None
    friction: float | None = None
    tolerances: Tolerances | None = None
    notes: tuple[Note, ...] = ()
    separate: bool = False
    hint: str = ""


def united(name: str, pieces: Sequence[tuple[Array, Numbers]], rounding: float = FLOAT64) -> RawMesh:
    """One mesh of several pieces, each vertices (n, 3) and faces (m, 3)."""
    starts = np.cumsum([0, *(len(v) for v, _ in pieces)])
    vertices = np.concatenate([np.zeros((0, 3)), *(v for v, _ in pieces)])
    faces = np.concatenate([np.zeros((0, 3), dtype=np.int64), *(f + s for (_, f), s in zip(pieces, starts))])
    return RawMesh(name, vertices, faces, rounding)
