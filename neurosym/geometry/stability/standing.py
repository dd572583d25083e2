"""Which subsets of rigid parts stand still under gravity: contact patches with friction.

Forces act at the corners of contact patches, inside linearised Coulomb cones; a subset stands when some choice
of them balances every part's weight and moments (Fahlman 1974; Livesley 1978). Where there is none, a virtual motion
in which gravity does work and no contact resists proves it: the evidence, and the parts that move in it.

`Equilibrium` decides most questions, and what it cannot prove a linear program decides. In a sequence of questions
about similar subsets most answers are local, each proved by itself:

* movable parts that hang together by no contacts stand or fall by themselves, and are judged and remembered so;
* forces of a subset that stood may balance a smaller one as they are, or when only those near what left are changed;
* parts that fall although all others were immovable fall in any case. Parts so light that rounding would drown their
  weight beside the heaviest are asked so first, among themselves.
"""

from __future__ import annotations

import functools
import math
from collections import OrderedDict, deque
from dataclasses import dataclass

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.contacts import TABLE, Contact
from neurosym.geometry.stability.equilibrium import BALANCE, CONE_EDGES, LIGHTEST, QUICK, THOROUGH, Balance, Equilibrium
from neurosym.geometry.stability.holding import Standing, parts_to_hold
from neurosym.geometry.stability.linear_program import solve_program
from neurosym.geometry.stability.patches import groups, masses, merged_patches, neighbours
from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.bitsets import bits
from neurosym.support.deadline import check

#: Up to so many movable parts a question is answered from scratch: the evidence is the same whatever was asked before.
SMALL = 48

#: So many subsets that stood are kept with their forces, and so many motions that proved a fall.
_KEPT_FORCES, _KEPT_FALLS = 12, 400

#: Of the largest residual: from which share on a part counts as moving, from the clearest motion to the faintest.
_MOVING = (0.3, 3e-2, 1e-3, 1e-6)


@dataclass(frozen=True, eq=False)
class _Question:
    """Parts that are there, those among them that can move, and the corners between them, as masks and numbers."""

    subset: int
    movable: int
    present: Truths
    parts: Numbers
    corners: Numbers


