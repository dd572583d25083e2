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

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.rigid_motions import Interpolation as Between
from neurosym.geometry.step_motion import Way

if TYPE_CHECKING:
    from neurosym.language.problem import Problem

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
            is at ``path[i] @ X_WP`` on its way out. Between two of them `centre` goes straight and the turn is even.
        arrives: whether the parts come in along the path, from its end, instead of leaving.
        given: whether the plan said how; otherwise a way was looked for here.
        centre: float64 (3,): a point of the resting parts, in the world.
        aside: groups of parts that move otherwise meanwhile, each with its own path of k motions and its own centre.
            Those not in `parts` make way, and are back in place afterwards.
        held: names of parts that are held meanwhile.
    """

    action: str
    parts: tuple[str, ...]
    path: Array
    arrives: bool = False
    given: bool = True
    centre: Array = field(default_factory=lambda: np.zeros(3))
    aside: tuple[tuple[tuple[str, ...], Array, Array], ...] = ()
    held: tuple[str, ...] = ()

    @property
    def length(self) -> float:
        """How far the parts' centre travels, in the assembly's unit; turning counts nothing."""
        return float(_legs(self.path, self.centre).sum())

    def at(self, share: float) -> Array:
        """float64 (4, 4): the motion of the world when `share` of the step is done, 0 to 1, at even pace."""
        share = min(max(share, 0.0), 1.0)
        return pose_along(self.path, 1 - share if self.arrives else share, self.centre)

    def where(self, share: float) -> dict[str, Array]:
        """The same for every part that moves, those that make way among them: name -> float64 (4, 4)."""
        moved = dict.fromkeys(self.parts, self.at(share))
        share = min(max(1 - share if self.arrives else share, 0.0), 1.0)
        key = _key(self.path, share, self.centre)
        for names, path, centre in self.aside:
            moved |= dict.fromkeys(names, _at_key(path, key, centre))
        return moved


@dataclass(frozen=True, eq=False)
class Staging:
    """A plan in space.

    Attributes:
        assembly: all parts that ever appear, where they rest when assembled.
        present: names of those that are there before the first step.
        motions: one a step.
        colours: part name -> RGB in 0..1, for parts with a colour of their own.
        tops: part name -> what lies on its top, uint8 (H, W, 3), for parts that bear a picture.
    """

    assembly: Assembly
    present: tuple[str, ...]
    motions: tuple[Motion, ...]
    colours: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    tops: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = set(self.assembly.names)
        moving = (n for m in self.motions for names in (m.parts, *(group[0] for group in m.aside)) for n in names)
        for name in (*self.present, *self.colours, *self.tops, *moving):
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

    The problem says itself what its actions do to parts (`Semantics.staging`), or a step's `Way` does, or the problem's
    `Simulation`; failing these, the effects do: an action takes away the parts about which it only deletes atoms, and
    brings those about which it only adds some.

    Args:
        problem: what was planned.
        plan: names of actions, in order.
        how: one entry a step, or none at all, as `PlanResult.how` has them: a `Way`, a direction (3,), a path of
            poses (k, 4, 4), or None, for which a free straight way is looked for.

    Raises:
        InputError: the problem does not say what its actions do to parts, or `how` does not fit the plan.
        UnknownNameError: a name in the plan that is no action.
    """
    if len(how) not in (0, len(plan)):
        raise InputError(f"Expected one `how` a step, {len(plan)}, or none; got {len(how)}.")
    for name in plan:
        if name not in problem.actions:
            raise UnknownNameError("action", name, problem.actions)
    staging = problem.semantics.staging(problem, plan, how)
    if staging is not None:
        return staging
    world = problem.world
    simulation = problem.simulation
    if simulation is None and isinstance(world, Assembly):
        return _by_effects(problem, world, plan, how)
    removes = {} if simulation is None else simulation.removes
    parts = [_parts_of(how[i] if how else None, name, removes) for i, name in enumerate(plan)]
    if not isinstance(world, Assembly) or not all(parts):
        raise _unclear(problem)
    # A plan that puts together begins with what it does not bring.
    arriving = {n for i, names in enumerate(parts) if _arrives(how[i] if how else None) for n in names}
    absent = arriving.union(() if simulation is None else simulation.absent)
    present = tuple(n for n in world.names if n not in absent)
    return Staging(world, present, steps_in_space(world, present, plan, parts, how))


def _unclear(problem: Problem) -> InputError:
    return InputError(
        f"Expected a problem that says what its actions do to parts in space; {problem.name!r} does not. Give "
        "Domain.problem a world that is an Assembly and simulation=Simulation('rigid', removes={action: part}), or "
        "semantics= with a method staging."
    )


