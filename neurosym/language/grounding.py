"""Grounding: a problem as bitsets. A state is one Python int, a bit a ground fluent, whatever the size."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from neurosym.errors import ContractError, DefinitionError
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.actions import moved_parts
from neurosym.language.bit_conditions import Candidates, Effects, Test, tested
from neurosym.language.conditions import Condition
from neurosym.language.evidence import Refused, as_motion, asks_world, decide, of_derived, of_literal
from neurosym.language.instances import Instance, Reachability, all_names, check_precedence, instantiate, possible
from neurosym.language.search_problem import Rejection, RelaxedPlan, Step, Verdict
from neurosym.language.state import BitState
from neurosym.language.terms import Atom, Derived, Fluent, Literal
from neurosym.language.uses import Uses, classes_of

if TYPE_CHECKING:
    from neurosym.language.ground_task import GroundTask
    from neurosym.language.problem import Problem


class GroundProblem:
    """A grounded problem: the `SearchProblem` that planners are given.

    Actions that no state can reach (delete relaxation, derived predicates taken as possible) are no action
    primitives: in a problem that starts half done, those already done are gone.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.world = problem.predicate_world
        within = Reachability(set(problem.init), instantiate(problem))
        self.instances = reachable = within.instances
        self.actions: tuple[str, ...] = tuple(i.name for i in reachable)
        self._goal_conditions = [c.expanded(problem.objects_of) for c in problem.goal_conditions]
        if problem.reachable:
            self._check_goal(within)
        names = all_names(problem) if problem.before or problem.interchangeable else []
        check_precedence(problem.before, names, f"problem {problem.name!r}")

        index = {name: i for i, name in enumerate(self.actions)}
        # A predecessor that can no longer be done was done before the problem began.
        precedence = [(index[a], index[b]) for a, b in problem.before if a in index and b in index]
        self._bits = self._number(reachable)
        done = {a: len(self._bits) + k for k, a in enumerate(sorted({a for a, _ in precedence}))}
        #: How many bits a state has.
        self.width = len(self._bits) + len(done)

        self._pos, self._neg, tests = [], [], {}
        self._effects: list[Effects] = []
        self._derived: list[list[tuple[Derived, tuple[str, ...], bool]]] = []
        for i, instance in enumerate(reachable):
            pos = self._mask(p.atom for p in instance.fluents if p.positive)
            self._pos.append(pos | sum(1 << done[a] for a, b in set(precedence) if b == i))
            self._neg.append(self._mask(p.atom for p in instance.fluents if not p.positive))
            if instance.conditions:
                tests[i] = [tested(c, self._bits) for c in instance.conditions]
            self._effects.append(self._effects_of(instance, 1 << done[i] if i in done else 0))
            self._derived.append(
                [(d.atom.predicate, d.atom.args, d.positive) for d in instance.derived]  # type: ignore[misc]
            )
        self._candidates = Candidates(self._pos, self._neg, tests)
        self.initial: int = self._mask(a for a in problem.init if a in self._bits)
        self._goal_pos = self._mask(g.atom for g in self._fluent_goals if g.positive)
        self._goal_neg = self._mask(g.atom for g in self._fluent_goals if not g.positive)
        self._goal_tests: list[Test] = [tested(c, self._bits) for c in self._goal_conditions]
        self._done_bits = done
        uses = Uses.of(reachable)
        #: A bitset of the actions that may be done any number of times; 0: each is done once at most.
        self.repeating: int = ((1 << len(self.actions)) - 1) & ~uses.remembered if uses.again else 0
        #: A bitset of the actions of which no state says whether they were done.
        self.remembered: int = uses.remembered
        #: What each action costs; None where plans are counted in actions.
        self.costs = tuple(i.cost for i in reachable) if problem.domain.has_costs else None
        self._all_names, self._again = names, uses.again
        self._constrained = {a for pair in precedence for a in pair}
        self._stated_classes = self._classes(problem.interchangeable)
        self._touching: dict[Atom, tuple[int, ...]] = {}
        self._promises: dict[tuple[Atom, ...], tuple[tuple[int, ...], int]] = {}
        for i, instance in enumerate(reachable):
            for atom in dict.fromkeys(effect.atom for effect in instance.effects()):
                self._touching[atom] = (*self._touching.get(atom, ()), i)

    def _effects_of(self, instance: Instance, done: int) -> Effects:
        conditional: dict[Condition, list[Literal]] = {}
        for condition, effect in instance.conditional:
            conditional.setdefault(condition, []).append(effect)
        add, delete = self._changes(instance.eff)
        return Effects(
            add | done, delete, [(tested(c, self._bits), *self._changes(eff)) for c, eff in conditional.items()]
        )

    def _changes(self, effects: Sequence[Literal]) -> tuple[int, int]:
        return self._mask(e.atom for e in effects if e.positive), self._mask(e.atom for e in effects if not e.positive)

    # -- what planners use ------------------------------------------------------------------------------------

    def is_goal(self, state: int) -> bool:
        """Whether the goal holds; its derived predicates are asked only once the fluents do."""
        if (state & self._goal_pos) != self._goal_pos or state & self._goal_neg:
            return False
        if self.asks_fluents_only:
            return True
        if not all(test(state) for test in self._goal_tests):
            return False
        asked = [*self._derived_goals, *(c for c in self._goal_conditions if asks_world(c))]
        return all(self._verdict(condition, state).holds for condition in asked)

    def candidates(self, state: int) -> list[int]:
        """Indices of the actions whose fluents allow them in `state`."""
        return self._candidates.of(state)

    def is_applicable(self, state: int, action: int) -> bool:
        """Whether `action` is one of the candidates in `state`."""
        return self._candidates.has(state, action)

    def attempt(self, state: int, action: int) -> Step[int] | Rejection:
        """Ask the derived predicates of `action`, in their order; the first refusal is the answer."""
        if not self.is_applicable(state, action):
            return self._not_applicable(state, action)
        refused, motion = self.ask(state, action)
        return Step(self.apply(state, action), motion) if refused is None else self._rejection(state, action, refused)

    def ask(self, state: int, action: int) -> tuple[Refused | None, StepMotion | None]:
        """The first derived predicate of `action` that does not allow it in `state`; if all do, how it moves parts."""
        motion: StepMotion | None = None
        view = BitState(self, state)
        for predicate, args, positive in self._derived[action]:
            verdict = self.judge(predicate, view, args)
            if verdict.holds is not positive:
                return Refused(f"{predicate}({', '.join(args)})", positive, verdict), None
            if verdict.motion is not None:
                stated = as_motion(predicate, verdict.motion)
                motion = stated if motion is None else motion.joined(stated)
        for condition in self.instances[action].conditions:
            if asks_world(condition):
                verdict = self._verdict(condition, state)
                if not verdict.holds:
                    return Refused(str(condition), True, verdict), None
                if verdict.motion is not None:
                    motion = verdict.motion if motion is None else motion.joined(verdict.motion)
        if motion is not None:
            parts, arrive = moved_parts(
                self.instances[action].eff, getattr(self.world, "names", ()), self.problem.domain.presence
            )
            motion = motion.of_parts(parts, arrive=arrive)
        return None, motion

    def judge(self, predicate: Derived, view: BitState, args: tuple[str, ...] = ()) -> Verdict:
        """What a derived predicate says of a state."""
        verdict = predicate.function(self.world, view, *args)
        if not isinstance(verdict, Verdict):
            raise ContractError(
                f"Expected the derived predicate {predicate} to answer with a Verdict; got {verdict!r}. "
                "Write ns.Verdict(holds, because=(...), reason='...')."
            )
        return verdict

    def _verdict(self, condition: Condition, state: int) -> Verdict:
        """Of an expanded condition in a state; each derived predicate is asked once."""
        view = BitState(self, state)
        known: dict[Atom, Verdict] = {}

        def ask(literal: Literal) -> Verdict:
            atom = literal.atom
            if not isinstance(atom.predicate, Derived):
                return of_literal(literal, view.holds(atom) is literal.positive)
            if atom not in known:
                known[atom] = self.judge(atom.predicate, view, tuple(map(str, atom.args)))
            return of_derived(literal, known[atom])

        return decide(condition, ask)

    def apply(self, state: int, action: int) -> int:
        """The state after the effects of `action`, no question asked."""
        return self._effects[action].after(state)

    @cached_property
    def task(self) -> GroundTask:
        """What heuristics ask: the problem without geometry, its derived predicates taken as possible."""
        from neurosym.language.ground_task import GroundTask

        return GroundTask.of(self)

    def relaxed_plan(self, state: int) -> RelaxedPlan | None:
        """See `RelaxedPlan`."""
        return self.problem.semantics.relaxed_plan(self.problem, state)

    @property
    def asked(self) -> int:
        """A bitset of the fluents that the goal asks for."""
        return self._goal_pos | self._goal_neg

    @property
    def asks_fluents_only(self) -> bool:
        """Whether the goal asks for nothing derived."""
        return not self._derived_goals and not self._goal_conditions

    @property
    def has_conditional_effects(self) -> bool:
        """Whether what an action changes depends on the state."""
        return any(effects.conditional for effects in self._effects)

    def precedence(self, action: int) -> int:
        """The bits of a state which say that what must come before the action was done."""
        return self._pos[action] & -(1 << len(self._bits))

    def done_bit(self, action: int) -> int:
        """The bit, as a bitset, that says that it was done; 0 where nothing asks for that."""
        return 1 << self._done_bits[action] if action in self._done_bits else 0

    @property
    def goal_conditions(self) -> list[Condition]:
        """The goal, all of it, expanded."""
        return [*self.problem.goal, *self._goal_conditions]

    @property
    def bits(self) -> dict[Atom, int]:
        """Ground fluent -> its bit in a state."""
        return self._bits

    def derived_of(self, action: int) -> tuple[Derived, ...]:
        """The derived predicates that must hold where `action` is done."""
        return tuple(predicate for predicate, _, positive in self._derived[action] if positive)

    def touching(self, atom: Atom) -> tuple[int, ...]:
        """The actions that change a fluent."""
        return self._touching.get(atom, ())

    # -- for people and oracles -------------------------------------------------------------------------------

    def atoms(self, state: int) -> tuple[Atom, ...]:
        """The fluents that hold in `state`."""
        static = (atom for atom in self.problem.init if atom not in self._bits)
        return (*static, *(atom for atom, bit in self._bits.items() if state >> bit & 1))

    def _not_applicable(self, state: int, action: int) -> Rejection:
        missing = [str(a) for a, bit in self._bits.items() if self._pos[action] >> bit & 1 and not state >> bit & 1]
        missing += [f"not {a}" for a, bit in self._bits.items() if self._neg[action] & state & (1 << bit)]
        for predecessor, bit in self._done_bits.items():
            if self._pos[action] >> bit & 1 and not state >> bit & 1:
                missing.append(f"{self.actions[predecessor]} to be done before")
        missing += [str(c) for c in self.instances[action].conditions if not tested(c, self._bits)(state)]
        return Rejection(f"{self.actions[action]} is not applicable: it needs {', '.join(missing)}.")

    def _rejection(self, state: int, action: int, refused: Refused) -> Rejection:
        verdict, phrase = refused.verdict, refused.sentence
        # A promise speaks of a verdict that stays false; it says nothing of one that must become false.
        if not verdict.proved:
            return Rejection(phrase, verdict.because, proved=False)
        if not refused.positive or verdict.until is None:
            return Rejection(phrase, verdict.because, ())
        known = self._promises.get(verdict.until)
        if known is None:
            touching = {a for atom in verdict.until for a in self._touching.get(atom, ())}
            atoms = self._mask(atom for atom in verdict.until if atom in self._bits)
            known = self._promises[verdict.until] = tuple(sorted(touching)), atoms
        until, atoms = known
        # Before any of `until` is done the atoms are as at first: only if they are so now does the verdict speak of it.
        unconditional = verdict.unconditional and not (state ^ self.initial) & atoms
        return Rejection(phrase, verdict.because, until or (action,), unconditional)

    # -- construction -----------------------------------------------------------------------------------------

    def _check_goal(self, within: Reachability) -> None:
        fluents = [*enumerate(self.problem.goal), *enumerate(self._goal_conditions, len(self.problem.goal))]
        for i, goal in fluents:
            if not possible(goal, within.may_hold):
                raise DefinitionError(
                    f"In problem {self.problem.name!r}, goal[{i}]: no action that can be reached makes {goal} true, "
                    "so no order can; check the effects and the initial state."
                )

    @cached_property
    def _fluent_goals(self) -> list[Literal]:
        return [g for g in self.problem.goal if not isinstance(g.atom.predicate, Derived)]

    @cached_property
    def _derived_goals(self) -> list[Literal]:
        return [g for g in self.problem.goal if isinstance(g.atom.predicate, Derived)]

    def _number(self, reachable: Sequence[Instance]) -> dict[Atom, int]:
        """Atom -> bit. Fluents of one argument take one run of bits in the order of the objects: `mask` shifts."""
        bits: dict[Atom, int] = {}
        self.runs: dict[Fluent, tuple[int, tuple[str, ...]]] = {}
        for fluent in self.problem.domain.fluents:
            if len(fluent.types) == 1:
                names = self.problem.objects_of(fluent.types[0])
                self.runs[fluent] = (len(bits), names)
                for name in names:
                    bits[Atom(fluent, (name,))] = len(bits)
        literals = [p for i in reachable for p in i.mentioned()] + self._fluent_goals
        literals += [p for c in self._goal_conditions for p in c.literals() if isinstance(p.atom.predicate, Fluent)]
        # What never changes is asked of states by derived predicates alone.
        derived = any(i.derived or i.conditions for i in reachable) or not self.asks_fluents_only
        for atom in (*(self.problem.init if derived else ()), *(p.atom for p in literals)):
            bits.setdefault(atom, len(bits))
        return bits

    def _mask(self, atoms: Iterable[Atom]) -> int:
        mask = 0
        for atom in atoms:
            mask |= 1 << self._bits[atom]
        return mask

    @cached_property
    def classes(self) -> tuple[int, ...]:
        """One integer an action: of the groups that the problem states, else of those that its semantics knows."""
        if self.problem.interchangeable:
            return self._stated_classes
        return self._classes(self.problem.semantics.interchangeable(self.problem))

    def _classes(self, groups: Sequence[Sequence[str]]) -> tuple[int, ...]:
        names = self._all_names or (all_names(self.problem) if groups else [])
        return classes_of(self.problem, groups, self.actions, names, self._constrained, self._again)
