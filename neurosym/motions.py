"""What a plan does to the parts, step by step: who moves, along which path, and whether it leaves or arrives.

Replays, pictures and viewers share this. A `Problem` says it itself (``stage``), or it follows from its
`Simulation`, which names the part that each action removes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation, Slerp

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly

if TYPE_CHECKING:
    from neurosym.language.domain import Problem

Array = NDArray[np.float64]

#: How far beyond the last obstacle a straight way goes on, as a share of what moves (its extent along the way).
CLEARANCE = 0.3


@dataclass(frozen=True, eq=False)
class Motion:
    """One step of a plan, in space.

    Attributes:
        action: name of the action.
        parts: names of the parts that move, as one.
        path: float64 (k, 4, 4), k >= 2: rigid motions of the world, the first the identity. A part that rests at X_WP
            is at ``path[i] @ X_WP`` on its way out.
        arrives: whether the parts come in along the path, from its end, instead of leaving.
        given: whether the plan said how; otherwise a way was looked for here.
    """

    action: str
    parts: tuple[str, ...]
    path: Array
    arrives: bool = False
    given: bool = True

    @property
    def length(self) -> float:
        """Length of the path of the parts' frame, in the assembly's unit; turning counts nothing."""
        return float(np.linalg.norm(np.diff(self.path[:, :3, 3], axis=0), axis=1).sum())

    def at(self, share: float) -> Array:
        """float64 (4, 4): the motion of the world when `share` of the step is done, 0 to 1, at even pace."""
        share = min(max(share, 0.0), 1.0)
        return pose_along(self.path, 1 - share if self.arrives else share)


@dataclass(frozen=True, eq=False)
class Staging:
    """A plan in space.

    Attributes:
        assembly: all parts that ever appear, where they rest when assembled.
        present: names of those that are there before the first step.
        motions: one a step.
        colours: part name -> RGB in 0..1, for parts with a colour of their own.
    """

    assembly: Assembly
    present: tuple[str, ...]
    motions: tuple[Motion, ...]
    colours: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = set(self.assembly.names)
        for name in (*self.present, *self.colours, *(n for m in self.motions for n in m.parts)):
            if name not in known:
                raise UnknownNameError("part", name, known)

    def there(self, step: int) -> tuple[str, ...]:
        """Names of the parts in place before step number `step` (from 0), in the assembly's order."""
        now = set(self.present)
        for motion in self.motions[:step]:
            now = now | set(motion.parts) if motion.arrives else now - set(motion.parts)
        return tuple(name for name in self.assembly.names if name in now)


def stage(problem: Problem, plan: Sequence[str], how: Sequence[Any] = ()) -> Staging:
    """The motions of a plan.

    Args:
        problem: what was planned.
        plan: names of actions, in order.
        how: one entry a step, or none at all, as `PlanResult.how` has them: a direction (3,), a path of poses
            (k, 4, 4), or None, for which a free straight way is looked for.

    Raises:
        InputError: the problem does not say what its actions do to parts, or `how` does not fit the plan.
        UnknownNameError: a name in the plan that is no action.
    """
    if len(how) not in (0, len(plan)):
        raise InputError(f"Expected one `how` a step, {len(plan)}, or none; got {len(how)}.")
    for name in plan:
        if name not in problem.actions:
            raise UnknownNameError("action", name, problem.actions)
    if problem.stage is not None:
        return problem.stage(plan, how)
    removes = None if problem.simulation is None else problem.simulation.removes
    if removes is None or not isinstance(problem.world, Assembly):
        raise InputError(
            f"Expected a problem that says what its actions do to parts in space; {problem.name!r} does not. Give "
            "Domain.problem a world that is an Assembly and simulation=Simulation('rigid', removes={action: part}), or "
            "a function as stage=."
        )
    absent = problem.simulation.absent if problem.simulation else ()
    present = tuple(n for n in problem.world.names if n not in absent)
    motions = removals(problem.world, present, plan, [(removes[name],) for name in plan], how)
    return Staging(problem.world, present, motions)


