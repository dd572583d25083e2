"""A check of paths that shares nothing with the searches for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.paths.clearance import Clearance, Floor
from neurosym.geometry.step_motion import StepMotion
from neurosym.support.arrays import Array


@dataclass(frozen=True)
class PathCheck:
    """What a check of a path found.

    Attributes:
        holds: the path is clear all along, and ends with the leaving parts away from the others.
        parts: where it is not, the two parts that meet; one part that reaches below the ground, or is not out.
        key: where on the path: key number, whole or between two.
        reason: that, in a sentence; empty when it holds.
    """

    holds: bool
    parts: tuple[str, ...] = ()
    key: float = 0.0
    reason: str = ""


def apart(assembly: Assembly, a: Array, b: Array) -> bool:
    """Whether points (n, 3) and others (m, 3) leave a gap, wider than touch, along an axis of the world or assembly."""
    axes = np.concatenate([np.eye(3), assembly.axes]).T
    one, two = a @ axes, b @ axes
    gap = np.maximum(one.min(axis=0) - two.max(axis=0), two.min(axis=0) - one.max(axis=0))
    return bool(gap.max() > assembly.touch)


def check_path(motion: StepMotion, assembly: Assembly, among: int, *, ground: float | None = None) -> PathCheck:
    """Whether a path can be taken, looked at without anything that the searches know.

    Every pair of parts that move relative to one another is followed along the whole way by `Clearance`, which
    misses no overlap deeper than the touching tolerance (by more than a tenth of it) at any moment.

    Args:
        motion: with its tracks.
        among: a bitset of the parts that are there; those that move are there in any case.
        ground: height (z, world) of a plane that no part may go below; None: there is none.

    Raises:
        UnknownNameError: a moving part that the assembly does not have.
    """
    tracks = motion.tracks
    masks = [sum(1 << assembly.index[assembly[name].name] for name in t.parts) for t in tracks]
    bodies = [assembly.bodies.of(mask) for mask in masks]
    resting = assembly.bodies.of(among & ~sum(masks))
    pairs: list[tuple[int, int | None, Clearance]] = []
    for a, own in enumerate(bodies):
        if resting:
            pairs.append((a, None, Clearance(assembly, own, resting)))
        pairs.extend((a, b, Clearance(assembly, own, bodies[b])) for b in range(a))
    floors = [] if ground is None else [Floor(assembly, own, ground) for own in bodies]
    for key in range(len(tracks[0].poses) - 1):
        legs = [t.between(key) for t in tracks]
        for a, b, clearance in pairs:
            hit = clearance.first_hit(legs[a], None if b is None else legs[b])
            if hit is not None:
                names = tuple(assembly.names[assembly.owners[i]] for i in hit[1:])
                at = key + hit[0]
                return PathCheck(False, names, at, f"{names[0]} meets {names[1]} at {at:.3f} of the path's keys")
        for track, floor, leg in zip(tracks, floors, legs):
            share = floor.first_hit(leg)
            if share is not None:
                reason = f"{', '.join(track.parts)} would go below the ground at {key + share:.3f} of the path's keys"
                return PathCheck(False, track.parts, key + share, reason)
    return _away(motion, assembly, among | sum(masks))


def _away(motion: StepMotion, assembly: Assembly, among: int) -> PathCheck:
    """Whether the parts that leave, or arrive, are away from all others at the outer end."""
    pose = {name: t.poses[-1] for t in motion.tracks for name in t.parts}
    leaving: list[Array] = []
    others: list[Array] = []
    for i in assembly.bodies.of(among):
        name = assembly.names[assembly.owners[i]]
        X = pose.get(name, np.eye(4))
        points = assembly.bodies.vertices(i) @ X[:3, :3].T + X[:3, 3]
        (leaving if name in motion.parts else others).append(points)
    if not others or apart(assembly, np.concatenate(leaving), np.concatenate(others)):
        return PathCheck(True)
    last = len(motion.tracks[0].poses) - 1.0
    return PathCheck(False, motion.parts, last, f"{', '.join(motion.parts)} is not out at the end")
