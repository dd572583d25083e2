"""A problem as STRIPS: operators with positive conditions only, as plain classical planners take them.

Preconditions that derived predicates add are written over fluents: what `Derived.formula` says, or, where it is silent,
what a walk through all reachable states shows (`pddl_table`). Negative conditions become facts of their own, which
effects keep up; disjunctions become one operator a disjunct. Gravity enters as the finite list of falls that removals
can meet (`neurosym.geometry.falls`): each must be made impossible by a part of it that has left, or by one that is
still there.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

from neurosym.errors import InputError
from neurosym.language.formulas import AnyOf, Formula, Stands
from neurosym.language.pddl_table import ways_from_table
from neurosym.language.terms import Atom, Derived, Literal

if TYPE_CHECKING:
    from neurosym.geometry.falls import Fall
    from neurosym.language.domain import Problem

T = TypeVar("T")

#: Of one way to do an action: into so many operators its disjunctions are multiplied out, at the most. What is left
#: over gets helper operators instead, which change nothing but a mark.
MAX_OPERATORS = 24


@dataclass(frozen=True)
class Mark:
    """A fact that the language does not have: that an action was or was not done, that a fall can no longer happen.

    Attributes:
        kind: "done" and "unused" (of an action), "averted" (of a fall), "kept" (of a part in the way of a fall).
        label: which one.
    """

    kind: str
    label: str


Fact = Literal | Mark


@dataclass(frozen=True)
class Operator:
    """What a planner may do.

    Attributes:
        name: in words; operators of one action may share it.
        action: the action primitive it stands for, None for a helper.
        how: in which way, in words; may be empty.
        pre, add, delete: facts, all positive.
    """

    name: str
    action: str | None
    how: str
    pre: frozenset[Fact]
    add: frozenset[Fact]
    delete: frozenset[Fact]


@dataclass(frozen=True)
class Strips:
    """A problem as operators over facts.

    Attributes:
        sound: every plan is a plan of the problem. False: there was no time to find all falls.
        notes: sentences on how it came about.
    """

    operators: tuple[Operator, ...]
    init: frozenset[Fact]
    goal: frozenset[Fact]
    sound: bool
    notes: tuple[str, ...]

    @property
    def facts(self) -> tuple[Fact, ...]:
        """All facts, in a stable order."""
        every = {f: None for o in self.operators for s in (o.pre, o.add, o.delete) for f in sorted(s, key=str)}
        every.update(dict.fromkeys(sorted((*self.init, *self.goal), key=str)))
        return tuple(every)


@dataclass
class _Instance:
    """A ground action on its way to operators: `ways` are (in words, conditions)."""

    name: str
    title: str
    needs: frozenset[Literal]
    derived: list[Literal]
    add: frozenset[Atom]
    delete: frozenset[Atom]
    ways: list[tuple[str, frozenset[Fact]]] = field(default_factory=list)
    marks: set[Mark] = field(default_factory=set)


def strips(problem: Problem, *, seconds: float | None = None, refuted: Sequence[Sequence[str]] = ()) -> Strips:
    """Compile a problem without rules of its own.

    Args:
        seconds: for the falls, or for the table of states.
        refuted: orders of action primitives in which something falls.

    Raises:
        InputError: a predicate without a formula in a problem of too many states, or a derived goal.
    """
    return _Compiler(problem, seconds, refuted).strips()


class _Compiler:
    def __init__(self, problem: Problem, seconds: float | None, refuted: Sequence[Sequence[str]]) -> None:
        self.problem, self.seconds, self.refuted = problem, seconds, refuted
        self.initial = frozenset(problem.init)
        self.instances = self._instances()
        self.helpers: list[Operator] = []
        self.kept: Mapping[Mark, set[Fact]] = {}
        self.notes: list[str] = []
        self.sound = True

    def strips(self) -> Strips:
        formulas = [self._formulas(i) for i in self.instances]
        gravity = self._gravity(formulas)
        if gravity is None:
            self._tabulate()
        else:
            self._write_out(formulas)
            if any(gravity.values()):
                self._weigh(gravity)
        return self._emit()

    # -- ground actions ---------------------------------------------------------------------------------------

    def _instances(self) -> list[_Instance]:
        problem = self.problem
        reachable, found = set(problem.actions), []
        for action in problem.domain.actions:
            for binding in problem.bindings(action):
                name = action.ground_name(binding)
                if name not in reachable:
                    continue
                pre = [p.bind(binding) for p in action.pre]
                eff = [e.bind(binding) for e in action.eff]
                found.append(
                    _Instance(
                        name,
                        " ".join([action.name, *(binding[p.name] for p in action.params)]),
                        frozenset(p for p in pre if not isinstance(p.atom.predicate, Derived)),
                        [p for p in pre if isinstance(p.atom.predicate, Derived)],
                        frozenset(e.atom for e in eff if e.positive),
                        frozenset(e.atom for e in eff if not e.positive),
                    )
                )
        return found

    def _formulas(self, instance: _Instance) -> list[Formula] | None:
        """Of its derived preconditions; None where one has none."""
        found = []
        for literal in instance.derived:
            predicate = literal.atom.predicate
            assert isinstance(predicate, Derived)
            formula = predicate.formula
            said = formula(self.problem.world, *literal.atom.args) if formula and literal.positive else None
            if said is None:
                return None
            found.append(said)
        return found

    def _gravity(self, formulas: Sequence[list[Formula] | None]) -> dict[str, Stands | None] | None:
        """Which instances ask that the others stand; None if the problem is not one that formulas can tell.

        Falls can be listed where every action that takes a part away asks whether the others stand, and none brings
        one back.
        """
        asked: dict[str, Stands | None] = {}
        for instance, own in zip(self.instances, formulas):
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
        for instance in self.instances:
            gone = [a.args for a in instance.delete if a.predicate is present]
            one = asked[instance.name]
            if any(a.predicate is present for a in instance.add) or gone != ([(one.without,)] if one else []):
                return None
            if one and one.without in self.problem.world.fixed:
                return None
        return asked

    # -- conditions -------------------------------------------------------------------------------------------

    def _settled(self) -> dict[Literal, bool]:
        """Literals that are true, or false, in every state."""
        made = {a for i in self.instances for a in i.add}
        unmade = {a for i in self.instances for a in i.delete}
        named = {p.atom for i in self.instances for _, way in i.ways for p in way if isinstance(p, Literal)}
        settled = {}
        for atom in named | {p.atom for i in self.instances for p in i.needs}:
            now = atom in self.initial
            if atom not in (unmade if now else made):
                settled[Literal(atom)], settled[~atom] = now, not now
        return settled

    def _write_out(self, formulas: Sequence[list[Formula] | None]) -> None:
        """The ways of all instances; those without any are dropped, which may settle more."""
        for instance, own in zip(self.instances, formulas):
            instance.ways = [("", frozenset(instance.needs))]
            for formula in own or ():
                if isinstance(formula, AnyOf):
                    both = itertools.product(instance.ways, formula.ways)
                    instance.ways = least([
                        (" ".join(filter(None, (said, way.name))), known | frozenset(way.literals))
                        for (said, known), way in both
                    ])
        self._settle()

    def _settle(self) -> None:
        count = -1
        while count != len(self.instances):
            count = len(self.instances)
            settled = self._settled()
            for instance in self.instances:
                instance.ways = least([
                    (said, frozenset(p for p in way if not (isinstance(p, Literal) and settled.get(p))))
                    for said, way in instance.ways
                    if not any(isinstance(p, Literal) and (settled.get(p) is False or ~p in way) for p in way)
                ])
            self.instances = [i for i in self.instances if i.ways]

    def _tabulate(self) -> None:
        silent = {str(p.atom.predicate) for i in self.instances for p in i.derived}
        table = ways_from_table(self.problem, self.seconds)
        for instance in self.instances:
            instance.ways = [("", instance.needs | way) for way in table.ways.get(instance.name, ())]
        self.instances = [i for i in self.instances if i.ways]
        self._settle()
        self.notes.append(
            f"Conditions ({', '.join(sorted(silent))}) were read off all {table.states:,} reachable states."
        )

    # -- gravity ----------------------------------------------------------------------------------------------

    def _weigh(self, asked: Mapping[str, Stands | None]) -> None:
        from neurosym.geometry.falls import find_falls  # geometry is no part of the language

        world = self.problem.world
        first = next(s for s in asked.values() if s)
        present = first.present
        moves: dict[int, list[int]] = {}
        for instance in self.instances:
            own = asked[instance.name]
            if own:
                masks = [
                    world.mask(n for n in world.names if ~present(n) in way)
                    for _, way in instance.ways
                ]
                moves.setdefault(world.index[own.without], []).extend(masks)
        initial = world.mask(n for n in world.names if present(n) in self.initial)
        removed = {name: world.index[s.without] for name, s in asked.items() if s}
        refuted = [[removed[name] for name in order if name in removed] for order in self.refuted]
        found = find_falls(world, initial, moves, held=first.held, refuted=refuted, seconds=self.seconds)
        self.sound = found.complete
        self.notes.append(
            f"Gravity: {len(found.falls)} falls, found among {found.sets:,} connected sets of parts, "
            + ("which are all that removals can lead to." if found.complete else "more than there was time for.")
        )
        self._avert(found.falls, {i.name: asked[i.name] for i in self.instances})

    def _avert(self, falls: Sequence[Fall], asked: Mapping[str, Stands | None]) -> None:
        """Add to each removal that no fall can happen after it.

        A fall that could not happen before a removal can happen after it only if what is removed is among the parts
        that must be gone. One that can happen at first must be made impossible by the first removal already.
        """
        world = self.problem.world
        present = next(s.present for s in asked.values() if s)
        remover = {s.without: i for i in self.instances if (s := asked[i.name])}
        averted: dict[int, Fact] = {}
        for number, fall in enumerate(falls):
            can_leave = [n for n in world.in_mask(fall.moving) if n in remover]
            if len(can_leave) == 1:
                averted[number] = ~present(can_leave[0])
            elif can_leave:
                averted[number] = Mark("averted", str(number))
                for name in can_leave:
                    remover[name].marks.add(Mark("averted", str(number)))
        kept: dict[Mark, set[Fact]] = {}
        for instance in self.instances:
            own = asked[instance.name]
            if own is None:
                continue
            bit = 1 << world.index[own.without]
            threats = [(k, f) for k, f in enumerate(falls) if not f.moving & bit and (f.gone & bit or not f.gone)]
            ways = []
            for said, way in instance.ways:
                clauses: list[tuple[str, frozenset[Fact]]] = []
                for number, fall in threats:
                    if any(~present(n) in way for n in world.in_mask(fall.moving)):
                        continue
                    stay = world.in_mask(fall.gone & ~bit)
                    if any(n not in remover or Literal(present(n)) in way for n in stay):
                        continue
                    choices: set[Fact] = {Literal(present(n)) for n in stay if ~present(n) not in way}
                    if number in averted:
                        choices.add(averted[number])
                    clauses.append((f"{number} {instance.name}", frozenset(choices)))
                ways += [(said, way | conjunction) for conjunction in self._multiplied(clauses, kept)]
            instance.ways = least(ways)
        self.instances = [i for i in self.instances if i.ways]
        self._add_helpers(kept)

    def _multiplied(
        self, clauses: Sequence[tuple[str, frozenset[Fact]]], kept: dict[Mark, set[Fact]]
    ) -> list[frozenset[Fact]]:
        """Conjunctions, one of which holds exactly when all clauses do. `kept` gains the clauses that need helpers."""
        found: list[frozenset[Fact]] = [frozenset()]
        for label, choices in sorted(clauses, key=lambda c: (len(c[1]), c[0])):
            more = [
                known | {choice}
                for known in found
                for choice in ([None] if known & choices else sorted(choices, key=str))
                if choice is not None
            ] + [known for known in found if known & choices]
            following = [way for _, way in least([("", m) for m in more])]
            if len(following) > MAX_OPERATORS:
                mark = Mark("kept", label)
                kept.setdefault(mark, set()).update(choices)
                following = [known | {mark} for known in found]
            found = following
        return found

    def _add_helpers(self, kept: Mapping[Mark, set[Fact]]) -> None:
        """Operators that note that a clause holds; a removal of any part that it counts on takes the note away."""
        for mark, choices in kept.items():
            for choice in sorted(choices, key=str):
                self.helpers.append(
                    Operator(f"note {mark.label}", None, "", frozenset([choice]), frozenset([mark]), frozenset())
                )
        self.kept = kept

    # -- operators --------------------------------------------------------------------------------------------

    def _emit(self) -> Strips:
        problem = self.problem
        names = set(problem.actions)
        before = [(a, b) for a, b in problem.before if a in names and b in names]
        made = {a for i in self.instances for a in i.add}
        unmade = {a for i in self.instances for a in i.delete}
        operators = []
        init: set[Fact] = set()
        for i in self.instances:
            add: set[Fact] = {*map(Literal, i.add), *(~a for a in i.delete), *i.marks}
            delete: set[Fact] = {*map(Literal, i.delete), *(~a for a in i.add)}
            delete |= {m for m, choices in self.kept.items() if delete & choices}
            pre: set[Fact] = {Mark("done", a) for a, b in before if b == i.name}
            if i.name in {a for a, _ in before}:
                add.add(Mark("done", i.name))
            # Each action can be used once. Most see to it themselves: what they take away does not come back.
            spent = any((p.atom in i.delete - made) if p.positive else (p.atom in i.add - unmade) for p in i.needs)
            if not spent:
                once = Mark("unused", i.name)
                pre.add(once)
                delete.add(once)
                init.add(once)
            for said, way in i.ways:
                operators.append(Operator(i.title, i.name, said, way | pre, frozenset(add), frozenset(delete)))
        operators += self.helpers
        goal = self._goal()
        used = goal.union(*(o.pre for o in operators))
        atoms = {f.atom for f in used if isinstance(f, Literal)}
        init |= {Literal(a) if a in self.initial else ~a for a in atoms}
        return Strips(
            tuple(Operator(o.name, o.action, o.how, o.pre, o.add & used, o.delete & used) for o in operators),
            frozenset(init & used),
            goal,
            self.sound,
            tuple(self.notes),
        )

    def _goal(self) -> frozenset[Fact]:
        derived = [str(g) for g in self.problem.goal if isinstance(g.atom.predicate, Derived)]
        if derived:
            raise InputError(
                f"Expected a goal of fluents to export {self.problem.name!r} as PDDL; {', '.join(derived)} is derived. "
                "State what should have changed instead."
            )
        return frozenset(self.problem.goal)


def least(ways: Iterable[tuple[T, frozenset[Fact]]]) -> list[tuple[T, frozenset[Fact]]]:
    """Without those ways that ask for all that another one asks for; of equal ones the first is kept, in order."""
    given = list(ways)
    kept: list[int] = []
    for k in sorted(range(len(given)), key=lambda k: (len(given[k][1]), k)):
        if not any(given[j][1] <= given[k][1] for j in kept):
            kept.append(k)
    return [given[k] for k in sorted(kept)]
