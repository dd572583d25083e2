"""Which of many axis-aligned bounds overlap: the filter before every exact question about pairs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely

from neurosym.support.arrays import Array, Numbers, Truths

#: Rows that one array operation works on at most: what bounds memory.
CHUNK = 1_000_000

#: Up to this many pairs all are compared with all, without a tree.
DENSE = 250_000

#: More overlapping pairs than this are too many to hold.
MOST = 50 * CHUNK

Bounds = tuple[Array, Array]


def near_pairs(
    first: Bounds, second: Bounds, limit: int, keep: Callable[[Numbers, Numbers], Truths] | None = None
) -> Numbers | None:
    """Pairs, int64 (k, 2), of boxes, one of each set, that overlap or touch; None when there are more than `limit`.

    Args:
        first, second: lowest and highest corners, float64 (n, 3) each, or (n, 2).
        keep: which of the pairs (i, j) count.
    """
    (low_a, high_a), (low_b, high_b) = first, second
    if not len(low_a) or not len(low_b):
        return np.zeros((0, 2), dtype=np.int64)
    dense = len(low_a) * len(low_b) <= min(DENSE, limit)
    # A tree over the two axes along which boxes are smallest for their spread; the third axis is looked at after.
    spread = np.ptp(low_b, axis=0) / np.maximum((high_b - low_b).mean(axis=0), 1e-300)
    x, y, *rest = np.argsort(-spread)
    tree = None if dense else shapely.STRtree(shapely.box(low_b[:, x], low_b[:, y], high_b[:, x], high_b[:, y]))
    pairs, count = [], 0
    step = len(low_a) if dense else max(16, 5 * CHUNK // len(low_b))
    for start in range(0, len(low_a), step):
        low, high = low_a[start : start + step], high_a[start : start + step]
        if tree is None:
            i, j = np.nonzero((low[:, None] <= high_b[None]).all(axis=2) & (low_b[None] <= high[:, None]).all(axis=2))
        else:
            i, j = tree.query(shapely.box(low[:, x], low[:, y], high[:, x], high[:, y]))
            for z in rest:
                meet = (low[i, z] <= high_b[j, z]) & (low_b[j, z] <= high[i, z])
                i, j = i[meet], j[meet]
        i = i + start
        if keep is not None:
            kept = keep(i, j)
            i, j = i[kept], j[kept]
        pairs.append(np.stack([i, j], axis=1))
        count += len(i)
        if count > limit:
            return None
    return np.concatenate(pairs).astype(np.int64)


def overlapping_pairs(low: Array, high: Array, groups: Numbers) -> Numbers:
    """Pairs i < j of different groups whose bounds overlap or touch, int64 (k, 2), in order.

    Args:
        low, high: float64 (n, 2) or (n, 3).
        groups: int64 (n,): bounds of one group are not compared.

    Raises:
        MemoryError: more than `MOST`.
    """
    pairs = near_pairs((low, high), (low, high), MOST, lambda i, j: (i < j) & (groups[i] != groups[j]))
    if pairs is None:
        raise MemoryError("too many parts in one place")
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def spans(counts: Numbers) -> tuple[Numbers, Numbers]:
    """For runs of the given lengths laid end to end: the run and the place in it of every element, int64 (sum,)."""
    run = np.repeat(np.arange(len(counts)), counts)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(counts) - counts, counts)
