"""Translation to infinity, exactly: swept boxes put to FCL, and triangle shadows for everything else.

Moving A along d hits B exactly when some line along d meets A before it meets B. A hit counts when the
overlap is deeper than the touching tolerance along d AND wider than it across: parts that merely touch, or
overlap a little where they mate, do not block one another.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from neurosym.geometry import collision
from neurosym.geometry.assembly import Box
from neurosym.geometry.contacts import plane_axes

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]


def swept_box_hits(
    assembly: Assembly, body: int, direction: Array, reach: float, objects: list[object], others: list[int]
) -> list[int]:
    """Which of `others` (boxes, with their FCL `objects`) a box hits on its way of length `reach` along a direction.

    Along one of its own axes a swept box is a longer box. In any other direction the triangles answer.
    """
    X, shape = assembly.X_WB[body], assembly.bodies[body].shape
    assert isinstance(shape, Box)
    local = X[:3, :3].T @ direction
    axis = int(np.argmax(np.abs(local)))
    if np.linalg.norm(np.delete(local, axis)) > assembly.tolerances.parallel:
        return [j for j in others if triangles_block(assembly, body, j, direction)]
    size = shape.size - 2 * assembly.touch
    size[axis] += reach
    swept = X.copy()
    swept[:3, 3] += direction * reach / 2
    sweep = collision.box_object(size, swept)
    return [j for j, other in zip(others, objects) if collision.collide(sweep, other)]


def triangles_block(assembly: Assembly, a: int, b: int, direction: Array) -> bool:
    """Whether body `a`, moved along a unit vector (3,) without end, hits body `b`; by the shadows of triangles.

    Both surfaces are projected along the direction. Over every patch where a triangle of `a` and one of `b`
    overlap, heights along the direction are linear, so their difference is largest at a corner of the patch.
    """
    touch = assembly.touch
    u, v = plane_axes(direction)
    frame = np.stack([u, v, direction], axis=1)
    ta, tb = (
        (assembly.body_vertices(i) @ frame)[assembly.bodies[i].shape.faces] for i in (a, b)
    )  # float64 (m, 3 corners, 3)
    ta, plane_a = _shadows(ta, touch)
    tb, plane_b = _shadows(tb, touch)
    low_a, high_a, low_b, high_b = ta.min(axis=1), ta.max(axis=1), tb.min(axis=1), tb.max(axis=1)
    near = (low_a[:, None, :2] + touch < high_b[None, :, :2]).all(axis=2)
    near &= (high_a[:, None, :2] - touch > low_b[None, :, :2]).all(axis=2)
    near &= high_b[None, :, 2] > low_a[:, None, 2] + touch
    i, j = np.nonzero(near)
    if not len(i):
        return False
    patches = shapely.intersection(shapely.polygons(ta[i, :, :2]), shapely.polygons(tb[j, :, :2]))
    areas = shapely.area(patches)
    # The width of a patch: a sliver along a shared edge is no hit.
    wide = areas > touch * np.maximum(shapely.length(patches) / 2, touch)
    if not wide.any():
        return False
    kept = np.flatnonzero(wide)
    uv, patch = shapely.get_coordinates(patches[kept], return_index=True)
    one = np.concatenate([uv, np.ones((len(uv), 1))], axis=1)
    depth = np.einsum("nk,nk->n", one, plane_b[j[kept][patch]] - plane_a[i[kept][patch]])
    return bool((depth > touch).any())


def _shadows(triangles: Array, touch: float) -> tuple[Array, Array]:
    """Triangles (m, 3, 3) that have a shadow, and their planes (m, 3): height = p0 u + p1 v + p2."""
    flat = triangles[..., :2]
    e1, e2 = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0])
    longest = np.maximum(np.ptp(triangles, axis=1).max(axis=1), 1e-300)
    kept = triangles[area > 1e-6 * longest**2]
    if not len(kept):
        return kept, np.zeros((0, 3))
    matrix = np.concatenate([kept[..., :2], np.ones((len(kept), 3, 1))], axis=2)
    return kept, np.linalg.solve(matrix, kept[..., 2][..., None])[..., 0]


def drops_onto(assembly: Assembly, body: int, other: int, X_WO: Array) -> bool:
    """Whether an upright box, falling, would land on box `other` at pose X_WO (4, 4)."""
    shape, target = assembly.bodies[body].shape, assembly.bodies[other].shape
    assert isinstance(shape, Box)
    assert isinstance(target, Box)
    pose = assembly.X_WB[body].copy()
    size = shape.size - 2 * assembly.touch
    axis = int(np.argmax(np.abs(pose[2, :3])))
    drop = float(pose[2, 3] - X_WO[2, 3]) + assembly.smallest_extent
    if drop <= 0:
        return False
    size[axis] += drop
    pose[2, 3] -= drop / 2
    return collision.collide(collision.box_object(size, pose), collision.box_object(target.size, X_WO))


def exits_along(assembly: Assembly, part: int, direction: Array, others: list[int]) -> list[int]:
    """Which of `others` (numbers of parts) a part hits on its way out along a direction, asked afresh.

    Boxes are moved in steps and put to FCL one by one, shrunk by the touching tolerance: a second way to the
    answer that shares nothing with swept boxes. Other shapes are asked pair by pair.
    """
    bodies = [int(b) for b in np.flatnonzero(assembly.owners == part)]
    hits = []
    for other in others:
        targets = [int(b) for b in np.flatnonzero(assembly.owners == other)]
        if any(_meets(assembly, a, b, direction) for a in bodies for b in targets):
            hits.append(other)
    return hits


def _meets(assembly: Assembly, a: int, b: int, direction: Array) -> bool:
    shape_a, shape_b = assembly.bodies[a].shape, assembly.bodies[b].shape
    if not isinstance(shape_a, Box) or not isinstance(shape_b, Box):
        return triangles_block(assembly, a, b, direction)
    first, second = assembly.body_vertices(a) @ direction, assembly.body_vertices(b) @ direction
    distance = float(second.max() - first.min())
    if distance <= assembly.touch:
        return False
    target = collision.box_object(shape_b.size, assembly.X_WB[b])
    pose = assembly.X_WB[a].copy()
    # Half the thinner of the two: no step can jump over the other box.
    step = 0.5 * float(min(shape_a.size.min(), shape_b.size.min()))
    for travelled in np.arange(0.0, distance + step, step):
        pose[:3, 3] = assembly.X_WB[a][:3, 3] + travelled * direction
        if collision.collide(collision.box_object(shape_a.size - 2 * assembly.touch, pose), target):
            return True
    return False