def removals(
    assembly: Assembly,
    present: Sequence[str],
    plan: Sequence[str],
    parts: Sequence[Sequence[str]],
    how: Sequence[Any] = (),
) -> tuple[Motion, ...]:
    """Motions of a plan that takes parts away.

    Args:
        present: names of the parts that are there at first.
        plan: names of the actions.
        parts: for each step, the parts that leave together.
        how: for each step a direction (3,), a path (k, 4, 4), or None; or nothing at all.
    """
    there, motions = set(present), []
    for i, (action, names) in enumerate(zip(plan, parts, strict=True)):
        others = there - set(names)
        given = how[i] if how else None
        if given is None:
            given = free_direction(assembly, names, others)
            motions.append(Motion(action, tuple(names), straight(assembly, names, given, others), given=False))
        else:
            motions.append(Motion(action, tuple(names), path_of(assembly, names, given, others)))
        there = others
    return tuple(motions)


def building(
    assembly: Assembly,
    present: Sequence[str],
    plan: Sequence[str],
    colours: Mapping[str, tuple[float, float, float]] | None = None,
) -> Staging:
    """The staging of a plan that puts parts in place from above, one a step, each action named after its part."""
    motions = tuple(
        Motion(action, (action,), straight(assembly, [action], (0, 0, 1), assembly.names), arrives=True)
        for action in plan
    )
    return Staging(assembly, tuple(present), motions, colours or {})


def path_of(assembly: Assembly, parts: Sequence[str], how: ArrayLike, others: Collection[str]) -> Array:
    """A path, float64 (k, 4, 4), from a direction (3,) or from a path that starts at rest.

    Raises:
        InputError: neither of the two, or a path whose first motion is not the identity.
    """
    try:
        given = np.asarray(how, dtype=np.float64)
    except (TypeError, ValueError):
        given = np.zeros(0)
    if given.shape == (3,) and np.isfinite(given).all() and given.any():
        return straight(assembly, parts, given, others)
    if given.ndim == 3 and given.shape[1:] == (4, 4) and len(given) > 1 and np.allclose(given[0], np.eye(4)):
        return given
    raise InputError(
        "Expected a way out as a direction of three numbers, or a path of at least two motions (k, 4, 4) that starts "
        f"with the identity; got {how!r}."
    )


def straight(assembly: Assembly, parts: Sequence[str], direction: ArrayLike, others: Collection[str]) -> Array:
    """float64 (2, 4, 4): along `direction` until past the bounds of all `others`, and `CLEARANCE` on."""
    unit = np.asarray(direction, dtype=np.float64)
    unit = unit / np.linalg.norm(unit)
    mine = _extent(assembly, parts, unit)
    theirs = _extent(assembly, others, unit) if others else mine
    path = np.tile(np.eye(4), (2, 1, 1))
    path[1, :3, 3] = unit * (max(theirs[1] - mine[0], 0.0) + CLEARANCE * (mine[1] - mine[0]))
    return path


def free_direction(assembly: Assembly, parts: Sequence[str], others: Collection[str]) -> Array:
    """float64 (3,): of the assembly's axes, upward first, one along which no other stands in the way of `parts`.

    Where there is none: the one with the fewest in the way. Downward, into the table, only as a last resort.
    """
    graph = assembly.blocking()
    group, there = assembly.mask(parts), assembly.mask(others)
    in_way = [graph.group_blockers(group, d, there).bit_count() for d in range(len(graph.vectors))]
    best = min(range(len(in_way)), key=lambda d: (bool(graph.into_table[d]), in_way[d], d))
    return np.asarray(graph.vectors[best])


def pose_along(path: Array, share: float) -> Array:
    """float64 (4, 4): the motion at a share of a path, 0 to 1, at even pace along the way.

    Positions are interpolated straight, turns along the shortest arc.
    """
    steps = np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1)
    if not steps.any():
        steps = np.ones(len(path) - 1)  # it only turns
    # A turn on the spot in a path that also travels still takes some time.
    marks = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 0.02 * steps.sum()))])
    at = share * marks[-1]
    X = np.eye(4)
    X[:3, 3] = [np.interp(at, marks, path[:, i, 3]) for i in range(3)]
    X[:3, :3] = Slerp(marks, Rotation.from_matrix(path[:, :3, :3]))(at).as_matrix()
    return X


def _extent(assembly: Assembly, parts: Collection[str], unit: Array) -> tuple[float, float]:
    wanted = {assembly.index[name] for name in parts}
    spans = [assembly.body_vertices(i) @ unit for i, owner in enumerate(assembly.owners) if int(owner) in wanted]
    return min(float(s.min()) for s in spans), max(float(s.max()) for s in spans)