def _by_effects(problem: Problem, world: Assembly, plan: Sequence[str], how: Sequence[Any]) -> Staging:
    """The staging of a problem that says nothing of space but what its actions add and delete."""
    leaves, comes, absent = {}, {}, set()
    for action in problem.domain.actions:
        for binding in problem.bindings(action):
            effects = [e.bind(binding) for e in action.eff]
            gone = {n for e in effects if not e.positive for n in e.atom.args}
            come = {n for e in effects if e.positive for n in e.atom.args}
            name = action.ground_name(binding)
            leaves[name] = tuple(n for n in world.names if n in gone - come)
            comes[name] = tuple(n for n in world.names if n in come - gone)
            lacking = {n for e in effects if not e.positive and e.atom not in problem.init for n in e.atom.args}
            absent |= lacking.intersection(leaves[name])
    parts, ways = [], []
    for i, name in enumerate(plan):
        given = how[i] if how else None
        moving = _parts_of(given, name, {}) or leaves[name] or comes[name]
        if not moving:
            raise _unclear(problem)
        if not leaves[name] and not isinstance(given, Way):
            out = None if given is None else np.negative(np.asarray(given, dtype=np.float64)).tolist()
            given = Way(moving, out, arrives=True)
        absent |= set(moving) if _arrives(given) else set()
        parts.append(moving)
        ways.append(given)
    present = tuple(n for n in world.names if n not in absent)
    return Staging(world, present, steps_in_space(world, present, plan, parts, ways))


def steps_in_space(
    assembly: Assembly,
    present: Sequence[str],
    plan: Sequence[str],
    parts: Sequence[Sequence[str]],
    how: Sequence[Any] = (),
) -> tuple[Motion, ...]:
    """Motions of a plan that takes parts away, or brings them.

    Args:
        present: names of the parts that are there at first.
        plan: names of the actions.
        parts: for each step, the parts that go together.
        how: for each step a `Way`, a direction (3,), a path (k, 4, 4), or None; or nothing at all.
    """
    there, motions = set(present), []
    for i, (action, names) in enumerate(zip(plan, parts, strict=True)):
        given = how[i] if how else None
        others = there - set(names)
        motions.append(_motion(assembly, action, tuple(names), given, others))
        there = others | set(names) if motions[-1].arrives else others
    return tuple(motions)


def _motion(assembly: Assembly, action: str, names: tuple[str, ...], how: Any, others: Collection[str]) -> Motion:
    centre, arrives = _middle(assembly, names), _arrives(how)
    if how is None:
        direction = free_direction(assembly, names, others)
        return Motion(action, names, straight(assembly, names, direction, others), given=False, centre=centre)
    if not isinstance(how, Way):
        return Motion(action, names, path_of(assembly, names, how, others), centre=centre)
    if how.path is None:
        if how.direction is None:
            direction = free_direction(assembly, names, others)
        else:
            direction = np.negative(how.direction) if arrives else np.asarray(how.direction)
        path = straight(assembly, names, direction, others)
        return Motion(action, names, path, arrives, how.direction is not None, centre, held=how.held)
    # Backwards it ends where it is assembled; here every path begins there.
    first, *rest = (how.path.reversed() if arrives else how.path).tracks
    aside = tuple((track.parts, track.poses, track.centre) for track in rest)
    return Motion(action, names, first.poses, arrives, True, first.centre, aside, how.held)


def _parts_of(how: Any, action: str, removes: Mapping[str, str]) -> tuple[str, ...]:
    if isinstance(how, Way) and how.parts:
        return how.parts
    return (removes[action],) if action in removes else ()


def _arrives(how: Any) -> bool:
    return isinstance(how, Way) and how.arrives


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


def pose_along(path: Array, share: float, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """float64 (4, 4): the motion at a share of a path, 0 to 1, at even pace along the way.

    Between two motions the point that rests at `centre` goes straight, and the turn takes the shortest arc.
    """
    where = np.asarray(centre, dtype=np.float64)
    return _at_key(path, _key(path, share, where), where)


def _legs(path: Array, centre: Array) -> Array:
    """float64 (k - 1,): how far the centre goes from each motion to the next."""
    return np.asarray(np.linalg.norm(np.diff(path[:, :3, :3] @ centre + path[:, :3, 3], axis=0), axis=1))


def _key(path: Array, share: float, centre: Array) -> float:
    """The number of the motion, whole or between two, at a share of the way."""
    legs = _legs(path, centre)
    # A turn on the spot takes some time too.
    marks = np.concatenate([[0.0], np.cumsum(np.maximum(legs, max(0.02 * float(legs.sum()), 1e-12)))])
    return float(np.interp(share * marks[-1], marks, np.arange(len(marks))))


def _at_key(path: Array, key: float, centre: Array) -> Array:
    first = min(int(key), len(path) - 2)
    return Between(path[first], path[first + 1], centre).at(key - first)


def _middle(assembly: Assembly, parts: Collection[str]) -> Array:
    wanted = {assembly.index[name] for name in parts}
    own = [i for i, owner in enumerate(assembly.owners) if int(owner) in wanted]
    bounds = assembly.body_bounds[own]
    return np.asarray((bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0)) / 2)


def _extent(assembly: Assembly, parts: Collection[str], unit: Array) -> tuple[float, float]:
    wanted = {assembly.index[name] for name in parts}
    spans = [assembly.body_vertices(i) @ unit for i, owner in enumerate(assembly.owners) if int(owner) in wanted]
    return min(float(s.min()) for s in spans), max(float(s.max()) for s in spans)
