"""Lines between boxes: each as little bent as it can be without running through the boxes of others."""

from collections.abc import Mapping, Sequence

import numpy as np

from neurosym.plotting.layers import BOX, box_width
from neurosym.support.arrays import Array

Point = tuple[float, float]
#: Bends that are tried, as shares of a line's length (the ``rad`` of matplotlib's ``arc3``), the straight line first.
BENDS = (0.0, 0.12, -0.12, 0.25, -0.25, 0.4, -0.4, 0.6, -0.6, 0.8, -0.8)
#: What a box in the way, a crossing, leaving the picture, and a whole line's length of bending cost.
_HIT, _CROSS, _OUTSIDE, _BENT = 100.0, 1.0, 1000.0, 4.0
#: Room around boxes (inches), and points along a line.
_CLEAR, _POINTS = 0.03, 24


def bends(
    pairs: Sequence[tuple[str, str]], places: Mapping[str, Point], room: tuple[float, float, float, float]
) -> list[float]:
    """How much each line is bent so that it runs through no box but its own two, and crosses few others.

    `pairs`: names that are joined, the line going from the first to the second. `places`: name -> the middle of its
    box, in inches. `room`: left, lower, right and upper end of where lines may run (inches). Returns one of `BENDS` a
    pair.
    """
    import shapely

    left, low, right, high = room
    boxes = {name: _box(name, at) for name, at in places.items()}
    chosen: list[float] = []
    drawn: list[shapely.LineString] = []
    for a, b in pairs:
        others = [box for name, box in boxes.items() if name not in (a, b)]
        lines = [shapely.LineString(curve(places[a], places[b], bend)) for bend in BENDS]
        costs = []
        for bend, line in zip(BENDS, lines):
            hits, crossed = shapely.intersects(line, others).sum(), shapely.crosses(line, drawn).sum()
            x1, y1, x2, y2 = line.bounds
            outside = x1 < left or y1 < low or x2 > right or y2 > high
            costs.append(_HIT * hits + _CROSS * crossed + _OUTSIDE * outside + _BENT * abs(bend))
        best = int(np.argmin(costs))
        chosen.append(BENDS[best])
        drawn.append(lines[best])
    return chosen


def curve(start: Point, end: Point, bend: float) -> Array:
    """float64 (n, 2): points on matplotlib's ``arc3`` with this ``rad``: a quadratic Bezier curve."""
    (x1, y1), (x2, y2) = start, end
    middle = np.array([(x1 + x2) / 2 + bend * (y2 - y1), (y1 + y2) / 2 - bend * (x2 - x1)])
    t = np.linspace(0, 1, _POINTS)[:, None]
    return np.asarray((1 - t) ** 2 * np.array(start) + 2 * t * (1 - t) * middle + t**2 * np.array(end))


def _box(name: str, at: Point) -> object:
    import shapely

    wide, high = box_width(name) / 2 + _CLEAR, BOX / 2 + _CLEAR
    return shapely.box(at[0] - wide, at[1] - high, at[0] + wide, at[1] + high)
