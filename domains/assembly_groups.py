"""Taking an assembly apart in groups: every action splits one block of parts into two, until all parts are single.

A state is a partition of the parts into blocks. Each block has one anchor, a part that stays nameless in it: in the
first block the fixed parts (together, for they never come apart), else one part that stays lowest. An action, named by
a part that is no anchor, splits its block so that this part and the anchor are on different sides, and makes the part
the anchor of its side. So each action can be used once, N loose parts take N splits beside fixed ones and N - 1
without, and every split that there is has a name: of its two halves one is without the anchor.

Without gravity no split is a mistake. Take any way to take the whole apart, and look at one block alone: what splits
the whole splits the block, too, or leaves it as it is, since fewer parts hit fewer. So no block is worse for having
been split off in another order, a planner need never go back, and where one block does not come apart, nothing does.

Under gravity the block that stands on the ground, or around the fixed parts, must go on standing; what was taken out of
it is in the hand, and is taken apart there without gravity and without ground. There the order matters, and a group
that would leave something to fall is tried with the fallen ones added; other groups are not tried, so a refusal that
rests on a fall proves nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from domains.assembly_scope import covering
from domains.assembly_splits import Block, Splitter
from domains.assembly_why import explain_groups, falls_at_first, together
from neurosym.errors import InputError
from neurosym.geometry.grouping import need_not_part
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.step_motion import StepMotion
from neurosym.language import Action, Domain, Fluent, GroundProblem, Problem, Type
from neurosym.language.explanation import WhyNot
from neurosym.language.search_problem import Rejection, RelaxedPlan, Step, Verdict
from neurosym.language.semantics import Semantics, Validation
from neurosym.support.bitsets import bits
from neurosym.support.words import listed

if TYPE_CHECKING:
    from domains.assembly import Setting

part = Type("part")
apart = Fluent("apart", part)
anchor = Fluent("anchor", part)
_p = part("p")

#: The symbols' bitset; the blocks of more than one part as bitsets, the one that stands first (0 where none does).
State = tuple[int, tuple[int, ...]]


def apart_in_groups(
    geometry: AssemblyGeometry,
    setting: Setting,
    *,
    before: Iterable[tuple[str, str]],
    name: str,
    family: str,
    details: Mapping[str, Any],
) -> Problem:
    """The problem in which an action, named by a part, splits that part's block."""
    pairs, assembly = tuple(before), geometry.assembly
    anchors = assembly.fixed or (_lowest(geometry, setting, pairs),)
    split = Action("split", _p, pre=[~apart(_p), ~anchor(_p)], eff=[apart(_p)], label="{p}", once=True)
    return Domain("assembly-groups", fluents=[apart, anchor], actions=[split]).problem(
        world=geometry,
        objects={part: assembly.names},
        init=[anchor(n) for n in anchors],
        goal=[apart(n) for n in assembly.names if n not in anchors],
        before=pairs,
        name=name,
        family=family,
        details={**details, "anchor": list(anchors)},
        semantics=GroupSemantics(geometry, setting, assembly.mask(anchors)),
    )


def _lowest(geometry: AssemblyGeometry, setting: Setting, before: Sequence[tuple[str, str]]) -> str:
    """The first anchor where nothing is fixed: low under gravity, large, and not named in the precedence."""
    assembly = geometry.assembly
    named = {n for pair in before for n in pair}
    free = [n for n in assembly.names if n not in named]
    free = [n for n in free if n not in setting.targets] or free
    if not free:
        raise InputError(
            "Expected a part, in groups without a fixed one, that `before` does not name: it stays as the anchor. "
            "Fix a part."
        )
    volumes = geometry.stability.masses / [p.density for p in assembly.parts]

    def key(name: str) -> tuple[float, float, int]:
        number = assembly.index[name]
        low = assembly.part_bounds[number, 0, 2] if setting.gravity else 0.0
        return round(float(low / assembly.touch)), -round(float(volumes[number] / assembly.touch**3)), number

    return min(free, key=key)


