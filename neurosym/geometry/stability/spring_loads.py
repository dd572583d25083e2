"""Loads besides a part's own weight: gravity that tilts, and parts that are drawn out against friction."""

from __future__ import annotations

import numpy as np

from neurosym.geometry.stability.patches import groups
from neurosym.geometry.stability.spring_stability import SpringStability
from neurosym.geometry.stability.spring_verdicts import SpringStanding, moving_parts
from neurosym.geometry.stability.springs import tilted
from neurosym.support.arrays import Array

#: Halvings of the angle from 90 degrees: to 0.2 degrees.
_HALVINGS = 9


def margin(stability: SpringStability, subset: int, held: int = 0) -> float:
    """The largest tilt of gravity (degrees) that a subset bears in each of four horizontal directions; 0: it falls."""
    if not stability.standing(subset, held).stands:
        return 0.0
    least = 90.0
    for direction in range(4):
        low, high = 0.0, least  # what is borne beyond the least so far is of no interest
        for _ in range(_HALVINGS):
            gravity = tilted(stability.gravity, (low + high) / 2)[direction]
            stands = stability.settled(subset, held, gravity=gravity).stands
            low, high = ((low + high) / 2, high) if stands else (low, (low + high) / 2)
        least = (low + high) / 2
    return least


def drag(
    stability: SpringStability, subset: int, leaving: int, direction: Array, held: int = 0
) -> dict[int, Array]:
    """The force and torque, float64 (6,), on each part that others touch as they are drawn along a direction (3,).

    It is mu times the force that presses the two, along the motion.

    Args:
        leaving: bitset of the parts that are drawn; all of them are in `subset`.
    """
    springs, settled = stability.springs, stability.settled(subset, held)
    way = np.asarray(direction, dtype=np.float64) / np.linalg.norm(direction)
    loads: dict[int, Array] = {}
    for k, corner in enumerate(settled.corners):
        a, b = int(springs.a[corner]), int(springs.b[corner])
        drawn = [part >= 0 and bool(leaving >> part & 1) for part in (a, b)]
        other = b if drawn[0] else a
        if drawn[0] == drawn[1] or other < 0 or settled.forces[k, 0] <= 0:
            continue
        along = way - (way @ springs.axes[corner, 0]) * springs.axes[corner, 0]
        size = float(np.linalg.norm(along))
        if size > 1e-9:
            force = springs.unit * springs.friction * settled.forces[k, 0] * along / size
            torque = np.cross(springs.at[corner] - springs.centres[other], force)
            loads[other] = loads.get(other, np.zeros(6)) + np.concatenate([force, torque])
    return loads


def standing_while_pulled(
    stability: SpringStability, subset: int, leaving: int, direction: Array, held: int = 0
) -> SpringStanding:
    """Whether a subset stands as some of its parts begin to be drawn along a direction (3,).

    What touches those parts is dragged along. They themselves weigh and carry as before, but hold nothing by friction;
    where they would fall by that, whoever draws them holds them. Only what hangs together with them is looked at.
    """
    movable = subset & ~held & ~stability.fixed
    near = sum(group for group in groups(movable, stability.touching) if group & leaving)
    around = stability.next_to(near) & subset & ~movable
    loads = drag(stability, near | around, leaving, direction, around)
    there = near | around
    if not loads:
        return SpringStanding(True, 0, held)
    alone = stability.settled(there, around, slippery=leaving).stands
    settled = stability.settled(there, around if alone else around | leaving, loads=loads, slippery=leaving)
    # Whether what is drawn moves by itself is no matter: it is on its way.
    moving = 0 if settled.stands else moving_parts(settled) & ~leaving
    return SpringStanding(not moving, moving, held)
