"""Which subsets of parts stand, judged by springs: what a simulation, and a hand, confirms."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from neurosym.geometry.contact.contacts import Contact
from neurosym.geometry.stability.contact_springs import contact_springs
from neurosym.geometry.stability.equilibrium import LIGHTEST
from neurosym.geometry.stability.holding import parts_to_hold
from neurosym.geometry.stability.load_paths import LEVEL, LoadPaths
from neurosym.geometry.stability.patches import groups, neighbours
from neurosym.geometry.stability.settling import Settled, settle
from neurosym.geometry.stability.spring_verdicts import (
    ContactForces,
    Movement,
    SpringStanding,
    contact_forces,
    movements,
    moving_parts,
)
from neurosym.geometry.stability.springs import DEFAULT_NUMBERS, DOWN, SpringNumbers, Springs, tilted
from neurosym.geometry.stability.standing import Stability
from neurosym.support.arrays import Array, Truths
from neurosym.support.bitsets import bits, members
from neurosym.support.progress import tell


class SpringStability:
    """Answers `standing(subset)` by springs. Movable parts that hang together are judged and remembered by themselves.

    A question is answered by the first of these that can:

    * loads that go straight down (`LoadPaths`): a proof that all stands, in no time;
    * single parts beside a gap that fall though all others are immovable, by limit analysis: a proof of a fall;
    * pushes straight down again, of those parts alone that do not simply hand on loads, by springs without friction;
    * springs.

    Where springs let something fall, limit analysis is asked about what moves, all else immovable: where no forces
    balance that, the fall is a promise about smaller subsets.

    Args:
        masses: float64 (n,), and `centres`, float64 (n, 3): centres of mass.
        limit: makes the limit analysis of the same parts, when it is first asked.
        patches: contact patches between parts (`merged_patches`).
        friction: Coulomb's coefficient.
        fixed: bitset of the parts that never move.
        gaps: float64 (len(patches),): how far apart the faces of each patch are (length): play, that closes first.
        gravity: float64 (3,), unit; or zeros, where there is none.
        tilt: degrees by which gravity may be tilted in four horizontal directions: what stands must stand so, too.
        remember: whether answers are kept.

    Attributes:
        masses: float64 (n_parts,): density times volume.
        touching: touching[i] is a bitset of the parts in contact with part i.
        on_table: bitset of the parts in contact with the table.
        supports: supports[i] is a bitset of the parts with a contact under part i (normal within 45 degrees).
        asked: how groups were judged: {"load paths", "single parts", "pushes", "springs"} -> how many.
    """

    def __init__(
        self,
        patches: Sequence[Contact],
        masses: Array,
        centres: Array,
        *,
        friction: float,
        limit: Callable[[], Stability],
        fixed: int = 0,
        gaps: Array | None = None,
        gravity: Array = DOWN,
        tilt: float = 0.0,
        numbers: SpringNumbers = DEFAULT_NUMBERS,
        remember: bool = True,
    ) -> None:
        self.masses, self.fixed, self.gravity, self.remember = masses, fixed, gravity, remember
        self._tilts = tilted(gravity, tilt) if tilt else np.zeros((0, 3))
        self.touching, self.supports, self.on_table = neighbours(patches, len(centres))
        self._make_limit = limit
        self._make_springs = functools.partial(
            contact_springs, patches, masses, centres, friction=friction, gaps=gaps, numbers=numbers
        )
        # Limit analysis knows of no tilted world; play it takes for contact, which speaks for standing.
        self._upright = bool(np.array_equal(gravity, DOWN))
        # Loads that go straight down prove nothing where parts drop by different play, and so may tilt.
        straight = self._upright and (gaps is None or not gaps.any())
        self._paths = LoadPaths(patches, centres) if straight else None
        self.asked = dict.fromkeys(("load paths", "single parts", "pushes", "springs"), 0)
        self._groups: dict[tuple[int, int], SpringStanding] = {}

    @functools.cached_property
    def limit(self) -> Stability:
        """Limit analysis of the same parts: whether some forces balance them."""
        return self._make_limit()

    @functools.cached_property
    def springs(self) -> Springs:
        """The springs at all contacts."""
        return self._make_springs()

    def standing(self, subset: int, held: int = 0) -> SpringStanding:
        """Whether the parts in a bitset stand while those in `held` and the fixed parts cannot move."""
        held &= subset
        movable = subset & ~held & ~self.fixed
        if self._paths is not None and not len(self._tilts) and self._paths.carry(subset, movable):
            self.asked["load paths"] += 1
            return SpringStanding(True, 0, held)
        for group in groups(movable, self.touching):
            answer = self._group(group, self.next_to(group) & subset & ~movable)
            if not answer.stands:
                return replace(answer, held=held)
        return SpringStanding(True, 0, held)

    def standing_when_held(self, subset: int, most: int, *, hands: int = -1) -> SpringStanding:
        """Whether the parts in a bitset stand when the right ones, `most` of them at the most, are held.

        Args:
            subset: bitset of the parts that are there.
            most: how many may be held.
            hands: bitset of the parts that can be held; default any that is not fixed. Only parts that move are tried.

        Returns:
            `held` is what to hold; if nothing helps, `moving` are the parts that move in one motion or another.
        """
        hands &= subset & ~self.fixed
        promises = True

        def ask(held: int) -> SpringStanding:
            nonlocal promises
            answer = self.standing(subset, held)
            promises &= answer.stands or answer.promises
            return answer

        held, motions = parts_to_hold(ask, hands, most)
        if held is not None:
            return SpringStanding(True, 0, held)
        moving = functools.reduce(int.__or__, motions, 0)
        movable = subset & ~self.fixed
        return SpringStanding(False, moving, 0, not promises, self._carried_by(moving, movable, subset))

    # -- evidence ---------------------------------------------------------------------------------------------

    def movements(self, subset: int, held: int = 0) -> tuple[Movement, ...]:
        """How parts of a subset begin to fall, the one that falls most first; none if it stands."""
        movable = subset & ~held & ~self.fixed
        for group in groups(movable, self.touching):
            around = self.next_to(group) & subset & ~movable
            answer = self._group(group, around)
            if answer.stands:
                continue
            # Most that falls, falls though all others are immovable: these alone are let go.
            near = self.next_to(answer.falling) & (group | around) & ~answer.falling
            settled = self.settled(answer.falling | near, near)
            if settled.stands:
                settled = self.settled(group | around, around)
            return tuple(
                replace(m, lost=self.supports[m.part] & ~subset or self.touching[m.part] & ~subset)
                for m in movements(self.springs, settled)
            )
        return ()

    def forces(self, subset: int, held: int = 0) -> ContactForces:
        """The forces at contacts in which a subset comes to rest."""
        return contact_forces(self.springs, self.settled(subset, held))

    # -- loads ------------------------------------------------------------------------------------------------

    def settled(
        self,
        subset: int,
        held: int = 0,
        *,
        loads: Mapping[int, Array] | None = None,
        gravity: Array | None = None,
        slippery: int = 0,
    ) -> Settled:
        """Where a subset comes to rest, all of it at once: nothing is remembered.

        Args:
            loads: for some parts a force and a torque about the centre of mass, float64 (6,): masses (times gravity)
                and lengths as the parts have.
            gravity: float64 (3,), instead of the usual.
            slippery: bitset of parts that rub on nothing.
        """
        there, moving = self._mask(subset), self._mask(subset & ~held & ~self.fixed)
        there[-1] = True
        load = self.springs.gravity(self.gravity if gravity is None else gravity)
        for part, wrench in (loads or {}).items():
            load[part] += self.springs.scaled(np.asarray(wrench, dtype=np.float64), part)
        corners = self.springs.corners_of(there, moving)
        smooth = self._mask(slippery)
        rubs_not = smooth[self.springs.a[corners]] | smooth[self.springs.b[corners]]
        return settle(self.springs, np.flatnonzero(moving), corners, load, slippery=rubs_not)

    # -- one group --------------------------------------------------------------------------------------------

    def _group(self, group: int, around: int) -> SpringStanding:
        answer = self._groups.get((group, around))
        if answer is None:
            answer = self._judge(group, around)
            for gravity in self._tilts if answer.stands else ():
                settled = self.settled(group | around, around, gravity=gravity)
                if not settled.stands:
                    answer = SpringStanding(False, moving_parts(settled))
                    break
            if not answer.stands:
                answer = replace(answer, along=self._carried_by(answer.moving, group, group | around))
            if self.remember:
                self._groups[group, around] = answer
        return answer

    def _judge(self, group: int, around: int) -> SpringStanding:
        there = group | around
        if self._upright:
            falls = self._single_fall(group, there)
            if falls:
                self.asked["single parts"] += 1
                return SpringStanding(False, falls, balanced=False)
        if self._paths is not None and self._pushes_balance(group, there):
            self.asked["pushes"] += 1
            return SpringStanding(True)
        light, light_stand = self._light(group), True
        for few in groups(light, self.touching):
            answer = self._group(few, self.next_to(few) & there & ~light)
            if not answer.stands and answer.promises:
                return SpringStanding(False, answer.moving, balanced=False)
            light_stand &= answer.stands
        self.asked["springs"] += 1
        tell("what stands", self.asked["springs"])
        settled = self.settled(there, around)
        moving = moving_parts(settled)
        # What stands though nothing heavy gives way stands by its own weight, not by the one that it was given there.
        if settled.stands or (light_stand and not moving & ~light):
            return SpringStanding(True)
        if self._upright:
            near = self.next_to(moving) & there & ~moving
            by_limit = self.limit.standing(moving | near, near)
            if not by_limit.stands:
                return SpringStanding(False, by_limit.moving, balanced=False)
        return SpringStanding(False, moving)

    def _pushes_balance(self, group: int, there: int) -> bool:
        """Whether parts that do not hand on every load stand by pushes straight down, and they are the fewer."""
        assert self._paths is not None
        open_ = self._paths.unproved(there, group)
        if not open_:
            return True
        if 2 * open_.bit_count() > group.bit_count():
            return False
        moving, present = self._mask(open_), self._mask(there)
        present[-1] = True
        corners = self.springs.corners_of(present, moving)
        corners = corners[np.abs(self.springs.axes[corners, 0, 2]) > 1 - LEVEL]
        smooth = np.ones(len(corners), dtype=bool)
        load = self.springs.gravity(self.gravity)
        return settle(self.springs, np.flatnonzero(moving), corners, load, slippery=smooth).stands

    def _single_fall(self, group: int, there: int) -> int:
        """A part that has lost a neighbour and falls even if all others cannot move, as a bitset; 0: none."""
        for part in bits(group):
            near = self.touching[part]
            if near & ~there and not (self._paths and self._paths.hands_on(part, there)):
                around = near & there
                if not self.limit.standing(around | 1 << part, around).stands:
                    return 1 << part
        return 0

    def _light(self, group: int) -> int:
        """Bitset of the parts of a group whose weight rounding would drown beside the heaviest of it."""
        parts = bits(group)
        return sum(1 << p for p, small in zip(parts, self.masses[parts] < LIGHTEST * self.masses[parts].max()) if small)

    def next_to(self, parts: int) -> int:
        """Bitset of the parts that touch some of those in a bitset."""
        return functools.reduce(int.__or__, (self.touching[p] for p in bits(parts)), 0)

    def _carried_by(self, falling: int, group: int, there: int) -> int:
        """Bitset of the parts of a group that lie on nothing but what falls."""
        carried, known = 0, -1
        while carried != known:
            known = carried
            for part in bits(group & ~(falling | carried | self.on_table)):
                below = self.supports[part] & there
                if below and not below & ~(falling | carried):
                    carried |= 1 << part
        return carried

    def _mask(self, parts: int) -> Truths:
        """bool (n + 1,): a bitset; the last stands for the table."""
        return members(parts, len(self.masses) + 1)
