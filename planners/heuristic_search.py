"""Best-first search by a heuristic of the ground task and by what actions cost.

Both forms put an action to the oracle only when it is its turn. A* and weighted A* look at the state that it would lead
to; greedy search does not even do that, but takes the estimate of the state before ("lazy"), and takes in turn from two
queues, of all actions and of the helpful ones, the latter more often after progress (Richter and Westphal, "The LAMA
planner", JAIR 39, 2010).
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Any

from neurosym.language.search_problem import Rejection
from planners.assignment_heuristic import AssignmentHeuristic
from planners.heuristics import Heuristic
from planners.node import Node
from planners.search_context import SearchContext

#: So many more actions are taken from the queue of helpful ones after the estimate became smaller than ever.
BOOST = 1000

Search = Generator[int, None, "CostNode | None"]


@dataclass(slots=True, eq=False)
class CostNode(Node):
    path_cost: float = 0.0


class HeuristicSearch:
    """One search; `run` gives the node of the first plan, or None."""

    def __init__(self, context: SearchContext, heuristic: Heuristic, weight: float) -> None:
        """`weight`: of the heuristic beside the cost so far; infinite for greedy search."""
        self.context, self.heuristic, self.weight = context, heuristic, weight
        self.problem: Any = context.problem
        self.costs: Sequence[float] = getattr(self.problem, "costs", None) or (1.0,) * len(context.classes)
        self.pushed = 0

    def run(self) -> Search:
        """Search, an attempt at a time, after which it gives the depth."""
        root = CostNode(self.problem.initial, repeating=self.context.repeating)
        if self.problem.is_goal(root.state):
            return root
        return (yield from (self._greedy(root) if math.isinf(self.weight) else self._weighted(root)))

    def _attempt(self, node: CostNode, action: int) -> CostNode | None:
        """Where an action leads; None where it is refused, or known to be."""
        if not self.context.nogoods.allowed(node, (action,)):
            return None
        answer = self.context.attempt(node, action)
        if isinstance(answer, Rejection):
            self.context.learn(node, action, answer)
            return None
        child = node.child(action, answer)
        child.path_cost = node.path_cost + self.costs[action]
        return child

    def _weighted(self, root: CostNode) -> Search:
        estimates: dict[int, float] = {}
        cheapest: dict[Any, float] = {self.context.key(root): 0.0}
        queue: list[tuple[float, float, int, CostNode, int]] = []

        def expand(node: CostNode) -> None:
            for action in self.context.expand(node.state, node.used):
                state = self.problem.apply(node.state, action)
                if state not in estimates:
                    estimates[state] = self.heuristic(state).value
                to_go, so_far = estimates[state], node.path_cost + self.costs[action]
                known = cheapest.get(self._key(node, action, state))
                if not math.isinf(to_go) and (known is None or so_far < known):
                    self.pushed += 1
                    heapq.heappush(queue, (so_far + self.weight * to_go, to_go, -self.pushed, node, action))

        expand(root)
        while queue:
            _, _, _, node, action = heapq.heappop(queue)
            key = self._key(node, action, self.problem.apply(node.state, action))
            if key in cheapest and cheapest[key] <= node.path_cost + self.costs[action]:
                continue
            child = self._attempt(node, action)
            if child is not None:
                cheapest[key] = child.path_cost
                if self.problem.is_goal(child.state):
                    return child
                expand(child)
            yield node.depth
        return None

    def _key(self, node: CostNode, action: int, state: int) -> Any:
        return self.context.key_of(state, node.used | (1 << action & ~node.repeating))

    def _greedy(self, root: CostNode) -> Search:
        context = self.context
        scores = None if context.scores is None else AssignmentHeuristic(context.scores, context.rng)
        met = {context.key(root)}
        queues: tuple[list[tuple[float, int, CostNode, int]], ...] = ([], [])
        taken = [0, 0]
        nearest = math.inf

        def expand(node: CostNode) -> None:
            nonlocal nearest
            estimate = self.heuristic(node.state)
            if math.isinf(estimate.value):
                return
            if estimate.value < nearest:
                nearest = estimate.value
                taken[1] -= BOOST
            actions = context.expand(node.state, node.used)
            regret = _regrets(scores, node, actions)
            helpful = frozenset(estimate.helpful)
            for action in actions:
                self.pushed += 1
                entry = (estimate.value + regret.get(action, 0.0), self.pushed, node, action)
                heapq.heappush(queues[0], entry)
                if action in helpful:
                    heapq.heappush(queues[1], entry)

        expand(root)
        while queues[0] or queues[1]:
            which = 1 if queues[1] and (taken[1] <= taken[0] or not queues[0]) else 0
            taken[which] += 1
            _, _, node, action = heapq.heappop(queues[which])
            key = self._key(node, action, self.problem.apply(node.state, action))
            if key in met:
                continue
            child = self._attempt(node, action)
            if child is not None:
                met.add(key)
                if self.problem.is_goal(child.state):
                    return child
                expand(child)
            yield node.depth
        return None


def _regrets(scores: AssignmentHeuristic | None, node: CostNode, actions: list[int]) -> dict[int, float]:
    """How many nats the best completion that begins with each action costs more than the best of all."""
    if scores is None or not actions:
        return {}
    values = scores.assign(node.depth, node.used).values
    least = min(float(values[action]) for action in actions)
    return {action: float(values[action]) - least for action in actions}
