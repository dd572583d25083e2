"""Independent replay of an order. Shares no code with planners or grounding, and asks geometry anew."""

from collections.abc import Sequence
from typing import Any

from neurosym.errors import ContractError, InputError, UnknownNameError
from neurosym.geometry.step_motion import StepMotion, check_motions
from neurosym.language.problem import Problem
from neurosym.language.search_problem import Rejection, SearchProblem
from neurosym.language.semantics import Validation as Validation
from neurosym.language.state import AtomSet
from neurosym.language.terms import Derived, Literal


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
    ground = {}
    for action in problem.domain.actions:
        for binding in problem.bindings(action):
            ground[action.ground_name(binding)] = (action, binding)
    for name in order:
        if not isinstance(name, str) or name not in ground:
            raise UnknownNameError("action primitive", name, ground)
    replayed = problem.semantics.replay(problem, order, motions)
    if replayed is not None:
        return replayed
    world = problem.predicate_world
    world = world.anew() if hasattr(world, "anew") else world
    state = AtomSet(set(problem.init), tuple(problem.type_of))
    done: list[str] = []
    possible = set(problem.actions)

    def failure(literals: Sequence[Literal], motion: StepMotion | None = None) -> tuple[tuple[str, ...], str] | None:
        for literal in sorted(literals, key=lambda x: isinstance(x.atom.predicate, Derived)):
            predicate = literal.atom.predicate
            if isinstance(predicate, Derived):
                if motion is not None and predicate.check is not None:
                    verdict = predicate.check(world, state, motion, *literal.atom.args)
                else:
                    verdict = predicate.function(world, state, *literal.atom.args)
                if verdict.holds is not literal.positive:
                    return verdict.because, verdict.reason or f"{literal} is not true."
            elif state.holds(literal.atom) is not literal.positive:
                return tuple(a for a in literal.atom.args if isinstance(a, str)), f"{literal} is not true."
        return None

    for step, name in enumerate(order):
        if name in done:
            # What the domain itself says of doing it again, a tower that comes down for instance, is worth hearing.
            action, binding = ground[name]
            again = failure([p.bind(binding) for p in action.pre])
            sentence = f"{name} was done already, as step {done.index(name)}." + (f" {again[1]}" if again else "")
            return Validation(False, step, (name,), sentence)
        for first, then in problem.before:
            if then == name and first in possible and first not in done:
                return Validation(False, step, (first,), f"{name} may be done only after {first}.")
        action, binding = ground[name]
        wrong = failure([p.bind(binding) for p in action.pre], motions[step] if motions else None)
        if wrong is not None:
            return Validation(False, step, wrong[0], f"Step {step}, {name}: {wrong[1]}")
        effects = [e.bind(binding) for e in action.eff]
        state.atoms -= {e.atom for e in effects if not e.positive}
        state.atoms |= {e.atom for e in effects if e.positive}
        done.append(name)
    wrong = failure(problem.goal)
    if wrong is not None:
        return Validation(False, len(order), wrong[0], f"After all {len(order)} actions the goal is missed: {wrong[1]}")
    return Validation(True)


def replay(problem: SearchProblem[Any], order: Sequence[str]) -> Validation:
    """The same for a bare `SearchProblem`, whose oracle is asked; for physics give it a fresh simulation."""
    index = {name: i for i, name in enumerate(problem.actions)}
    state = problem.initial
    for step, name in enumerate(order):
        if name not in index:
            raise UnknownNameError("action primitive", name, index)
        if name in order[:step]:
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
