"""Lists of names, and directions, in a sentence."""

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


def counted(number: int, what: str) -> str:
    """'1 step', '2,000 steps'."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def in_words(direction: Sequence[float]) -> str:
    """A direction of three numbers: ``+z`` along an axis of the world, its three numbers otherwise."""
    for axis, name in enumerate("xyz"):
        if abs(abs(direction[axis]) - 1) < 1e-9:
            return ("+" if direction[axis] > 0 else "-") + name
    return "(" + ", ".join(f"{float(v) + 0.0:.3g}" for v in direction) + ")"
