"""Names of array types. Shapes are said where an array is."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
Truths = NDArray[np.bool_]
Pixels = NDArray[np.uint8]


def bounds(points: Array) -> tuple[Array, Array]:
    """Least and greatest of each column of float64 (n, d): column by column, for numpy takes short rows one by one."""
    return np.array([c.min() for c in points.T]), np.array([c.max() for c in points.T])


def extents(points: Array) -> Array:
    """How far each column of float64 (n, d) reaches: float64 (d,)."""
    low, high = bounds(points)
    return np.asarray(high - low)
