"""When does taking a piece out of a stack of unit cubes bring others down? Three rules, as derived predicates.

``cubes``   Burke, Subr, Ramamoorthy (RA-L 2021), Sec. IV-D: unit cubes are independent bodies, a piece is
            deleted, and a collapse is MORE THAN ONE cube moving. One cube that falls alone is no collapse; it
            settles down on what is under it.
``strict``  nothing may be left over a removed cube.
``rigid``   pieces are rigid bodies: one must leave along a straight line that the others and the table leave
            free, and the rest must stand (`neurosym.language.predicates.free`, `stable_without`).

The first two stand on the blocking graph of the cubes' boxes in the direction down: cube b is over cube a when
b, moved down, would hit a. Falling keeps every column's order and leaves no gap in it, so the set of pieces
left decides where every cube lies.
"""

from dataclasses import dataclass, field
from functools import cache, reduce
from itertools import combinations
from operator import or_

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.stepping import drops_onto
from neurosym.geometry.contact import collision
from neurosym.geometry.contact.contacts import TABLE
from neurosym.geometry.mesh.broad_phase import overlapping_pairs
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.shapes import Box
from neurosym.language import Derived, Fluent, State
from neurosym.language.formulas import AnyOf, Way
from neurosym.language.search_problem import Verdict
from neurosym.language.travel import remade
from neurosym.support.arrays import Array
from neurosym.support.bitsets import bits

RULES = ("cubes", "strict", "rigid")
#: Moving cubes that are still no collapse (the paper: "any", by its code more than one).
MAY_MOVE = {"cubes": 1, "strict": 0}
#: How far cubes over one another may be out of line, as a share of their edge.
SQUARELY = 0.01

_DOWN = ((0.0, 0.0, -1.0),)


@dataclass(frozen=True)
class Stacks:
    """Which cubes stand over which, as bitsets.

    `own`: one bitset of cubes a piece: its own. `over`: one bitset of cubes a piece: all cubes of other pieces over any
    of its own. `owner`: the number of the piece of each cube.
    """

    own: tuple[int, ...]
    over: tuple[int, ...]
    owner: tuple[int, ...]
    _cubes: dict[int, int] = field(default_factory=dict, repr=False)

    def cubes_of(self, pieces: int) -> int:
        """All cubes of the pieces in a bitset; each set is gathered once."""
        if pieces not in self._cubes:
            self._cubes[pieces] = reduce(or_, (self.own[piece] for piece in bits(pieces)), 0)
        return self._cubes[pieces]


def stacks_of(world: AssemblyGeometry) -> Stacks:
    """The stacks of an assembly of cubes; computed once for it."""
    return world.ask_once(_stacks)


def _stacks(world: AssemblyGeometry) -> Stacks:
    below, owners = world.blocking(_DOWN).by_body[0], world.assembly.owners.tolist()
    own, over = [0] * len(world), [0] * len(world)
    for cube, owner in enumerate(owners):
        own[owner] |= 1 << cube
        for other in bits(below[cube]):
            over[owners[other]] |= 1 << cube
    return Stacks(tuple(own), tuple(o & ~m for o, m in zip(over, own)), tuple(owners))


@remade
def keeps_standing(present: Fluent, rule: str) -> Derived:
    """``keeps_standing(p)``: at most `MAY_MOVE` cubes move when piece p is deleted."""
    limit = MAY_MOVE[rule]
    atom_of = cache(present)  # atoms are checked when they are made: once a piece will do

    def keeps_standing(world: AssemblyGeometry, state: State, p: str) -> Verdict:
        number = world.index[p]
        there = state.mask(present, world.names) & ~(1 << number)
        if world.tabulate:
            stacks = stacks_of(world)
            moving = stacks.over[number] & stacks.cubes_of(there)
        else:
            moving = _falling(world.assembly, there, number)
        return _STANDS if moving.bit_count() <= limit else collapse(world, number, moving)

    def collapse(world: AssemblyGeometry, number: int, moving: int) -> Verdict:
        """The refusal for cubes that would move. On the way of every refused attempt, so kept short."""
        counts = [(-(own & moving).bit_count(), i) for i, own in enumerate(stacks_of(world).own) if own & moving]
        names = world.names
        because = tuple([names[i] for _, i in counts])
        # As long as any limit + 1 of these cubes are there, they move; the fewest pieces that own so many.
        counts.sort()
        until, cubes = [], 0
        for count, owner in counts:
            until.append(atom_of(names[owner]))
            cubes -= count
            if cubes > limit:
                break
        total = moving.bit_count()
        falling = f"{total} cube{'s' if total > 1 else ''} of {', '.join(because)}"
        return Verdict(False, because, _SAYS[rule].format(names[number], falling), tuple(until), unconditional=True)

    def formula(world: AssemblyGeometry, p: str) -> AnyOf:
        stacks = stacks_of(world)
        over = stacks.over[world.index[p]]
        count = {world.names[i]: (own & over).bit_count() for i, own in enumerate(stacks.own) if own & over}
        # At most `limit` cubes may move: of so many pieces over it at the most some may still be there.
        stay = [s for k in range(limit + 1) for s in combinations(count, k) if sum(count[n] for n in s) <= limit]
        return AnyOf(tuple(Way("", tuple(~atom_of(n) for n in count if n not in s)) for s in stay))

    return Derived("keeps_standing", present.types, keeps_standing, formula=formula)


_STANDS = Verdict(True)
_SAYS = {"cubes": "Without {}, {} would fall.", "strict": "Without {}, {} would be left over it."}


