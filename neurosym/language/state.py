"""What a derived predicate may ask of a state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from neurosym.language.terms import Atom, Fluent


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
        return sum(1 << i for i, name in enumerate(names) if Atom(fluent, (name,)) in self.atoms)
