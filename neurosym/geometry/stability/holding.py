"""Whether a subset stands, and which parts to hold so that it does: a set that hits every motion in which it falls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from neurosym.support.bitsets import bits


@dataclass(frozen=True)
class Standing:
    """Whether a subset of parts stands.

    Attributes:
        stands: the answer.
        moving: if not, a bitset of parts that move in a virtual motion that nothing resists. While all of them are
            there, none of them held, any smaller subset falls too.
        held: a bitset of the parts that have to be held for it to stand.
    """

    stands: bool
    moving: int = 0
    held: int = 0

    @property
    def promises(self) -> bool:
        """Whether any smaller subset falls while all of `moving` are there, none of them held."""
        return not self.stands

    @property
    def falling(self) -> int:
        """A bitset of all that falls, as far as it is known: `moving`, and what goes along."""
        return self.moving


def parts_to_hold(standing: Callable[[int], Standing], hands: int, most: int) -> tuple[int | None, list[int]]:
    """What to hold, `most` parts at the most, so that a subset stands.

    Holding helps only against a motion in which the held part moves. So where a subset falls, one of the parts that
    move is held, and the question is asked again.

    Args:
        standing: whether the subset stands when the parts in a bitset are held.
        hands: bitset of the parts that can be held.

    Returns:
        A bitset of parts, None if nothing helps; and the motions that were met, each a bitset of the parts that move.
    """
    motions: list[int] = []
    lasting: list[int] = []  # those that stay possible whatever else is held
    asked: set[int] = set()

    def search(held: int, left: int) -> int | None:
        if held in asked:
            return None
        asked.add(held)
        missed = [m & hands for m in lasting if not m & held]
        options = min(missed, key=int.bit_count, default=None)
        if options is None:
            answer = standing(held)
            if answer.stands:
                return held
            motions.append(answer.moving)
            if answer.promises:
                lasting.append(answer.moving)
            options = answer.moving & hands & ~held
        for part in bits(options) if left else ():
            found = search(held | 1 << part, left - 1)
            if found is not None:
                return found
        return None

    return search(0, most), motions


def all_falling(standing: Callable[[int, int], Standing], subset: int, falling: int) -> int:
    """Bitset of all parts of a subset that fall, some of which are known: what falls though these are held falls, too.

    Args:
        standing: whether a subset stands when the parts in a bitset are held.
    """
    while falling and not (more := standing(subset, falling)).stands:
        if not more.falling & ~falling:
            break
        falling |= more.falling
    return falling