class GroupSemantics(Semantics):
    """What a split changes: the search over partitions, and its replay."""

    def __init__(self, geometry: AssemblyGeometry, setting: Setting, anchors: int) -> None:
        self.geometry, self.setting, self.anchors = geometry, setting, anchors
        self.assembly = assembly = geometry.assembly
        self.targets = assembly.mask(setting.targets)
        #: Whether one block stands: on a ground, around fixed parts, or under gravity.
        self.standing = setting.gravity or assembly.has_table or bool(assembly.fixed)

    @property
    def planner(self) -> str:
        return "fewest" if self.targets else "backtracking"

    def search(self, problem: Problem) -> GroupSearch:
        return GroupSearch(self, problem.symbols)

    def replay(self, problem: Problem, order: Sequence[str], motions: Sequence[StepMotion | None]) -> Validation:
        """Replays an order on blocks that are plain sets; each split is asked of the pairs concerned, anew."""
        world = self.geometry.anew()
        splitter = Splitter(world, self.setting)
        everything = frozenset(world.names)
        grounded = everything if self.standing else frozenset[str]()
        blocks = [everything]
        anchors = set(world.in_mask(self.anchors))
        if order and not (first := self.stands_at_first(world)).holds:
            return Validation(False, 0, first.because, f"Step 0, {order[0]}: {first.reason}")
        for step, name in enumerate(order):
            if name in anchors:
                done = f"was done already, as step {order.index(name)}" if name in order[:step] else "is an anchor"
                return Validation(False, step, (name,), f"{name} {done}.")
            missing = [a for a, b in problem.before if b == name and a not in order[:step]]
            if missing:
                return Validation(False, step, (missing[0],), f"{name} may be done only after {missing[0]}.")
            block = next(b for b in blocks if name in b)
            asked = Block(world.mask(block), block == grounded)
            kept = world.mask(anchors & block)
            motion = motions[step] if motions else None
            if motion is not None:
                verdict = splitter.check(asked, world.index[name], kept, motion)
            else:
                verdict = splitter.split(asked, world.index[name], kept)
            if verdict.motion is None:
                return Validation(False, step, verdict.because, f"Step {step}, {name}: {verdict.reason}")
            leaving = frozenset(verdict.motion.parts)
            blocks = [b for b in blocks if b != block] + [leaving, block - leaving]
            if block == grounded:
                grounded = block - leaving
            anchors.add(name)
        together = [b for b in blocks if len(b - set(self.assembly.fixed)) + bool(b & set(self.assembly.fixed)) > 1]
        if self.setting.targets:
            together = [b for b in together if b & set(self.setting.targets)]
        if together and (self.setting.targets or not need_not_part(together, self.assembly.piece_groups)):
            left = tuple(n for n in world.names if n in together[0])
            sentence = f"After all {len(order)} actions the goal is missed: {listed(left)} are still together."
            return Validation(False, len(order), left, sentence)
        return Validation(True)

    def stands_at_first(self, world: AssemblyGeometry) -> Verdict:
        """Whether the whole stands as it is, where it has to."""
        if not self.setting.gravity:
            return Verdict(True)
        answer = world.stability.standing_when_held((1 << len(world)) - 1, self.setting.held)
        falling = world.in_mask(answer.falling)
        sentence = f"The assembly does not stand as it is: {listed(falling)} would fall."
        return Verdict(answer.stands, () if answer.stands else falling, "" if answer.stands else sentence)

    def refute(self, problem: Problem) -> WhyNot | None:
        if problem.symbols.is_goal(problem.symbols.initial):
            return None
        return covering(
            problem, self.setting, together(falls_at_first(self.geometry, self.setting), self._interlock(problem))
        )

    def _interlock(self, problem: Problem) -> WhyNot | None:
        """A proof that some block never comes apart, even without gravity, where any order of splits will do."""
        if self.setting.paths == "any" and self.geometry.cells is None:
            return None  # the searches for paths prove nothing
        relaxed = replace(self.setting, gravity=False, held=0)
        splitter = Splitter(self.geometry, relaxed)
        waiting = [(Block((1 << len(self.assembly)) - 1, self.standing), self.anchors)]
        done: list[str] = []
        stuck: list[tuple[Block, dict[str, Rejection]]] = []
        while waiting:
            block, kept = waiting.pop()
            refused = {}
            for number in bits(block.parts & ~kept):
                verdict = splitter.split(block, number, kept)
                if verdict.motion is not None:
                    leaving = self.assembly.mask(verdict.motion.parts)
                    staying = block.parts & ~leaving
                    anchors = {True: 1 << number, False: kept}
                    done.append(self.assembly.names[number])
                    waiting.append((Block(leaving, False), anchors[bool(leaving >> number & 1)]))
                    waiting.append((Block(staying, block.stands), anchors[bool(staying >> number & 1)]))
                    break
                refused[self.assembly.names[number]] = Rejection(verdict.reason, verdict.because, proved=verdict.proved)
            else:
                if refused and all(r.proved for r in refused.values()):
                    stuck.append((block, refused))
                    if not self.may_stay([b for b, _ in stuck]):
                        blocks, rejections = [b for b, _ in stuck], {k: r for _, own in stuck for k, r in own.items()}
                        why = explain_groups(self.geometry, relaxed, tuple(done), blocks, rejections)
                        return replace(why, relaxed=self.setting.gravity)
        return None

    def may_stay(self, blocks: Sequence[Block]) -> bool:
        """Whether blocks need not come apart: there is no target in them, or each is within one piece group."""
        if self.targets:
            return not any(b.parts & self.targets for b in blocks)
        return need_not_part([self.assembly.in_mask(b.parts) for b in blocks], self.assembly.piece_groups)

    def explain(self, problem: Problem, done: Sequence[str]) -> WhyNot | None:
        """Why the blocks that are left after the longest prefix do not come apart."""
        search = problem.ground()
        assert isinstance(search, GroupSearch)
        state = search.initial
        for name in done:
            answer = search.attempt(state, search.actions.index(name))
            assert isinstance(answer, Step)
            state = answer.state
        refused = {a: search.attempt(state, a) for a in search.candidates(state)}
        stuck = {search.actions[a]: r for a, r in refused.items() if isinstance(r, Rejection)}
        why = explain_groups(self.geometry, self.setting, tuple(done), search.blocks(state), stuck)
        return covering(problem, self.setting, why)


