"""Lists of names in a sentence."""

from __future__ import annotations

from collections.abc import Sequence


def joined(names: Sequence[str]) -> str:
    """'L', 'L and T', 'L, T and V'; nothing of none."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
