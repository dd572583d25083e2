"""Random trees by OMPL, spoken to in this place alone: between points of a box, and over rigid motions.

OMPL's own random numbers have one seed a process, set anew for each tree (generators made by OMPL afterwards, in
another's code, then follow from it, too). Trees end by a question of the caller's, not by the clock.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from neurosym.errors import MissingDependencyError
from neurosym.support.arrays import Array

T = TypeVar("T")


@dataclass(frozen=True)
class Growth:
    """How trees grow: by so much at once, motions checked so far apart, from which seed, and when it is time to end."""

    step: float
    resolution: float
    seed: int
    spent: Callable[[], bool]


def _ompl() -> tuple[Any, Any, Any]:
    """OMPL's modules; `MissingDependencyError` where it is not installed."""
    try:
        from ompl import base, geometric, util
    except ModuleNotFoundError as error:
        raise MissingDependencyError.of("OMPL", "looks for paths that are no straight line", "paths") from error
    return base, geometric, util


def connected(
    low: Array, high: Array, start: Array, goals: Sequence[Array], is_free: Callable[[Array], bool], growth: Growth
) -> list[Array] | None:
    """Points, float64 (n,) within bounds (n,), from `start` to one of `goals`, by RRTConnect; None: no way was met.

    Of several goals those that are not free are left out.
    """
    base, geometric, _ = _ompl()

    def point(state: Any) -> Array:
        return np.array([state[k] for k in range(len(low))])

    def state(at: Array) -> Any:
        allocated = space.allocState()
        for k, value in enumerate(at):
            allocated[k] = float(value)
        return allocated

    space, calls = base.RealVectorStateSpace(len(low)), _Calls()
    setup = _setup(space, low, high, calls.kept(lambda state: bool(is_free(point(state))), False), growth)
    if len(goals) == 1:
        setup.setStartAndGoalStates(state(start), state(goals[0]))
    else:
        setup.setStartState(state(start))
        # Python must hold the goal: OMPL keeps no reference that counts.
        goal = base.GoalStates(setup.getSpaceInformation())
        for free in filter(is_free, goals):
            goal.addState(state(free))
        if not goal.hasStates():
            return None
        setup.setGoal(goal)
    return [point(s) for s in _solved(setup, geometric.RRTConnect, growth, calls)] or None


def grown_out(
    low: Array, high: Array, is_free: Callable[[Array], bool], left: Callable[[Array], float], growth: Growth
) -> list[Array] | None:
    """Rigid motions, float64 (4, 4), from the identity until nothing is `left` to go, by RRT; None: no way was met.

    Their translations lie within bounds (3,).
    """
    base, geometric, _ = _ompl()
    calls = _Calls()
    distance = calls.kept(lambda state: left(_pose(state)), math.inf)

    class Out(base.GoalRegion):  # type: ignore[misc,name-defined]
        def distanceGoal(self, state: Any) -> float:
            return distance(state)

    space = base.SE3StateSpace()
    setup = _setup(space, low, high, calls.kept(lambda state: bool(is_free(_pose(state))), False), growth)
    start = space.allocState()
    start.setXYZ(0.0, 0.0, 0.0)
    start.rotation().setIdentity()
    setup.setStartState(start)
    goal = Out(setup.getSpaceInformation())
    goal.setThreshold(1e-9)
    setup.setGoal(goal)
    return [_pose(state) for state in _solved(setup, geometric.RRT, growth, calls)] or None


def _setup(space: Any, low: Array, high: Array, is_free: Callable[[Any], bool], growth: Growth) -> Any:
    base, geometric, util = _ompl()

    # OMPL logs to stdout, which belongs to the program that calls us.
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(growth.seed)
    bounds = base.RealVectorBounds(len(low))
    for k, ends in enumerate(zip(low, high)):
        bounds.setLow(k, float(ends[0]))
        bounds.setHigh(k, float(ends[1]))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    setup.setStateValidityChecker(is_free)  # a plain bool only
    share = growth.resolution / float(space.getMaximumExtent())
    setup.getSpaceInformation().setStateValidityCheckingResolution(share)
    return setup


class _Calls:
    """Functions that OMPL calls. What they raise, an interrupt too, may be lost in it: it is kept, and ends it."""

    def __init__(self) -> None:
        self.raised: BaseException | None = None

    def kept(self, function: Callable[..., T], otherwise: T) -> Callable[..., T]:
        """The function; its answer is `otherwise` from the first exception on."""

        def called(*given: Any) -> T:
            try:
                return function(*given) if self.raised is None else otherwise
            except BaseException as error:
                self.raised = error
                return otherwise

        return called


def _solved(setup: Any, planner: Callable[[Any], Any], growth: Growth, calls: _Calls) -> list[Any]:
    """States of an exact solution; none where there is none."""
    base, _, _ = _ompl()

    grower = planner(setup.getSpaceInformation())
    grower.setRange(growth.step)
    setup.setPlanner(grower)
    setup.solve(base.PlannerTerminationCondition(calls.kept(lambda: bool(growth.spent()), True)))
    if calls.raised is not None:
        raise calls.raised
    return list(setup.getSolutionPath().getStates()) if setup.haveExactSolutionPath() else []


def _pose(state: Any) -> Array:
    """From a place and a unit quaternion; scipy's rotation takes longer than the collision check that follows."""
    q = state.rotation()
    x, y, z, w = q.x, q.y, q.z, q.w
    X = np.eye(4)
    X[:3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), state.getX()],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), state.getY()],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), state.getZ()],
    ]
    return X


def ompl_works() -> str:
    """Plan a way round a wall in the plane with OMPL; returns one line about it, raises where it fails."""
    end = time.monotonic() + 5.0
    growth = Growth(0.3, 0.02, 1, lambda: time.monotonic() > end)

    def is_free(at: Array) -> bool:
        # A wall at x = 0.5 with a gap above y = 0.7.
        return bool(abs(at[0] - 0.5) > 0.05 or at[1] > 0.7)

    points = connected(np.zeros(2), np.ones(2), np.array([0.1, 0.1]), [np.array([0.9, 0.1])], is_free, growth)
    if points is None:
        raise RuntimeError("RRTConnect found no way round a wall in the plane within 5 s")
    if not all(map(is_free, points)):
        raise RuntimeError("RRTConnect answered with a path through the wall")
    return f"RRTConnect went round a wall in the plane in {len(points)} states"
