"""The blocking graph: per direction, which parts stand in the way of which.

A directional blocking graph (Wilson and Latombe, "Geometric reasoning about mechanical assembly", 1994) says
for one direction of translation to infinity which parts a part would hit. It is computed once, pair by pair
and body by body; every later question about a subset of the parts is bit arithmetic.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from neurosym.geometry.blocking.sweep import Sweep
from neurosym.geometry.step_motion import Vector
from neurosym.support.bitsets import bits, bitsets
from neurosym.support.words import in_words

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]


class BlockingGraph:
    """Blocking of an assembly in k directions.

    Attributes:
        directions: float64 (k, 3), unit vectors.
        by_body: by_body[d][i] is a bitset of the bodies that body i hits when it moves along direction d.
        by_part: the same for parts: what any body of the part hits, the part itself left out.
        into_table: bool (k,): whether a motion along the direction would run into the table.
        queries: pairs of bodies put to the exact test, after the filter by swept bounds.
    """

    def __init__(self, assembly: Assembly, directions: Array) -> None:
        self.assembly = assembly
        self.directions = directions
        self.vectors: list[Vector] = [(float(x), float(y), float(z)) for x, y, z in self.directions]
        self.names = assembly.names
        self.into_table = (self.directions[:, 2] < -assembly.tolerances.parallel) & assembly.has_table
        self.queries = 0
        self.by_body: list[list[int]] = []
        self.by_part: list[list[int]] = []
        sweeps: list[Sweep] = []
        for d, direction in enumerate(self.directions):
            opposite = np.flatnonzero(np.linalg.norm(self.directions[:d] + direction, axis=1) < 1e-12)
            # What hits what going one way is hit by it going the other.
            sweep = sweeps[opposite[0]].reversed() if len(opposite) else Sweep.along(assembly, direction)
            sweeps.append(sweep)
            self.queries += sweep.queries
            self.by_body.append(bitsets(sweep.hits, len(assembly.bodies)))
            self.by_part.append(bitsets(assembly.owners[sweep.hits], len(assembly)))

    def blockers(self, part: int, direction: int, among: int) -> int:
        """Bitset of those parts in `among` that part number `part` would hit along direction number `direction`."""
        return self.by_part[direction][part] & among & ~(1 << part)

    def group_blockers(self, group: int, direction: int, among: int) -> int:
        """The same for a group of parts (a bitset) that leaves together."""
        hit = 0
        for part in bits(group):
            hit |= self.by_part[direction][part]
        return hit & among & ~group

    def free_directions(self, part: int, among: int, *, table: bool = True) -> list[int]:
        """Numbers of the directions along which a part can leave the parts in `among` (and the table).

        A fixed part has none.
        """
        if self.assembly.fixed_mask >> part & 1:
            return []
        return [
            d
            for d in range(len(self.directions))
            if not (table and self.into_table[d]) and not self.blockers(part, d, among)
        ]

    def carried(self, group: int, direction: int, among: int) -> int:
        """Bitset of all parts in `among` that move when the parts in `group` move along a direction, `group` too.

        What is hit is pushed along, and hits in turn: the closure of `group` under blocking.
        """
        moving = waiting = group & among
        while waiting:
            hit = 0
            for part in bits(waiting):
                hit |= self.by_part[direction][part]
            waiting = hit & among & ~moving
            moving |= waiting
        return moving

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


