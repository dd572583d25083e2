"""One split: how a block of parts falls into two, the part that is asked for on the one side, its anchor on the other.

Of the two halves one leaves, along a straight line or a path. A block either stands (on the ground, around the fixed
parts), and then what stays of it must stand, too; or it is in the hand, without gravity.

Along one direction, what leaves is closed under "hits": the smallest group that holds a part is the closure of that
part. Either the asked part's closure leaves the anchor, or the anchor's half leaves the asked part, whose smallest
half then is its closure under "is hit by". So if a block comes apart at all along one of the directions, with some part
and its anchor on different sides, that part's closure says so. Of all these halves the smallest leaves: what is named
after a screw moves the screw, and the rest of the machine only where nothing else is possible.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from domains.assembly_paths import NoWay, check_motion, separation, way_out
from domains.assembly_pull import checked_while_drawn, stands_while_drawn
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.predicates import stands
from neurosym.language.search_problem import Verdict
from neurosym.support.words import listed

if TYPE_CHECKING:
    from domains.assembly import Setting


@dataclass(frozen=True)
class Block:
    """Parts that hang together: a bitset, and whether they stand or are in the hand."""

    parts: int
    stands: bool


@dataclass(frozen=True)
class Half:
    """A half of a block that may leave (a bitset), and along which direction, by number."""

    leaving: int
    direction: int


class Splitter:
    """Answers how a part is split from its anchor.

    Args:
        geometry: of the assembly, with its fixed parts and its ground.
        setting: the options of the problem.
    """

    def __init__(self, geometry: AssemblyGeometry, setting: Setting) -> None:
        self.geometry, self.assembly, self.setting = geometry, geometry.assembly, setting
        self.graph = geometry.blocking(setting.directions)
        vectors = np.asarray(self.graph.vectors)
        back = np.abs(vectors[:, None] + vectors[None]).max(axis=2) < 1e-9
        #: For each direction the number of the one the other way, or -1.
        self.opposite = np.where(back.any(axis=1), back.argmax(axis=1), -1)

    def split(self, block: Block, part: int, anchor: int) -> Verdict:
        """The smallest half that comes off, so that `part` and the parts in `anchor` (a bitset) are on different sides.

        Returns:
            A verdict: its motion is that of the half that leaves; where there is none, what `because` names keeps the
            two together, or would fall.
        """
        # The fallen that a half takes along make it larger: the smallest is always looked at first.
        queue: list[tuple[int, int, int, Half]] = []
        for d in range(len(self.graph.vectors)):
            for kind, leaving in enumerate(self._halves(block, part, anchor, d)):
                if leaving:
                    self._push(queue, Half(leaving, d), kind, block, part)
        refused: Verdict | None = None
        while queue:
            _, _, kind, half = heapq.heappop(queue)
            motion = StepMotion(self.assembly.in_mask(half.leaving), self.graph.vectors[half.direction])
            standing = self._standing(block, motion)
            if standing.holds:
                return standing
            refused = refused or standing
            taken = half.leaving | self.assembly.mask(standing.because)
            grown = self.graph.carried(taken, half.direction, block.parts)
            stays = anchor if half.leaving >> part & 1 else 1 << part
            if not grown & stays:
                self._push(queue, Half(grown, half.direction), kind, block, part)
        if self.setting.paths == "any":
            found = self._by_path(block, part, anchor)
            if found.holds or refused is None:
                return found
        if refused is not None:
            # Another group than those looked at might leave the rest standing: nothing is proved.
            return Verdict(False, refused.because, refused.reason, proved=False)
        return self._interlocked(block, part, anchor)

    def check(self, block: Block, part: int, anchor: int, motion: StepMotion) -> Verdict:
        """Whether a half may leave by a given motion, asked of the pairs concerned alone."""
        leaving = self.assembly.mask(motion.parts)
        rest = block.parts & ~leaving
        sentence = ", ".join(motion.parts)
        apart = bool(leaving >> part & 1) != bool(leaving & anchor) and (anchor & rest) in (0, anchor)
        if leaving & ~block.parts or not apart:
            name = self.assembly.names[part]
            return Verdict(False, motion.parts, f"{sentence}: this does not split {name} from its block.")
        if block.stands and leaving & self.assembly.fixed_mask:
            return Verdict(False, motion.parts, f"{sentence}: one of these is fixed.")
        free = check_motion(self.geometry, self.setting, motion, block.parts, standing=block.stands)
        if not free.holds:
            return free
        if block.stands and self.setting.gravity:
            if len(motion.held) > self.setting.held or self.assembly.mask(motion.held) & ~rest:
                return Verdict(False, motion.held, f"{', '.join(motion.held)} cannot all be held.")
            held = self.assembly.mask(motion.held)
            answer = self.geometry.stability.standing(rest, held=held)
            if not answer.stands:
                falling = self.assembly.in_mask(answer.falling)
                return Verdict(False, falling, f"Without {sentence}, {listed(falling)} would fall.")
            if self.setting.pull:
                return checked_while_drawn(self.geometry, block.parts, motion)
        return Verdict(True, motion=motion)

    # -- straight lines ---------------------------------------------------------------------------------------

    def _halves(self, block: Block, part: int, anchor: int, d: int) -> tuple[int, int]:
        """What leaves along a direction: the asked part with what it hits, or all but what it is hit by; 0: neither."""
        if block.stands and self.graph.into_table[d]:
            return 0, 0
        with_part = self.graph.carried(1 << part, d, block.parts)
        if with_part & anchor:
            with_part = 0
        if block.stands and anchor & self.assembly.fixed_mask:
            return with_part, 0
        if not block.stands and self.opposite[d] >= 0:
            return with_part, 0  # in the hand it is all one which half moves: the part's own does, the other way
        staying = self.graph.carried(1 << part, d, block.parts, backwards=True)
        return with_part, 0 if staying & anchor else block.parts & ~staying

    def _push(self, queue: list[tuple[int, int, int, Half]], half: Half, kind: int, block: Block, part: int) -> None:
        order = kind * len(self.graph.vectors) + half.direction
        heapq.heappush(queue, (half.leaving.bit_count(), order, kind, half))

    def _standing(self, block: Block, motion: StepMotion) -> Verdict:
        """Whether the rest stands without what leaves by a motion, and if asked for while it does; with that motion."""
        if not (block.stands and self.setting.gravity):
            return Verdict(True, motion=motion)
        rest = block.parts & ~self.assembly.mask(motion.parts)
        answer = stands(self.geometry, rest, motion.parts, held=self.setting.held)
        if answer.holds and self.setting.pull:
            return stands_while_drawn(self.geometry, block.parts, [motion], self.setting.held)
        return replace(answer, motion=motion if answer.motion is None else motion.joined(answer.motion))

    def _interlocked(self, block: Block, part: int, anchor: int) -> Verdict:
        name, kept = self.assembly.names[part], self.assembly.in_mask(anchor)
        because = 0
        sentence = []
        for d in range(len(self.graph.vectors)):
            if block.stands and self.graph.into_table[d]:
                sentence.append(f"{self.graph.describe(d)}: into the table")
                continue
            hit = self.graph.blockers(part, d, block.parts)
            because |= hit
            closed = self.assembly.in_mask(self.graph.carried(1 << part, d, block.parts))
            sentence.append(f"{self.graph.describe(d)}: it moves {listed(closed)}")
        reason = f"{name} cannot be separated from {listed(kept)} along any direction ({'; '.join(sentence)})."
        return Verdict(False, self.assembly.in_mask(because), reason)

    # -- paths ------------------------------------------------------------------------------------------------

    def _by_path(self, block: Block, part: int, anchor: int) -> Verdict:
        """Off by a path: of cells, the first separation of the block by moves of groups; else the part by itself."""
        name = self.assembly.names[part]
        if not (block.stands and self.setting.gravity) and self.geometry.cells is not None:
            found = separation(self.geometry, block.parts, standing=block.stands)
            if isinstance(found, NoWay):
                others = self.assembly.in_mask(block.parts & ~(1 << part))
                return Verdict(False, others, found.reason, proved=found.proved)
            leaving = self.assembly.mask(found.parts)
            if bool(leaving >> part & 1) == bool(leaving & anchor):
                reason = f"{name} stays with its anchor: {listed(found.parts)} can be separated first."
                return Verdict(False, found.parts, reason)
            return Verdict(True, motion=found)
        out = way_out(self.geometry, 1 << part, block.parts, shifting=False)
        if isinstance(out, NoWay):
            # The part may come off together with others, which this search does not try.
            return Verdict(False, out.because, out.reason, proved=False)
        standing = self._standing(block, out)
        return standing if standing.holds else Verdict(False, standing.because, standing.reason, proved=False)