class Stability:
    """Answers `standing(subset)` for an assembly; each subset is solved once and remembered.

    Args:
        contacts: of the assembly.
        remember: whether answers are kept; otherwise each question is solved anew.
        heaviest: heavier parts than this count as so heavy: for questions in which they cannot move.

    Attributes:
        masses: float64 (n_parts,): density times volume.
        touching: touching[i] is a bitset of the parts in contact with part i.
        on_table: bitset of the parts in contact with the table.
        supports: supports[i] is a bitset of the parts with a contact under part i (normal within 45 degrees).
        light: bitset of the parts below `LIGHTEST` of the heaviest.
        asked: how the questions so far were answered: {"kept", "near", "whole", "program"} -> how many.
    """

    def __init__(
        self,
        assembly: Assembly,
        contacts: tuple[Contact, ...],
        *,
        remember: bool = True,
        heaviest: float = math.inf,
    ) -> None:
        self.assembly, self.remember = assembly, remember
        own, self._centres = masses(assembly)
        self.masses = np.minimum(own, heaviest)
        self.light = sum(1 << int(p) for p in np.flatnonzero(self.masses < LIGHTEST * self.masses.max()))
        self._contacts = contacts
        patches = merged_patches(assembly, contacts)
        self.touching, self.supports, self.on_table = neighbours(patches, len(assembly))
        self.equilibrium = Equilibrium(assembly, patches, self.masses, self._centres)
        self.asked = dict.fromkeys(("kept", "near", "whole", "program"), 0)
        self._answers: dict[tuple[int, int], Standing] = {}
        self._forces: OrderedDict[tuple[int, int], Array] = OrderedDict()
        self._falls: deque[tuple[int, int]] = deque(maxlen=_KEPT_FALLS)
        self._whole_asked = False

    def standing(self, subset: int, held: int = 0) -> Standing:
        """Whether the parts in a bitset stand while those in `held` and the fixed parts cannot move."""
        held &= subset
        answer = self._answers.get((subset, held))
        if answer is None:
            check()
            answer = self._answer(subset, held)
            if self.remember:
                self._answers[subset, held] = answer
        return answer

    def standing_when_held(self, subset: int, most: int, *, hands: int = -1) -> Standing:
        """Whether the parts in a bitset stand when the right ones, `most` of them at the most, are held.

        Args:
            subset: bitset of the parts that are there.
            most: how many may be held.
            hands: bitset of the parts that can be held; default any that is not fixed.

        Returns:
            `held` is what to hold; if nothing helps, `moving` are the parts that move in one motion or another, whose
            presence is enough for the subset and any smaller one to fall.
        """
        hands &= subset & ~self.assembly.fixed_mask
        held, motions = parts_to_hold(lambda held: self.standing(subset, held), hands, most)
        if held is not None:
            return Standing(True, 0, held)
        return Standing(False, functools.reduce(int.__or__, motions, 0))

    def by_program(self, subset: int, held: int = 0) -> Standing:
        """The same question put to a linear program over all contacts at once: slow, and the last word."""
        question = self._question(subset, subset & ~held & ~self.assembly.fixed_mask)
        balance = solve_program(self.equilibrium, question.parts, question.corners, self.assembly.in_mask(subset))
        return Standing(True, 0, held) if balance.stands else self._fallen(question, balance, held)

    # -- one question -----------------------------------------------------------------------------------------

    def _question(self, subset: int, movable: int) -> _Question:
        """All corners between parts that are there, one of them movable at least."""
        n = len(self.assembly)
        present, moves = np.zeros(n + 1, dtype=bool), np.zeros(n + 1, dtype=bool)
        present[bits(subset)] = True
        present[TABLE] = True
        moves[bits(movable)] = True
        whole = self.equilibrium
        corners = np.flatnonzero(present[whole.a] & present[whole.b] & (moves[whole.a] | moves[whole.b]))
        return _Question(subset, movable, present, np.flatnonzero(moves[:n]), corners)

    def _answer(self, subset: int, held: int) -> Standing:
        movable = subset & ~held & ~self.assembly.fixed_mask
        moving = 0
        for group in groups(movable, self.touching):
            around = functools.reduce(int.__or__, (self.touching[p] for p in bits(group)), 0) & subset & ~group
            if group | around == subset:
                return self._judge(subset, movable, held)
            moving |= self.standing(group | around, around).moving
        return Standing(not moving, moving, held)

    def _judge(self, subset: int, movable: int, held: int) -> Standing:
        """The answer for movable parts that hang together, with all that touches them."""
        for known, moving in self._falls:
            if not moving & ~movable and not subset & ~known:
                self.asked["kept"] += 1
                return Standing(False, moving, held)
        if movable & self.light:
            alone = self._lighter.standing(subset, subset & ~(movable & self.light))
            if not alone.stands or not movable & ~self.light:
                return Standing(alone.stands, alone.moving, held)
        question = self._question(subset, movable)
        start = self._similar(subset, held) if len(question.parts) > SMALL else None
        if start is not None:
            answer = self._near(question, start, held)
            if answer is not None:
                return answer
            start = start[question.corners]
        self.asked["whole"] += 1
        weights = self.equilibrium.weights[question.parts]
        balance = self.equilibrium.balance(question.parts, question.corners, weights, start, QUICK[start is not None :])
        for steps in (THOROUGH, None):
            if balance.stands:
                return self._stood(question, balance.forces, held)
            fallen = self._proved_fall(question, balance)
            if fallen:
                return self._fell(subset, fallen, held)
            if steps is None:
                break
            balance = self.equilibrium.balance(question.parts, question.corners, weights, balance.forces, steps)
        self.asked["program"] += 1
        return self.by_program(subset, held)

    @functools.cached_property
    def _lighter(self) -> Stability:
        """For questions in which none but light parts can move."""
        most = float(self.masses[bits(self.light)].max())
        return Stability(self.assembly, self._contacts, remember=self.remember, heaviest=most)

    def _similar(self, subset: int, held: int) -> Array | None:
        """Forces of the most similar subset that stood, float64 (all corners, CONE_EDGES).

        The first question is preceded by that about the whole: most subsets are what is left of it.
        """
        if not self._whole_asked:
            self._whole_asked = True
            self.standing((1 << len(self.assembly)) - 1)
        if not self._forces:
            return None
        nearest = min(self._forces, key=lambda k: (k[0] ^ subset).bit_count() + (k[1] ^ held).bit_count())
        self._forces.move_to_end(nearest)
        return self._forces[nearest]

    def _near(self, question: _Question, start: Array, held: int) -> Standing | None:
        """An answer from what is near the parts that forces of a similar subset leave unbalanced, if there is one."""
        whole = self.equilibrium
        weights = whole.weights[question.parts]
        left = weights - whole.wrenches(question.corners, start[question.corners], len(self.assembly))[question.parts]
        unbalanced = sum(1 << int(p) for p in question.parts[np.abs(left).max(axis=1) > BALANCE])
        if not unbalanced:
            self.asked["kept"] += 1
            forces = start[question.corners]
            return self._stood(question, forces, held)
        # What has lost a support is asked first whether it falls, what was relieved of a load whether it stands.
        lost = float(left[:, 2].max()) > BALANCE
        for ask in (self._falls_near, self._stands_near) if lost else (self._stands_near, self._falls_near):
            answer = ask(question, start, unbalanced, held)
            if answer is not None:
                self.asked["near"] += 1
                return answer
        return None

    def _falls_near(self, question: _Question, start: Array, unbalanced: int, held: int) -> Standing | None:
        """All others immovable: if these parts fall even so, they fall."""
        near = self._question(question.subset, self._with_ring(unbalanced, question.movable))
        if len(near.parts) == len(question.parts):
            return None
        balance = self.equilibrium.balance(near.parts, near.corners, self.equilibrium.weights[near.parts])
        fallen = self._proved_fall(near, balance) if not balance.stands else 0
        return self._fell(question.subset, fallen, held) if fallen else None

    def _stands_near(self, question: _Question, start: Array, unbalanced: int, held: int) -> Standing | None:
        """All other forces as they are: if those about a path to the ground can balance what is left, all stands."""
        whole = self.equilibrium
        strip = self._with_ring(self._carriers(question, start, unbalanced), question.movable)
        if 2 * strip.bit_count() >= len(question.parts):
            return None
        inner = self._question(question.subset, strip)
        moves = np.ones(len(self.assembly) + 1, dtype=bool)
        moves[question.parts] = False
        moves[inner.parts] = True  # True: in the strip, or immovable
        open_ = moves[whole.a[inner.corners]] & moves[whole.b[inner.corners]]
        edge, corners = inner.corners[~open_], inner.corners[open_]
        target = whole.weights[inner.parts] - whole.wrenches(edge, start[edge], len(self.assembly))[inner.parts]
        balance = whole.balance(inner.parts, corners, target, start[corners], QUICK[1:])
        if not balance.stands:
            return None
        forces = start.copy()
        forces[corners] = balance.forces
        return self._stood(question, forces[question.corners], held)

    def _with_ring(self, parts: int, among: int) -> int:
        """Parts, and those that touch them."""
        touching = functools.reduce(int.__or__, (self.touching[p] for p in bits(parts)), parts)
        return touching & among

    def _carriers(self, question: _Question, forces: Array, parts: int) -> int:
        """Parts, and those that carry most of each of them, down to the ground or to what cannot move."""
        whole = self.equilibrium
        at = question.corners
        lift = np.einsum("ke,ke->k", whole.lift[at], forces[at])
        first = np.flatnonzero(np.diff(whole.patch[at], prepend=-1))
        lift = np.add.reduceat(lift, first) if len(first) else lift
        a, b = whole.a[at[first]], whole.b[at[first]]
        down = lift > 0
        upper, lower = np.where(down, a, b), np.where(down, b, a)
        best: dict[int, int] = {}
        for k in np.argsort(np.abs(lift)):
            best[int(upper[k])] = int(lower[k])
        found = parts
        waiting = bits(parts)
        while waiting:
            lower_part = best.get(waiting.pop(), TABLE)
            if lower_part != TABLE and question.movable >> lower_part & 1 and not found >> lower_part & 1:
                found |= 1 << lower_part
                waiting.append(lower_part)
        return found

    # -- proofs -----------------------------------------------------------------------------------------------

    def _stood(self, question: _Question, forces: Array, held: int) -> Standing:
        if len(question.parts) > SMALL:
            kept = np.zeros((len(self.equilibrium.a), CONE_EDGES))
            kept[question.corners] = forces
            self._forces[question.subset, held] = kept
            if len(self._forces) > _KEPT_FORCES:
                self._forces.popitem(last=False)
        return Standing(True, 0, held)

    def _fell(self, subset: int, moving: int, held: int) -> Standing:
        if self.remember:
            self._falls.append((subset, moving))
        return Standing(False, moving, held)

    def _proved_fall(self, question: _Question, balance: Balance) -> int:
        """A bitset of parts that fall even if all others cannot move; 0 where that cannot be proved.

        The parts with most of the residual are asked about by themselves, then more of them.
        """
        speed = np.abs(balance.residual).max(axis=1)
        before = 0
        for share in _MOVING:
            parts = question.parts[speed >= share * speed.max()]
            mask = sum(1 << int(p) for p in parts)
            if mask == before:
                continue
            before = mask
            inner = self._question(question.subset, mask)
            if len(inner.parts) == len(question.parts):
                break
            weights = self.equilibrium.weights[inner.parts]
            steps = QUICK + THOROUGH if len(inner.parts) <= SMALL else QUICK
            if self.equilibrium.balance(inner.parts, inner.corners, weights, None, steps).stands is False:
                return mask
        return sum(1 << int(p) for p in question.parts) if balance.stands is False else 0

    def _fallen(self, question: _Question, balance: Balance, held: int) -> Standing:
        moving = self._proved_fall(question, balance)
        return Standing(False, moving or sum(1 << int(p) for p in question.parts), held)
