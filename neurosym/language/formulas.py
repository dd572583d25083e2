"""What a derived predicate may say of itself besides its verdicts: when it holds, written over fluents.

A verdict answers for one state; a formula speaks of all states at once, so that a problem can be written down for
programs that cannot ask geometry (`neurosym.pddl.export`). `Derived.formula` gives one; it may be None.
"""

from dataclasses import dataclass

from neurosym.language.terms import Fluent, Literal


@dataclass(frozen=True)
class Way:
    """One way in which a predicate holds: all these literals do.

    `name`: in words, for instance a direction; may be empty.
    """

    name: str
    literals: tuple[Literal, ...]


@dataclass(frozen=True)
class AnyOf:
    """Holds exactly when one of these ways does. Without any it never holds."""

    ways: tuple[Way, ...]


@dataclass(frozen=True)
class Stands:
    """Holds exactly when the parts of the world that are there stand under gravity, without one of them.

    There is no formula of bounded size for it: equilibrium is a linear program.

    `present`: the fluent of one part that says which parts are there. `without`: the part that is left out. `held`: how
    many may be held.
    """

    present: Fluent
    without: str
    held: int = 0


Formula = AnyOf | Stands
