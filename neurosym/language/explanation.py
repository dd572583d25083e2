"""Why there is no plan, as data and in sentences: who blocks whom, which parts interlock, what would fall.

`explain` looks at one set of parts at which a search got stuck: nothing of it could be taken out.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from neurosym.geometry.blocking.graph import BlockingGraph
from neurosym.geometry.step_motion import GROUND, Vector
from neurosym.support.bitsets import bits
from neurosym.support.deadline import check
from neurosym.support.words import LISTED, in_words, listed


@dataclass(frozen=True)
class Blocked:
    """A part that cannot go along a direction, and the parts (or the ground) that it would hit."""

    part: str
    direction: Vector
    by: tuple[str, ...]


@dataclass(frozen=True)
class Cycle:
    """Parts each of which would hit the next one, and the last one the first, along a direction."""

    direction: Vector
    parts: tuple[str, ...]


@dataclass(frozen=True)
class Fall:
    """Parts that would fall if others left.

    Attributes:
        without: names of the parts that would leave, or, of what is built up, come; none, where these fall as it is.
        parts: names of those that would fall.
        lost: pairs (a, b): a falls, and touched b, which would leave.
        held: how many parts may be held, which does not help.
        movement: a sentence on what moves first, and how; empty where that is not known.
        drawn: along what they would leave, dragging the others along; empty where these fall without them.
    """

    without: tuple[str, ...]
    parts: tuple[str, ...]
    lost: tuple[tuple[str, str], ...]
    held: int = 0
    movement: str = ""
    drawn: str = ""


@dataclass(frozen=True)
class Wider:
    """An option of a problem that would widen what an answer covers: its name, its value, and the flag for both."""

    option: str
    value: Any
    flag: str


@dataclass(frozen=True)
class WhyNot:
    """Why nothing can be taken out.

    Attributes:
        after: names of the actions after which the search got stuck: the longest prefix that works.
        left: names of the parts that are there still, those that never leave included.
        blocked: for every part that is blocked in each direction, one entry a direction.
        cycle: the smallest cycle of parts that block one another along one direction; None where there is none,
            because all that is blocked is blocked by what never leaves.
        falls: for parts that could leave, what would fall.
        waiting: pairs (a, b): a could go, but only after b.
        unproved: names of parts for which a search for a way ended without a proof that there is none.
        relaxed: whether gravity and precedence were left aside: even so there is no plan. `after` then need not work.
        building: of a search from the empty side, the names of the parts that are there from its beginning; else None.
            Then `after` is what can be put in place at the most, as the end of a plan, and `left` what cannot.
        scope: a sentence on what the answer covers: which motions, what is held, gravity or not.
        wider: options that would widen it, the likeliest to help first.
    """

    after: tuple[str, ...]
    left: tuple[str, ...]
    blocked: tuple[Blocked, ...] = ()
    cycle: Cycle | None = None
    falls: tuple[Fall, ...] = ()
    waiting: tuple[tuple[str, str], ...] = ()
    unproved: tuple[str, ...] = ()
    relaxed: bool = False
    building: tuple[str, ...] | None = None
    scope: str = ""
    wider: tuple[Wider, ...] = ()

    @property
    def stands(self) -> bool:
        """Whether all stands before anything is done, as far as that was asked."""
        return all(f.without for f in self.falls)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The reasons, what they cover, and what would widen that."""
        flags = f"What would widen it: {', '.join(w.flag for w in self.wider)}." if self.wider else ""
        return tuple(filter(None, (*self.reasons, self.scope, flags)))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why, for a person, the decisive sentence first; what is long is cut, with a count."""
        lines = [_fall(f) for f in self.falls if not f.without]
        if self.building is not None:
            return (*lines, *self._of_building(self.building))
        if lines and not self.blocked:
            return tuple(lines)
        start = f"After {listed(self.after)} nothing" if self.after else "Nothing"
        relaxed = ", even if nothing could fall and any order would do" if self.relaxed else ""
        lines.append(f"{start} can be taken out of {listed(self.left)}{relaxed}.")
        if self.cycle is not None:
            chain = " blocks ".join([self.cycle.parts[0], *self.cycle.parts[:0:-1], self.cycle.parts[0]])
            lines.append(
                f"The smallest interlocked cycle, along {in_words(self.cycle.direction)}, has "
                f"{len(self.cycle.parts)} parts: {chain}."
            )
        by_part: dict[str, list[Blocked]] = {}
        for blocked in self.blocked:
            by_part.setdefault(blocked.part, []).append(blocked)
        lines += _first(
            [
                f"{part} is blocked: " + "; ".join(f"{in_words(b.direction)} by {listed(b.by)}" for b in entries) + "."
                for part, entries in by_part.items()
            ],
            "parts are blocked",
        )
        lines += _first([_fall(f) for f in self.falls if f.without], "parts could go, but others would fall")
        lines += _first([f"{a} may leave only after {b}." for a, b in self.waiting], "parts wait for others")
        if self.unproved:
            lines.append(
                f"For {listed(self.unproved)} the search for a way ended at its own limits, which proves nothing; "
                "more time would not change that."
            )
        return tuple(lines)

    def _of_building(self, base: tuple[str, ...]) -> tuple[str, ...]:
        start, loose = f"From {listed(base) or 'the table'} alone", len(self.after) + len(self.left)
        placed = f": {listed(self.after[::-1])}" if self.after else ""
        lines = [f"{start} only {len(self.after)} of {loose} parts can be put in place one by one{placed}."]
        blocked = list(dict.fromkeys(b.part for b in self.blocked))
        lines += _first([f"{part} has no way in any more." for part in blocked], "parts have no way in")
        falls = [_fall(f, "With") for f in self.falls if f.without]
        lines += _first(falls, "parts could come next, but something would fall")
        lines += _first([f"{b} may come only after {a}." for a, b in self.waiting], "parts wait for others")
        return tuple(lines)

    def as_json(self) -> dict[str, Any]:
        """For a file: the attributes, and `sentences`."""
        return {**asdict(self), "sentences": list(self.sentences)}


def blockers_of(graph: BlockingGraph, part: int, there: int, *, table: bool) -> list[Blocked]:
    """What stops a part among the parts in the bitset `there`, one entry a direction in which something does."""
    found = []
    for d, vector in enumerate(graph.vectors):
        by = graph.assembly.in_mask(graph.blockers(part, d, there))
        if table and graph.into_table[d]:
            by = (*by, GROUND)
        if by:
            x, y, z = vector
            found.append(Blocked(graph.names[part], (x, y, z), by))
    return found


def smallest_cycle(graph: BlockingGraph, there: int) -> Cycle | None:
    """The shortest cycle of parts in `there` that block one another along one direction, over all directions.

    Along each direction in turn; the first of the shortest. Two that block each other are found by bit arithmetic,
    longer ones by breadth-first search from each part.
    """
    best: tuple[int, ...] = ()
    direction = 0
    for d in range(len(graph.vectors)):
        along = [graph.blockers(i, d, there) if there >> i & 1 else 0 for i in range(len(graph.names))]
        found = _shortest(along, there, len(best) or len(along) + 1)
        if found:
            best, direction = found, d
        if len(best) == 2:
            break
    if not best:
        return None
    x, y, z = graph.vectors[direction]
    return Cycle((x, y, z), tuple(graph.names[i] for i in best))


def _shortest(along: Sequence[int], there: int, below: int) -> tuple[int, ...]:
    """The shortest cycle with fewer than `below` nodes in a graph of bitsets of successors; empty: none."""
    for i in bits(there):
        check()
        for j in bits(along[i]):
            if along[j] >> i & 1:
                return (i, j) if below > 2 else ()
    best: tuple[int, ...] = ()
    for start in bits(there):
        check()
        parent = {start: -1}
        layer, seen, length = [start], 1 << start, 1  # parts on a path from the start to one of this layer
        while layer and length < below:
            last = next((i for i in layer if along[i] >> start & 1), -1)
            if last >= 0:
                path = []
                while last >= 0:
                    path.append(last)
                    last = parent[last]
                best, below = tuple(path[::-1]), length
                break
            following = []
            for i in layer:
                for j in bits(along[i] & ~seen):
                    seen |= 1 << j
                    parent[j] = i
                    following.append(j)
            layer, length = following, length + 1
    return best


def _fall(fall: Fall, when: str = "Without") -> str:
    lost = [f"{a} loses {b}" for a, b in fall.lost]
    held = "" if not fall.held else f", whichever {'part' if fall.held == 1 else f'{fall.held} parts'} one holds"
    cause = f" ({'; '.join(lost[:LISTED])}{'; ...' if len(lost) > LISTED else ''})" if lost else ""
    moves = f" {fall.movement}" if fall.movement else ""
    if not fall.without:
        return f"It does not stand as it is: {listed(fall.parts)} would fall{held}.{moves}"
    if fall.drawn:
        return f"Drawn {fall.drawn}, {listed(fall.without)} would drag {listed(fall.parts)} along{held}.{moves}"
    return f"{when} {listed(fall.without)}, {listed(fall.parts)} would fall{held}{cause}.{moves}"


def _first(sentences: list[str], what: str) -> list[str]:
    if len(sentences) <= LISTED:
        return sentences
    return [*sentences[: LISTED - 1], f"{len(sentences) - LISTED + 1} more {what}."]
