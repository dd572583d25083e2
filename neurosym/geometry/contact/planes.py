"""Points and convex polygons in a plane of space."""

from __future__ import annotations

import numpy as np

from neurosym.geometry.mesh.triangles import plane_axes
from neurosym.support.arrays import Array


def hull_points(points: Array, normal: Array) -> Array:
    """Corners, in order, of the convex hull of coplanar points (n, 3); empty when they span no area."""
    if len(points) < 3:
        return points[:0]
    from scipy.spatial import ConvexHull, QhullError

    u, v = plane_axes(normal)
    flat = np.stack([points @ u, points @ v], axis=1)
    try:
        corners: Array = points[ConvexHull(flat).vertices]
        return corners
    except QhullError:
        return points[:0]


def polygon_area(points: Array, normal: Array) -> float:
    """Area of a convex polygon with corners (k, 3) in order."""
    if len(points) < 3:
        return 0.0
    arms = points - points.mean(axis=0)
    return 0.5 * abs(float(np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0) @ normal))


def is_wide(points: Array, area: float, touch: float) -> bool:
    """Whether a patch (k, 3) is wider than a tolerance: edges and corners that meet are no contact."""
    return len(points) >= 3 and area > touch * float(np.linalg.norm(np.ptp(points, axis=0)))
