"""A plan in space: who is there, and how each step moves parts, straight lines with the length that they need."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.rigid_motions import shifted
from neurosym.geometry.step_motion import StepMotion, Track, Vector

Array = NDArray[np.float64]

#: How far beyond the last obstacle a straight motion goes on, as a share of what moves (its extent along the way).
CLEARANCE = 0.3


@dataclass(frozen=True, eq=False)
class Staging:
    """A plan in space.

    Attributes:
        assembly: all parts that ever appear, where they rest when assembled.
        present: names of those that are there before the first step.
        plan: names of the actions.
        motions: one a step, each with its tracks; without parts where a step moves nothing (glue, a tool in the hand).
        colours: part name -> RGB in 0..1, for parts with a colour of their own.
        tops: part name -> what lies on its top, uint8 (H, W, 3), for parts that bear a picture.
        guessed: numbers of the steps whose motion the plan does not say: a free straight line was looked for.
    """

    assembly: Assembly
    present: tuple[str, ...]
    plan: tuple[str, ...] = ()
    motions: tuple[StepMotion, ...] = ()
    colours: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    tops: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)
    guessed: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        known = set(self.assembly.names)
        moving = (name for m in self.motions for name in m.parts + m.making_way)
        for name in (*self.present, *self.colours, *self.tops, *moving):
            if name not in known:
                raise UnknownNameError("part", name, known)

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the parts that are there at any time, in the assembly's order."""
        ever = set(self.present).union(*(motion.parts for motion in self.motions))
        return tuple(name for name in self.assembly.names if name in ever)

    def there(self, step: int) -> tuple[str, ...]:
        """Names of the parts in place before step number `step` (from 0), in the assembly's order."""
        now = set(self.present)
        for motion in self.motions[:step]:
            now = now | set(motion.parts) if motion.arrives else now - set(motion.parts)
        return tuple(name for name in self.assembly.names if name in now)


def staged(
    given: Assembly | AssemblyGeometry, present: Sequence[str], plan: Sequence[str], motions: Sequence[StepMotion]
) -> Staging:
    """A plan in space whose motions say which parts move: straight ones lead as far as the others reach.

    Args:
        present: names of the parts that are there at first.
        plan: names of the actions.
        motions: one a step.
    """
    geometry, there, long = AssemblyGeometry.of(given), set(present), []
    for motion in motions:
        others = there - set(motion.parts)
        long.append(motion if motion.tracks or not motion.parts else _straight(geometry, motion, others))
        there = others | set(motion.parts) if motion.arrives else others
    guessed = frozenset(i for i, m in enumerate(motions) if m.parts and not m.tracks and not m.direction)
    return Staging(geometry.assembly, tuple(present), tuple(plan), tuple(long), guessed=guessed)


def building(
    assembly: Assembly,
    present: Sequence[str],
    plan: Sequence[str],
    colours: Mapping[str, tuple[float, float, float]] | None = None,
) -> Staging:
    """The staging of a plan that puts parts in place from above, one a step, each action named after its part."""
    down = [StepMotion((action,), (0.0, 0.0, -1.0), arrives=True) for action in plan]
    geometry = AssemblyGeometry(assembly)
    long = [_straight(geometry, motion, assembly.names) for motion in down]
    return Staging(assembly, tuple(present), tuple(plan), tuple(long), colours or {})


def _straight(geometry: AssemblyGeometry, motion: StepMotion, others: Collection[str]) -> StepMotion:
    """Straight until past the bounds of all `others`, and `CLEARANCE` on; without a direction, along a free one."""
    assembly = geometry.assembly
    outward = motion.outward or _free_direction(geometry, motion.parts, others)
    unit = np.array(outward) / np.linalg.norm(outward)
    low, high = _extent(assembly, motion.parts, unit)
    _, end = _extent(assembly, others, unit) if others else (low, high)
    poses = np.stack([np.eye(4), shifted(unit * (max(end - low, 0.0) + CLEARANCE * (high - low)))])
    track = Track(motion.parts, poses, assembly.bodies.centre(assembly.mask(motion.parts)))
    out = replace(motion, direction=outward, tracks=(track,), arrives=False)
    return out.reversed() if motion.arrives else out


def _free_direction(geometry: AssemblyGeometry, parts: Sequence[str], others: Collection[str]) -> Vector:
    """Of the assembly's axes, upward first, one along which no other stands in the way of `parts`.

    Where there is none: the one with the fewest in the way. Downward, into the table, only as a last resort.
    """
    graph = geometry.blocking()
    group, there = geometry.mask(parts), geometry.mask(others)
    in_way = [graph.group_blockers(group, d, there).bit_count() for d in range(len(graph.vectors))]
    best = min(range(len(in_way)), key=lambda d: (bool(graph.into_table[d]), in_way[d], d))
    return graph.vectors[best]


def _extent(assembly: Assembly, parts: Collection[str], unit: Array) -> tuple[float, float]:
    heights = assembly.bodies.points(assembly.mask(parts)) @ unit
    return float(heights.min()), float(heights.max())
