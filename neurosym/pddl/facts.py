"""What a problem as STRIPS is made of: facts, and operators over them with positive conditions only."""

import re
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

    `name`: in words; operators of one action may share it. `action`: the action primitive it stands for, None for a
    helper. `how`: in which way, in words; may be empty. `pre, add, delete`: facts, all positive.
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


#: What PDDL, or a reader of it, takes for something else.
RESERVED = frozenset(
    part
    for line in (
        "action all always and assign at axiom condition constants constraints decrease define derived distance",
        "domain duration durative-action effect either end exists false fluents forall functions goal implies imply",
        "increase init length maximize metric minimize not number object objects of-type or over parameters",
        "precondition predicates preference problem requirements scale-down scale-up situation sometime start",
        "strips total-cost total-time true typing types undefined when within",
    )
    for part in line.split(" ")
)


class Names:
    """Identifiers given out so far: letters in lower case, digits, hyphens and underscores, a letter first."""

    def __init__(self) -> None:
        self._taken: set[str] = set(RESERVED)

    def fresh(self, text: str) -> str:
        """An identifier like `text`, unlike all others. What PDDL does not allow becomes a hyphen."""
        spelt = re.sub(r"(?<![\w)])([+-])(?=\w)", lambda m: "plus-" if m[1] == "+" else "minus-", text.lower())
        base = re.sub(r"[^a-z0-9_]+", "-", spelt).strip("-_") or "x"
        if not base[0].isalpha():
            base = f"n{base}"
        name, count = base, 1
        while name in self._taken:
            count += 1
            name = f"{base}-{count}"
        self._taken.add(name)
        return name
