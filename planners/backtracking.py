"""Backtracking: depth first, complete, in the order of the best completion under the prior."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.language.search_problem import Rejection
from neurosym.planning.planner import PlannerTraits
from neurosym.planning.result import Status
from planners.assignment_heuristic import RESOLUTION, AssignmentHeuristic
from planners.node import Node
from planners.search_context import SearchContext
from planners.search_planner import Steps, TwoSidedSearchPlanner


class Backtracking(TwoSidedSearchPlanner):
    """Depth-first search that keeps the verified prefix, learns from every rejection, and leaves only dead states.

    With scores, the next action is the first of the cheapest completion (`planners.assignment_heuristic`) that is not
    known to be refused; a completion is kept for as long as the search keeps to it, so a good prior costs one
    assignment. Among equals, and without scores: what rejections named last, then the rng. A state with the set of
    used actions that was entered is never entered again: it is dead, or lies on the path.
    """

    traits = PlannerTraits(complete=True, either_side=True)

    def steps(self, context: SearchContext) -> Steps:
        goal = yield from DepthFirst(context).run()
        if goal is None:
            return context.failed(Status.UNSOLVABLE)
        return context.solved(goal) if context.problem.is_goal(goal.state) else context.met(goal)


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
        self.entered: set[tuple[Any, int]] = set()  # left again, and so dead, or on the path to where it is
        self.rank = context.rng.permutation(len(context.classes))  # the last tie-breaker

    def run(self) -> Generator[int, None, Node | None]:
        """Where the first plan ends, or meets the search from the other side, or None; an attempt at a time."""
        context, is_goal = self.context, self.context.problem.is_goal
        root = _Node(context.problem.initial, repeating=context.repeating)
        if is_goal(root.state):
            return root
        self._enter(root)
        node: _Node | None = root
        while node is not None:
            action = self._next_action(node)
            if action is None:
                context.deviated = True
                context.path.pop(node.state, None)
                node = node.parent
                continue
            answer = context.attempt(node, action)
            node.untried.remove(action)
            if isinstance(answer, Rejection):
                context.learn(node, action, answer)
            else:
                child = node.child(action, answer)
                if is_goal(child.state) or context.meets(child):
                    return child
                if context.key(child) not in self.entered:
                    self._enter(child)
                    node = child
            yield node.depth
        return None

    def _enter(self, node: _Node) -> None:
        context = self.context
        self.entered.add(context.key(node))
        node.untried = context.nogoods.allowed(node, context.expand(node.state, node.used))
        context.path[node.state] = node

    def _next_action(self, node: _Node) -> int | None:
        """What to attempt at this node, or None when nothing is left."""
        while (action := self._foremost_untried(node)) is not None:
            # What was learned below since this node was entered may refuse it by now.
            if self._worth_asking(node, action):
                return action
            node.untried.remove(action)
        return None

    def _worth_asking(self, node: _Node, action: int) -> bool:
        if not self.context.nogoods.allowed(node, (action,)):
            return False
        # From the full side what leads to a dead state is asked for even so: its rejections are what is counted.
        after = getattr(self.context.problem, "apply", None) if self.context.from_goal else None
        if after is None:
            return True
        return self.context.key(_Node(after(node.state, action), node.used | 1 << action)) not in self.entered

    def _foremost_untried(self, node: _Node) -> int | None:
        options = node.untried
        if not options:
            return None
        if self.heuristic is None:
            return self._foremost(options)
        if node.completion and (completion := self.context.restated(node.completion, options)):
            node.completion = completion
            return completion[0]
        if node.values is None:
            self.context.deviated |= bool(node.completion)
            if self.context.from_goal and self.context.scores is not None:
                # From there most states are dead ends, and an assignment for each would cost more than all questions.
                node.values = self.context.scores.costs[node.depth]
            else:
                assignment = self.heuristic.assign(node.depth, node.used)
                node.values, node.completion = assignment.values, assignment.completion
        least = min(node.values[a] for a in options)
        return self._foremost([a for a in options if node.values[a] <= least + RESOLUTION])

    def _foremost(self, options: list[int]) -> int:
        """Among equals: what rejections named last, then the rng's order."""
        preferred = self.context.preferred.first_of(options)
        return min(options, key=lambda a: int(self.rank[a])) if preferred is None else preferred
