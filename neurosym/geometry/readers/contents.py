"""What a reader gives: meshes as they stand in the file, parts that are ready, and what the format says besides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from neurosym.geometry.grouping import PieceGroup
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
        within: the sub-assemblies that it lies in, the outermost first: a number each, and its name.
    """

    name: str
    vertices: Array
    faces: Numbers
    rounding: float = FLOAT64
    X_WP: Array | None = None
    density: float = 1.0
    within: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, eq=False)
class Contents:
    """What was read.

    Attributes:
        parts: meshes still to be looked at, and parts that are ready.
        units, fixed, table, friction, tolerances: as in `Assembly`; None where the file says nothing.
        touching_gaps: whether faces that lie near one another are taken as touching.
        notes: what was odd but harmless.
        separate: whether solids of one mesh are parts of their own.
        keep, piece_groups, subassemblies: as in `Assembly`; sub-assemblies besides those that meshes lie in.
        hint: what to try where parts cannot be used; empty: what each fault says.
    """

    parts: tuple[RawMesh | Part, ...]
    units: str | None = None
    fixed: tuple[str, ...] = ()
    table: float | None = None
    friction: float | None = None
    tolerances: Tolerances | None = None
    touching_gaps: bool = False
    notes: tuple[Note, ...] = ()
    separate: bool = False
    hint: str = ""
    keep: tuple[tuple[str, ...], ...] = ()
    piece_groups: tuple[PieceGroup, ...] = ()
    subassemblies: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def united(name: str, pieces: Sequence[tuple[Array, Numbers]], rounding: float = FLOAT64) -> RawMesh:
    """One mesh of several pieces, each vertices (n, 3) and faces (m, 3)."""
    starts = np.cumsum([0, *(len(v) for v, _ in pieces)])
    vertices = np.concatenate([np.zeros((0, 3)), *(v for v, _ in pieces)])
    faces = np.concatenate([np.zeros((0, 3), dtype=np.int64), *(f + s for (_, f), s in zip(pieces, starts))])
    return RawMesh(name, vertices, faces, rounding)


def subassemblies(parts: Sequence[RawMesh | Part]) -> list[tuple[str, list[int]]]:
    """Names of the sub-assemblies that meshes lie in, each with the numbers of its parts: several, but not all."""
    inside: dict[tuple[int, str], list[int]] = {}
    for number, part in enumerate(parts):
        for above in part.within if isinstance(part, RawMesh) else ():
            inside.setdefault(above, []).append(number)
    return [(name, own) for (_, name), own in inside.items() if name and 1 < len(own) < len(parts)]
