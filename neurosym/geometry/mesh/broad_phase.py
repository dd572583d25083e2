"""Which of many axis-aligned bounds overlap: the filter before every exact question about pairs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pairs = NDArray[np.int64]

#: So many bounds are put to the tree at a time: what overlaps them is filtered before the next come.
_AT_A_TIME = 4_096


def overlapping_pairs(low: Array, high: Array, groups: NDArray[np.int64]) -> Pairs:
    """Pairs i < j of different groups whose bounds overlap or touch, int64 (k, 2), in order.

    Args:
        low, high: float64 (n, 2) or (n, 3).
        groups: int64 (n,): bounds of one group are not compared.
    """
    found = list(_overlapping(low, high, groups))
    pairs = np.concatenate(found) if found else np.zeros((0, 2), dtype=np.int64)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def _overlapping(low: Array, high: Array, groups: NDArray[np.int64]) -> Iterator[Pairs]:
    """A tree over the two axes that tell most apart; the third is compared afterwards."""
    if len(low) < 2:
        return
    crowded = (high - low).mean(axis=0) / np.maximum(high.max(axis=0) - low.min(axis=0), 1e-300)
    axes = np.argsort(crowded)
    x, y, rest = axes[0], axes[1], axes[2:]
    flat = shapely.box(low[:, x], low[:, y], high[:, x], high[:, y])
    tree = shapely.STRtree(flat)
    for start in range(0, len(flat), _AT_A_TIME):
        i, j = tree.query(flat[start : start + _AT_A_TIME])
        i = i + start
        kept = (i < j) & (groups[i] != groups[j])
        i, j = i[kept], j[kept]
        for axis in rest:
            kept = (low[i, axis] <= high[j, axis]) & (low[j, axis] <= high[i, axis])
            i, j = i[kept], j[kept]
        yield np.stack([i, j], axis=1)


def spans(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For runs of the given lengths laid end to end: the run and the place in it of every element, int64 (sum,)."""
    run = np.repeat(np.arange(len(counts)), counts)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(counts) - counts, counts)
