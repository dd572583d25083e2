"""Independent replay of an order. Shares no code with planners or grounding, and asks geometry anew."""

from collections.abc import Iterable, Sequence
from typing import Any

from neurosym.errors import ContractError, InputError, UnknownNameError
from neurosym.geometry.step_motion import StepMotion, check_motions
from neurosym.language.actions import Action
from neurosym.language.conditions import And, Condition, Equality, Or, Quantified, When
from neurosym.language.problem import Problem
from neurosym.language.search_problem import Rejection, SearchProblem, Verdict
from neurosym.language.semantics import Validation as Validation
from neurosym.language.state import AtomSet
from neurosym.language.terms import Atom, Derived, Literal


def validate(problem: Problem, order: Sequence[str], motions: Sequence[StepMotion | None] = ()) -> Validation:
    """Replay an order, given as names of action primitives (for Soma the pieces' letters).

    `motions`: one a step, as `PlanResult.motions` has them: then each step must be possible so. Empty: in any way.
    Raises UnknownNameError: a name that is no action of the problem's domain; InputError: not one motion a step.
    """
    if not hasattr(problem, "domain"):
        raise InputError(f"Expected a Problem, as Domain.problem makes it; got {problem!r}.")
    if not isinstance(order, Sequence):
        raise InputError(f"Expected an order as a list of names of action primitives; got {order!r}.")
    check_motions(motions, len(order))
    ground: dict[str, tuple[Action, dict[str, str]]] = {}
    for name in order:
        meant = problem.meant_by(name) if isinstance(name, str) else None
        if meant is None:
            raise UnknownNameError("action primitive", name, problem.actions)
        ground[name] = meant
    replayed = problem.semantics.replay(problem, order, motions)
    if replayed is not None:
        return replayed
    world = problem.predicate_world
    world = world.anew() if hasattr(world, "anew") else world
    state = AtomSet(set(problem.init), tuple(problem.type_of))
    done: list[str] = []
    possible = set(problem.actions)

    def ask(literal: Literal, motion: StepMotion | None) -> Verdict:
        predicate, args = literal.atom.predicate, literal.atom.args
        if not isinstance(predicate, Derived):
            holds = state.holds(literal.atom) is literal.positive
            return Verdict(holds, tuple(map(str, args)), f"{literal} is not true.")
        if motion is not None and predicate.check is not None:
            verdict = predicate.check(world, state, motion, *args)
        else:
            verdict = predicate.function(world, state, *args)
        holds = verdict.holds is literal.positive
        return Verdict(holds, verdict.because, verdict.reason or f"{literal} is not true.")

    def failure(conditions: Iterable[Condition], motion: StepMotion | None = None) -> Verdict | None:
        """Of the first condition that does not hold; fluents are looked at before the world is asked."""
        for world_too in (False, True):
            for condition in conditions:
                asks = any(isinstance(literal.atom.predicate, Derived) for literal in condition.literals())
                if asks is world_too and not (verdict := look(condition, motion)).holds:
                    return verdict
        return None

    def look(condition: Condition, motion: StepMotion | None) -> Verdict:
        if isinstance(condition, Literal):
            return ask(condition, motion)
        if isinstance(condition, Equality):
            return Verdict(bool(condition), (), f"{condition} is not true.")
        if isinstance(condition, Quantified):
            parts = [part for part in condition.bodies(problem.objects_of) if isinstance(part, Condition)]
            return look(And(tuple(parts)) if condition.universal else Or(tuple(parts)), motion)
        if isinstance(condition, Atom):
            return look(Literal(condition), motion)
        assert isinstance(condition, And | Or)
        verdicts = [look(part, motion) for part in condition.parts]
        wrong = [verdict for verdict in verdicts if not verdict.holds]
        if not wrong or (isinstance(condition, Or) and len(wrong) < len(verdicts)):
            return Verdict(bool(verdicts) or isinstance(condition, And), (), "Nothing makes it hold.")
        wrong = wrong[:1] if isinstance(condition, And) else wrong
        return Verdict(False, tuple(x for v in wrong for x in v.because), " ".join(v.reason for v in wrong))

    def changes(action: Action, binding: dict[str, str]) -> list[Literal]:
        """What an action changes in this state."""
        effects = [e.bind(binding) for e in action.eff]
        for each in action.conditional:
            whole = When(each.condition, (each.effect,)).bind(binding)
            for body in Quantified(True, each.bound, whole).bodies(problem.objects_of) if each.bound else (whole,):
                assert isinstance(body, When)
                if look(body.condition, None).holds:
                    effects += [e for e in body.effects if isinstance(e, Literal)]
        return effects

    for step, name in enumerate(order):
        action, binding = ground[name]
        if name in done and action.once:
            # What the domain itself says of doing it again, a tower that comes down for instance, is worth hearing.
            again = failure([p.bind(binding) for p in (*action.pre, *action.conditions)])
            sentence = f"{name} was done already, as step {done.index(name)}."
            sentence += "" if again is None else f" {again.reason}"
            return Validation(False, step, (name,), sentence)
        for first, then in problem.before:
            if then == name and first in possible and first not in done:
                return Validation(False, step, (first,), f"{name} may be done only after {first}.")
        pre = [p.bind(binding) for p in (*action.pre, *action.conditions)]
        wrong = failure(pre, motions[step] if motions else None)
        if wrong is not None:
            return Validation(False, step, wrong.because, f"Step {step}, {name}: {wrong.reason}")
        effects = changes(action, binding)
        state.atoms -= {e.atom for e in effects if not e.positive}
        state.atoms |= {e.atom for e in effects if e.positive}
        done.append(name)
    wrong = failure((*problem.goal, *problem.goal_conditions))
    if wrong is not None:
        sentence = f"After all {len(order)} actions the goal is missed: {wrong.reason}"
        return Validation(False, len(order), wrong.because, sentence)
    return Validation(True)


def replay(problem: SearchProblem[Any], order: Sequence[str]) -> Validation:
    """The same for a bare `SearchProblem`, whose oracle is asked; for physics give it a fresh simulation."""
    index = {name: i for i, name in enumerate(problem.actions)}
    state = problem.initial
    for step, name in enumerate(order):
        if name not in index:
            raise UnknownNameError("action primitive", name, index)
        if name in order[:step] and not getattr(problem, "repeating", 0) >> index[name] & 1:
            return Validation(False, step, (name,), f"{name} was done already.")
        if index[name] not in set(problem.candidates(state)):
            return Validation(False, step, (name,), f"Step {step}: {name} is not applicable.")
        answer = problem.attempt(state, index[name])
        if isinstance(answer, Rejection):
            return Validation(False, step, answer.because, f"Step {step}, {name}: {answer.reason}")
        state = answer.state
    if not problem.is_goal(state):
        return Validation(False, len(order), (), f"After all {len(order)} actions the goal is missed.")
    return Validation(True)


def confirm(planner: object, plan: Sequence[str], replayed: Validation) -> None:
    """Refuse a plan that did not survive its replay. Raises ContractError: it did not."""
    if not replayed.ok:
        raise ContractError(
            f"The planner {type(planner).__name__} answered with the plan {', '.join(plan)}, which fails its replay: "
            f"{replayed.reason} This is a fault of the planner or of the oracle; please report it."
        )