class GroupSearch:
    """The `SearchProblem` over partitions."""

    #: Of the splits that a name may stand for, the one with the smallest half is tried.
    exhaustive = False

    def __init__(self, rules: GroupSemantics, symbols: GroundProblem) -> None:
        self.rules, self.symbols = rules, symbols
        self.assembly = rules.assembly
        self.splitter = Splitter(rules.geometry, rules.setting)
        self.actions = symbols.actions
        self.classes = symbols.classes
        whole = (1 << len(rules.assembly)) - 1
        self.initial: State = (symbols.initial, (whole,) if rules.standing else (0, whole))
        self._numbers = [rules.assembly.index[name] for name in self.actions]
        self._action_of = {number: action for action, number in enumerate(self._numbers)}
        self._verdicts: dict[tuple[int, bool, int], Verdict] = {}
        self._at_first: Verdict | None = None

    def is_goal(self, state: State) -> bool:
        early = self.rules.targets or self.assembly.piece_groups  # the goal may come before all are apart
        return self.symbols.is_goal(state[0]) or (bool(early) and self.rules.may_stay(self.blocks(state)))

    def relaxed_plan(self, state: State) -> RelaxedPlan | None:
        """A block without k of its parts is k splits away, k - 1 where these are all."""
        targets = self.rules.targets
        if not targets:
            return None
        blocks = [b.parts for b in self.blocks(state) if b.parts & targets]
        count = sum((b & targets).bit_count() - (not b & ~targets) for b in blocks)
        wanted = [self._action_of[n] for b in blocks for n in bits(b & targets) if n in self._action_of]
        return RelaxedPlan(count, tuple(wanted))

    def candidates(self, state: State) -> list[int]:
        return self.symbols.candidates(state[0])

    def attempt(self, state: State, action: int) -> Step[State] | Rejection:
        symbols, blocks = state
        if action not in self.candidates(state):
            answer = self.symbols.attempt(symbols, action)
            assert isinstance(answer, Rejection)
            return answer
        if state == self.initial:
            self._at_first = self._at_first or self.rules.stands_at_first(self.rules.geometry)
            if not self._at_first.holds:
                return Rejection(self._at_first.reason, self._at_first.because, (action,))
        number = self._numbers[action]
        place = next(i for i, block in enumerate(blocks) if block >> number & 1)
        block = Block(blocks[place], place == 0)
        anchors = self.rules.anchors | self._used(symbols)
        verdict = self._split(block, number, anchors & block.parts)
        if verdict.motion is None:
            # The answer depends on the block alone, and the block stays as it is until one of its parts is split off.
            others = [self._action_of[n] for n in bits(block.parts & ~anchors) if self._action_of[n] != action]
            until = tuple(others) or (action,)
            return Rejection(verdict.reason, verdict.because, until, proved=verdict.proved)
        leaving = self.assembly.mask(verdict.motion.parts)
        return Step((self.symbols.apply(symbols, action), self._after(blocks, place, leaving)), verdict.motion)

    def blocks(self, state: State) -> list[Block]:
        """The blocks of more than one part, the fixed ones counted as one."""
        fixed = self.assembly.fixed_mask
        found = [Block(parts, i == 0) for i, parts in enumerate(state[1])]
        return [b for b in found if (b.parts & ~fixed).bit_count() + bool(b.parts & fixed) > 1]

    def _split(self, block: Block, number: int, anchor: int) -> Verdict:
        key = (block.parts, block.stands, number)
        if key not in self._verdicts:
            self._verdicts[key] = self.splitter.split(block, number, anchor)
        return self._verdicts[key]

    def _used(self, symbols: int) -> int:
        start, _ = self.symbols.runs[apart]
        return (symbols >> start) & ((1 << len(self.assembly)) - 1)

    @staticmethod
    def _after(blocks: tuple[int, ...], place: int, leaving: int) -> tuple[int, ...]:
        stands, hand = blocks[0], list(blocks[1:])
        if place == 0:
            stands &= ~leaving
            hand.append(leaving)
        else:
            rest = hand.pop(place - 1) & ~leaving
            hand += [leaving, rest]
        return (stands, *sorted(b for b in hand if b & (b - 1)))
