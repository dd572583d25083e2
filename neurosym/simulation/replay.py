"""A plan replayed in PyBullet: what moves goes along its path, and what stays should stand still.

Parts are rigid, under gravity, on the table, and the scene is scaled until a typical body measures one unit (see
`neurosym.simulation.world`). Two ways to take a part along its path:

* by hand (the default): first the way is looked along for parts that it would cut into, where they lie now; then the
  part goes, and the others do not feel it. This asks what `validate` asks: is the way free, does the rest stand?
* pulled: a grip drags the part along the path against friction and whatever it meets. What lies on a part that is
  pulled out sideways comes along, as it would on a real table; geometry alone does not say so.

What simulates well: boxes, convex bodies, and meshes with few inner edges, which are cut into convex pieces exactly. A
mesh with a curved hollow is taken apart by V-HACD, approximately (see `neurosym.simulation.decomposition`); a fixed
part collides exactly as it is.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from neurosym.motions import Motion, Staging, stage
from neurosym.simulation.carrying import Carrier, hold
from neurosym.simulation.oracle import COLLAPSE_CUBES, CUBES_CLEARANCE
from neurosym.simulation.scene import part_colours
from neurosym.simulation.world import MOVED_SHARE, SETTLE_STEPS, Physics, Snapshot, World
from neurosym.words import joined

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly
    from neurosym.language.domain import Problem

#: A pulled part that ends farther than this from its path's end, in typical bodies, was jammed.
JAMMED_SHARE = 0.5


@dataclass(frozen=True)
class StepReplay:
    """What one step did to the parts that stay.

    Attributes:
        action: name of the action.
        parts: names of the parts that went, or came.
        arrives: whether they came.
        displacement: how far the farthest-moved corner of any part that stays went, in the assembly's length unit.
        share: the same, as a share of the smallest part (the smallest extent of any part).
        farthest: name of the part it belongs to; None when no part stays.
        moved: the parts that moved by more than the threshold, with how far.
        in_the_way: names of the parts that the path cuts into; of the moving parts themselves, where they were jammed.
        stood_still: whether nothing was in the way and the rest stood still.
        reason: one sentence.
    """

    action: str
    parts: tuple[str, ...]
    arrives: bool
    displacement: float
    share: float
    farthest: str | None
    moved: Mapping[str, float]
    in_the_way: tuple[str, ...]
    stood_still: bool
    reason: str


@dataclass(frozen=True)
class ReplayReport:
    """What a replay found. Truthy exactly when every step left the rest standing still.

    Attributes:
        start: displacements before the first step, of an assembly that stands by itself next to nothing.
        steps: one a step of the plan, or up to the first failure where it was to stop there.
        threshold: the displacement above which a part has moved, in the assembly's length unit.
        smallest: the smallest extent of any part, same unit.
        bodies: ``"rigid"`` or ``"cubes"``, see `replay_plan`.
        pulled: whether parts were pulled along.
    """

    start: StepReplay
    steps: tuple[StepReplay, ...]
    threshold: float
    smallest: float
    bodies: str
    pulled: bool

    @property
    def failed_at(self) -> int | None:
        """Number of the first step (from 0) that did not leave the rest standing still; -1: it never stood; or None."""
        if not self.start.stood_still:
            return -1
        return next((i for i, step in enumerate(self.steps) if not step.stood_still), None)

    @property
    def ok(self) -> bool:
        return self.failed_at is None

    def __bool__(self) -> bool:
        return self.ok

    def as_json(self) -> dict[str, Any]:
        """Plain data, for a file."""
        return {
            "ok": self.ok,
            "failed_at": self.failed_at,
            "threshold": self.threshold,
            "smallest_part": self.smallest,
            "bodies": self.bodies,
            "pulled": self.pulled,
            "start": _step_json(self.start),
            "steps": [_step_json(step) for step in self.steps],
        }


def _step_json(step: StepReplay) -> dict[str, Any]:
    return {**vars(step), "parts": list(step.parts), "moved": dict(step.moved), "in_the_way": list(step.in_the_way)}


def replay_plan(
    problem: Problem,
    plan: Sequence[str],
    how: Sequence[Any] = (),
    *,
    pulled: bool = False,
    bodies: str | None = None,
    friction: float | None = None,
    threshold: float | None = None,
    stop_at_failure: bool = False,
    window: bool = False,
) -> ReplayReport:
    """Replay a plan in PyBullet.

    Args:
        problem: what was planned.
        plan: names of actions, in order.
        how: one entry a step, as `PlanResult.how` has them, or nothing; then a free straight way is looked for.
        pulled: whether parts are pulled along their path by a grip, against friction, instead of by hand.
        bodies: ``"rigid"``: every part is one body; ``"cubes"``: every body of a part is independent, a part is
            deleted rather than moved, and one body may fall alone (the paper's rule); None: as the problem's
            `Simulation` says, rigid if it says nothing.
        friction: coefficient between any two bodies, and the table; None takes the assembly's.
        threshold: a part has moved when a corner of it did by more, in the assembly's length unit; None means
            `MOVED_SHARE` of a typical body.
        stop_at_failure: leave out the steps after the first that fails.
        window: show it in PyBullet's own window, in real time.

    A problem that was planned without gravity is replayed without.

    Raises:
        InputError: a plan, a `how` or an assembly that cannot be simulated.
        NeurosymError: no screen for the window.
    """
    rule = bodies or (problem.simulation.bodies if problem.simulation is not None else "rigid")
    physics = Physics(
        friction=friction,
        gravity=9.81 if problem.details.get("gravity", True) else 0.0,
        clearance=CUBES_CLEARANCE if rule == "cubes" else 0.0,
    )
    return replay_staging(
        stage(problem, plan, how),
        pulled=pulled,
        bodies=rule,
        physics=physics,
        threshold=threshold,
        stop_at_failure=stop_at_failure,
        window=window,
    )


def replay_staging(
    staging: Staging,
    *,
    pulled: bool = False,
    bodies: str = "rigid",
    physics: Physics | None = None,
    threshold: float | None = None,
    stop_at_failure: bool = False,
    window: bool = False,
) -> ReplayReport:
    """The same for a plan that is given in space.

    Args:
        physics: friction, gravity and the solver's numbers; None takes the assembly's friction.

    The others are those of `replay_plan`.
    """
    with World(
        staging.assembly,
        bodies="cubes" if bodies == "cubes" else "parts",
        physics=physics,
        present=staging.present,
        meshes="decompose",
        window=window,
    ) as world:
        run = _Run(world, staging, bodies == "cubes", pulled, threshold, window)
        start = run.start()
        steps: list[StepReplay] = []
        for motion in staging.motions:
            if stop_at_failure and not (steps[-1] if steps else start).stood_still:
                break
            steps.append(run.step(motion))
        return ReplayReport(start, tuple(steps), run.threshold, run.smallest, bodies, pulled)


class _Run:
    """One replay under way."""

    def __init__(
        self, world: World, staging: Staging, cubes: bool, pulled: bool, threshold: float | None, window: bool
    ) -> None:
        self.world, self.cubes, self.pulled, self.window = world, cubes, pulled and not cubes, window
        self.threshold = MOVED_SHARE * world.unit if threshold is None else threshold
        self.smallest = smallest_part(staging.assembly)
        self._colours = part_colours(staging)
        self._paint()

    def start(self) -> StepReplay:
        """Let everything settle before the first step."""
        before = self.world.poses()
        self._settle()
        return self._judged(Motion("(start)", (), np.tile(np.eye(4), (2, 1, 1))), before, ())

    def step(self, motion: Motion) -> StepReplay:
        """Do one step, and let the rest settle."""
        world = self.world
        there = {part for part, _ in world.bodies}
        if motion.arrives:
            world.add(*(name for name in motion.parts if name not in there))
            self._paint()
        elif not there & set(motion.parts):
            # A sub-assembly that left as a whole is taken apart where nothing rests on it.
            said = f"{joined(motion.parts)} left before, with others: taken from them in the hand."
            return StepReplay(motion.action, motion.parts, False, 0.0, 0.0, None, {}, (), True, said)
        before = world.poses()
        with ExitStack() as stack:
            if motion.held:
                stack.enter_context(hold(world, motion.held))
            carrier = Carrier(world, motion)
            blocked = self._pull(carrier) if self.pulled else self._by_hand(carrier)
        return self._judged(motion, before, blocked)

    def _pull(self, carrier: Carrier) -> tuple[str, ...]:
        motion = carrier.motion
        behind = carrier.pull(self._show)
        if not motion.arrives:
            self.world.remove(*motion.parts)
        self._settle()
        return motion.parts if behind > JAMMED_SHARE * self.world.unit else ()

    def _by_hand(self, carrier: Carrier) -> tuple[str, ...]:
        motion = carrier.motion
        # Cubes of the paper's rule are deleted; they need no way.
        blocked = () if self.cubes else carrier.in_the_way()
        carrier.collide(False)
        for i in range(1, SETTLE_STEPS + 1):
            carrier.put(1 - i / SETTLE_STEPS if motion.arrives else i / SETTLE_STEPS)
            self.world.step()
            self._show()
        carrier.put(0.0)
        carrier.collide(True)
        if motion.arrives:
            self._settle()
        else:
            self.world.remove(*motion.parts)
            if self.cubes:
                self.world.settle(2 * SETTLE_STEPS, until_rest=True)
        return blocked

    def _settle(self) -> None:
        for _ in range(SETTLE_STEPS):
            self.world.step()
            self._show()

    def _show(self) -> None:
        if self.window:
            time.sleep(self.world.physics.time_step)

    def _paint(self) -> None:
        if self.window:
            for part, colour in self._colours.items():
                self.world.paint(part, colour)

    def _judged(self, motion: Motion, before: Snapshot, blocked: tuple[str, ...]) -> StepReplay:
        """What moved since `before`; what has arrived is to stand too."""
        moved_bodies: dict[str, list[float]] = {}
        for (part, _), far in self.world.displacement(before).items():
            moved_bodies.setdefault(part, []).append(far)
        farthest = max(moved_bodies, key=lambda part: max(moved_bodies[part]), default=None)
        distance = 0.0 if farthest is None else max(moved_bodies[farthest])
        moved = {part: max(far) for part, far in moved_bodies.items() if max(far) > self.threshold}
        count = sum(d > self.threshold for far in moved_bodies.values() for d in far)
        stood = not blocked and count <= (COLLAPSE_CUBES if self.cubes else 0)
        share = distance / self.smallest
        reason = _reason(motion, moved, blocked, distance, share, farthest)
        if moved and stood:
            reason += " One cube alone may fall, by this rule."
        return StepReplay(
            motion.action, motion.parts, motion.arrives, distance, share, farthest, moved, blocked, stood, reason
        )


def _reason(
    motion: Motion,
    moved: Mapping[str, float],
    blocked: tuple[str, ...],
    distance: float,
    share: float,
    farthest: str | None,
) -> str:
    said = []
    if blocked and set(blocked) == set(motion.parts):
        said.append(f"{joined(blocked)} jammed on the way.")
    elif blocked:
        said.append(f"{joined(blocked)} {'is' if len(blocked) == 1 else 'are'} in the way of {joined(motion.parts)}.")
    if moved:
        said.append("Moved: " + joined([f"{part} by {far:.3g}" for part, far in moved.items()]) + ".")
    elif farthest is None:
        said.append("Nothing is left.")
    elif not said:
        said.append(f"The rest stood still; {farthest} moved by {distance:.2g}, {share:.2%} of the smallest part.")
    return " ".join(said)


def smallest_part(assembly: Assembly) -> float:
    """The smallest extent of any part along the world's axes, in the assembly's length unit."""
    found = []
    for number in range(len(assembly)):
        bounds = assembly.body_bounds[assembly.owners == number]
        found.append(float((bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).min()))
    return min(found)
