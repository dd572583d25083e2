"""Names as figures write them: cut to a length, without what all of them share, and how wide they are."""

from collections.abc import Sequence

#: Longest name; what is longer is cut.
MOST_LETTERS = 14


def shortened(name: str, most: int = MOST_LETTERS) -> str:
    """A name of at most so many letters; what is longer loses its middle, as names often differ at their ends."""
    if len(name) <= most:
        return name
    tail = (most - 1) // 2
    return name[: most - 1 - tail] + "…" + name[len(name) - tail :]


def without_common(names: Sequence[str]) -> dict[str, str]:
    """Names without what all of them share: ``remove(leg)`` among removals is ``leg``."""
    heads = {name.partition("(")[0] for name in names}
    if len(heads) == 1 and all(name.endswith(")") and "(" in name for name in names):
        return {name: name.partition("(")[2][:-1] for name in names}
    return {name: name for name in names}


def width_of(text: str, size: float) -> float:
    """How wide a text of so many points is drawn (inches)."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0, 0), text, size=size).get_extents().width) / 72 if text.strip() else 0.0
