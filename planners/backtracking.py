"""Backtracking: depth first, complete, in the order of the best completion under the prior."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.language.search_problem import Rejection
from neurosym.planning.planner import PlannerTraits
from neurosym.planning.result import PlanResult, Status
from planners.assignment_heuristic import RESOLUTION, AssignmentHeuristic
from planners.node import Node
from planners.search_context import SearchContext
from planners.search_planner import SearchPlanner


class Backtracking(SearchPlanner):
    """Depth-first search that keeps the verified prefix, learns from every rejection, and leaves only dead states.

    With scores, the next action is the first of the cheapest completion (`planners.assignment_heuristic`) that is not
    known to be refused; a completion is kept for as long as the search keeps to it, so a good prior costs one
    assignment. Among equals, and without scores: what rejections named last, then the rng. A state with the set of
    used actions that was found dead is never entered again.
    """

    traits = PlannerTraits(complete=True)

    def search(self, context: SearchContext) -> PlanResult:
        goal = DepthFirst(context).run()
        return context.failed(Status.UNSOLVABLE) if goal is None else context.solved(goal)


@dataclass(slots=True, eq=False)
class _Node(Node):
    untried: list[int] = field(default_factory=list)
    values: NDArray[np.float64] | None = None  # what each next action costs in the end


class DepthFirst:
    """The search itself, for planners that begin with it."""

    def __init__(self, context: SearchContext) -> None:
        self.context = context
        heuristic = None if context.scores is None else AssignmentHeuristic(context.scores, context.rng)
        self.heuristic = None if heuristic is None or heuristic.indifferent else heuristic
        self.rank = context.rng.permutation(len(context.classes))  # the last tie-breaker

    def run(self) -> Node | None:
        """Where the first plan ends, or None."""
        context, is_goal = self.context, self.context.problem.is_goal
        root = _Node(context.problem.initial)
        if is_goal(root.state):
            return root
        dead: set[tuple[Any, int]] = set()
        root.untried = context.expand(root.state, root.used)
        node: _Node | None = root
        while node is not None:
            action = self._next_action(node)
            if action is None:
                dead.add((node.state, node.used))
                context.deviated = True
                node = node.parent
                continue
            answer = context.attempt(node, action)
            node.untried.remove(action)
            if isinstance(answer, Rejection):
                context.learn(node, action, answer)
                continue
            child = node.child(action, answer)
            if is_goal(child.state):
                return child
            if (child.state, child.used) not in dead:
                child.untried = context.expand(child.state, child.used)
                node = child
        return None

    def _next_action(self, node: _Node) -> int | None:
        """What to attempt at this node, or None when nothing is left."""
        options = self.context.nogoods.allowed(node, node.untried)
        if not options:
            return None
        if self.heuristic is None:
            return self._foremost(options)
        if node.completion and (completion := self.context.restated(node.completion, options)):
            node.completion = completion
            return completion[0]
        if node.values is None:
            self.context.deviated |= bool(node.completion)
            assignment = self.heuristic.assign(node.depth, node.used)
            node.values, node.completion = assignment.values, assignment.completion
        least = min(node.values[a] for a in options)
        return self._foremost([a for a in options if node.values[a] <= least + RESOLUTION])

    def _foremost(self, options: list[int]) -> int:
        """Among equals: what rejections named last, then the rng's order."""
        preferred = self.context.preferred.first_of(options)
        return min(options, key=lambda a: int(self.rank[a])) if preferred is None else preferred
