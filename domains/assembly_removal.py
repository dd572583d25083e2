"""Taking an assembly apart one part at a time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from neurosym import predicates
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.sweep import exits_along
from neurosym.language import Action, Derived, Domain, Fluent, Problem, Simulation, State, Type
from neurosym.problem import Verdict
from neurosym.ways import Way
from neurosym.why_not import listed

if TYPE_CHECKING:
    from domains.assembly import Setting

part = Type("part")
present = Fluent("present", part)
fixed = Fluent("fixed", part)
_p = part("p")


def apart_one_by_one(
    assembly: Assembly,
    setting: Setting,
    *,
    before: Iterable[tuple[str, str]],
    name: str,
    family: str,
    details: Mapping[str, Any],
) -> Problem:
    """The problem in which an action, named by a part, removes that part."""
    geometry = [can_leave(setting)(_p)]
    if setting.gravity:
        geometry += [stands_at_first(setting)(), predicates.stable_without(present, held=setting.held)(_p)]
    remove = Action("remove", _p, pre=[present(_p), ~fixed(_p), *geometry], eff=[~present(_p)], label="{p}")
    loose = [n for n in assembly.names if n not in assembly.fixed]
    judged_alike = setting.gravity and not setting.held and not assembly.fixed and setting.paths == "straight"
    return Domain("assembly", fluents=[present, fixed], actions=[remove]).problem(
        world=assembly,
        objects={part: assembly.names},
        init=[*(present(n) for n in assembly.names), *(fixed(n) for n in assembly.fixed)],
        goal=[~present(n) for n in loose],
        before=before,
        name=name,
        family=family,
        simulation=Simulation("rigid", {n: n for n in loose}) if judged_alike else None,
        details=details,
    )


def can_leave(setting: Setting) -> Derived:
    """``free(p)``: part p can leave; the `how` is a `Way`."""
    straight = predicates.free(present, directions=setting.directions)

    def ask(world: Assembly, state: State, p: str) -> Verdict:
        verdict = straight.function(world, state, p)
        if verdict.holds:
            return Verdict(True, (), verdict.reason, how=Way.along((p,), verdict.how))
        return verdict

    def check(world: Assembly, state: State, how: Any, p: str) -> Verdict:
        others = [world.index[n] for n in state.objects(present) if n != p]
        if not isinstance(how, Way) or how.direction is None or how.parts != (p,):
            return ask(world, state, p)
        direction = np.array(how.direction)
        hit = world.in_mask(sum(1 << o for o in exits_along(world, world.index[p], direction, others)))
        down = world.has_table and direction[2] < -world.tolerances.parallel
        if hit or down:
            return Verdict(False, hit, f"{p} cannot go {how}: {', '.join(hit) or 'the table'} is in the way.")
        return Verdict(True, (), f"{p} is free {how}.", how=how)

    return Derived("free", [part], ask, check=check)


def stands_at_first(setting: Setting) -> Derived:
    """``stands()``: the whole stands before anything is taken out. Afterwards each removal has seen to it."""

    def ask(world: Assembly, state: State) -> Verdict:
        there = state.mask(present, world.names)
        if there != (1 << len(world)) - 1:
            return Verdict(True)
        answer = world.stability().standing_when_held(there, setting.held)
        if answer.stands:
            return Verdict(True)
        falling = world.in_mask(answer.moving)
        said = f"The assembly does not stand as it is: {listed(falling)} would fall."
        return Verdict(False, falling, said, ())

    return Derived("stands", [], ask)
