"""What a derived predicate may ask of a state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from neurosym.language.terms import Atom, Fluent

if TYPE_CHECKING:
    from neurosym.language.grounding import GroundProblem


class State(Protocol):
    """A read-only view of a state: which fluents hold. Grounded problems keep bits, replays keep sets."""

    def holds(self, atom: Atom) -> bool:
        """Whether a ground fluent holds."""
        ...

    def objects(self, fluent: Fluent) -> tuple[str, ...]:
        """The objects of which a fluent of one argument holds, in the order of the problem."""
        ...

    def mask(self, fluent: Fluent, names: tuple[str, ...]) -> int:
        """A bitset: bit i says whether the fluent holds of ``names[i]``."""
        ...


class AtomSet:
    """A state as a plain set of atoms: slow and obvious, for replays."""

    def __init__(self, atoms: set[Atom], objects: Sequence[str]) -> None:
        self.atoms = atoms
        self._objects = tuple(objects)

    def holds(self, atom: Atom) -> bool:
        return atom in self.atoms

    def objects(self, fluent: Fluent) -> tuple[str, ...]:
        return tuple(o for o in self._objects if Atom(fluent, (o,)) in self.atoms)

    def mask(self, fluent: Fluent, names: tuple[str, ...]) -> int:
        there = {atom.args for atom in self.atoms if atom.predicate == fluent}
        return sum(1 << i for i, name in enumerate(names) if (name,) in there)


class BitState:
    """A bitset of a grounded problem as a state."""

    __slots__ = ("_bits", "_ground")

    def __init__(self, ground: GroundProblem, bits: int) -> None:
        self._ground = ground
        self._bits = bits

    def holds(self, atom: Atom) -> bool:
        bit = self._ground._bits.get(atom)
        return bit is not None and bool(self._bits >> bit & 1)

    def objects(self, fluent: Fluent) -> tuple[str, ...]:
        start, names = self._ground.runs[fluent]
        run = self._bits >> start
        return tuple(name for i, name in enumerate(names) if run >> i & 1)

    def mask(self, fluent: Fluent, names: tuple[str, ...]) -> int:
        start, own = self._ground.runs[fluent]
        if own == names:
            return (self._bits >> start) & ((1 << len(own)) - 1)
        position = {name: i for i, name in enumerate(own)}
        run = self._bits >> start
        return sum(1 << i for i, name in enumerate(names) if name in position and run >> position[name] & 1)
