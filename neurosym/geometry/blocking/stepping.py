"""What one part hits along a direction, asked anew: a second way to the answer that shares nothing with the tables.

Boxes are moved in steps and put to FCL one by one, shrunk by the touching tolerance. For other shapes triangles answer
alone, without hulls.
"""

from __future__ import annotations

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.sweep import Sweeps
from neurosym.geometry.contact import collision
from neurosym.support.arrays import Array
from neurosym.support.deadline import check


def hits_along(sweeps: Sweeps, part: int, direction: Array, others: int) -> int:
    """Bitset of those of `others` that part number `part` hits on its way out along a unit vector (3,)."""
    assembly = sweeps.assembly
    bodies, targets = np.array(assembly.bodies.of(1 << part)), np.array(assembly.bodies.of(others), dtype=np.int64)
    # What is behind, or beside the way, needs no closer look.
    low, high = assembly.body_bounds[:, 0], assembly.body_bounds[:, 1]
    centre, reach = (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2
    towards = centre[targets][None] - centre[bodies][:, None]
    forward = towards @ direction
    near = reach[bodies][:, None] + reach[targets][None]
    ahead = (forward > -near) & (np.linalg.norm(towards - forward[..., None] * direction, axis=2) < near)
    i, j = np.nonzero(ahead)
    pairs = np.stack([bodies[i], targets[j]], axis=1)
    boxes = assembly.bodies.is_box[pairs].all(axis=1)
    meshes = pairs[~boxes]
    hit = 0
    for owner in np.unique(assembly.owners[meshes[sweeps.triangles_hit(meshes, direction), 1]]):
        hit |= 1 << int(owner)
    for (a, b), apart in zip(pairs[boxes].tolist(), sweeps.mating.apart(pairs[boxes])):
        check()
        owner = 1 << int(assembly.owners[b])
        if not hit & owner and _meets(assembly, a, b, direction, apart):
            hit |= owner
    return hit


def _meets(assembly: Assembly, a: int, b: int, direction: Array, apart: Array) -> bool:
    """Whether box `a`, moved in steps along a direction, meets box `b`, thought moved by `apart` (3,)."""
    bodies = assembly.bodies
    size_a, size_b = bodies.box_sizes[a], bodies.box_sizes[b]
    first, second = bodies.vertices(a) @ direction, bodies.vertices(b) @ direction
    distance = float(second.max() - first.min())
    if distance <= assembly.touch:
        return False
    other = bodies.X_WB[b].copy()
    other[:3, 3] += apart
    pose = bodies.X_WB[a].copy()
    # Half the thinner of the two: no step can jump over the other box. No earlier than where the other begins.
    step = 0.5 * float(min(size_a.min(), size_b.min()))
    begin = max(0.0, float(second.min() - first.max()))
    for travelled in np.arange(begin, distance + step, step):
        pose[:3, 3] = bodies.X_WB[a][:3, 3] + travelled * direction
        if collision.boxes_meet(size_a - 2 * assembly.touch, pose, size_b, other):
            return True
    return False


def drops_onto(assembly: Assembly, body: int, other: int, X_WO: Array) -> bool:
    """Whether an upright box, falling, would land on box `other` at pose X_WO (4, 4)."""
    pose = assembly.X_WB[body].copy()
    size = assembly.bodies.box_sizes[body] - 2 * assembly.touch
    axis = int(np.argmax(np.abs(pose[2, :3])))
    drop = float(pose[2, 3] - X_WO[2, 3]) + assembly.smallest_extent
    if drop <= 0:
        return False
    size[axis] += drop
    pose[2, 3] -= drop / 2
    return collision.boxes_meet(size, pose, assembly.bodies.box_sizes[other], X_WO)
