"""A lattice of translations whose lines lie where faces come level, searched by A*.

Offsets along each axis of the moving parts are those at which one of their faces comes level with a face of the
others, so passages without any play have lattice lines in them. Between boxes with common axes that is complete: the
free offsets are cut by these planes into boxes, each of them free or not as a whole, and any way through free ones can
be moved onto their edges. There a search that ends without a way out proves that no translations lead out. For other
shapes the levels of the commonest corners stand in, filled up by even steps.
"""

from __future__ import annotations

import heapq
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from neurosym.geometry.motions import Motion, shifted
from neurosym.geometry.removal import Removal

Array = NDArray[np.float64]
Index = tuple[int, int, int]

#: Levels of corners considered for each side, and offsets along an axis, for parts that are no boxes.
MAX_LEVELS = 24
MAX_OFFSETS = 48

#: Even steps along an axis for parts that are no boxes.
FILL = 24


class Lattice:
    """The lattice of one removal.

    Attributes:
        offsets: three float64 arrays: translations along the axes of the removal's frame.
        complete: whether no way out on the lattice means that there is none by translations.
    """

    def __init__(self, removal: Removal) -> None:
        self.removal = removal
        self.offsets = [self._along(axis) for axis in range(3)]
        ground = removal.ground is None or bool(np.isclose(np.abs(removal.frame[2]).max(), 1.0, atol=1e-9))
        self.complete = removal.aligned and ground
        self._known: dict[tuple[Index, Index], bool] = {}

    def search(self) -> list[Array] | None:
        """Poses (4, 4) of a way out, turns only; None: there is none on the lattice.

        Raises:
            OutOfBudget: the removal's budget ended the search.
        """
        while True:
            way = self._shortest()
            if way is None:
                return None
            poses = [shifted(self._offset(index)) for index in _corners(way)]
            bad = False
            # Boxes were answered exactly, edge by edge; other parts only at the ends and some places between.
            if not self.removal.aligned:
                for first, second in pairwise(way):
                    motion = Motion(shifted(self._offset(first)), shifted(self._offset(second)), self.removal.centre)
                    if not self.removal.is_clear(motion):
                        self._known[min(first, second), max(first, second)] = False
                        bad = True
            if not bad:
                return poses

    def _shortest(self) -> list[Index] | None:
        """A* from rest to the first offset that is out; straight on is a little cheaper than round a corner."""
        x, y, z = (int(np.flatnonzero(o == 0.0)[0]) for o in self.offsets)
        start: Index = (x, y, z)
        turn = 1e-3 * self.removal.assembly.smallest_extent
        best = {start: 0.0}
        came: dict[Index, Index] = {}
        queue: list[tuple[float, float, Index, int]] = [(self._left(start), 0.0, start, -1)]
        done = set()
        while queue:
            _, cost, at, heading = heapq.heappop(queue)
            if at in done:
                continue
            done.add(at)
            self.removal.spend()
            if self._left(at) == 0.0:
                way = [at]
                while way[-1] in came:
                    way.append(came[way[-1]])
                return way[::-1]
            for axis, sign in product(range(3), (1, -1)):
                place = at[axis] + sign
                if not 0 <= place < len(self.offsets[axis]):
                    continue
                following: Index = (*at[:axis], place, *at[axis + 1 :])  # type: ignore[assignment]
                if following in done:
                    continue
                step = abs(float(self.offsets[axis][place] - self.offsets[axis][at[axis]]))
                reached = cost + step + (0.0 if heading == axis else turn)
                if reached >= best.get(following, np.inf) or not self._is_free(at, following):
                    continue
                best[following], came[following] = reached, at
                heapq.heappush(queue, (reached + self._left(following), reached, following, axis))
        return None

    def _is_free(self, a: Index, b: Index) -> bool:
        edge = (min(a, b), max(a, b))
        known = self._known.get(edge)
        if known is None:
            known = self._known[edge] = self._asked(*edge)
        return known

    def _asked(self, a: Index, b: Index) -> bool:
        removal = self.removal
        first, second = self._offset(a), self._offset(b)
        if removal.aligned:
            return removal.is_clear(Motion(shifted(first), shifted(second), removal.centre))
        count = int(np.ceil(np.linalg.norm(second - first) / (0.2 * removal.assembly.smallest_extent)))
        shares = np.linspace(0.0, 1.0, max(count, 2) + 1)
        return not any(removal.hit(shifted((1 - s) * first + s * second)) for s in (1.0, *shares[:-1]))

    def _left(self, index: Index) -> float:
        return self.removal.left(shifted(self._offset(index)))

    def _offset(self, index: Index) -> Array:
        local = np.array([o[i] for o, i in zip(self.offsets, index)])
        offset: Array = self.removal.frame @ local
        return offset

    def _along(self, axis: int) -> Array:
        """Offsets along an axis, in order; 0 and one beyond each end are among them."""
        removal, assembly = self.removal, self.removal.assembly
        direction = removal.frame[:, axis]
        own = [assembly.body_vertices(i) @ direction for i in removal.own_bodies]
        others = [assembly.body_vertices(i) @ direction for i in removal.other_bodies]
        low, high = min(o.min() for o in own), max(o.max() for o in own)
        ends = min(o.min() for o in others), max(o.max() for o in others)
        room = 0.25 * assembly.smallest_extent
        start, end = float(ends[0] - high - room), float(ends[1] - low + room)
        must = [0.0, start, end]
        if removal.ground is not None and abs(direction[2]) > 1 - 1e-9:
            heights = np.concatenate([assembly.body_vertices(i)[:, 2] for i in removal.own_bodies])
            must.append((removal.ground - float(heights.min())) * float(np.sign(direction[2])))
        if removal.aligned:
            own_low, own_high = (np.unique([f(o) for o in own]) for f in (np.min, np.max))
            other_low, other_high = (np.unique([f(o) for o in others]) for f in (np.min, np.max))
            levels = [(other_low[:, None] - own_high).ravel(), (other_high[:, None] - own_low).ravel()]
            return _merged(np.concatenate(levels), must, start, end, assembly.touch, None)
        common = [_commonest(np.concatenate(points), assembly.touch) for points in (own, others)]
        levels = [(common[1][:, None] - common[0]).ravel()]
        must.extend(np.linspace(start, end, FILL).tolist())
        return _merged(np.concatenate(levels), must, start, end, assembly.touch, MAX_OFFSETS)


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


def _commonest(levels: Array, touch: float) -> Array:
    """The levels that most corners lie on."""
    levels = np.sort(levels)
    groups = np.split(levels, np.flatnonzero(np.diff(levels) > touch) + 1)
    chosen = sorted(groups, key=len, reverse=True)[:MAX_LEVELS]
    return np.array([g.mean() for g in chosen])


def _corners(way: list[Index]) -> list[Index]:
    """A way without the points that lie between two others on one line."""
    kept = [way[0]]
    for before, at, after in zip(way, way[1:], way[2:]):
        step, following = np.subtract(at, before), np.subtract(after, at)
        if not np.array_equal(step, following):
            kept.append(at)
    if len(way) > 1:
        kept.append(way[-1])
    return kept
