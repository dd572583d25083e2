"""Names for PDDL: any text becomes an identifier, and two texts never the same one."""

import re

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
