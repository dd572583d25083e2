"""Names of parts that can be printed, typed and told apart, from whatever files call them."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence

from neurosym.geometry.notes import Note

#: Longer names are cut.
MAX_LENGTH = 120

#: Unicode's categories of what cannot be shown: controls, halves of characters, private ones, line ends.
_UNPRINTABLE = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")


def distinct(names: Sequence[str], what: str = "part") -> tuple[list[str], list[Note]]:
    """Names without control characters, none empty, none twice, in the same order; and a note for each one changed.

    A name that is given again gets " (2)", " (3)" and so on; an empty one becomes "part-7", counted from 1.
    """
    chosen: list[str] = []
    notes = []
    # Names that come once keep theirs, whatever the others turn into.
    plain = [_plain(name) or f"{what}-{number}" for number, name in enumerate(names, 1)]
    first = {name: i for i, name in reversed(list(enumerate(plain)))}
    taken = set(first)
    copies: dict[str, int] = {}
    for i, (given, name) in enumerate(zip(names, plain)):
        if first[name] != i:
            number = copies.get(name, 2)
            while f"{name} ({number})" in taken:
                number += 1
            copies[name] = number + 1
            name = f"{name} ({number})"
            taken.add(name)
        if name != given:
            notes.append(Note(name, "name", 0.0, f"Part {name!r} is called {_brief(given)} in the file."))
        chosen.append(name)
    return chosen, notes


def _plain(name: str) -> str:
    """Without control characters, line ends and halves of characters; white space at the ends is dropped."""
    cut = name[: 4 * MAX_LENGTH]
    # Of all white space only the plain space is printable.
    kept = ("_" if unicodedata.category(c) in _UNPRINTABLE else c if c.isprintable() else " " for c in cut)
    return "".join(kept).strip()[:MAX_LENGTH].strip()


def _brief(name: str) -> str:
    return ascii(name if len(name) <= 60 else name[:57] + "...")
