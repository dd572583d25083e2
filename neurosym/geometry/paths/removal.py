"""The question that the path searches answer: may these parts leave those, and when are they out?"""

from __future__ import annotations

import time
from collections import Counter

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.mesh.triangles import area_vectors
from neurosym.geometry.paths.clearance import Clearance, Floor
from neurosym.geometry.paths.path_check import apart
from neurosym.geometry.rigid_motions import Interpolation, shifted
from neurosym.geometry.shapes import Box
from neurosym.geometry.step_motion import Kind, StepMotion, Track
from neurosym.support.arrays import Array
from neurosym.support.deadline import check, remaining

_UNTURNED = np.eye(3)


class OutOfBudget(Exception):
    """Raised inside a search when its checks or seconds are used up; never leaves this package."""


class Removal:
    """Parts that are to leave others.

    Attributes:
        moving, others: bitsets of parts.
        centre: float64 (3,): the middle of the moving parts, in the world.
        frame: float64 (3, 3): columns are the axes along which the moving parts are built.
        aligned: whether all bodies are boxes with these axes.
        checks, max_checks: poses and ways asked so far, and how many may be.
        met: how often each other part was in the way, by number.
    """

    def __init__(
        self, assembly: Assembly, moving: int, others: int, ground: float | None, max_checks: int, seconds: float | None
    ) -> None:
        self.assembly, self.moving, self.others, self.ground = assembly, moving, others & ~moving, ground
        self.own_bodies, self.other_bodies = assembly.bodies.of(moving), assembly.bodies.of(self.others)
        self.clearance = Clearance(assembly, self.own_bodies, self.other_bodies)
        self.floor = None if ground is None else Floor(assembly, self.own_bodies, ground)
        self.centre = assembly.bodies.centre(moving)
        self.own_points, self.other_points = (_extreme(assembly.bodies.points(m)) for m in (moving, self.others))
        self.frame, self.aligned = self._frame()
        self._axes = np.concatenate([np.eye(3), assembly.axes, self.frame.T])
        spans = self.other_points @ self._axes.T
        self._low, self._high = spans.min(axis=0), spans.max(axis=0)
        own = self.own_points @ self._axes.T
        self._own_low, self._own_high = own.min(axis=0), own.max(axis=0)
        self.checks, self.max_checks = 0, max_checks
        self._deadline = None if seconds is None else time.monotonic() + seconds
        self.met: Counter[int] = Counter()

    def spend(self) -> None:
        """Count one check; `OutOfBudget` where there are none left."""
        check()
        self.checks += 1
        if self.spent():
            raise OutOfBudget

    def spent(self, checks: float = np.inf) -> bool:
        """Whether the budget, or so many checks of it, are used up."""
        late = self._deadline is not None and time.monotonic() > self._deadline
        return late or remaining() < 0 or self.checks >= min(self.max_checks, checks)

    def hit(self, X: Array) -> bool:
        """Whether the moving parts, at a pose (4, 4), are in others or below the ground."""
        self.checks += 1
        if self.floor is not None and self.floor.hit(X):
            return True
        pair = self.clearance.hit(X)
        if pair is not None:
            self.met[int(self.assembly.owners[pair[1]])] += 1
        return pair is not None

    def is_clear(self, motion: Interpolation) -> bool:
        """Whether a motion meets nothing on its way, by the check that misses nothing."""
        self.checks += 1
        if self.floor is not None and self.floor.first_hit(motion) is not None:
            return False
        hit = self.clearance.first_hit(motion)
        if hit is not None:
            self.met[int(self.assembly.owners[hit[2]])] += 1
        return hit is None

    def left(self, X: Array) -> float:
        """How far the parts at a pose still have to go, along one axis, to be out; 0 when they are (length)."""
        if np.array_equal(X[:3, :3], _UNTURNED):
            shift = self._axes @ X[:3, 3]
            low, high = self._own_low + shift, self._own_high + shift
        else:
            spans = (self.own_points @ X[:3, :3].T + X[:3, 3]) @ self._axes.T
            low, high = spans.min(axis=0), spans.max(axis=0)
        way = min(float((self._high - low).min()), float((high - self._low).min()))
        return max(way + 2 * self.assembly.touch, 0.0)

    def path(self, kind: Kind, poses: list[Array]) -> StepMotion:
        """A path through these poses, the last one out; a straight leg is added that leaves some room."""
        last = poses[-1]
        points = self.own_points @ last[:3, :3].T + last[:3, 3]
        spans = points @ self._axes.T
        gaps = np.concatenate([spans.min(axis=0) - self._high, self._low - spans.max(axis=0)])
        widest = int(np.argmax(gaps))
        direction = np.concatenate([self._axes, -self._axes])[widest]
        if self.ground is not None and direction[2] < -self.assembly.tolerances.parallel:
            # Below everything else: nothing stands in that layer, so out sideways.
            direction = np.array([1.0, 0.0, 0.0])
        step = self.assembly.smallest_extent
        end = last
        while not apart(self.assembly, points + end[:3, 3] - last[:3, 3], self.other_points) or end is last:
            end = shifted(step * direction) @ last
            step *= 2
        parts = self.assembly.in_mask(self.moving)
        return StepMotion(parts, tracks=(Track(parts, np.array([*poses, end]), self.centre),), kind=kind)

    def _frame(self) -> tuple[Array, bool]:
        """The axes of the moving parts' boxes, or of their largest faces; and whether everything is boxes so turned."""
        assembly = self.assembly
        boxes = [i for i in self.own_bodies if isinstance(assembly.bodies[i].shape, Box)]
        if boxes:
            frame = assembly.X_WB[boxes[0]][:3, :3].copy()
            every = [*self.own_bodies, *self.other_bodies]
            if not all(isinstance(assembly.bodies[i].shape, Box) for i in every):
                return frame, False
            turns = np.abs(np.einsum("ji,njk->nik", frame, assembly.X_WB[every][:, :3, :3]))
            return frame, bool(np.abs(turns - np.round(turns)).max() <= assembly.tolerances.parallel)
        meshes = [assembly.bodies.vertices(i)[assembly.bodies[i].shape.faces] for i in self.own_bodies]
        area = area_vectors(np.concatenate(meshes))
        first = _main_direction(area)
        second = _main_direction(area - np.outer(area @ first, first))
        return np.stack([first, second, np.cross(first, second)], axis=1), False


def _main_direction(area: Array) -> Array:
    """The direction, up to sign, that the largest share of area vectors (n, 3) has."""
    size = np.linalg.norm(area, axis=1)
    area, size = area[size > 1e-9 * size.max()], size[size > 1e-9 * size.max()]
    normals = area / size[:, None]
    # Opposite faces count together; the half space is chosen by the first coordinate that is not nothing.
    keys = np.round(normals, 3)
    sign = np.sign(keys[:, 0] * 1e6 + keys[:, 1] * 1e3 + keys[:, 2])
    keys *= np.where(sign == 0, 1.0, sign)[:, None]
    _, group = np.unique(keys, axis=0, return_inverse=True)
    best = int(np.argmax(np.bincount(group.reshape(-1), weights=size)))
    member = normals[int(np.argmax(np.where(group.reshape(-1) == best, size, 0.0)))]
    return np.asarray(member / np.linalg.norm(member))


def _extreme(points: Array) -> Array:
    """Those points (n, 3) that span the same convex hull."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points
