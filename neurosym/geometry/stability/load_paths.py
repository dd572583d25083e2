"""Where loads go straight down: a proof, without solving anything, that parts stand.

A part whose centre of mass, and all corners at which others lie on it, are above the area that it lies on itself hands
every load on to those below, without friction and without being held down by anything. Where all parts do, pushes
without friction balance, whatever springs and friction add: such parts stand. Walls and stacks are mostly so.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from neurosym.geometry.contact.contacts import TABLE, Contact
from neurosym.support.arrays import Array
from neurosym.support.bitsets import bits

#: A contact is level when its normal is this near to the vertical (sine).
LEVEL = 1e-6
#: A point within this share of a part's size of the area is on it.
_ON_EDGE = 1e-9


class LoadPaths:
    """Which parts hand on every load, given which of their neighbours are there.

    Args:
        patches: between parts, or a part and the table; normals from a to b.
        centres: float64 (n, 3): centres of mass.
    """

    def __init__(self, patches: Sequence[Contact], centres: Array) -> None:
        n = len(centres)
        self.centres = centres[:, :2]
        #: What each part lies on, and what lies on it: number of the other (or TABLE), and corners (k, 2).
        self.below: list[list[tuple[int, Array]]] = [[] for _ in range(n)]
        self.above: list[list[tuple[int, Array]]] = [[] for _ in range(n)]
        self.near = [0] * n
        lower, upper = [], []
        for p in patches:
            if np.hypot(p.normal[0], p.normal[1]) > LEVEL:
                continue
            top, bottom = (p.a, p.b) if p.normal[2] < 0 else (p.b, p.a)
            if top == TABLE:
                continue
            self.below[top].append((bottom, p.points[:, :2]))
            if bottom != TABLE:
                self.above[bottom].append((top, p.points[:, :2]))
                self.near[top] |= 1 << bottom
                self.near[bottom] |= 1 << top
                lower.append(bottom)
                upper.append(top)
        # Parts that lie on one another in a circle hand nothing on.
        graph = csr_array((np.ones(len(lower)), (upper, lower)), shape=(n, n))
        _, label = connected_components(graph, directed=True, connection="strong")
        self.circular = np.bincount(label, minlength=n)[label] > 1
        self._known: dict[tuple[int, int], bool] = {}
        self._carried = (0, 0)

    def carry(self, there: int, movable: int) -> bool:
        """Whether all movable parts of those that are there hand on every load; bitsets. True is a proof."""
        seen, moved = self._carried
        fresh = movable
        if not there & ~seen and not movable & ~moved:
            fresh = 0
            for part in bits(seen & ~there):
                fresh |= self.near[part]
            fresh &= movable
        if not all(self.hands_on(part, there) for part in bits(fresh)):
            return False
        self._carried = there, movable
        return True

    def unproved(self, there: int, movable: int) -> int:
        """Movable parts that do not hand on every load, and all that lie on these, as a bitset.

        Where these stand by pushes straight down, all others immovable, all movable parts stand.
        """
        found = fresh = sum(1 << part for part in bits(movable) if not self.hands_on(part, there))
        while fresh:
            above = 0
            for part in bits(fresh):
                for top, _ in self.above[part]:
                    above |= 1 << top
            fresh = above & movable & ~found
            found |= fresh
        return found

    def hands_on(self, part: int, there: int) -> bool:
        """Whether a part hands on every load to those below that are there."""
        key = part, there & self.near[part]
        answer = self._known.get(key)
        if answer is None:
            answer = self._known[key] = not self.circular[part] and self._hands_on(part, there)
        return answer

    def _hands_on(self, part: int, there: int) -> bool:
        area = [points for other, points in self.below[part] if other == TABLE or there >> other & 1]
        loads = [points for other, points in self.above[part] if there >> other & 1]
        if not area:
            return False
        return _within(np.concatenate([self.centres[part][None], *loads]), np.concatenate(area))


def _within(points: Array, corners: Array) -> bool:
    """Whether all points (k, 2) lie in the convex hull of corners (m, 2), its edge included."""
    edge = _ON_EDGE * float(np.ptp(corners, axis=0).max())
    ring = _hull(corners)
    along = np.roll(ring, -1, axis=0) - ring
    off = points[:, None] - ring
    outside = off[..., 0] * along[:, 1] - off[..., 1] * along[:, 0]
    return bool((outside <= edge * np.hypot(along[:, 0], along[:, 1])).all())


def _hull(points: Array) -> Array:
    """Corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(map(tuple, points.tolist())))
    rings = []
    for run in (ordered, ordered[::-1]):
        ring: list[tuple[float, float]] = []
        for x, y in run:
            while len(ring) > 1:
                (px, py), (qx, qy) = ring[-2:]
                if (qx - px) * (y - py) - (qy - py) * (x - px) > 0:
                    break
                ring.pop()
            ring.append((x, y))
        rings += ring[:-1]
    return np.array(rings)
