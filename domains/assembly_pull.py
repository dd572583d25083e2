"""Parts drawn out against friction: they drag what they touch, and what stays must stand under that, too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.stability.holding import Standing, parts_to_hold
from neurosym.geometry.step_motion import StepMotion
from neurosym.language import Derived, Fluent, State
from neurosym.language.predicates import stands
from neurosym.language.search_problem import Verdict
from neurosym.language.travel import remade
from neurosym.support.arrays import Array
from neurosym.support.words import listed

if TYPE_CHECKING:
    from domains.assembly import Setting


@remade
def drawn_out(setting: Setting, leave: Derived, present: Fluent) -> Derived:
    """``drawn_out(p)``: part p can leave (see `leave`); the others stand while it is drawn, and without it."""

    def ask(world: AssemblyGeometry, state: State, p: str) -> Verdict:
        free = leave.function(world, state, p)
        if not free.holds:
            return free
        there, leaving = state.mask(present, world.names), 1 << world.index[p]
        without = stands(world, there & ~leaving, (p,), None if setting.held else present, setting.held)
        if not without.holds:
            return without
        return drawn_part(world, setting, there, world.index[p], free.motion)

    def check(world: AssemblyGeometry, state: State, motion: StepMotion, p: str) -> Verdict:
        assert leave.check is not None
        free = leave.check(world, state, motion, p)
        if not free.holds:
            return free
        there = state.mask(present, world.names)
        if len(motion.held) > setting.held or world.mask(motion.held) & ~there or p in motion.held:
            return Verdict(False, motion.held, f"{listed(motion.held)} cannot all be held.")
        return checked_while_drawn(world, there, motion)

    return Derived("drawn_out", leave.types, ask, check=check)


def drawn_part(
    world: AssemblyGeometry, setting: Setting, there: int, part: int, path: StepMotion | None = None
) -> Verdict:
    """Whether a part can be drawn out along one of its free directions, or if there is none along a path."""
    graph, names = world.blocking(setting.directions), (world.names[part],)
    straight = [StepMotion.along(names, graph.vectors[d]) for d in graph.free_directions(part, there)]
    path = None if path is None else path.of_parts(names, arrive=False)
    return stands_while_drawn(world, there, straight or [path or StepMotion(names)], setting.held)


def stands_while_drawn(world: AssemblyGeometry, there: int, motions: Sequence[StepMotion], held: int) -> Verdict:
    """Whether parts can be drawn out by one of several motions so that all others stand, then and without them.

    Args:
        there: bitset of all parts that are there.
        motions: of the same parts, in the order in which they are tried.
        held: how many of the others may be held.

    Returns:
        A verdict whose motion says along what, and what is held.
    """
    leaving, falling = world.mask(motions[0].parts), 0
    hands = there & ~leaving & ~world.assembly.fixed_mask
    for motion in motions:
        hold, moving = parts_to_hold(lambda hold, m=motion: _ask(world, there, m, hold), hands, held)  # type: ignore[misc]
        if hold is not None:
            return Verdict(True, motion=motion.joined(StepMotion(held=world.in_mask(hold))))
        falling = falling or moving[0]
    return _refused(world, motions, falling, held)


def checked_while_drawn(world: AssemblyGeometry, there: int, motion: StepMotion) -> Verdict:
    """The same of one motion, with what it says is held."""
    answer = _ask(world, there, motion, world.mask(motion.held))
    return Verdict(True, motion=motion) if answer.stands else _refused(world, [motion], answer.falling, 0)


def _ask(world: AssemblyGeometry, there: int, motion: StepMotion, hold: int) -> Standing:
    from neurosym.geometry.stability.spring_loads import standing_while_pulled

    leaving = world.mask(motion.parts)
    answer = standing_while_pulled(world.springs, there, leaving, _first_way(motion), hold)
    return world.springs.standing(there & ~leaving, hold) if answer.stands else answer


def _first_way(motion: StepMotion) -> Array:
    """Along which vector (3,) a motion begins; up where it only turns."""
    if motion.direction is not None:
        return np.array(motion.direction)
    for track in motion.tracks[:1]:
        legs = np.diff(track.poses[:, :3, :3] @ track.centre + track.poses[:, :3, 3], axis=0)
        going = legs[np.linalg.norm(legs, axis=1) > 0]
        if len(going):
            return np.asarray(going[0])
    return np.array([0.0, 0.0, 1.0])


def _refused(world: AssemblyGeometry, motions: Sequence[StepMotion], falling: int, held: int) -> Verdict:
    names = world.in_mask(falling)
    ways = "in any direction that is free" if len(motions) > 1 else str(motions[0])
    hands = "" if not held else f", whichever {'part' if held == 1 else f'{held} parts'} one holds"
    return Verdict(False, names, f"Drawn {ways}, {listed(motions[0].parts)} would drag {listed(names)} along{hands}.")
