"""Lists of names in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

#: Names, or sentences of one kind, beyond this many are counted, not listed; the data has them all.
LISTED = 8


def joined(names: Sequence[str]) -> str:
    """'L', 'L and T', 'L, T and V'; nothing of none."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def listed(names: Sequence[str]) -> str:
    """'a, b and c'; many names are cut short."""
    if len(names) > LISTED:
        return f"{', '.join(names[: LISTED - 1])} and {len(names) - LISTED + 1} more"
    return joined(names)
