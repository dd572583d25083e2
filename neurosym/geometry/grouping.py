"""Piece groups, as BurrTools has them: parts that need not be separated from one another."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class PieceGroup:
    """Parts that need not be separated from one another, though they may be.

    Attributes:
        members: names of interchangeable parts, most often one, and how many of them may be in the group. Which, is
            open, as it is of copies of one shape of which only some are in a group.
    """

    members: tuple[tuple[tuple[str, ...], int], ...]

    @classmethod
    def of(cls, names: Iterable[str]) -> PieceGroup:
        """A group of all these parts."""
        return cls(tuple(((name,), 1) for name in names))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all that may be in it."""
        return tuple(dict.fromkeys(name for names, _ in self.members for name in names))

    def renamed(self, renamed: Mapping[str, str]) -> PieceGroup:
        """The group once parts became others, several parts one: that is in it if all of them were.

        A part that is made of several copies counts as so many.
        """
        out = {new for old, new in renamed.items() if old not in self.names}
        members = [(tuple(renamed.get(n, n) for n in names), most) for names, most in self.members]
        kept = [(tuple(n for n in names if n not in out), most) for names, most in members]
        return PieceGroup(tuple((names, most) for names, most in kept if names))


def need_not_part(blocks: Sequence[Collection[str]], groups: Sequence[PieceGroup]) -> bool:
    """Whether each block of parts lies within one group, and no group has more copies in all its blocks than it may."""
    left = [[most for _, most in group.members] for group in groups]

    def fits(number: int) -> bool:
        if number == len(blocks):
            return True
        block = blocks[number]
        for group, room in zip(groups, left):
            taken = [sum(name in block for name in names) for names, _ in group.members]
            if not set(block) <= set(group.names) or any(t > r for t, r in zip(taken, room)):
                continue
            room[:] = [r - t for r, t in zip(room, taken)]
            if fits(number + 1):
                return True
            room[:] = [r + t for r, t in zip(room, taken)]
        return False

    return fits(0)
