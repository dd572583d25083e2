"""Rigid motions from one pose to another."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from neurosym.support.arrays import Array, Truths

_UNTURNED = np.eye(3)


class Interpolation:
    """From one pose of a body to another: its centre goes straight and its rotation turns evenly.

    Attributes:
        first, second: float64 (4, 4): rigid motions of the world, applied to the body where it is assembled.
        centre: float64 (3,): the point of the body, where it is assembled, that goes straight.
        way, angle: float64 (3,), how far the centre goes; how far the rotation turns, the shorter way (0 to pi).
    """

    def __init__(self, first: Array, second: Array, centre: Array) -> None:
        self.first, self.second, self.centre = first, second, centre
        self._start = first[:3, :3] @ centre + first[:3, 3]
        self.way: Array = second[:3, :3] @ centre + second[:3, 3] - self._start
        self.angle = 0.0
        if not np.array_equal(first[:3, :3], second[:3, :3]):
            from scipy.spatial.transform import Rotation  # half a command's start, and seldom needed

            turn = Rotation.from_matrix(first[:3, :3].T @ second[:3, :3]).as_rotvec()
            self.angle = float(np.linalg.norm(turn))
            x, y, z = turn / max(self.angle, 1e-300)
            self._cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            self._cross_twice = self._cross @ self._cross

    def travel(self, radius: float) -> float:
        """How far a point within `radius` of the centre goes at most (length)."""
        return float(np.linalg.norm(self.way)) + self.angle * radius

    def at(self, share: float) -> Array:
        """The motion of the world, float64 (4, 4), after a share from 0 to 1 of the way."""
        X = self.first.copy()
        if not self.angle:
            X[:3, 3] += share * self.way
            return X
        # Rodrigues' formula.
        angle, K = share * self.angle, self._cross
        R = self.first[:3, :3] @ (_UNTURNED + math.sin(angle) * K + (1 - math.cos(angle)) * self._cross_twice)
        X[:3, :3] = R
        X[:3, 3] = self._start + share * self.way - R @ self.centre
        return X


def shifted(way: Array | Sequence[float]) -> Array:
    """The translation by a vector (3,), as a motion (4, 4)."""
    return posed(_UNTURNED, way)


def posed(R: Array, at: Array | Sequence[float]) -> Array:
    """The pose (4, 4) of a rotation (3, 3) and a place (3,)."""
    X = np.eye(4)
    X[:3, :3] = R
    X[:3, 3] = at
    return X


def are_rigid(X: Array) -> Truths:
    """bool (...): which of the matrices, float64 (..., 4, 4), are finite rotations with a shift, last row 0 0 0 1."""
    R = X[..., :3, :3]
    with np.errstate(invalid="ignore", over="ignore"):
        turned = np.isclose(R @ R.swapaxes(-1, -2), np.eye(3), rtol=0.0, atol=1e-6).all(axis=(-1, -2))
        upright = np.isclose(X[..., 3, :], (0, 0, 0, 1)).all(axis=-1)
        return np.asarray(np.isfinite(X).all(axis=(-1, -2)) & turned & upright & (np.linalg.det(R) > 0))
