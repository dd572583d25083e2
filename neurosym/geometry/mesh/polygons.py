"""Polygons of the plane put together and intersected by GEOS, which refuses what is not valid or noded by a hair."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

Polygons = NDArray[np.object_]


def intersections(one: Polygons, two: Polygons, grid: float) -> Polygons:
    """What polygons (n,) and (n,) have in common, corners on a grid (length).

    On a grid: with floating numbers GEOS may take two neighbours that share an edge for one and the same.
    """

    def common(a: Polygons, b: Polygons, size: float) -> Polygons:
        return np.asarray(shapely.intersection(a, b, grid_size=size), dtype=object)

    one, two = _valid(one), _valid(two)
    try:
        return common(one, two, grid)
    except shapely.errors.GEOSException:  # of one of them: each by itself
        return np.array([_on_grids(common, grid, a, b) for a, b in zip(one, two)], dtype=object)


def union(polygons: Polygons, grid: float) -> Any:
    """Polygons (n,) put together; on a grid (length) only where GEOS needs one."""
    polygons = _valid(polygons)
    try:
        return shapely.union_all(polygons)
    except shapely.errors.GEOSException:
        return _on_grids(lambda p, size: shapely.union_all(p, grid_size=size), grid, polygons)


def _valid(polygons: Polygons) -> Polygons:
    """The same with those made valid that cross themselves; what has no area is left out of these."""
    sound = shapely.is_valid(polygons)
    if sound.all():
        return polygons
    mended = shapely.make_valid(polygons[~sound], method="structure", keep_collapsed=False)
    polygons = polygons.copy()
    polygons[~sound] = mended
    return polygons


def _on_grids(operation: Callable[..., Any], grid: float, *polygons: Any) -> Any:
    """An operation on polygons rounded to a grid, or to the next coarser one on which it succeeds."""
    for size in (grid, 4 * grid, 16 * grid):
        try:
            return operation(*(shapely.set_precision(p, size) for p in polygons), size)
        except shapely.errors.GEOSException as error:
            last = error
    raise last
