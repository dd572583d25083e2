"""The symbols of Scrabble: a tile may be laid while it is unused and the reference has its letter at the next slot.

Tiles are laid left to right, so how many lie there says which slot is next, and no slot enters an action: the N tiles
are the N action primitives.
"""

from dataclasses import dataclass

from neurosym.language import Action, Atom, Domain, Fluent, Type
from neurosym.language.search_problem import Verdict
from neurosym.language.state import State
from neurosym.language.terms import derived

tile = Type("tile")
laid = Fluent("laid", tile)


@dataclass(frozen=True)
class Reference:
    """The word to lay, and what to lay it with.

    `word`: its letters; slot i takes ``word[i]``. `tiles`: names of the tiles, a letter and an instance. `start`: how
    many slots are filled when the problem begins.
    """

    word: str
    tiles: tuple[str, ...]
    start: int = 0

    def atoms(self, letter: str) -> tuple[Atom, ...]:
        """`laid` of every tile of a letter."""
        return tuple(laid(name) for name in self.tiles if name[0] == letter)


def _slots_filled(world: Reference, state: State) -> int:
    return state.mask(laid, world.tiles).bit_count()


@derived(tile)
def matches(world: Reference, state: State, name: str) -> Verdict:
    """Whether the reference has the tile's letter at the next slot."""
    word, letter = world.word, name[0]
    slot = _slots_filled(world, state)
    if slot >= len(word):
        return Verdict(False, (name,), f"All {len(word)} slots are filled; {name} has no place.", until=())
    if word[slot] == letter:
        return Verdict(True, (name,))
    reason = f"Slot {slot} wants {word[slot]}; {name} is {'an' if letter in 'aefhilmnorsx' else 'a'} {letter}"
    # What was fit for an earlier slot was not refused there: then the promise holds from here on only.
    everywhere = letter not in word[world.start : slot]
    later = word.find(letter, slot)
    if later < 0:
        return Verdict(False, (name,), f"{reason}, wanted nowhere later.", until=(), unconditional=everywhere)
    # The slot before the tile's own must be filled first, and only its letter can do that.
    reason = f"{reason}, wanted at slot {later}."
    return Verdict(False, (name,), reason, until=world.atoms(word[later - 1]), unconditional=everywhere)


@derived()
def all_slots_filled(world: Reference, state: State) -> Verdict:
    """Whether the word is laid to its end."""
    filled, length = _slots_filled(world, state), len(world.word)
    return Verdict(filled >= length, (), f"{filled} of {length} slots are filled.")


_t = tile("t")
_lay = Action("lay", _t, pre=[~laid(_t), matches(_t)], eff=[laid(_t)], label="{t}", once=True)
DOMAIN = Domain("scrabble", fluents=[laid], actions=[_lay])
