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

from collections.abc import Sequence
from contextlib import ExitStack

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.staging import Staging
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.problem import Problem
from neurosym.planning.staging import stage
from neurosym.simulation.carrying import Carrier, hold
from neurosym.simulation.oracle import COLLAPSE_CUBES, CUBES_CLEARANCE
from neurosym.simulation.physics import MOVED_SHARE, SETTLE_STEPS, Physics, Snapshot
from neurosym.simulation.replay_report import ReplayReport, StepReplay, in_hand, reason_of
from neurosym.simulation.solids import BodiesKind
from neurosym.simulation.window import WorldWindow
from neurosym.simulation.world import World
from neurosym.support.words import listed

#: A pulled part that ends farther than this from its path's end, in typical bodies, was jammed.
JAMMED_SHARE = 0.5
#: Bodies that overlap by more before anything moves, in typical bodies, are not those of the assembly.
PRESSED_SHARE = 0.01


def replay_plan(
    problem: Problem,
    plan: Sequence[str],
    motions: Sequence[StepMotion | None] = (),
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
        motions: one a step, as `PlanResult.motions` has them, or none; then a free straight line is looked for.
        pulled: whether parts are pulled along their path by a grip, against friction, instead of by hand.
        bodies: ``"rigid"``: every part is one body; ``"cubes"``: every body of a part is independent, a part is
            deleted rather than moved, and one body may fall alone (the paper's rule); None: as the problem's
            `Simulation` says, rigid if it says nothing.
        friction: coefficient between any two bodies, and the table; None takes the assembly's.
        threshold: a part has moved when a corner of it did by more, in the assembly's length unit; None means
            `MOVED_SHARE` of a typical body.
        stop_at_failure: leave out the steps after the first that fails.
        window: show it in PyBullet's own window, in real time; whoever looks may close it, which ends nothing else.

    A problem that was planned without gravity is replayed without.

    Raises:
        InputError: a plan, a motion or an assembly that cannot be simulated.
        NeurosymError: no screen for the window, or no OpenGL.
    """
    rule = bodies or (problem.simulation.bodies if problem.simulation is not None else "rigid")
    physics = Physics(
        friction=friction,
        gravity=9.81 if problem.details.get("gravity", True) else 0.0,
        clearance=CUBES_CLEARANCE if rule == "cubes" else 0.0,
    )
    return replay_staging(
        stage(problem, plan, motions),
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

    `physics`: friction, gravity and the solver's numbers; None takes the assembly's friction.
    """
    with ExitStack() as stack:
        kind: BodiesKind = "cubes" if bodies == "cubes" else "parts"
        made = World(staging.assembly, bodies=kind, physics=physics, present=staging.present, meshes="decompose")
        world = stack.enter_context(made)
        shown = stack.enter_context(WorldWindow(world, staging)) if window else None
        run = _Run(world, staging, bodies == "cubes", pulled, threshold, shown)
        if kind == "parts":
            _check_rest(world)
        start = run.start()
        steps: list[StepReplay] = []
        for step in range(len(staging.motions)):
            if stop_at_failure and not (steps[-1] if steps else start).stood_still:
                break
            steps.append(run.step(step))
        return ReplayReport(
            start,
            tuple(steps),
            run.threshold,
            run.smallest,
            bodies,
            pulled,
            unit=staging.assembly.units,
            gravity=world.physics.gravity > 0,
            friction=staging.assembly.friction if world.physics.friction is None else world.physics.friction,
        )


def _check_rest(world: World) -> None:
    """Refuse a scene whose bodies overlap before anything moves: it would fly apart, and say nothing of the parts."""
    depths = {pair: deep for pair, deep in world.pressed().items() if deep > PRESSED_SHARE * world.unit}
    if not depths:
        return
    unit = f" {world.assembly.units}" if world.assembly.units else ""
    deepest = sorted(depths, key=lambda pair: -depths[pair])
    pressed = listed([f"{a} and {b} by {depths[a, b]:.3g}{unit}" for a, b in deepest])
    raise AssemblyError(
        f"Expected parts that do not overlap in the simulator; there {pressed} do, before anything moves, so it has no "
        "verdict. Meshes with curved hollows are only approximated there: give such a part as several convex bodies, "
        "fix it (a fixed part collides as the mesh it is), or mend an overlap that the model has."
    )


class _Run:
    """One replay under way."""

    def __init__(
        self,
        world: World,
        staging: Staging,
        cubes: bool,
        pulled: bool,
        threshold: float | None,
        window: WorldWindow | None,
    ) -> None:
        self.world, self.cubes, self.pulled, self.window = world, cubes, pulled and not cubes, window
        self.threshold = MOVED_SHARE * world.unit if threshold is None else threshold
        #: The smallest extent of any part along the world's axes, in the assembly's length unit.
        self.smallest = float(np.ptp(staging.assembly.part_bounds, axis=1).min())
        self._staging = staging

    def start(self) -> StepReplay:
        """Let everything settle before the first step."""
        before = self.world.poses()
        self.world.settle(watch=self._show)
        return self._judged("(start)", StepMotion(), before, ())

    def step(self, number: int) -> StepReplay:
        """Do one step, and let the rest settle."""
        world, action, motion = self.world, self._staging.plan[number], self._staging.motions[number]
        there = {part for part, _ in world.there}
        if not motion.parts:
            before = world.poses()
            world.settle(watch=self._show)
            return self._judged(action, motion, before, ())
        if motion.arrives:
            later = self._staging.motions[number + 1 :]
            if any(other.arrives and set(motion.parts) & set(other.parts) for other in later):
                return in_hand(action, motion, "will arrive later, with others: put together in the hand.")
            world.add(*(name for name in motion.parts if name not in there))
        elif not there & set(motion.parts):
            # A sub-assembly that left as a whole is taken apart where nothing rests on it.
            return in_hand(action, motion, "left before, with others: taken from them in the hand.")
        before = world.poses()
        with ExitStack() as stack:
            if motion.held:
                stack.enter_context(hold(world, motion.held))
            carrier = Carrier(world, motion)
            blocked = self._pull(carrier) if self.pulled else self._by_hand(carrier)
        return self._judged(action, motion, before, blocked)

    def _pull(self, carrier: Carrier) -> tuple[str, ...]:
        motion = carrier.motion
        behind = carrier.pull(self._show)
        if not motion.arrives:
            self.world.remove(*motion.parts)
        self.world.settle(watch=self._show)
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
            self.world.settle(watch=self._show)
        else:
            self.world.remove(*motion.parts)
            if self.cubes:
                self.world.settle(2 * SETTLE_STEPS, until_rest=True, watch=self._show)
        return blocked

    def _show(self) -> None:
        if self.window is not None:
            self.window.tick()

    def _judged(self, action: str, motion: StepMotion, before: Snapshot, blocked: tuple[str, ...]) -> StepReplay:
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
        reason = reason_of(motion, moved, blocked, distance, share, farthest)
        if moved and stood:
            reason += " One cube alone may fall, by this rule."
        judged = (distance, share, farthest, moved, blocked, stood, reason)
        return StepReplay(action, motion.parts, motion.arrives, *judged, motion.held)
