"""Grounding: a problem as bitsets. A state is one Python int, a bit a ground fluent, whatever the size."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from neurosym.errors import ContractError, DefinitionError, InputError, UnknownNameError
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.actions import moved_parts
from neurosym.language.instances import Instance, check_precedence, instantiate, reachable_instances
from neurosym.language.search_problem import Rejection, RelaxedPlan, Step, Verdict
from neurosym.language.state import BitState
from neurosym.language.terms import Atom, Derived, Fluent, Literal

if TYPE_CHECKING:
    from neurosym.language.problem import Problem


class Refused(NamedTuple):
    """A derived predicate that does not allow an action."""

    predicate: Derived
    args: tuple[str, ...]
    positive: bool  # whether it had to hold
    verdict: Verdict

    @property
    def sentence(self) -> str:
        """Why."""
        named = f"{self.predicate}({', '.join(self.args)})"
        return self.verdict.reason or f"{named} {'does not hold' if self.positive else 'holds'}."


class GroundProblem:
    """A grounded problem: the `SearchProblem` that planners are given.

    Actions that no state can reach (delete relaxation, derived predicates taken as possible) are no action
    primitives: in a problem that starts half done, those already done are gone.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.world = problem.predicate_world
        instances, all_names = instantiate(problem)
        reachable = reachable_instances(set(problem.init), instances)
        self.actions: tuple[str, ...] = tuple(i.name for i in reachable)
        self._check_goal(reachable)
        check_precedence(problem.before, all_names, f"problem {problem.name!r}")

        index = {name: i for i, name in enumerate(self.actions)}
        # A predecessor that can no longer be done was done before the problem began.
        precedence = [(index[a], index[b]) for a, b in problem.before if a in index and b in index]
        self._bits = self._number(reachable)
        done = {a: len(self._bits) + k for k, a in enumerate(sorted({a for a, _ in precedence}))}

        self._pos, self._neg, self._add, self._del = [], [], [], []
        self._effects = [instance.eff for instance in reachable]
        self._derived: list[list[tuple[Derived, tuple[str, ...], bool]]] = []
        for i, instance in enumerate(reachable):
            pos = self._mask(p.atom for p in instance.fluents if p.positive)
            self._pos.append(pos | sum(1 << done[a] for a, b in set(precedence) if b == i))
            self._neg.append(self._mask(p.atom for p in instance.fluents if not p.positive))
            add = self._mask(e.atom for e in instance.eff if e.positive)
            self._add.append(add | (1 << done[i] if i in done else 0))
            self._del.append(self._mask(e.atom for e in instance.eff if not e.positive))
            self._derived.append(
                [(d.atom.predicate, d.atom.args, d.positive) for d in instance.derived]  # type: ignore[misc]
            )
        self.initial: int = self._mask(problem.init)
        self._goal_pos = self._mask(g.atom for g in self._fluent_goals if g.positive)
        self._goal_neg = self._mask(g.atom for g in self._fluent_goals if not g.positive)
        self._done_bits = done
        self._all_names, self._constrained = all_names, {a for pair in precedence for a in pair}
        self._stated_classes = self._classes(problem.interchangeable)
        self._touching: dict[Atom, tuple[int, ...]] = {}
        self._promises: dict[tuple[Atom, ...], tuple[tuple[int, ...], int]] = {}
        for i, instance in enumerate(reachable):
            for effect in instance.eff:
                self._touching[effect.atom] = (*self._touching.get(effect.atom, ()), i)

    # -- what planners use ------------------------------------------------------------------------------------

    def is_goal(self, state: int) -> bool:
        """Whether the goal holds; its derived predicates are asked only once the fluents do."""
        if (state & self._goal_pos) != self._goal_pos or state & self._goal_neg:
            return False
        view = BitState(self, state)
        return all(
            self.judge(g.atom.predicate, view, g.atom.args).holds is g.positive  # type: ignore[arg-type]
            for g in self._derived_goals
        )

    def candidates(self, state: int) -> list[int]:
        """Indices of the actions whose fluents allow them in `state`."""
        return [i for i, (pos, neg) in enumerate(zip(self._pos, self._neg)) if (state & pos) == pos and not state & neg]

    def is_applicable(self, state: int, action: int) -> bool:
        """Whether `action` is one of the candidates in `state`."""
        pos = self._pos[action]
        return (state & pos) == pos and not state & self._neg[action]

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
                return Refused(predicate, args, positive, verdict), None
            if verdict.motion is not None:
                stated = _as_motion(predicate, verdict.motion)
                motion = stated if motion is None else motion.joined(stated)
        if motion is not None:
            parts, arrive = moved_parts(
                self._effects[action], getattr(self.world, "names", ()), self.problem.domain.presence
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

    def apply(self, state: int, action: int) -> int:
        """The state after the effects of `action`, no question asked."""
        return (state & ~self._del[action]) | self._add[action]

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
        return not self._derived_goals

    def derived_of(self, action: int) -> tuple[Derived, ...]:
        """The derived predicates that must hold where `action` is done."""
        return tuple(predicate for predicate, _, positive in self._derived[action] if positive)

    def touching(self, atom: Atom) -> tuple[int, ...]:
        """The actions that change a fluent."""
        return self._touching.get(atom, ())

    # -- for people and oracles -------------------------------------------------------------------------------

    def atoms(self, state: int) -> tuple[Atom, ...]:
        """The fluents that hold in `state`."""
        return tuple(atom for atom, bit in self._bits.items() if state >> bit & 1)

    def _not_applicable(self, state: int, action: int) -> Rejection:
        missing = [str(a) for a, bit in self._bits.items() if self._pos[action] >> bit & 1 and not state >> bit & 1]
        missing += [f"not {a}" for a, bit in self._bits.items() if self._neg[action] & state & (1 << bit)]
        for predecessor, bit in self._done_bits.items():
            if self._pos[action] >> bit & 1 and not state >> bit & 1:
                missing.append(f"{self.actions[predecessor]} to be done before")
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

    def _check_goal(self, reachable: Sequence[Instance]) -> None:
        initial = set(self.problem.init)
        made = {e.atom for i in reachable for e in i.eff if e.positive} | initial
        unmade = {e.atom for i in reachable for e in i.eff if not e.positive}
        for i, goal in enumerate(self.problem.goal):
            if isinstance(goal.atom.predicate, Derived):
                continue
            stuck = goal.atom not in made if goal.positive else goal.atom in initial and (
                goal.atom not in unmade
            )
            if stuck:
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
        literals = [p for i in reachable for p in (*i.fluents, *i.eff)] + self._fluent_goals
        for atom in (*self.problem.init, *(p.atom for p in literals)):
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
        place = f"In problem {self.problem.name!r}, interchangeable"
        index = {name: i for i, name in enumerate(self.actions)}
        classes = list(range(len(self.actions)))
        grouped: set[str] = set()
        for number, group in enumerate(groups):
            for name in group:
                if name not in self._all_names:
                    raise DefinitionError(f"{place}[{number}]: {UnknownNameError('action', name, self._all_names)}")
            twice = grouped & set(group)
            if twice or len(set(group)) != len(group):
                raise DefinitionError(f"{place}: expected each action in one group; {sorted(twice) or group} is not.")
            grouped |= set(group)
            # An action that the user's precedence singles out is no longer like the others.
            members = [index[name] for name in group if name in index and index[name] not in self._constrained]
            for member in members:
                classes[member] = members[0]
        return tuple(classes)


def _as_motion(predicate: Derived, given: Any) -> StepMotion:
    """What a predicate says of how parts move; a direction will do."""
    try:
        return given if isinstance(given, StepMotion) else StepMotion.along((), given)
    except InputError:
        raise ContractError(
            f"Expected the derived predicate {predicate} to answer with a StepMotion as motion, or with a direction of "
            f"three numbers; got {given!r}."
        ) from None