def _falling(world: Assembly, there: int, removed: int) -> int:
    """Asked anew: settle the cubes with and without piece `removed`, and see which come to lie lower."""
    with_it = _settled(world, there | 1 << removed)
    without = _settled(world, there)
    return sum(1 << cube for cube, z in without.items() if with_it[cube] - z > world.smallest_extent / 2)


def _settled(world: Assembly, there: int) -> dict[int, float]:
    """Heights (z of the centre) at which the cubes of the pieces in `there` come to rest, lowest first."""
    edge = world.smallest_extent
    cubes = [int(c) for c in np.argsort(world.X_WB[:, 2, 3], kind="stable") if there >> int(world.owners[c]) & 1]
    poses: dict[int, Array] = {}
    for cube in cubes:
        pose = world.X_WB[cube].copy()
        under = [poses[c] for c in poses if drops_onto(world, cube, c, poses[c])]
        top = max((p[2, 3] + edge / 2 for p in under), default=world.ground)
        pose[2, 3] = top + edge / 2
        poses[cube] = pose
    return {cube: float(pose[2, 3]) for cube, pose in poses.items()}


def check_cubes(world: Assembly, rule: str) -> None:
    """Refuse what the rules `cubes` and `strict` cannot judge: anything but equal upright cubes."""
    advice = f"The rule {rule!r} judges unit cubes; use collapse='rigid' for other shapes."
    if not world.bodies.all_boxes:
        odd = next(p.name for p in world.parts if not all(isinstance(b.shape, Box) for b in p.bodies))
        raise AssemblyError(f"Expected pieces made of equal cubes; {odd!r} is not. {advice}")
    sizes = np.array([b.shape.size for b in world.bodies if isinstance(b.shape, Box)])
    if np.ptp(sizes) > 0.01 * sizes.min():
        raise AssemblyError(f"Expected cubes of one size; got edges from {sizes.min():g} to {sizes.max():g}. {advice}")
    vertical = np.abs(world.X_WB[:, 2, :3]).max(axis=1)
    if vertical.min() < 1 - 1e-6:
        raise AssemblyError(f"Expected upright cubes, an axis of each along z; some are tilted. {advice}")
    frame = world.X_WB[0, :3, :3]
    turned = np.abs(frame.T @ world.X_WB[:, :3, :3]).max(axis=1).min()
    # Where cubes lie over one another, they must do so squarely: a cube over halves of two might fall either way.
    centres = (world.X_WB[:, :3, 3] - world.X_WB[0, :3, 3]) @ frame / sizes.min()
    level = centres[:, np.abs(frame[2]) < 0.5]
    apart = np.abs(level[:, None] - level[None])
    over = (apart < 1 - SQUARELY).all(axis=2)
    if turned < 1 - 1e-6 or (over & (apart > SQUARELY).any(axis=2)).any():
        raise AssemblyError(f"Expected cubes on one grid, squarely over one another; some overhang others. {advice}")


def check_standing(geometry: AssemblyGeometry, rule: str) -> None:
    """Refuse a puzzle that floats or falls by itself: under `cubes` a cube, else a piece, with nothing to stand on.

    The whole is judged: a problem may start from any part of it, also from one that no order of removals leads to.
    """
    world, present = geometry.assembly, (1 << len(geometry)) - 1
    if rule == "cubes":
        # A cube may stand on its own piece: the rule takes the pieces' cubes for independent.
        for cube, z in _settled(world, present).items():
            if world.X_WB[cube, 2, 3] - z > world.smallest_extent / 2:
                at = ", ".join(f"{v:.3g}" for v in world.X_WB[cube, :3, 3])
                raise AssemblyError(
                    f"Piece {world.names[world.owners[cube]]!r}: its cube ({at}) is floating. Under the rule 'cubes' "
                    "each cube is a body of its own and would fall at once; use collapse='rigid' or 'strict'."
                )
        return
    # Whoever stands on the table, then whoever stands on those, and so on.
    carries: dict[int, set[int]] = {}
    for contact in geometry.contacts:
        a, b = int(world.owners[contact.a]), TABLE if contact.b == TABLE else int(world.owners[contact.b])
        if abs(contact.normal[2]) > 0.7:
            below, above = (b, a) if contact.normal[2] < 0 else (a, b)
            carries.setdefault(below, set()).add(above)
    floating, reached = set(range(len(geometry))), {TABLE}
    while reached:
        floating -= reached
        reached = {above for below in reached for above in carries.get(below, ())} & floating
    if floating:
        raise AssemblyError(
            f"Piece {world.names[min(floating)]!r} is floating: nothing that it stands on reaches the table (z is up, "
            f"the table is at z = {world.ground:g}). Move it down, or leave it out."
        )
    if rule == "rigid":
        standing = geometry.stability.standing(present)
        if not standing.stands:
            falling = ", ".join(world.in_mask(standing.falling))
            raise AssemblyError(
                f"Expected a puzzle that stands by itself; {falling} would fall at once. Support it, or raise the "
                f"friction (it is {world.friction:g})."
            )


def check_overlaps(world: Assembly) -> None:
    """Refuse boxes of different pieces that overlap by more than the touching tolerance."""
    bounds, sizes, shrink = world.body_bounds, world.bodies.box_sizes, world.touch
    near = overlapping_pairs(bounds[:, 0] + shrink, bounds[:, 1] - shrink, world.owners)
    for a, b in near[world.bodies.is_box[near].all(axis=1)]:
        if collision.boxes_meet(sizes[a] - shrink, world.X_WB[a], sizes[b] - shrink, world.X_WB[b]):
            raise AssemblyError(
                f"Pieces {world.names[world.owners[a]]!r} and {world.names[world.owners[b]]!r} overlap by more than "
                f"{shrink:g}; expected pieces that at most touch. Move one of them."
            )
