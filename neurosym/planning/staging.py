"""What a plan does to the parts, step by step: who moves, along which path, and whether it leaves or arrives.

Replays, pictures and viewers share this. A family says it itself (`Semantics.staging`), or it follows from the motions
of the plan, from the problem's `Simulation`, which names the part that each action removes, or from the effects.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.rigid_motions import shifted
from neurosym.geometry.step_motion import StepMotion, Track, Vector, check_motions
from neurosym.language.actions import moved_parts

if TYPE_CHECKING:
    from neurosym.language.problem import Problem

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
        motions: one a step, each with its tracks.
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

    def there(self, step: int) -> tuple[str, ...]:
        """Names of the parts in place before step number `step` (from 0), in the assembly's order."""
        now = set(self.present)
        for motion in self.motions[:step]:
            now = now | set(motion.parts) if motion.arrives else now - set(motion.parts)
        return tuple(name for name in self.assembly.names if name in now)


def stage(problem: Problem, plan: Sequence[str], motions: Sequence[StepMotion | None] = ()) -> Staging:
    """A plan in space.

    Where a step's motion does not say which parts move, the problem's `Simulation` does; failing that, the effects: an
    action takes away the parts about which it only deletes atoms, else it brings those about which it only adds some.

    Args:
        problem: what was planned.
        plan: names of actions, in order.
        motions: one a step, or none at all, as `PlanResult.motions` has them; for None a free straight line is looked
            for.

    Raises:
        InputError: the problem does not say what its actions do to parts, or not one motion a step.
        UnknownNameError: a name in the plan that is no action.
    """
    check_motions(motions, len(plan))
    for name in plan:
        if name not in problem.actions:
            raise UnknownNameError("action", name, problem.actions)
    staging = problem.semantics.staging(problem, plan, motions)
    if staging is not None:
        return staging
    world, geometry, moved = problem.world, problem.geometry, dict[str, tuple[tuple[str, ...], bool]]()
    absent: set[str] = set()
    if problem.simulation is not None:
        moved = {action: ((part,), False) for action, part in problem.simulation.removes.items()}
        absent.update(problem.simulation.absent)
    elif geometry is not None:
        for action in problem.domain.actions:
            for binding in problem.bindings(action):
                effects = [e.bind(binding) for e in action.eff]
                moved[action.ground_name(binding)] = parts, arrive = moved_parts(effects, world.names)
                if not arrive:
                    lacking = [e.atom for e in effects if not e.positive and e.atom not in problem.init]
                    absent.update(name for name in parts if any(name in atom.args for atom in lacking))
    whole = []
    for name, motion in zip(plan, motions or [None] * len(plan)):
        parts, arrive = moved.get(name, ((), False))
        whole.append((motion or StepMotion()).of_parts(parts, arrive=arrive))
        absent |= set(whole[-1].parts) if whole[-1].arrives else set()
    if geometry is None or not all(motion.parts for motion in whole):
        raise InputError(
            f"Expected a problem that says what its actions do to parts in space; {problem.name!r} does not. Give "
            "Domain.problem a world that is an Assembly and simulation=Simulation('rigid', removes={action: part}), or "
            "semantics= with a method staging."
        )
    # A plan that puts together begins with what it does not bring.
    return staged(geometry, [n for n in world.names if n not in absent], plan, whole)


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
        long.append(motion if motion.tracks else _straight(geometry, motion, others))
        there = others | set(motion.parts) if motion.arrives else others
    guessed = frozenset(i for i, m in enumerate(motions) if not m.tracks and not m.direction)
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
