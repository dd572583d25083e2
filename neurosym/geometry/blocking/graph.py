"""The blocking graph: per direction, which parts stand in the way of which.

A directional blocking graph (Wilson and Latombe, "Geometric reasoning about mechanical assembly", 1994) says
for one direction of translation to infinity which parts a part would hit. It is computed once, pair by pair
and body by body; every later question about a subset of the parts is bit arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from neurosym.geometry.blocking.stepping import hits_along
from neurosym.geometry.blocking.sweep import Hits, Sweeps
from neurosym.geometry.step_motion import Vector
from neurosym.support.arrays import Array
from neurosym.support.bitsets import bits, bitsets
from neurosym.support.deadline import check
from neurosym.support.progress import tell
from neurosym.support.words import in_words

if TYPE_CHECKING:
    import networkx as nx

#: Gives what a function finds, or found before.
Keep = Callable[[Callable[[], Sequence[Hits]]], Sequence[Hits]]


def _anew(find: Callable[[], Sequence[Hits]]) -> Sequence[Hits]:
    return find()


class BlockingGraph:
    """Blocking of an assembly in k directions.

    Args:
        sweeps: of the assembly.
        directions: float64 (k, 3), unit vectors.
        tabulate: whether all pairs are asked at once. Otherwise each question is asked anew (`hits_along`).
        kept: given what finds the hits along all directions, gives them, from disk for instance.

    Attributes:
        directions, vectors: the directions, as an array and as tuples.
        into_table: bool (k,): whether a motion along the direction would run into the table.
    """

    def __init__(self, sweeps: Sweeps, directions: Array, *, tabulate: bool = True, kept: Keep = _anew) -> None:
        self._kept = kept
        self.sweeps, self.assembly, self.names = sweeps, sweeps.assembly, sweeps.assembly.names
        self.directions = directions
        self.vectors: list[Vector] = [(x, y, z) for x, y, z in directions.tolist()]
        self.into_table = (directions[:, 2] < -self.assembly.tolerances.parallel) & self.assembly.has_table
        self._table = self.by_part if tabulate else None

    @cached_property
    def _hits(self) -> Sequence[Hits]:
        return self._kept(self._found)

    def _found(self) -> list[Hits]:
        along: list[Hits] = []
        for d, direction in enumerate(self.directions):
            check()
            tell("blocking", d, len(self.directions))
            opposite = np.flatnonzero(np.linalg.norm(self.directions[:d] + direction, axis=1) < 1e-12)
            # What hits what going one way is hit by it going the other.
            along.append(along[opposite[0]].reversed() if len(opposite) else self.sweeps.along(direction))
        tell()
        return along

    @cached_property
    def by_body(self) -> list[list[int]]:
        """by_body[d][i] is a bitset of the bodies that body i hits when it moves along direction d."""
        return [bitsets(hits.pairs, len(self.assembly.bodies)) for hits in self._hits]

    @cached_property
    def by_part(self) -> list[list[int]]:
        """The same for parts: what any body of the part hits, the part itself left out."""
        return [bitsets(self.assembly.owners[hits.pairs], len(self.names)) for hits in self._hits]

    @property
    def queries(self) -> int:
        """Pairs of bodies put to the exact test, after the filter by swept bounds."""
        return sum(hits.queries for hits in self._hits)

    def blockers(self, part: int, direction: int, among: int) -> int:
        """Bitset of those parts in `among` that part number `part` would hit along direction number `direction`."""
        others = among & ~(1 << part)
        if self._table is None:
            return hits_along(self.sweeps, part, self.directions[direction], others)
        return self._table[direction][part] & others

    def group_blockers(self, group: int, direction: int, among: int) -> int:
        """The same for a group of parts (a bitset) that leaves together."""
        rest, hit = among & ~group, 0
        for part in bits(group):
            hit |= self.blockers(part, direction, rest)
        return hit

    def free_directions(self, part: int, among: int, *, table: bool = True) -> list[int]:
        """Numbers of the directions along which a part can leave the parts in `among` (and the table).

        A fixed part has none.
        """
        check()
        if self.assembly.fixed_mask >> part & 1:
            return []
        return [
            d
            for d in range(len(self.directions))
            if not (table and self.into_table[d]) and not self.blockers(part, d, among)
        ]

    def carried(self, group: int, direction: int, among: int, *, backwards: bool = False) -> int:
        """Bitset of all parts in `among` that move when the parts in `group` move along a direction, `group` too.

        What is hit is pushed along, and hits in turn: the closure of `group` under blocking. Backwards: all that cannot
        move along the direction while `group` stays.
        """
        rows = None if self._table is None else (self._hit_by if backwards else self._table)[direction]
        moving = waiting = group & among
        while waiting:
            check()
            rest, hit = among & ~moving, 0
            if rows is not None:
                for part in bits(waiting):
                    hit |= rows[part]
            elif backwards:
                hit = sum(1 << part for part in bits(rest) if self.blockers(part, direction, waiting))
            else:
                hit = self.group_blockers(waiting, direction, rest)
            waiting = hit & rest
            moving |= waiting
        return moving

    @cached_property
    def _hit_by(self) -> list[list[int]]:
        """by_part the other way: which parts hit each."""
        return [bitsets(self.assembly.owners[hits.pairs[:, ::-1]], len(self.names)) for hits in self._hits]

    def leaving_group(self, part: int, direction: int, among: int, *, table: bool = True) -> int:
        """Bitset of the smallest group that holds a part and can leave the rest of `among` along a direction.

        0 when there is none, because a fixed part or the table would have to move. The group may be all of `among`.
        """
        if table and self.into_table[direction]:
            return 0
        group = self.carried(1 << part, direction, among)
        return 0 if group & self.assembly.fixed_mask else group

    def components(self, direction: int, among: int, *, table: bool = True) -> list[int]:
        """The parts in `among` as bitsets that can leave along a direction only together, in an order that works.

        These are the strongly connected components of the direction's graph: each hits only itself and earlier
        ones. Those that a fixed part or the table keeps are left out; `carried` says which parts they would move.
        """
        if table and self.into_table[direction]:
            return []
        import networkx as nx  # not at the top: many commands draw no graph

        index = self.assembly.index
        groups = nx.strongly_connected_components(self.graph(direction, among))
        masks = [sum(1 << index[name] for name in group) for group in groups]
        fixed = self.assembly.fixed_mask
        kept = 0
        found = []
        for mask in masks:  # networkx gives a component after those it leads to
            if mask & fixed or self.group_blockers(mask, direction, kept):
                kept |= mask
            else:
                found.append(mask)
        return found

    def graph(self, direction: int, among: int | None = None) -> nx.DiGraph:
        """The graph of one direction: an edge from a part to each part that it would hit.

        A part without outgoing edges is free in this direction; the parts of a strongly connected component
        can leave only together.
        """
        import networkx as nx

        among = (1 << len(self.names)) - 1 if among is None else among
        graph = nx.DiGraph(direction=tuple(map(float, self.directions[direction])))
        for i in bits(among):
            graph.add_node(self.names[i])
        for i in bits(among):
            graph.add_edges_from((self.names[i], self.names[j]) for j in bits(self.blockers(i, direction, among)))
        return graph

    def describe(self, direction: int) -> str:
        """A direction in words: ``+z``, or its three numbers."""
        return in_words(self.vectors[direction])


