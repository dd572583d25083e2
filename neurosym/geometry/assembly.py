"""Assemblies: named rigid parts at poses, each a union of boxes, convex bodies or closed meshes. Data, no questions.

Frames are named as Drake does: ``X_WP`` is the pose of part P in the world W, a 4 x 4 rigid motion;
``X_PB`` that of body B in part P. z points up; lengths are in the user's unit. What is possible with an assembly is
asked of `neurosym.geometry.queries.AssemblyGeometry`.
"""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from neurosym.errors import AssemblyError, UnknownNameError
from neurosym.geometry.bodies import Bodies
from neurosym.geometry.grouping import PieceGroup
from neurosym.geometry.notes import Note
from neurosym.geometry.rigid_motions import are_rigid
from neurosym.geometry.shapes import Part
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances
from neurosym.support.arrays import Array, Numbers
from neurosym.support.bitsets import bits
from neurosym.support.html import table
from neurosym.support.words import counted, listed

#: The height of a table that is not there: infinitely far down, where nothing touches it.
NO_TABLE = float("-inf")

#: Coulomb's coefficient where nothing else is known.
FRICTION = 0.5


@dataclass(frozen=True, eq=False, repr=False)
class Assembly:
    """Named parts at poses.

    Attributes:
        parts: the parts, each with a name of its own.
        table: height of the table's plane (z, world); None: under the lowest point; `NO_TABLE`: there is none.
        friction: Coulomb's coefficient between any two faces (no unit).
        tolerances: how exact the geometry is taken to be.
        fixed: names of parts that never move and need no support, such as springers and foundations.
        units: what a length of 1 is ("m", "mm", ...), for people and files; None when nobody said.
        notes: what a file's reader saw and mended.
        keep: names of parts, or of one sub-assembly, that the domain "assembly" takes as one part each (see
            `neurosym.geometry.keeping`).
        piece_groups: parts that it need not separate from one another.
        subassemblies: name -> names of its parts, for those that the file has.
    """

    parts: tuple[Part, ...]
    table: float | None = None
    friction: float = FRICTION
    tolerances: Tolerances = DEFAULT_TOLERANCES
    fixed: tuple[str, ...] = ()
    units: str | None = None
    notes: tuple[Note, ...] = ()
    keep: tuple[tuple[str, ...], ...] = ()
    piece_groups: tuple[PieceGroup, ...] = ()
    subassemblies: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = [p.name for p in self.parts]
        if not names:
            raise AssemblyError("Expected at least one part; got none.")
        twice = sorted(n for n, count in Counter(names).items() if count > 1)
        if twice:
            raise AssemblyError(f"Expected each part name once; got twice: {', '.join(twice)}. Rename one.")
        if not (isinstance(self.friction, int | float | np.number) and 0.0 <= self.friction < np.inf):
            raise AssemblyError(f"Expected a coefficient of friction of 0 or more; got {self.friction!r}.")
        check_fixed(self.fixed, names)
        grouped = {"piece group": [g.names for g in self.piece_groups], "sub-assembly": self.subassemblies.values()}
        for what, groups in grouped.items():
            if strange := [n for own in groups for n in own if n not in names]:
                raise UnknownNameError(f"part of a {what}", strange[0], names)

    @classmethod
    def from_cells(
        cls,
        cells: Mapping[str, Iterable[Sequence[int]]],
        size: float = 1.0,
        *,
        table: float | None = None,
        friction: float = FRICTION,
        tolerances: Tolerances = DEFAULT_TOLERANCES,
    ) -> Assembly:
        """Parts made of unit cells, each cell a box of edge `size`; cell (x, y, z) spans size * (x .. x + 1).

        `AssemblyError` for an empty part, a cell that comes twice, is in two parts, or is no triple of integers.
        """
        return cls(_reader("cells").parts_from_cells(cells, size), table, friction, tolerances)

    @classmethod
    def from_meshes(
        cls,
        meshes: Mapping[str, Any],
        *,
        units: str | None = None,
        fixed: Iterable[str] = (),
        table: float | None = None,
        friction: float = FRICTION,
        tolerances: Tolerances | None = None,
    ) -> Assembly:
        """Parts given as closed meshes in their assembled poses, looked over and refused as those that `load` reads.

        Args:
            meshes: name -> a `trimesh.Trimesh`, or anything with ``vertices`` (n, 3) and ``faces`` (m, 3), or a
                pair of such arrays. A part all of whose faces lie on one cubic grid (in any pose) becomes boxes.
            units, fixed, tolerances: as in `neurosym.geometry.readers.loading.load`.
        """
        made: Assembly = _reader("loading").from_meshes(
            meshes, units=units, fixed=fixed, table=table, friction=friction, tolerances=tolerances
        )
        return made

    @classmethod
    def load(cls, path: str | Path, **options: Any) -> Assembly:
        """An assembly from a folder of meshes or a file, looked over; options as `readers.loading.load` has them."""
        loaded: Assembly = _reader("loading").load(path, **options)
        return loaded

    def save(self, path: str | Path) -> None:
        """Write the assembly as JSON, whole or not at all; `load` gives the same one back, number by number."""
        _reader("assembly_json").write(self, path)

    def transformed(self, X: ArrayLike) -> Assembly:
        """The assembly moved by a rigid motion of the world, float64 (4, 4).

        A table that was given goes along with an upright motion; one under the lowest point stays there.
        """
        motion = np.asarray(X, dtype=np.float64)
        if motion.shape != (4, 4) or not are_rigid(motion):
            raise AssemblyError(
                "Expected a rigid motion of shape (4, 4): a rotation without scale or reflection and a shift, last row "
                f"0 0 0 1; got {np.array2string(motion, precision=3)}."
            )
        table = self.table
        if table is not None and table != NO_TABLE:
            if not np.isclose(motion[2, 2], 1.0):
                raise AssemblyError("Expected an upright motion: the table of this assembly was given by its height.")
            table = float(table + motion[2, 3])
        return replace(self, parts=tuple(replace(p, X_WP=motion @ p.X_WP) for p in self.parts), table=table)

    def with_fixed(self, names: Iterable[str]) -> Assembly:
        """The assembly with these parts fixed, and no others."""
        return replace(self, fixed=tuple(names))

    def with_table(self, height: float | None) -> Assembly:
        """The assembly with the table at this height, under its lowest point (None), or nowhere (`NO_TABLE`)."""
        return replace(self, table=height)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parts, in order; masks of parts number their bits so."""
        return tuple(p.name for p in self.parts)

    def __repr__(self) -> str:
        units = f", {self.units}" if self.units else ""
        return f"Assembly({counted(len(self), 'part')}: {listed(self.names)}{units})"

    def _repr_html_(self) -> str:
        low, high = self.part_bounds[:, 0], self.part_bounds[:, 1]
        sizes = [" x ".join(f"{v:.4g}" for v in size) for size in (high - low).tolist()]
        facets = [sum(len(body.shape.faces) for body in part.bodies) for part in self.parts]
        there = ["fixed" if name in self.fixed else "" for name in self.names]
        rows = zip(self.names, (len(part.bodies) for part in self.parts), facets, sizes, there)
        head = ("part", "bodies", "facets", f"extents{f' ({self.units})' if self.units else ''}", "")
        after = " ".join(map(str, self.notes))
        return table(head, rows, title=f"Assembly of {counted(len(self), 'part')}", after=after)

    @cached_property
    def index(self) -> dict[str, int]:
        """Name of a part -> its number."""
        return {name: i for i, name in enumerate(self.names)}

    def __len__(self) -> int:
        return len(self.parts)

    def __getitem__(self, name: str) -> Part:
        try:
            return self.parts[self.index[name]]
        except KeyError:
            raise UnknownNameError("part", name, self.names) from None

    def mask(self, names: Iterable[str]) -> int:
        """A bitset of parts."""
        return sum(1 << self.index[n] for n in names)

    def in_mask(self, mask: int) -> tuple[str, ...]:
        """Names of the parts in a bitset."""
        return tuple(self.names[i] for i in bits(mask & (1 << len(self.names)) - 1))

    @cached_property
    def fixed_mask(self) -> int:
        """A bitset of the fixed parts."""
        return self.mask(self.fixed)

    @cached_property
    def bodies(self) -> Bodies:
        """All bodies, part by part, and arrays of them; masks of bodies number their bits so."""
        return Bodies(self.parts)

    @property
    def owners(self) -> Numbers:
        """int64 (n_bodies,): the number of the part that each body belongs to."""
        return self.bodies.owners

    @property
    def X_WB(self) -> Array:
        """float64 (n_bodies, 4, 4): poses of all bodies in the world."""
        return self.bodies.X_WB

    @property
    def body_bounds(self) -> Array:
        """float64 (n_bodies, 2, 3): axis-aligned bounds of the bodies, in the world."""
        return self.bodies.bounds

    @property
    def part_bounds(self) -> Array:
        """float64 (n_parts, 2, 3): axis-aligned bounds of the parts, in the world."""
        return self.bodies.part_bounds

    @cached_property
    def bounds(self) -> Array:
        """float64 (2, 3): axis-aligned bounds of the whole, in the world."""
        return np.array([self.body_bounds[:, 0].min(axis=0), self.body_bounds[:, 1].max(axis=0)])

    @property
    def ground(self) -> float:
        """Height of the table (z, world): as given, else the lowest point; `NO_TABLE` where there is none."""
        return float(self.bounds[0, 2]) if self.table is None else self.table

    @property
    def has_table(self) -> bool:
        """Whether there is a table at all."""
        return self.table != NO_TABLE

    @property
    def smallest_extent(self) -> float:
        """The smallest extent of any body in its own frame: what tolerances are shares of."""
        return self.bodies.smallest_extent

    @cached_property
    def touch(self) -> float:
        """The touching tolerance as a length."""
        return self.tolerances.touch * self.smallest_extent

    @cached_property
    def mate(self) -> float:
        """The tolerance for overlaps at rest as a length."""
        return max(self.touch, self.tolerances.mate * self.smallest_extent)

    @cached_property
    def axes(self) -> Array:
        """float64 (k, 3): the directions in which the assembly is built, both ways, the most upward first.

        These are the axes of its boxes, up to sign, and the vertical; without boxes, the world's axes.
        """
        return self.bodies.axes(self.tolerances.parallel)


def check_fixed(fixed: Iterable[str], names: Sequence[str]) -> None:
    """Refuse names of fixed parts that are no parts."""
    for name in fixed:
        if name not in names:
            raise UnknownNameError("fixed part", name, names)


def _reader(module: str) -> Any:
    """A module of the readers, looked up when asked for: they need this one."""
    return importlib.import_module(f"neurosym.geometry.readers.{module}")
