"""Which groups of voxel parts can move, given how far each part can go before it meets another.

Let ``gap[i][j]`` be the number of cells that part i can go along a direction before it hits part j. A group G can go
s cells exactly when ``gap[i][j] >= s`` for every i in G and j outside: G is closed under the relation "i drives j",
``gap[i][j] < s``. The closed groups are the unions of the closures of single parts, so these and their unions are all
the moves of s cells there are. (BurrTools closes the matrix of gaps by shortest paths, which is the same relation.)
Moving G one way or the others the other way leaves the same relative offsets, so groups without one reference part, in
all six directions, cover everything; fixed parts are that reference.

Groups are bitsets of parts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from neurosym.geometry.paths.voxel_gaps import Meeting
from neurosym.support.bitsets import bits
from neurosym.support.deadline import check

#: No obstacle ahead, however far.
ENDLESS = 1 << 30


def closures(ahead: Sequence[Meeting], count: int, steps: int, reference: int) -> Iterator[int]:
    """Of each part outside `reference`, the parts that go along when it goes `steps`, each group once.

    Groups that drive the reference, a bitset of parts that stay, are left out. `ahead` is what each of the
    `count` parts meets in the direction of the move.
    """
    along = [0] * count
    into = [0] * count
    for gap, i, j in ahead:
        if gap < steps:
            along[i] |= 1 << j
            into[j] |= 1 << i
    seen = set()
    for i in bits(((1 << count) - 1) & ~_closed(reference, into)):
        group = _closed(1 << i, along)
        if group not in seen:
            seen.add(group)
            yield group


def _closed(group: int, successors: Sequence[int]) -> int:
    """A group with all that its members lead to."""
    new = group
    while new:
        after = 0
        for i in bits(new):
            after |= successors[i]
        new = after & ~group
        group |= new
    return group


def unions(groups: Iterable[int]) -> list[int]:
    """All unions of one or more of these groups, in order of their numbers."""
    every = {0}
    for group in groups:
        check()
        every |= {group | known for known in every}
    return sorted(every - {0})


def undriving(ahead: Sequence[Meeting], count: int, reference: int) -> Iterator[int]:
    """The strongly connected groups that drive no others: the smallest closure of any direction is one of them.

    Arguments as for `closures`; groups with a part of the reference are left out. For many parts this is quicker.
    """
    rows, columns = np.array([i for _, i, _ in ahead], dtype=int), np.array([j for _, _, j in ahead], dtype=int)
    graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(count, count))
    number, label = connected_components(graph, connection="strong")
    drivers = set(label[rows][label[rows] != label[columns]].tolist())
    groups = dict.fromkeys(range(number), 0)
    for part, of in enumerate(label.tolist()):
        groups[of] |= 1 << part
    for of, group in groups.items():
        if of not in drivers and not group & reference:
            yield group
