"""A prior that needs no training: what lies outermost leaves first."""

import itertools
from collections.abc import Sequence

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.directions import Directions
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.language.problem import Problem
from neurosym.planning.order_scores import AT_A_TIME, OrderScores
from neurosym.planning.prior import Prior
from neurosym.support.bitsets import bits
from neurosym.support.deadline import portions


class OutermostFirst(Prior):
    """Peels an assembly like an onion: first the parts that nothing blocks, then those that only these blocked, ...

    Under gravity a layer has only parts with nothing above them, as long as there are such. Within a layer the topmost
    comes first, then the farthest from the middle; parts that never come free by themselves are last. Geometry alone,
    along the problem's directions: no pictures, and no question whether anything falls.

    `decay`: how many steps away from its place in this order a part is e times less likely (steps).
    """

    def __init__(self, *, decay: float = 2.0) -> None:
        if not decay > 0:
            raise InputError(f"Expected a decay above 0 steps; got {decay}.")
        self.decay = decay

    def scores(self, problems: Sequence[Problem]) -> list[OrderScores]:
        """One table a problem, (n_actions, n_actions).

        Raises InputError: the problem's world is no `Assembly`, or its actions are not named after parts.
        """
        return [self._scores(problem) for problem in problems]

    def _scores(self, problem: Problem) -> OrderScores:
        world, parts = parts_of_actions(problem, "outermost-first")
        details = problem.details
        order = outermost_order(world, details.get("directions"), gravity=details.get("gravity", True))
        rank = {world.index[name]: place for place, name in enumerate(order)}
        place = np.argsort(np.argsort([rank[n] for n in parts]))
        steps = np.arange(len(parts))
        table = np.empty((len(parts), len(parts)))
        for rows in portions(np.full(len(parts), len(parts)), AT_A_TIME):
            table[rows] = np.abs(np.subtract.outer(steps[rows], place)) / -self.decay
        return OrderScores(table, problem.actions, classes=problem.classes)


def outermost_order(
    given: Assembly | AssemblyGeometry, directions: Directions = None, *, gravity: bool = True
) -> list[str]:
    """Names of all parts, the outermost first, fixed ones last."""
    geometry = AssemblyGeometry.of(given)
    layers = outermost_layers(geometry, directions, gravity=gravity)
    order = [i for layer in layers for tied in layer for i in tied]
    return [geometry.names[i] for i in [*order, *bits(geometry.assembly.fixed_mask)]]


def outermost_layers(
    geometry: AssemblyGeometry, directions: Directions = None, *, gravity: bool = True
) -> list[list[list[int]]]:
    """Numbers of all parts that are not fixed, layer by layer, each in its order, those together that tie."""
    assembly, graph, up = geometry.assembly, geometry.blocking(directions), geometry.blocking("+z")
    fixed = assembly.fixed_mask
    left = (1 << len(assembly)) - 1 & ~fixed
    # In steps of the touching tolerance: heights that differ by rounding are equal.
    height = [round(high / assembly.touch) for high in assembly.part_bounds[:, 1, 2].tolist()]
    middle = assembly.bounds.mean(axis=0)
    own = (assembly.body_bounds[assembly.owners == i] for i in range(len(assembly)))
    distance = [float(np.linalg.norm(bounds.mean(axis=(0, 1)) - middle)) for bounds in own]
    layers: list[list[list[int]]] = []
    while left:
        free = [i for i in bits(left) if graph.free_directions(i, left | fixed)] or bits(left)
        topmost = [i for i in free if not up.blockers(i, 0, left | fixed)] if gravity else []
        layer = topmost or free
        layer.sort(key=lambda i: (-height[i], -distance[i], i))
        ties = itertools.groupby(layer, key=lambda i: (height[i], round(distance[i] / assembly.touch)))
        layers.append([list(tied) for _, tied in ties])
        left &= ~sum(1 << i for i in layer)
    return layers


def parts_of_actions(problem: Problem, prior: str) -> tuple[AssemblyGeometry, list[int]]:
    """What answers questions about a problem's assembly, and the number of the part that each action takes out.

    Raises InputError: its world is no `Assembly`, or its actions are not named after parts; `prior` is who asks.
    """
    world = problem.geometry
    removes = {} if problem.simulation is None else problem.simulation.removes
    names = [removes.get(action, action) for action in problem.actions]
    strange = [n for n in names if world is None or n not in world.index]
    if world is None or strange:
        raise InputError(
            "Expected a problem whose world is an Assembly and whose actions are named after its parts, for the prior "
            f"{prior}; {problem.name!r} has the action {strange[0]!r}."
        )
    return world, [world.index[n] for n in names]
