"""The only door to OMPL, which plans free-form paths for parts that no straight line takes out."""

from __future__ import annotations


def ompl_works() -> str:
    """Plan a way round a wall in the plane with OMPL; returns one line about it, raises where it fails."""
    from ompl import base, geometric, util

    # OMPL logs to stdout, which belongs to the program that calls us.
    util.setLogLevel(util.LogLevel.LOG_NONE)
    space = base.RealVectorStateSpace(2)
    bounds = base.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(1.0)
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)

    def free(state: base.State) -> bool:
        # A wall at x = 0.5 with a gap above y = 0.7.
        return bool(abs(state[0] - 0.5) > 0.05 or state[1] > 0.7)

    setup.setStateValidityChecker(free)
    start, goal = space.allocState(), space.allocState()
    start[0], start[1], goal[0], goal[1] = 0.1, 0.1, 0.9, 0.1
    setup.setStartAndGoalStates(start, goal)
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    if not setup.solve(5.0):
        raise RuntimeError("RRTConnect found no way round a wall in the plane within 5 s")
    states = setup.getSolutionPath().getStates()
    if not all(free(state) for state in states):
        raise RuntimeError("RRTConnect answered with a path through the wall")
    return f"RRTConnect went round a wall in the plane in {len(states)} states"
