"""At which offsets the faces of moving parts come level with faces of the others.

Between boxes with common axes those offsets at which a lower face comes to lie on an upper one are enough: any free
place can be moved down along each axis until something is underneath, and the places so moved hang together as the free
places did. For other shapes the levels of the commonest corners stand in, filled up by even steps.
"""

from __future__ import annotations

import numpy as np

from neurosym.geometry.paths.removal import Removal
from neurosym.support.arrays import Array

#: Levels of corners considered for each side, and offsets along an axis, for parts that are no boxes.
MAX_LEVELS = 24
MAX_OFFSETS = 48

#: Even steps along an axis for parts that are no boxes.
FILL = 24


def levels_along(removal: Removal, direction: Array, rotation: Array, digits: int) -> list[float]:
    """Offsets of the moving parts, turned by a rotation (3, 3), along one of the axes of the removal's frame, in order.

    0 and one beyond each end are among them; they are rounded to so many digits.
    """
    assembly = removal.assembly
    # Offsets are the centre's: turning back the direction is cheaper than turning the parts.
    towards = rotation.T @ direction
    base = float(removal.centre @ (direction - towards))
    own = [assembly.bodies.vertices(i) @ towards + base for i in removal.own_bodies]
    others = [assembly.bodies.vertices(i) @ direction for i in removal.other_bodies]
    low, high = min(o.min() for o in own), max(o.max() for o in own)
    ends = min(o.min() for o in others), max(o.max() for o in others)
    room = 0.25 * assembly.smallest_extent
    start, end = float(ends[0] - high - room), float(ends[1] - low + room)
    must = [0.0, start, end]
    if removal.ground is not None and abs(direction[2]) > 1 - 1e-9:
        lowest = low if direction[2] > 0 else high
        must.append(removal.ground * float(np.sign(direction[2])) - float(lowest))
    if removal.aligned:
        lower, upper = np.unique([o.min() for o in own]), np.unique([o.max() for o in others])
        found = _merged((upper[:, None] - lower).ravel(), must, start, end, assembly.touch, None)
    else:
        common = [commonest(np.concatenate(points), assembly.touch) for points in (own, others)]
        must.extend(np.linspace(start, end, FILL).tolist())
        between = (common[1][:, None] - common[0]).ravel()
        found = _merged(between, must, start, end, assembly.touch, MAX_OFFSETS)
    return sorted({round(float(v), digits) + 0.0 for v in found})


def _merged(levels: Array, must: list[float], start: float, end: float, touch: float, limit: int | None) -> Array:
    """Levels within the range, those nearer than `touch` to another merged, the commonest kept; `must` are all kept."""
    found = sorted(must)
    levels = np.sort(levels[(levels > start) & (levels < end)])
    if len(levels):
        groups = np.split(levels, np.flatnonzero(np.diff(levels) > touch) + 1)
        if limit is not None:
            groups = sorted(groups, key=len, reverse=True)[:limit]
        # The middle of a group of levels that differ by rounding, or by overlaps that are no more than touch.
        middles = np.array([g.mean() for g in groups])
        found.extend(m for m in middles if np.abs(np.array(must) - m).min() > touch)
    return np.unique(found)


def commonest(levels: Array, touch: float) -> Array:
    """The levels that most corners lie on, float64 (k,), the commonest first; those within `touch` count as one."""
    levels = np.sort(levels)
    groups = np.split(levels, np.flatnonzero(np.diff(levels) > touch) + 1)
    chosen = sorted(groups, key=len, reverse=True)[:MAX_LEVELS]
    return np.array([g.mean() for g in chosen])
