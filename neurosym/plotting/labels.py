"""Names beside a drawing: one column on each side, none on another, each joined to its point by a straight line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from neurosym.plotting.layers import shortened

Point = tuple[float, float]

#: Size of the letters (points), from one name to the next, and from a name to its line (inches).
LETTERS, PITCH, AWAY = 6.5, 0.115, 0.03


@dataclass(frozen=True)
class Label:
    """A name that has its place.

    Attributes:
        key: what is named.
        said: what is written.
        right: whether it stands in the column on the right, and begins at `place`; else it ends there.
        place: where it is, in inches.
        point: what its line leads to, in inches.
    """

    key: str
    said: str
    right: bool
    place: Point
    point: Point


def said_of(name: str, number: str = "") -> str:
    """What a label says: its number in the order, where it has one, and the name, cut if it is long."""
    return f"{number}: {shortened(name)}" if number else shortened(name)


def width_of(said: str, size: float = LETTERS) -> float:
    """How wide a text is drawn (inches)."""
    from matplotlib.textpath import TextPath

    return float(TextPath((0, 0), said, size=size).get_extents().width) / 72 if said.strip() else 0.0


def in_columns(
    said: Mapping[str, str], points: Mapping[str, Point], left: float, right: float, span: tuple[float, float]
) -> list[Label]:
    """Labels in two columns, so that all lines together are as short as can be: then no two of them cross.

    Args:
        said: key -> what is written.
        points: key -> where its line leads.
        left, right: where the names of the left column end, and those of the right one begin.
        span: the least and the greatest height of a name; it must have room for half of them, `PITCH` apart.
    """
    keys = list(said)
    rows = 1 + int((span[1] - span[0]) / PITCH + 1e-6)
    heights = (span[0] + span[1]) / 2 + PITCH * (np.arange(rows)[::-1] - (rows - 1) / 2)
    slots = np.array([(x, y) for x in (left, right) for y in heights])
    ends = np.array([points[key] for key in keys])
    chosen = linear_sum_assignment(np.linalg.norm(ends[:, None] - slots, axis=2))[1]
    found = [
        Label(key, said[key], bool(slot >= rows), (float(slots[slot, 0]), float(slots[slot, 1])), points[key])
        for key, slot in zip(keys, chosen)
    ]
    level = _levelled(found, span)
    return found if _any_cross(level) else level


def _levelled(labels: Sequence[Label], span: tuple[float, float]) -> list[Label]:
    """The same labels in the same order, nearer to the heights of their points."""
    found: list[Label] = []
    for right in (False, True):
        column = sorted((label for label in labels if label.right == right), key=lambda label: -label.place[1])
        heights = _spaced([label.point[1] for label in column], span)
        found += [replace(label, place=(label.place[0], y)) for label, y in zip(column, heights)]
    return found


def _spaced(wanted: Sequence[float], span: tuple[float, float]) -> list[float]:
    """Heights from the top down, at least `PITCH` apart, none outside the span, close to what is wanted."""
    # Neighbours that would lie on one another form a block, which shares what is lacking (pool adjacent violators).
    blocks: list[tuple[float, int]] = []  # sum of the wanted heights of its first name, number of names
    for k, y in enumerate(wanted):
        blocks.append((y + PITCH * k, 1))
        while len(blocks) > 1 and blocks[-2][0] / blocks[-2][1] < blocks[-1][0] / blocks[-1][1]:
            total, count = blocks.pop()
            blocks[-1] = (blocks[-1][0] + total, blocks[-1][1] + count)
    tops = [total / count for total, count in blocks for _ in range(count)]
    least = span[0] + PITCH * (len(wanted) - 1)
    return [min(max(top, least), span[1]) - PITCH * k for k, top in enumerate(tops)]


def _any_cross(labels: Sequence[Label]) -> bool:
    return any(crosses(a.place, a.point, b.place, b.point) for k, a in enumerate(labels) for b in labels[:k])


def crosses(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether the lines from a to b and from c to d cross."""

    def side(p: Point, q: Point, r: Point) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0
