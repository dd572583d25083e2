"""Why an assembly does not come apart: looked up in the geometry where a search got stuck."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from domains.assembly_paths import NoWay, way_out
from domains.assembly_pull import drawn_part
from neurosym.geometry.grouping import need_not_part
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.stability.holding import all_falling
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.explanation import Blocked, Cycle, Fall, WhyNot, blockers_of, smallest_cycle
from neurosym.language.predicates import losses
from neurosym.language.search_problem import Rejection
from neurosym.support.bitsets import bits
from neurosym.support.words import LISTED

if TYPE_CHECKING:
    from domains.assembly import Setting
    from domains.assembly_splits import Block


def refute_removal(geometry: AssemblyGeometry, setting: Setting) -> WhyNot | None:
    """A proof, without a search, that some parts never leave along straight lines, one at a time; None: all do.

    Without gravity what is free stays free, so the order in which parts are peeled off does not matter.
    """
    if setting.paths != "straight":
        return None
    graph = geometry.blocking(setting.directions)
    there, done = (1 << len(geometry)) - 1, list[int]()
    while free := [p for p in bits(there) if graph.free_directions(p, there)]:
        done += free
        there &= ~sum(1 << p for p in free)
    kept = there & ~geometry.assembly.fixed_mask
    if setting.targets and not kept & geometry.mask(setting.targets):
        return None
    if not kept or (not setting.targets and need_not_part([geometry.in_mask(there)], geometry.assembly.piece_groups)):
        return None
    return WhyNot(
        after=tuple(geometry.names[p] for p in done),
        left=geometry.in_mask(there),
        blocked=tuple(b for p in bits(kept) for b in blockers_of(graph, p, there, table=True)),
        cycle=smallest_cycle(graph, kept),
        relaxed=setting.gravity,
    )


def falls_at_first(geometry: AssemblyGeometry, setting: Setting) -> WhyNot | None:
    """That the whole does not stand before anything is taken out, where it has to; None: it does."""
    whole = (1 << len(geometry)) - 1
    if not setting.gravity or (answer := geometry.stability.standing_when_held(whole, setting.held)).stands:
        return None
    falls = (fall(geometry, whole, 0, all_falling(geometry.stability.standing, whole, answer.falling), setting.held),)
    return WhyNot(after=(), left=geometry.names, falls=falls)


def together(at_first: WhyNot | None, interlock: WhyNot | None) -> WhyNot | None:
    """Both reasons in one; None where there is neither."""
    if at_first is None or interlock is None:
        return at_first or interlock
    return replace(interlock, falls=(*at_first.falls, *interlock.falls))


def explain_removal(
    geometry: AssemblyGeometry, setting: Setting, before: Sequence[tuple[str, str]], done: tuple[str, ...]
) -> WhyNot:
    """Why nothing more can be removed after `done`, the longest prefix that works."""
    there = (1 << len(geometry)) - 1 & ~geometry.mask(done)
    graph = geometry.blocking(setting.directions)
    blocked: list[Blocked] = []
    falls: list[Fall] = []
    waiting: list[tuple[str, str]] = []
    unproved: list[str] = []
    whole = geometry.stability.standing_when_held(there, setting.held) if setting.gravity else None
    if whole is not None and not whole.stands:
        falls.append(fall(geometry, there, 0, whole.falling, setting.held))
    for part in bits(there & ~geometry.assembly.fixed_mask):
        name = geometry.names[part]
        if not graph.free_directions(part, there):
            way: StepMotion | NoWay = NoWay("", (), True)
            if setting.paths == "any":
                way = way_out(geometry, 1 << part, there, shifting=not setting.gravity)
            if isinstance(way, NoWay):
                blocked += blockers_of(graph, part, there, table=True)
                unproved += [] if way.proved else [name]
                continue
        waiting += [(name, first) for first, then in before if then == name and first not in done]
        if whole is not None and whole.stands:
            answer = geometry.stability.standing_when_held(there & ~(1 << part), setting.held)
            if not answer.stands:
                told = len(falls) < LISTED
                falls.append(fall(geometry, there, 1 << part, answer.falling, setting.held, told=told))
            elif setting.pull:
                drawn = drawn_part(geometry, setting, there, part)
                if not drawn.holds:
                    falls.append(Fall((name,), drawn.because, (), setting.held, drawn="in any direction that is free"))
    kept = geometry.mask({b.part for b in blocked})
    return WhyNot(
        after=done,
        left=geometry.in_mask(there),
        blocked=tuple(blocked),
        cycle=smallest_cycle(graph, kept),
        falls=tuple(falls),
        waiting=tuple(waiting),
        unproved=tuple(unproved),
    )


def explain_building(
    geometry: AssemblyGeometry, setting: Setting, before: Sequence[tuple[str, str]], placed: tuple[str, ...]
) -> WhyNot:
    """Why nothing more can be put in place beside what never leaves and `placed`, in the order of the plan's end."""
    there = geometry.assembly.fixed_mask | geometry.mask(placed)
    missing = (1 << len(geometry)) - 1 & ~there
    graph, stability = geometry.blocking(setting.directions), geometry.stability
    blocked: list[Blocked] = []
    falls: list[Fall] = []
    near = functools.reduce(int.__or__, (stability.touching[p] for p in bits(there)), stability.on_table) & missing
    for part in bits(near if setting.gravity else missing):
        if not graph.free_directions(part, there | 1 << part):
            blocked += blockers_of(graph, part, there, table=True)
        elif setting.gravity:
            answer = stability.standing_when_held(there | 1 << part, setting.held)
            if not answer.stands:
                falls.append(Fall((geometry.names[part],), geometry.in_mask(answer.moving), (), setting.held))
    absent = {geometry.names[p] for p in bits(missing)}
    return WhyNot(
        after=placed,
        left=geometry.in_mask(missing),
        blocked=tuple(blocked),
        falls=tuple(falls),
        waiting=tuple((a, b) for a, b in before if a in absent and b in absent),
        building=geometry.assembly.fixed,
    )


