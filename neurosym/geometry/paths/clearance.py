"""Whether moving bodies meet others on their way: exact for turned-alike boxes, by steps that miss nothing otherwise.

Every body is inset by half the touching tolerance, so bodies that touch, or overlap by no more than the tolerance, are
clear of one another. Between two poses, boxes whose axes agree and that do not turn are answered exactly (slabs). Any
other pair advances by the distance that FCL says lies between the two surfaces: no point travels farther than that, so
nothing is jumped over (conservative advancement; Mirtich, "Impulse-based dynamic simulation", 1996). FCL has one of
its own, which misses hits.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact import collision
from neurosym.geometry.mesh.inset import inset_vertices
from neurosym.geometry.rigid_motions import Interpolation
from neurosym.geometry.shapes import Body, Box, Mesh
from neurosym.support.arrays import Array, Numbers
from neurosym.support.deadline import check

#: The least step of an advance, as a share of the touching tolerance: an overlap deeper than the tolerance by so much
#: of it is never missed.
LEAST_STEP = 0.1

_CUBE = np.array(list(product((-1.0, 1.0), repeat=3)))
_STAY = np.eye(4)


class Clearance:
    """Moving bodies against others. Bodies are named by their numbers in the assembly; poses are motions of the world.

    Lengths are divided by the assembly's smallest extent inside, so that FCL's absolute tolerances fit any unit.
    """

    def __init__(self, assembly: Assembly, moving: Sequence[int], others: Sequence[int]) -> None:
        self.moving, self.others = list(moving), list(others)
        self._scale = assembly.smallest_extent
        self._touch = assembly.tolerances.touch
        self._middle = assembly.bounds.mean(axis=0)
        every = [*self.moving, *self.others]
        X = assembly.X_WB[every].copy()
        X[:, :3, 3] = (X[:, :3, 3] - self._middle) / self._scale
        shapes = [assembly.bodies[i] for i in every]
        n = len(self.moving)
        self._X, self._Y = X[:n], X[n:]
        # Corners of the box about each body in its own frame, and how far its inset faces are from the middle.
        low, high = (
            np.array([end(b.shape.vertices, axis=0) for b in shapes]).reshape(-1, 3) / self._scale
            for end in (np.min, np.max)
        )
        corners = (low + high)[:, None] / 2 + _CUBE * (high - low)[:, None] / 2
        self._corners = np.einsum("nij,nkj->nki", X[:, :3, :3], corners) + X[:, None, :3, 3]
        self._half = (high - low) / 2 - self._touch / 2
        boxes = np.array([isinstance(b.shape, Box) for b in shapes])
        # A box among meshes is one of them: mixed pairs are FCL's weakest.
        objects = [self._object(b, bool(boxes.all()), pose) for b, pose in zip(shapes, X)]
        self._a, self._b = objects[:n], objects[n:]
        turn = np.einsum("nji,mjk->nmik", self._X[:, :3, :3], self._Y[:, :3, :3])
        whole = np.round(turn)
        near = np.abs(turn - whole).max(axis=(2, 3), initial=0.0) <= assembly.tolerances.parallel
        self._alike = near & boxes[:n, None] & boxes[None, n:]
        # Half the edges of the two boxes together, along the axes of the moving one.
        self._reach = self._half[:n, None] + np.einsum("nmik,mk->nmi", np.abs(whole), self._half[n:])
        self._still_a = self._corners[:n].min(axis=1), self._corners[:n].max(axis=1)
        self._still_b = self._corners[n:].min(axis=1), self._corners[n:].max(axis=1)

    def hit(self, X: Array) -> tuple[int, int] | None:
        """A pair of bodies that overlap by more than the tolerance when the moving ones are at a pose (4, 4)."""
        X = self._inner(X)
        turned = not np.array_equal(X[:3, :3], _STAY[:3, :3])
        if turned:
            corners = self._corners[: len(self._a)] @ X[:3, :3].T + X[:3, 3]
            low, high = corners.min(axis=1), corners.max(axis=1)
        else:
            low, high = self._still_a[0] + X[:3, 3], self._still_a[1] + X[:3, 3]
        near = (low[:, None] < self._still_b[1]) & (high[:, None] > self._still_b[0])
        pairs = np.argwhere(near.all(axis=2))
        if not len(pairs):
            return None
        if not turned:
            i, j = pairs.T
            alike = self._alike[i, j]
            apart = self._apart(i, j) - np.einsum("d,ndi->ni", X[:3, 3], self._X[i, :3, :3])
            inside = alike & (np.abs(apart) < self._reach[i, j]).all(axis=1)
            if inside.any():
                return self._named(*pairs[int(np.argmax(inside))])
            pairs = pairs[~alike]
        placed = -1
        for i, j in pairs:
            if i != placed:
                collision.place(self._a[i], X @ self._X[i])
                placed = i
            if collision.collide(self._a[i], self._b[j]):
                return self._named(i, j)
        return None

    def first_hit(self, motion: Interpolation, other: Interpolation | None = None) -> tuple[float, int, int] | None:
        """Where two bodies first overlap by more than the tolerance: share of the way, and the two.

        The moving bodies go along `motion`, the others along `other`, or rest.
        """
        a = self._scaled(motion)
        b = None if other is None else self._scaled(other)
        start_a, start_b = a.at(0.0), _STAY if b is None else b.at(0.0)
        n = len(self._a)
        corners_a = self._corners[:n] @ start_a[:3, :3].T + start_a[:3, 3]
        corners_b = self._corners[n:] @ start_b[:3, :3].T + start_b[:3, 3]
        travel_a = self._travel(a, self._corners[:n])
        travel_b = np.zeros(len(self._b)) if b is None else self._travel(b, self._corners[n:])
        apart = np.maximum(
            corners_b.min(axis=1)[None] - corners_a.max(axis=1)[:, None],
            corners_a.min(axis=1)[:, None] - corners_b.max(axis=1)[None],
        )
        bound = np.linalg.norm(np.maximum(apart, 0.0), axis=2)
        travel = travel_a[:, None] + travel_b[None]
        pairs = np.argwhere(bound < travel + self._touch)
        best: tuple[float, int, int] | None = None
        same = np.array_equal(start_a[:3, :3], _STAY[:3, :3]) and np.array_equal(start_b[:3, :3], _STAY[:3, :3])
        if same and not a.angle and (b is None or not b.angle) and len(pairs):
            i, j = pairs.T
            exact = self._alike[i, j]
            way = a.way - (0.0 if b is None else b.way)
            when = self._slabs(i[exact], j[exact], start_a[:3, 3] - start_b[:3, 3], way)
            if len(when) and when.min() <= 1.0:
                first = int(np.argmin(when))
                best = (float(when[first]), *self._named(*pairs[exact][first]))
            pairs = pairs[~exact]
        for i, j in pairs:
            check()
            until = 1.0 if best is None else best[0]
            share = self._advance(int(i), int(j), a, b, float(travel[i, j]), until)
            if share is not None:
                best = (share, *self._named(i, j))
        return best

    def _advance(
        self, i: int, j: int, a: Interpolation, b: Interpolation | None, travel: float, until: float
    ) -> float | None:
        """Conservative advancement of one pair; the share of the way at which it meets, None if not before `until`."""
        first, second = self._a[i], self._b[j]
        share = 0.0
        try:
            while True:
                check()
                collision.place(first, a.at(share) @ self._X[i])
                if b is not None:
                    collision.place(second, b.at(share) @ self._Y[j])
                gap = collision.distance(first, second)
                if gap <= 0.0:
                    return share
                if share >= until or travel <= 0.0:
                    return None
                share = min(share + max(gap, LEAST_STEP * self._touch) / travel, until)
        finally:
            collision.place(second, self._Y[j])

    def _slabs(self, i: Numbers, j: Numbers, start: Array, way: Array) -> Array:
        """When (share of the way, infinity for never) boxes that do not turn first overlap."""
        axes = self._X[i, :3, :3]
        apart = self._apart(i, j) - np.einsum("d,ndi->ni", start, axes)
        speed = np.einsum("d,ndi->ni", way, axes)
        reach = self._reach[i, j]
        moving = np.abs(speed) > 1e-12
        safe = np.where(moving, speed, 1.0)
        one, two = (apart - reach) / safe, (apart + reach) / safe
        inside = np.abs(apart) < reach
        enter = np.where(moving, np.minimum(one, two), np.where(inside, -np.inf, np.inf)).max(axis=1, initial=-np.inf)
        leave = np.where(moving, np.maximum(one, two), np.inf).min(axis=1, initial=np.inf)
        # Entering and leaving at once is a corner that touches; so is meeting at the very end.
        meets = (enter < leave - 1e-12) & (leave > 1e-12) & (enter < 1.0 - 1e-12)
        return np.where(meets, np.maximum(enter, 0.0), np.inf)

    def _apart(self, i: Numbers, j: Numbers) -> Array:
        """From moving boxes' centres to others', where they are assembled, along the axes of the moving ones."""
        return np.asarray(np.einsum("nd,ndi->ni", self._Y[j, :3, 3] - self._X[i, :3, 3], self._X[i, :3, :3]))

    def _inner(self, X: Array) -> Array:
        """A motion of the world as one of the scaled world about its middle."""
        inner = X.copy()
        inner[:3, 3] = (X[:3, :3] @ self._middle + X[:3, 3] - self._middle) / self._scale
        return inner

    def _scaled(self, motion: Interpolation) -> Interpolation:
        centre = (motion.centre - self._middle) / self._scale
        return Interpolation(self._inner(motion.first), self._inner(motion.second), centre)

    @staticmethod
    def _travel(motion: Interpolation, corners: Array) -> Array:
        """How far (n,) any point of each body goes at most."""
        radii = np.linalg.norm(corners - motion.centre, axis=2).max(axis=1)
        return np.asarray(np.linalg.norm(motion.way) + motion.angle * radii)

    def _object(self, body: Body, all_boxes: bool, pose: Array) -> object:
        shape = body.shape
        if all_boxes and isinstance(shape, Box):
            return collision.box_object(shape.size / self._scale - self._touch, pose)
        vertices = inset_vertices(shape.vertices / self._scale, shape.faces, self._touch / 2)
        return collision.mesh_object(Mesh(vertices, shape.faces), pose)

    def _named(self, i: int, j: int) -> tuple[int, int]:
        return self.moving[i], self.others[j]


class Floor:
    """A plane below which no moving body may go."""

    def __init__(self, assembly: Assembly, moving: Sequence[int], ground: float) -> None:
        self._vertices = np.concatenate([assembly.bodies.vertices(i) for i in moving])
        self._level = ground - assembly.touch
        self._step = LEAST_STEP * assembly.touch

    def hit(self, X: Array) -> bool:
        """Whether the bodies reach below the plane, by more than the touching tolerance, at a pose (4, 4)."""
        return self._height(X) < 0.0

    def first_hit(self, motion: Interpolation) -> float | None:
        """The share of the way at which the bodies first reach below the plane; None: never."""
        if not motion.angle:
            start, end = self._height(motion.first), self._height(motion.second)
            if min(start, end) >= 0.0:
                return None
            return 0.0 if start < 0.0 else start / (start - end)
        travel = motion.travel(float(np.linalg.norm(self._vertices - motion.centre, axis=1).max()))
        share = 0.0
        while True:
            height = self._height(motion.at(share))
            if height < 0.0:
                return share
            if share >= 1.0:
                return None
            share = min(share + max(height, self._step) / travel, 1.0)

    def _height(self, X: Array) -> float:
        return float((self._vertices @ X[2, :3]).min() + X[2, 3]) - self._level
