"""Ready-made geometric predicates for domains whose world is an `Assembly`; they ask its `AssemblyGeometry`.

Each is made from the fluent that says which parts are there:

    free, stable_without = ns.predicates.free(present), ns.predicates.stable_without(present)

and answers with evidence: which parts block, in which directions; which parts fall and what they lose. What a
verdict promises (`until`) follows from removal tasks: parts that left do not come back. A domain in which
parts also return must pass ``removal=False``.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from neurosym.errors import DefinitionError
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.step_motion import StepMotion
from neurosym.language import formulas
from neurosym.language.search_problem import Verdict
from neurosym.language.state import State
from neurosym.language.terms import Atom, Derived, Fluent, Literal, Type
from neurosym.language.travel import remade
from neurosym.support.bitsets import bits
from neurosym.support.words import listed


@remade
def free(present: Fluent, *, directions: ArrayLike | None = None, table: bool = True, removal: bool = True) -> Derived:
    """``free(p)``: part p can leave by one straight translation, past the parts present and the table.

    Args:
        present: the fluent, of one part, that says which parts are there.
        directions: float64 (k, 3), tried in order; default the axes the assembly is built along, up first.
        table: whether the table is in the way of what moves down.
        removal: parts that left do not come back, so that a verdict may promise.
    """
    part = _part_type(present)

    def ask(world: AssemblyGeometry, state: State, p: str) -> Verdict:
        graph = world.blocking(directions)
        number = world.index[p]
        there = state.mask(present, world.names) & ~(1 << number)
        witnesses, because = 0, 0
        hits = {}
        for d in range(len(graph.vectors)):
            if table and graph.into_table[d]:
                continue
            hit = graph.blockers(number, d, there)
            if not hit:
                motion = StepMotion(direction=graph.vectors[d])
                return Verdict(True, (), f"{p} is free along {graph.describe(d)}.", motion=motion)
            hits[d] = hit
            because |= hit
            # One blocker a direction keeps the promise; one that blocks several keeps it for all of them.
            if not witnesses & hit:
                witnesses |= hit & -hit
        sentence = "; ".join(
            f"{graph.describe(d)}: {', '.join(world.in_mask(hits[d])) if d in hits else 'the table'}"
            for d in range(len(graph.vectors))
        )
        until = tuple(Atom(present, (n,)) for n in world.in_mask(witnesses)) if removal else None
        sentence = f"{p} is blocked in every direction ({sentence})."
        return Verdict(False, world.in_mask(because), sentence, until, unconditional=True)

    def formula(world: AssemblyGeometry, p: str) -> formulas.AnyOf:
        graph = world.blocking(directions)
        ways = []
        for d in range(len(graph.directions)):
            if not (table and graph.into_table[d]):
                blockers = world.in_mask(graph.by_part[d][world.index[p]])
                ways.append(formulas.Way(f"along {graph.describe(d)}", tuple(~present(n) for n in blockers)))
        return formulas.AnyOf(tuple(ways))

    return Derived("free", [part], ask, formula=formula)


@remade
def interlocked(present: Fluent, *, directions: ArrayLike | None = None, table: bool = True) -> Derived:
    """``interlocked()``: no single part of those present is free (they may still come apart in groups)."""
    one = free(present, directions=directions, table=table).function

    def ask(world: AssemblyGeometry, state: State) -> Verdict:
        there = state.objects(present)
        for p in there:
            verdict = one(world, state, p)
            if verdict.holds:
                return Verdict(False, (p,), verdict.reason)
        return Verdict(bool(there), there, f"No single part of {', '.join(there) or 'none'} is free.")

    return Derived("interlocked", [], ask)


@remade
def supported(present: Fluent, *, removal: bool = True) -> Derived:
    """``supported(p)``: something under part p, a part present or the table, touches it from below."""
    part = _part_type(present)

    def ask(world: AssemblyGeometry, state: State, p: str) -> Verdict:
        stability = world.stability
        number = world.index[p]
        carriers = world.in_mask(stability.supports[number] & state.mask(present, world.names))
        if stability.on_table >> number & 1:
            carriers = (*carriers, "the table")
        if carriers:
            return Verdict(True, carriers, f"{p} stands on {', '.join(carriers)}.")
        lost = world.in_mask(stability.supports[number])
        return Verdict(False, lost, f"{p} has lost {', '.join(lost) or 'nothing'} under it.", () if removal else None)

    def formula(world: AssemblyGeometry, p: str) -> formulas.AnyOf:
        stability = world.stability
        number = world.index[p]
        if stability.on_table >> number & 1:
            return formulas.AnyOf((formulas.Way("on the table", ()),))
        carriers = world.in_mask(stability.supports[number])
        return formulas.AnyOf(tuple(formulas.Way(f"on {n}", (Literal(present(n)),)) for n in carriers))

    return Derived("supported", [part], ask, formula=formula)


@remade
def stable_without(present: Fluent, *, removal: bool = True, held: int = 0) -> Derived:
    """``stable_without(p)``: the parts present other than p stand still under gravity, friction included.

    Args:
        present: the fluent, of one part, that says which parts are there.
        removal: parts that left do not come back, so that a verdict may promise.
        held: how many of the others may be held meanwhile; with any, the verdict's motion says which, and nothing is
            promised.
    """
    part = _part_type(present)

    def ask(world: AssemblyGeometry, state: State, p: str) -> Verdict:
        rest = state.mask(present, world.names) & ~(1 << world.index[p])
        return stands(world, rest, (p,), present, held, removal=removal and not held)

    def check(world: AssemblyGeometry, state: State, motion: StepMotion, p: str) -> Verdict:
        hands = motion.held
        if len(hands) > held or p in hands:
            return Verdict(False, hands, f"Step {p}: expected at most {held} of the others to be held; got {hands}.")
        rest = state.mask(present, world.names) & ~(1 << world.index[p])
        if world.stability.standing(rest, held=world.mask(hands)).stands:
            return Verdict(True, (), f"The others stand without {p}.", motion=motion)
        if not hands:
            return ask(world, state, p)
        return _falls(world, world.stability.standing(rest).falling, rest, (p,), held)

    def formula(world: AssemblyGeometry, p: str) -> formulas.Stands:
        return formulas.Stands(present, p, held)

    return Derived("stable_without", [part], ask, check=check, formula=formula, after=stands_there(present, held))


@remade
def stands_there(present: Fluent, held: int = 0) -> Derived:
    """``stands_there()``: the parts present stand still under gravity, `held` of them held at the most."""

    def ask(world: AssemblyGeometry, state: State) -> Verdict:
        return stands(world, state.mask(present, world.names), (), present, held)

    return Derived("stands_there", [], ask)


def stands(
    world: AssemblyGeometry,
    rest: int,
    leaving: Sequence[str],
    present: Fluent | None = None,
    held: int = 0,
    *,
    removal: bool = False,
) -> Verdict:
    """Whether the parts in the bitset `rest` stand once those in `leaving` are gone.

    Args:
        present: the fluent that says which parts are there, for a verdict that promises; None promises nothing.
        held: how many may be held.
        removal: parts that left do not come back, so that the parts that move are all that a promise rests on.
    """
    sentence = ", ".join(leaving)
    answer = world.stability.standing_when_held(rest, held) if held else world.stability.standing(rest)
    if answer.stands:
        motion = StepMotion(held=world.in_mask(answer.held)) if answer.held else None
        return Verdict(True, (), f"The others stand without {sentence}.", motion=motion)
    verdict = _falls(world, answer.falling, rest, leaving, held)
    if present is None or not answer.promises:
        return verdict
    # The motion stays possible while every part that moves in it is there, whatever else has left, and whatever comes
    # that touches none of them: all others are immovable in it. Those that go along are named besides: that promises
    # less, and gives planners more to try next.
    named = tuple(Atom(present, (n,)) for n in verdict.because)
    near = functools.reduce(int.__or__, (world.stability.touching[p] for p in bits(answer.moving)), 0)
    absent = near & ~rest & ~answer.moving & ~world.mask(leaving)
    decided_by = tuple(Atom(present, (n,)) for n in world.in_mask(answer.moving | absent))
    return replace(verdict, until=named if removal else None, decided_by=decided_by)


def _falls(world: AssemblyGeometry, moving: int, rest: int, leaving: Sequence[str], held: int) -> Verdict:
    falling, gone = world.in_mask(moving), world.mask(leaving)
    anyhow = 0 if not leaving else world.stability.standing_when_held(rest | gone, held).falling & moving
    if moving and anyhow == moving:
        return Verdict(False, falling, f"{listed(falling)} would fall, with {listed(leaving)} or without.")
    lost = losses(world, moving & ~anyhow, gone)
    without = f"Without {listed(leaving)}, " if leaving else ""
    sentence = f"{without}{listed(world.in_mask(moving & ~anyhow))} would fall"
    if held:
        sentence += f", whichever {'part' if held == 1 else f'{held} parts'} one holds"
    if lost:
        sentence += f" ({listed([f'{a} loses {b}' for a, b in lost])})"
    also = f" {listed(world.in_mask(anyhow))} would fall anyhow." if anyhow else ""
    return Verdict(False, falling, f"{sentence}.{also}")


def losses(world: AssemblyGeometry, falling: int, leaving: int) -> tuple[tuple[str, str], ...]:
    """Pairs of names (a, b): a is one of `falling` and touches b, one of `leaving` (bitsets of parts)."""
    touching = world.stability.touching
    return tuple((world.names[a], b) for a in bits(falling) for b in world.in_mask(touching[a] & leaving))


def _part_type(present: Fluent) -> Type:
    if not isinstance(present, Fluent) or len(present.types) != 1:
        raise DefinitionError(
            f"Expected the fluent of one part that says which parts are there; got {present!r}. "
            'For instance present = ns.Fluent("present", part).'
        )
    return present.types[0]