def fall(
    geometry: AssemblyGeometry, there: int, leaving: int, moving: int, held: int, *, told: bool = True
) -> Fall:
    """What falls (`moving`, a bitset) of the parts in `there` when those in `leaving` go, and how if `told`."""
    lost, movement = losses(geometry, moving, leaving), ""
    if told and geometry.rule == "springs":
        first = next(iter(geometry.springs.movements(there & ~leaving)), None)
        movement = replace(first, lost=first.lost & ~leaving).sentence(geometry.names) if first else ""
    return Fall(geometry.in_mask(leaving), geometry.in_mask(moving), lost, held, movement)


def explain_groups(
    geometry: AssemblyGeometry,
    setting: Setting,
    done: tuple[str, ...],
    blocks: Sequence[Block],
    refused: Mapping[str, Rejection],
) -> WhyNot:
    """Why the blocks that are left do not come apart in groups.

    Args:
        done: names of the actions that were done.
        blocks: of more than one part.
        refused: part that is no anchor -> why it cannot be split off.
    """
    graph = geometry.blocking(setting.directions)
    blocked: list[Blocked] = []
    falls: list[Fall] = []
    cycles: list[Cycle] = []
    unproved: list[str] = []
    left = 0
    for block in blocks:
        names = [n for n in geometry.in_mask(block.parts) if n in refused]
        if not names:
            continue
        left |= block.parts
        for name in names:
            blocked += blockers_of(graph, geometry.index[name], block.parts, table=block.stands)
            if not refused[name].proved:
                unproved.append(name)
        cycle = smallest_cycle(graph, block.parts)
        if cycle is not None:
            cycles.append(cycle)
        if block.stands and setting.gravity:
            answer = geometry.stability.standing_when_held(block.parts, setting.held)
            if answer.stands:
                falls += _falls_of_groups(geometry, setting, block, names)
            else:
                falls.append(fall(geometry, block.parts, 0, answer.falling, setting.held))
    return WhyNot(
        after=done,
        left=geometry.in_mask(left),
        blocked=tuple(blocked),
        cycle=min(cycles, key=lambda c: len(c.parts), default=None),
        falls=tuple(falls),
        unproved=tuple(unproved),
    )


def _falls_of_groups(geometry: AssemblyGeometry, setting: Setting, block: Block, names: Sequence[str]) -> list[Fall]:
    """For each part the smallest group that could leave with it, and what would fall then."""
    graph = geometry.blocking(setting.directions)
    found: dict[int, Fall] = {}
    for name in names:
        number = geometry.index[name]
        groups = [graph.leaving_group(number, d, block.parts) for d in range(len(graph.vectors))]
        leaving = min((g for g in groups if g and g != block.parts), key=int.bit_count, default=0)
        if leaving and leaving not in found:
            answer = geometry.stability.standing_when_held(block.parts & ~leaving, setting.held)
            if not answer.stands:
                told = len(found) < LISTED
                found[leaving] = fall(geometry, block.parts, leaving, answer.falling, setting.held, told=told)
    return list(found.values())
