"""Triangles in the order in which trees of bounds hold them."""

from __future__ import annotations

import numpy as np

from neurosym.support.arrays import Array, Numbers


def along_curve(points: Array, group: Numbers) -> Numbers:
    """Numbers of points (m, 3) group by group (ascending, (m,)), in each along a curve that fills space (Morton)."""
    if not len(points):
        return np.zeros(0, dtype=np.int64)
    first = np.flatnonzero(np.diff(group, prepend=group[0] - 1))
    low, high = np.minimum.reduceat(points, first), np.maximum.reduceat(points, first)
    count = np.diff(first, append=len(points))
    size = np.maximum((high - low).max(axis=1), 1e-300)
    cells = ((points - np.repeat(low, count, axis=0)) * np.repeat(1023 / size, count)[:, None]).astype(np.int64)
    # Each of ten bits is moved to every third place.
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cells = (cells | cells << shift) & mask
    key = cells[:, 0] | cells[:, 1] << 1 | cells[:, 2] << 2
    return np.argsort(key + (np.repeat(np.arange(len(first)), count) << 30), kind="stable")
