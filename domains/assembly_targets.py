"""Taking out some parts only: what has to go before them, if nothing could fall.

Without gravity this is an AND/OR graph (Homem de Mello and Sanderson, "AND/OR graph representation of assembly plans",
IEEE Transactions on Robotics and Automation 6(2), 1990): a part leaves along one of its directions (OR) once all that
it would hit there is out (AND). With gravity no smaller set gets the targets out, whatever is held: the smallest bounds
the number of removals from below, and is a good guess which they are.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any

from neurosym.geometry.queries import AssemblyGeometry
from neurosym.support.bitsets import bits

if TYPE_CHECKING:
    from domains.assembly import Setting

#: Sets of parts that one search for the smallest looks at. Where it ends, the bound is lower than it might be.
MAX_SETS = 2_000


class Relaxation:
    """Removals without gravity, as bitsets of parts.

    Args:
        geometry: of the assembly, with its fixed parts and its ground.
        setting: the options of the problem.
        targets: the parts that are to be out.
        before: pairs of names of parts: the first must leave before the second.
    """

    def __init__(
        self, geometry: AssemblyGeometry, setting: Setting, targets: int, before: Iterable[tuple[str, str]]
    ) -> None:
        self.geometry, self.setting, self.targets, self.before = geometry, setting, targets, tuple(before)
        self._known: dict[int, tuple[int, tuple[int, ...]]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies sent to other processes leave the answers behind."""
        return Relaxation, (self.geometry, self.setting, self.targets, self.before)

    @cached_property
    def _ways(self) -> list[list[int]]:
        """For each part what must be out before it, one bitset a direction; only with parts that come out at all."""
        geometry, everything = self.geometry, (1 << len(self.geometry)) - 1
        fixed = geometry.assembly.fixed_mask
        first = [geometry.mask({a for a, b in self.before if b == name}) & ~fixed for name in geometry.names]
        ways = [[own] for own in first]  # along a path anything may be passed
        if self.setting.paths == "straight":
            graph = geometry.blocking(self.setting.directions)
            usable = [d for d in range(len(graph.vectors)) if not graph.into_table[d]]
            ways = [[graph.blockers(p, d, everything) | own for d in usable] for p, own in enumerate(first)]
        ways = [[] if fixed >> p & 1 else own for p, own in enumerate(ways)]
        out = sum(1 << p for p in self._peeled(ways, everything, everything))
        ways = [[w for w in set(own) if not w & ~out] for own in ways]
        # What needs more than another way needs is never the better one.
        return [[w for w in own if not any(v != w and v & w == v for v in own)] for own in ways]

    @staticmethod
    def _peeled(ways: list[list[int]], among: int, there: int) -> list[int]:
        """Those in `among` that come out of `there` one by one while the others stay, in an order in which they do."""
        out: list[int] = []
        waiting = bits(among & there)
        while free := [p for p in waiting if not all(w & there for w in ways[p])]:
            out += free
            there &= ~sum(1 << p for p in free)
            waiting = [p for p in waiting if there >> p & 1]
        return out

    @cached_property
    def _landmarks(self) -> list[int]:
        """For each part all that is out whenever it is, itself included: what all its ways have in common.

        The greatest solution of landmarks(p) = p and the intersection over ways of the union of what they need (Keyder,
        Richter, Helmert, "Sound and complete landmarks for AND/OR graphs", ECAI 2010).
        """
        ways, everything = self._ways, (1 << len(self.geometry)) - 1
        found = [everything if own else 0 for own in ways]
        changed = True
        while changed:
            changed = False
            for p, own in enumerate(ways):
                common = everything if own else 0
                for way in own:
                    union = 0
                    for q in bits(way):
                        union |= found[q]
                    common &= union
                common |= 1 << p
                changed |= common != found[p]
                found[p] = common
        return found

    @cached_property
    def _needing(self) -> list[int]:
        """For each part the parts that have a way for which it must be out: a bitset."""
        found = [0] * len(self.geometry)
        for part, own in enumerate(self._ways):
            for q in {q for way in own for q in bits(way)}:
                found[q] |= 1 << part
        return found

    def may_swap(self, one: int, other: int) -> bool:
        """Whether all ways of all parts stay as they are when two parts are swapped."""
        both = 1 << one | 1 << other

        def swapped(ways: list[int]) -> set[int]:
            return {w ^ both if (w & both).bit_count() == 1 else w for w in ways}

        concerned = (self._needing[one] | self._needing[other]) & ~both
        return swapped(self._ways[one]) == set(self._ways[other]) and all(
            swapped(self._ways[p]) == set(self._ways[p]) for p in bits(concerned)
        )

    def smallest(self, there: int) -> tuple[int, tuple[int, ...]]:
        """Of the parts in `there`, how many must go at least until no target is there, and numbers of such, in order.

        The order lacks those that do not come out, where the search ended early.
        """
        there &= self._relevant
        if there not in self._known:
            self._known[there] = self._search(there)
        return self._known[there]

    @cached_property
    def _relevant(self) -> int:
        found = waiting = self.targets
        while waiting:
            below = 0
            for part in bits(waiting):
                for way in self._ways[part]:
                    below |= way
            waiting = below & ~found
            found |= waiting
        return found

    def _closed(self, parts: int, there: int) -> int:
        closed = parts
        for part in bits(parts):
            closed |= self._landmarks[part]
        return closed & there

    def _search(self, there: int) -> tuple[int, tuple[int, ...]]:
        """Sets grow by what a part needs that is not in them yet, the smallest first.

        Take the order in which a best set leaves. The first of its parts that does not come out of a smaller set within
        it goes a way that lacks something there, and all else that it needs does come out: other ways are left aside.
        """
        start = self._closed(self.targets & there, there)
        queue, seen = [(start.bit_count(), start)], {start}
        size, order = len(bits(start)), list[int]()
        for _ in range(MAX_SETS):
            if not queue:
                break
            size, best = heapq.heappop(queue)
            order = self._peeled(self._ways, best, there)
            stuck = best & ~sum(1 << p for p in order)
            if not stuck:
                break
            for part in bits(stuck):
                for way in self._ways[part]:
                    needed = way & there
                    if needed & stuck or not needed & ~best:
                        continue
                    larger = best | self._closed(needed & ~best, there)
                    if larger not in seen:
                        seen.add(larger)
                        heapq.heappush(queue, (larger.bit_count(), larger))
        return size, tuple(order)
