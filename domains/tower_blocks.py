"""Blocks, and the reference towers made of them: the world that the tower domain's predicates are asked about."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from neurosym.errors import AssemblyError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.rigid_motions import shifted
from neurosym.geometry.shapes import boxes_part
from neurosym.support.arrays import Array

#: What makes blocks interchangeable: a colour and a size (width along x, depth along y, height).
Kind = tuple[str, tuple[float, float, float]]
#: Colours of blocks, RGB in 0..1. Their hues lie far enough apart to stay themselves in the hard pictures.
COLOURS: Mapping[str, tuple[float, float, float]] = {
    "red": (0.82, 0.12, 0.10),
    "yellow": (0.93, 0.80, 0.12),
    "blue": (0.12, 0.28, 0.82),
    "green": (0.16, 0.66, 0.22),
    "cyan": (0.15, 0.75, 0.80),
    "purple": (0.62, 0.18, 0.76),
}


@dataclass(frozen=True, slots=True)
class Block:
    """A block: a box that can be placed once.

    Its name is that of the action primitive that places it, its colour one of `COLOURS`, its size width (x), depth (y)
    and height (z), in any unit. Raises UnknownNameError: no such colour; AssemblyError: not three lengths above 0.
    """

    name: str
    colour: str
    size: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if self.colour not in COLOURS:
            raise UnknownNameError("colour", self.colour, COLOURS)
        size = np.asarray(self.size, dtype=np.float64)
        if size.shape != (3,) or not np.isfinite(size).all() or size.min() <= 0:
            raise AssemblyError(f"Block {self.name!r}: expected a size of three lengths above 0; got {self.size!r}.")
        object.__setattr__(self, "size", tuple(size.tolist()))

    @property
    def kind(self) -> Kind:
        """What the reference asks of a block: colour and size."""
        return self.colour, self.size


@dataclass(frozen=True, eq=False)
class ReferenceTower:
    """A tower to be built, and the blocks at hand.

    Attributes:
        blocks: all blocks, those that the tower does not need among them.
        levels: names of the blocks that the reference is made of, from the bottom up.
        offsets: float64 (n_levels, 2): how far each level's middle lies from the plumb line, along x and y.
        frame: height of the space that pictures show; None is the height of the tower.
        tabulate: whether towers of one shape share what is known of their geometry; otherwise all is asked anew.
    """

    blocks: tuple[Block, ...]
    levels: tuple[str, ...]
    offsets: Array
    frame: float | None = None
    tabulate: bool = field(default=True, repr=False)

    @classmethod
    def of(
        cls,
        blocks: Sequence[Block],
        levels: Sequence[str],
        offsets: ArrayLike | None = None,
        frame: float | None = None,
    ) -> Self:
        """A reference tower, checked; without offsets it stands plumb.

        Raises AssemblyError: no levels, a name that two blocks bear or two levels take, offsets of another shape;
        UnknownNameError: a level of no known block.
        """
        names = [b.name for b in blocks]
        if twice := sorted({n for n in names if names.count(n) > 1}):
            raise AssemblyError(f"Expected each block's name once; got twice: {', '.join(twice)}. Rename one.")
        levels = tuple(levels)
        if not levels:
            raise AssemblyError("Expected a tower of at least one level; got none.")
        for name in levels:
            if name not in names:
                raise UnknownNameError("block", name, names)
        if twice := sorted({n for n in levels if levels.count(n) > 1}):
            raise AssemblyError(f"Expected each block in one level of the tower; got twice: {', '.join(twice)}.")
        moved = np.zeros((len(levels), 2)) if offsets is None else np.asarray(offsets, dtype=np.float64)
        if moved.shape != (len(levels), 2) or not np.isfinite(moved).all():
            raise AssemblyError(f"Expected finite offsets (x, y) of {len(levels)} levels; got shape {moved.shape}.")
        return cls(tuple(blocks), levels, moved, frame)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all blocks."""
        return tuple(b.name for b in self.blocks)

    @cached_property
    def kinds(self) -> dict[str, Kind]:
        """Name of a block -> its kind."""
        return {b.name: b.kind for b in self.blocks}

    @cached_property
    def reference(self) -> tuple[Kind, ...]:
        """What kind of block each level asks for, from the bottom up."""
        return tuple(self.kinds[name] for name in self.levels)

    @cached_property
    def colours(self) -> tuple[str, ...]:
        """The colour sequence, from the bottom up."""
        return tuple(colour for colour, _ in self.reference)

    @cached_property
    def geometry(self) -> AssemblyGeometry:
        """The finished tower on the table at z = 0, its parts called level 1, level 2, ... from the bottom up."""
        sizes = tuple(size for _, size in self.reference)
        shared = _stack(sizes, tuple((float(x), float(y)) for x, y in self.offsets))
        return shared if self.tabulate else shared.anew()

    @property
    def assembly(self) -> Assembly:
        """The same as data."""
        return self.geometry.assembly

    def falling(self, height: int) -> tuple[int, ...]:
        """Which levels (from 0) would fall when the lowest `height` stood by themselves; none: they stand."""
        answer = self.geometry.stability.standing((1 << height) - 1)
        return () if answer.stands else tuple(i for i in range(height) if answer.falling >> i & 1)

    def built(self, order: Sequence[str]) -> Assembly:
        """The tower that these blocks make, from the bottom up: parts on the levels' places, named after the blocks.

        Raises UnknownNameError: no such block; AssemblyError: more blocks than levels, or none.
        """
        if not 0 < len(order) <= len(self.levels):
            raise AssemblyError(f"Expected 1 to {len(self.levels)} blocks; got {len(order)}.")
        for name in order:
            if name not in self.kinds:
                raise UnknownNameError("block", name, self.names)
        return _stacked(order, [self.kinds[name][1] for name in order], self.offsets.tolist())

    def anew(self) -> Self:
        """The same tower with nothing remembered: every question is asked anew."""
        return replace(self, tabulate=False)


@lru_cache(maxsize=4096)
def _stack(sizes: tuple[tuple[float, float, float], ...], offsets: tuple[tuple[float, float], ...]) -> AssemblyGeometry:
    return AssemblyGeometry(_stacked([f"level {i}" for i in range(1, len(sizes) + 1)], sizes, offsets))


def _stacked(names: Sequence[str], sizes: Sequence[Sequence[float]], offsets: Sequence[Sequence[float]]) -> Assembly:
    parts, top = [], 0.0
    for name, size, (x, y) in zip(names, sizes, offsets):
        at = shifted((x, y, top + size[2] / 2))
        parts.append(boxes_part(name, np.zeros((1, 3)), np.array(size), at))
        top += size[2]
    return Assembly(tuple(parts), table=0.0)
