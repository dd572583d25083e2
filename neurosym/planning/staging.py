"""From a plan to a plan in space: which parts each action moves, said by the family, the motions or the effects."""

from collections.abc import Sequence

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.staging import Staging, staged
from neurosym.geometry.step_motion import StepMotion, check_motions
from neurosym.language.actions import moved_parts
from neurosym.language.problem import Problem


def stage(problem: Problem, plan: Sequence[str], motions: Sequence[StepMotion | None] = ()) -> Staging:
    """A plan in space.

    Where a step's motion does not say which parts move, the problem's `Simulation` does; failing that, the effects: an
    action takes away the parts about which it only deletes atoms, else it brings those about which it only adds some.

    `problem`: what was planned. `plan`: names of actions, in order. `motions`: one a step, or none at all, as
    `PlanResult.motions` has them; for None a free straight line is looked for. Raises InputError: the problem does not
    say what its actions do to parts, or not one motion a step; UnknownNameError: a name in the plan that is no action.
    """
    check_motions(motions, len(plan))
    for name in plan:
        if name not in problem.actions:
            raise UnknownNameError("action", name, problem.actions)
    staging = problem.semantics.staging(problem, plan, motions)
    if staging is not None:
        return staging
    world, geometry, moved = problem.world, problem.geometry, dict[str, tuple[tuple[str, ...], bool]]()
    absent: set[str] = set()
    if problem.simulation is not None:
        moved = {action: ((part,), False) for action, part in problem.simulation.removes.items()}
        absent.update(problem.simulation.absent)
    elif geometry is not None:
        for action in problem.domain.actions:
            for binding in problem.bindings(action):
                effects = [e.bind(binding) for e in action.eff]
                moved[action.ground_name(binding)] = parts, arrive = moved_parts(
                    effects, world.names, problem.domain.presence
                )
                if not arrive:
                    lacking = [e.atom for e in effects if not e.positive and e.atom not in problem.init]
                    absent.update(name for name in parts if any(name in atom.args for atom in lacking))
    whole = []
    for name, motion in zip(plan, motions or [None] * len(plan)):
        parts, arrive = moved.get(name, ((), False))
        whole.append((motion or StepMotion()).of_parts(parts, arrive=arrive))
        absent |= set(whole[-1].parts) if whole[-1].arrives else set()
    # A step may move nothing; a plan that moves nothing at all has no place in space.
    if geometry is None or (whole and not any(motion.parts for motion in whole)):
        raise InputError(
            f"Expected a problem that says what its actions do to parts in space; {problem.name!r} does not. Give "
            "Domain.problem a world that is an Assembly and simulation=Simulation('rigid', removes={action: part}), or "
            "semantics= with a method staging."
        )
    # A plan that puts together begins with what it does not bring.
    return staged(geometry, [n for n in world.names if n not in absent], plan, whole)
