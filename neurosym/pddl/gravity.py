"""Gravity, compiled: every fall that removals can meet is made impossible before it can happen.

The falls are a finite list (`neurosym.geometry.stability.falls`). Each happens while all of its moving parts are there
and what would resist is gone; so a part of it must have left, or one that resists must still be there.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.stability.falls import Fall, find_falls
from neurosym.language.formulas import Formula, Stands
from neurosym.language.problem import Problem
from neurosym.language.terms import Fluent, Literal
from neurosym.pddl.facts import Fact, Mark, Operator
from neurosym.pddl.instances import Instance, least

#: Of one way to do an action: into so many operators its disjunctions are multiplied out, at the most. What is left
#: over gets helper operators instead, which change nothing but a mark.
MAX_OPERATORS = 24


#: Action primitive -> what it asks of gravity, or None.
Asked = Mapping[str, Stands | None]


@dataclass(frozen=True)
class Weighed:
    """What gravity makes of ground actions.

    `instances`: those that can ever be done, with conditions under which nothing falls after them. `helpers`: operators
    that note that one of several facts holds. `kept`: the marks that helpers set -> those facts; what takes one of them
    away takes the mark away. `sound`: whether all falls are known. `note`: a sentence on how they were found.
    """

    instances: list[Instance]
    helpers: tuple[Operator, ...]
    kept: Mapping[Mark, set[Fact]]
    sound: bool
    note: str


def standing_asked(
    problem: Problem, instances: Sequence[Instance], formulas: Sequence[Sequence[Formula] | None]
) -> Asked | None:
    """Which instances ask that the others stand; None if the problem is not one that formulas can tell.

    Falls can be listed where every action that takes a part away asks whether the others stand, and none brings
    one back.
    """
    asked: dict[str, Stands | None] = {}
    for instance, own in zip(instances, formulas):
        if own is None:
            return None
        stands = [f for f in own if isinstance(f, Stands)]
        asked[instance.name] = stands[0] if stands else None
        if len(set(stands)) > 1:
            return None
    kinds = {(s.present, s.held) for s in asked.values() if s}
    if not kinds:
        return asked
    if len(kinds) > 1:
        return None
    present = next(iter(kinds))[0]
    for instance in instances:
        gone = [a.args for a in instance.delete if a.predicate == present]
        one = asked[instance.name]
        if any(a.predicate == present for a in instance.add) or gone != ([(one.without,)] if one else []):
            return None
        if one and one.without in problem.world.fixed:
            return None
    return asked


def weighed(
    problem: Problem,
    instances: Sequence[Instance],
    asked: Asked,
    *,
    refuted: Sequence[Sequence[str]],
    seconds: float | None,
) -> Weighed:
    """Add to the ways of each removal that no fall can happen after it.

    `instances`: with their ways, gravity left out. `asked`: see `standing_asked`; one at least asks. `refuted`: orders
    of action primitives in which something falls. `seconds`: for the search for falls.
    """
    world, init = problem.geometry, frozenset(problem.init)
    assert world is not None
    first = next(s for s in asked.values() if s)
    present = first.present
    moves: dict[int, list[int]] = {}
    for instance in instances:
        own = asked[instance.name]
        if own:
            masks = [world.mask(n for n in world.names if ~present(n) in way) for _, way in instance.ways]
            moves.setdefault(world.index[own.without], []).extend(masks)
    initial = world.mask(n for n in world.names if present(n) in init)
    removed = {name: world.index[s.without] for name, s in asked.items() if s}
    orders = [[removed[name] for name in order if name in removed] for order in refuted]
    by_limit = world.rule == "limit"
    limit = world.limit if by_limit else world.springs.limit
    found = find_falls(limit, initial, moves, held=first.held, refuted=orders, seconds=seconds)
    removals = [(s.without, i) for i in instances if (s := asked[i.name])]
    kept = _avert(world.assembly, present, found.falls, removals)
    return Weighed(
        [i for i in instances if i.ways],
        _helpers(kept),
        kept,
        found.complete and by_limit,
        f"Gravity: {len(found.falls)} falls, found among {found.sets:,} connected sets of parts, "
        + ("which are all that removals can lead to" if found.complete else "more than there was time for")
        + ("." if by_limit else ", as far as forces that balance (limit analysis) tell: springs may see more."),
    )


def _avert(
    world: Assembly, present: Fluent, falls: Sequence[Fall], removals: Sequence[tuple[str, Instance]]
) -> dict[Mark, set[Fact]]:
    """Add to the ways of each removal that no fall can happen after it; the clauses that need helpers.

    A fall that could not happen before a removal can happen after it only if what is removed is among the parts
    that must be gone. One that can happen at first must be made impossible by the first removal already.

    `removals`: names of parts, and what removes them; one part may have several.
    """
    removers: dict[str, list[Instance]] = {}
    for part, instance in removals:
        removers.setdefault(part, []).append(instance)
    averted: dict[int, Fact] = {}
    for number, fall in enumerate(falls):
        can_leave = [n for n in world.in_mask(fall.moving) if n in removers]
        if len(can_leave) == 1:
            averted[number] = ~present(can_leave[0])
        elif can_leave:
            averted[number] = mark = Mark("averted", str(number))
            for instance in itertools.chain.from_iterable(removers[n] for n in can_leave):
                instance.marks.add(mark)
    kept: dict[Mark, set[Fact]] = {}
    for part, instance in removals:
        bit = 1 << world.index[part]
        threats = [(k, f) for k, f in enumerate(falls) if not f.moving & bit and (f.gone & bit or not f.gone)]
        ways = []
        for name, way in instance.ways:
            clauses: list[tuple[str, frozenset[Fact]]] = []
            for number, fall in threats:
                if any(~present(n) in way for n in world.in_mask(fall.moving)):
                    continue
                stay = world.in_mask(fall.gone & ~bit)
                if any(n not in removers or Literal(present(n)) in way for n in stay):
                    continue
                choices: set[Fact] = {Literal(present(n)) for n in stay if ~present(n) not in way}
                if number in averted:
                    choices.add(averted[number])
                clauses.append((f"{number} {instance.name}", frozenset(choices)))
            ways += [(name, way | conjunction) for conjunction in _multiplied(clauses, kept)]
        instance.ways = least(ways)
    return kept


def _multiplied(clauses: Sequence[tuple[str, frozenset[Fact]]], kept: dict[Mark, set[Fact]]) -> list[frozenset[Fact]]:
    """Conjunctions, one of which holds exactly when all clauses do. `kept` gains the clauses that need helpers."""
    found: list[frozenset[Fact]] = [frozenset()]
    for label, choices in sorted(clauses, key=lambda c: (len(c[1]), c[0])):
        open_, met = [k for k in found if not k & choices], [k for k in found if k & choices]
        more = [known | {choice} for known in open_ for choice in sorted(choices, key=str)] + met
        following = [way for _, way in least([("", m) for m in more])]
        if len(following) > MAX_OPERATORS:
            mark = Mark("kept", label)
            kept.setdefault(mark, set()).update(choices)
            following = [known | {mark} for known in found]
        found = following
    return found


def _helpers(kept: Mapping[Mark, set[Fact]]) -> tuple[Operator, ...]:
    """Operators that note that a clause holds; a removal of any part that it counts on takes the note away."""
    return tuple(
        Operator(f"note {mark.label}", None, "", frozenset([choice]), frozenset([mark]), frozenset())
        for mark, choices in kept.items()
        for choice in sorted(choices, key=str)
    )
