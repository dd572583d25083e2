"""The rules of building: one symbolic domain, and the derived predicates that read the reference and geometry."""

from domains.tower_blocks import Kind, ReferenceTower
from neurosym.language import Action, Derived, Domain, Fluent, State, Type
from neurosym.language.search_problem import Verdict

block = Type("block")
#: Fluent: the block stands in the tower. How many do says which level is next.
placed = Fluent("placed", block)
#: Static fluent: the block was at hand when the work began. What stood already is no action primitive.
stocked = Fluent("stocked", block)


def _unused(world: ReferenceTower, state: State, b: str) -> Verdict:
    if not state.holds(placed(b)):
        return Verdict(True)
    # Blocks never leave the tower, so this is for good.
    return Verdict(False, (b,), f"{b} is in the tower already: to take it again is to demolish the tower.", ())


def _matches(world: ReferenceTower, state: State, b: str) -> Verdict:
    level, kind = _level(world, state), world.kinds[b]
    if level == len(world.reference):
        return Verdict(False, (), f"The tower has all its {level} levels; {b} is left over.", ())
    wanted = world.reference[level]
    if kind == wanted:
        return Verdict(True)
    fitting = tuple(n for n in _left(world, state) if world.kinds[n] == wanted)
    what = f"{wanted[0]}, {b} is {kind[0]}"
    if wanted[0] == kind[0]:
        what = f"{wanted[0]} of size {wanted[1]}, {b} has size {kind[1]}"
    # Only an earlier level, passed by now, could have taken b in another state.
    unconditional = kind not in world.reference[:level]
    until = tuple(placed(n) for n in _before(world, state, level, kind))
    return Verdict(False, fitting, f"Level {level + 1} of the reference is {what}.", until, unconditional=unconditional)


def _before(world: ReferenceTower, state: State, level: int, kind: Kind) -> tuple[str, ...]:
    """Blocks of which one must be placed before a level asks for `kind`; none: no level will."""
    if kind not in world.reference[level:]:
        return ()
    between = world.reference[level : world.reference.index(kind, level)]
    last = max(set(between), key=between.index)
    return tuple(n for n in _left(world, state) if world.kinds[n] == last)


def _rests(world: ReferenceTower, state: State, b: str) -> Verdict:
    """Asked of a block that matches: it lies where the reference has it, on the levels that are there."""
    height = _level(world, state)
    falling = world.falling(height + 1)
    if not falling:
        return Verdict(True)
    names = (*_built(world, state), b)
    because = tuple(names[i] for i in falling)
    reason = f"With {b} on level {height + 1} the tower topples: {', '.join(because)} would fall."
    # No other kind of block may come next, and any of this kind topples it: this is for good.
    return Verdict(False, because, reason, ())


def _finished(world: ReferenceTower, state: State) -> Verdict:
    level = _level(world, state)
    missing = f"The tower has {level} of {len(world.reference)} levels."
    return Verdict(level == len(world.reference), tuple(_left(world, state)), missing)


def _level(world: ReferenceTower, state: State) -> int:
    """The level that comes next, from 0."""
    return state.mask(placed, world.names).bit_count()


def _left(world: ReferenceTower, state: State) -> list[str]:
    there = state.mask(placed, world.names)
    return [n for i, n in enumerate(world.names) if not there >> i & 1]


def _built(world: ReferenceTower, state: State) -> list[str]:
    """The blocks that are placed, level by level; of blocks of one kind it does not matter which is where."""
    there = [n for n in world.names if state.holds(placed(n))]
    built: list[str] = []
    for kind in world.reference[: len(there)]:
        built.append(next(n for n in there if world.kinds[n] == kind and n not in built))
    return built


unused = Derived("unused", [block], _unused)
matches = Derived("matches", [block], _matches)
rests = Derived("rests", [block], _rests)
finished = Derived("finished", [], _finished)

_b = block("b")
_needs = [stocked(_b), unused(_b), matches(_b), rests(_b)]
place = Action("place", _b, pre=_needs, eff=[placed(_b)], label="{b}", once=True)
TOWER = Domain("tower", fluents=[placed, stocked], actions=[place])
