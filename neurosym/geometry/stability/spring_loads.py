"""Loads besides a part's own weight: gravity that tilts, and parts that are drawn out against friction."""

from __future__ import annotations

import numpy as np

from neurosym.geometry.stability.spring_stability import SpringStability
from neurosym.geometry.stability.spring_verdicts import SpringStanding, moving_parts
from neurosym.support.arrays import Array

#: The horizontal directions in which gravity is tilted, and halvings of the angle from 90 degrees: to 0.2 degrees.
_TILTS = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
_HALVINGS = 9


def margin(stability: SpringStability, subset: int, held: int = 0) -> float:
    """The largest tilt of gravity (degrees) that a subset bears in each of four horizontal directions; 0: it falls."""
    if not stability.standing(subset, held).stands:
        return 0.0
    least = 90.0
    for direction in _TILTS:
        low, high = 0.0, least  # what is borne beyond the least so far is of no interest
        for _ in range(_HALVINGS):
            tilt = np.radians((low + high) / 2)
            gravity = np.cos(tilt) * stability.gravity + np.sin(tilt) * direction
            stands = stability.settled(subset, held, gravity=gravity).stands
            low, high = ((low + high) / 2, high) if stands else (low, (low + high) / 2)
        least = (low + high) / 2
    return least


def drag(stability: SpringStability, subset: int, part: int, direction: Array, held: int = 0) -> dict[int, Array]:
    """The force and torque, float64 (6,), on each part that one touches as it is drawn along a direction (3,).

    It is mu times the force that presses the two, along the motion.
    """
    springs, settled = stability.springs, stability.settled(subset, held)
    way = np.asarray(direction, dtype=np.float64) / np.linalg.norm(direction)
    loads: dict[int, Array] = {}
    for k, corner in enumerate(settled.corners):
        pair = int(springs.a[corner]), int(springs.b[corner])
        other = pair[0] if pair[1] == part else pair[1]
        if part not in pair or other < 0 or settled.forces[k, 0] <= 0:
            continue
        along = way - (way @ springs.axes[corner, 0]) * springs.axes[corner, 0]
        size = float(np.linalg.norm(along))
        if size > 1e-9:
            force = springs.unit * springs.friction * settled.forces[k, 0] * along / size
            torque = np.cross(springs.at[corner] - springs.centres[other], force)
            loads[other] = loads.get(other, np.zeros(6)) + np.concatenate([force, torque])
    return loads


def standing_while_pulled(
    stability: SpringStability, subset: int, part: int, direction: Array, held: int = 0
) -> SpringStanding:
    """Whether a subset stands as one of its parts begins to be drawn along a direction (3,).

    What touches the part is dragged along. The part itself goes where it is drawn: it still carries what lies on it,
    but holds nothing by friction.
    """
    loads = drag(stability, subset, part, direction, held)
    settled = stability.settled(subset, held | 1 << part, loads=loads, slippery=1 << part)
    return SpringStanding(settled.stands, 0 if settled.stands else moving_parts(settled), held)
