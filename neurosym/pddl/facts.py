"""What a problem as STRIPS is made of: facts, and operators over them with positive conditions only."""

from dataclasses import dataclass

from neurosym.language.terms import Literal


@dataclass(frozen=True)
class Mark:
    """A fact that the language does not have: that an action was or was not done, that a fall can no longer happen.

    `kind`: "done" and "unused" (of an action), "averted" (of a fall), "kept" (of a part in the way of a fall). `label`:
    which one.
    """

    kind: str
    label: str


Fact = Literal | Mark


@dataclass(frozen=True)
class Operator:
    """What a planner may do.

    Attributes:
        name: in words; operators of one action may share it.
        action: the action primitive it stands for, None for a helper.
        how: in which way, in words; may be empty.
        pre, add, delete: facts, all positive.
    """

    name: str
    action: str | None
    how: str
    pre: frozenset[Fact]
    add: frozenset[Fact]
    delete: frozenset[Fact]


@dataclass(frozen=True)
class Strips:
    """A problem as operators over facts.

    `sound`: every plan is a plan of the problem. False: there was no time to find all falls. `notes`: sentences on how
    it came about.
    """

    operators: tuple[Operator, ...]
    init: frozenset[Fact]
    goal: frozenset[Fact]
    sound: bool
    notes: tuple[str, ...]

    @property
    def facts(self) -> tuple[Fact, ...]:
        """All facts, in a stable order."""
        every = {f: None for o in self.operators for s in (o.pre, o.add, o.delete) for f in sorted(s, key=str)}
        every.update(dict.fromkeys(sorted((*self.init, *self.goal), key=str)))
        return tuple(every)
