"""A problem as STRIPS: operators with positive conditions only, as plain classical planners take them.

Preconditions that derived predicates add are written over fluents (`pddl_instances`). Negative conditions become facts
of their own, which effects keep up; disjunctions become one operator a disjunct. Gravity enters as the finite list of
falls that removals can meet (`pddl_gravity`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from neurosym.errors import InputError
from neurosym.language.problem import Problem
from neurosym.language.terms import Derived, Literal
from neurosym.pddl.facts import Fact, Mark, Operator, Strips
from neurosym.pddl.gravity import standing_asked, weighed
from neurosym.pddl.instances import Instance, formulas_of, ground_instances, with_formulas, with_table


def strips(problem: Problem, *, seconds: float | None = None, refuted: Sequence[Sequence[str]] = ()) -> Strips:
    """Compile a problem without rules of its own.

    `seconds`: for the falls, or for the table of states. `refuted`: orders of action primitives in which something
    falls. Raises InputError: a predicate without a formula in a problem of too many states, or a derived goal.
    """
    if any(a.conditions or a.conditional or a.cost is not None for a in problem.domain.actions):
        raise InputError(
            f"Expected a domain of literals only, to write {problem.name!r} as ground PDDL: its actions have formulas, "
            "conditional effects or costs beside predicates that geometry answers. Without such predicates, or with "
            "literals only, it can be written."
        )
    instances = ground_instances(problem)
    formulas = [formulas_of(problem, i) for i in instances]
    asked = standing_asked(problem, instances, formulas)
    if asked is None:
        instances, note = with_table(problem, instances, seconds)
        return _compiled(problem, instances, notes=(note,))
    instances = with_formulas(problem, instances, formulas)
    if not any(asked.values()):
        return _compiled(problem, instances)
    own = weighed(problem, instances, asked, refuted=refuted, seconds=seconds)
    return _compiled(problem, own.instances, helpers=own.helpers, kept=own.kept, sound=own.sound, notes=(own.note,))


def _compiled(
    problem: Problem,
    instances: Sequence[Instance],
    *,
    helpers: Sequence[Operator] = (),
    kept: Mapping[Mark, set[Fact]] | None = None,
    sound: bool = True,
    notes: tuple[str, ...] = (),
) -> Strips:
    """One operator a way of each instance, with what keeps up negative conditions, the order and single use."""
    names, initial = set(problem.actions), frozenset(problem.init)
    before = [(a, b) for a, b in problem.before if a in names and b in names]
    made = {a for i in instances for a in i.add}
    unmade = {a for i in instances for a in i.delete}
    operators = []
    init: set[Fact] = set()
    for i in instances:
        add: set[Fact] = {*map(Literal, i.add), *(~a for a in i.delete), *i.marks}
        delete: set[Fact] = {*map(Literal, i.delete), *(~a for a in i.add)}
        delete |= {m for m, choices in (kept or {}).items() if delete & choices}
        pre: set[Fact] = {Mark("done", a) for a, b in before if b == i.name}
        if i.name in {a for a, _ in before}:
            add.add(Mark("done", i.name))
        # What can be used once most often sees to it itself: what it takes away does not come back.
        spent = any((p.atom in i.delete - made) if p.positive else (p.atom in i.add - unmade) for p in i.needs)
        if i.once and not spent:
            for facts in (pre, delete, init):
                facts.add(Mark("unused", i.name))
        for how, way in i.ways:
            operators.append(Operator(i.title, i.name, how, way | pre, frozenset(add), frozenset(delete)))
    operators += helpers
    goal = _goal(problem)
    used = goal.union(*(o.pre for o in operators))
    atoms = {f.atom for f in used if isinstance(f, Literal)}
    init |= {Literal(a) if a in initial else ~a for a in atoms}
    trimmed = tuple(replace(o, add=o.add & used, delete=o.delete & used) for o in operators)
    return Strips(trimmed, frozenset(init & used), goal, sound, notes)


def _goal(problem: Problem) -> frozenset[Fact]:
    derived = [*map(str, problem.goal_conditions)]
    derived += [str(g) for g in problem.goal if isinstance(g.atom.predicate, Derived)]
    if derived:
        raise InputError(
            f"Expected a goal of fluents to export {problem.name!r} as PDDL; {', '.join(derived)} is no fluent. "
            "State what should have changed instead."
        )
    return frozenset(problem.goal)
