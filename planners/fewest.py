"""Fewest actions: a plan soon, then shorter ones, until none can be shorter or the effort is spent."""

from __future__ import annotations

import heapq
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple, cast

from neurosym.errors import InputError
from neurosym.language.search_problem import Rejection, RelaxedPlan
from neurosym.planning.planner import PlannerTraits
from neurosym.planning.result import PlanResult, Status
from planners.backtracking import DepthFirst
from planners.node import Node
from planners.search_context import BudgetSpent, SearchContext
from planners.search_planner import SearchPlanner, finish

#: Attempts an action of the problem that the greedy search is given.
GREEDY = 4

#: Attempts that are made for a shorter plan once there is one.
EFFORT = 5_000


class Fewest(SearchPlanner):
    """A plan with as few actions as can be; `PlanResult.fewest` says whether that there is none with fewer is proved.

    First greedily, after what a relaxed plan does (`SearchProblem.relaxed_plan`, where the problem has one); where that
    leads nowhere soon, by backtracking, with the prior. Then the actions that this plan does not need are left out, and
    A* with unit costs (Hart, Nilsson, Raphael 1968) looks for plans with fewer.

    Args:
        effort: attempts that are made once there is a plan; None: until it is proved.
    """

    traits = PlannerTraits(complete=True)

    def __init__(self, *, effort: int | None = EFFORT) -> None:
        if effort is not None and effort < 0:
            raise InputError(f"Expected an effort of 0 attempts or more, or None; got {effort}.")
        self.effort = effort

    def search(self, context: SearchContext) -> PlanResult:
        greedy = _Search(context, greedy=True, most=GREEDY * len(context.classes))
        first: Node | None = greedy.run() if _relaxed(context, greedy.root) is not None else None
        if first is None and not greedy.exhausted:
            first = finish(DepthFirst(context).run())
        if first is None:
            return context.failed(Status.UNSOLVABLE)
        most = None if self.effort is None else context.log.attempts + self.effort
        best, least = first, greedy.root.at_least
        if best.depth > least:
            with suppress(BudgetSpent):
                best = _without_needless(context, first, greedy.root, most)
        if best.depth <= least:
            return context.solved(best, fewest=True)
        shorter = _Search(context, below=best.depth, most=most)
        with suppress(BudgetSpent):
            shorter.run()
        exhaustive = shorter.exhausted and context.log.all_proved and getattr(context.problem, "exhaustive", True)
        return context.solved(shorter.found or best, fewest=exhaustive)


@dataclass(slots=True, eq=False)
class _Node(Node):
    at_least: int = 0  # actions from here to the goal
    relaxed: tuple[int, ...] = ()  # those of a relaxed plan
    waiting: list[int] = field(default_factory=list)  # candidates that are not queued yet


def _relaxed(context: SearchContext, node: Node) -> RelaxedPlan | None:
    problem = context.problem
    known: RelaxedPlan | None = problem.relaxed_plan(node.state) if hasattr(problem, "relaxed_plan") else None
    return known


class _Entry(NamedTuple):
    """What waits in the queue, the least first: an attempt, or (action -1) one of those that wait at a node."""

    bound: int
    others: bool
    shallow: int
    number: int
    node: _Node
    action: int


class _Search:
    """A* on the number of actions, or greedily on the bound alone; lazy: an attempt is made when it is its turn.

    Args:
        below: only plans with fewer actions.
        most: of the log's attempts, after which it stops.
    """

    def __init__(
        self, context: SearchContext, *, greedy: bool = False, below: int | None = None, most: int | None = None
    ) -> None:
        self.context, self.greedy, self.below, self.most = context, greedy, below, most
        self.root = _Node(context.problem.initial, repeating=context.repeating)
        self.exhausted, self.found = False, cast(_Node | None, None)
        self.queue: list[_Entry] = []
        self.pushed = 0

    def run(self) -> _Node | None:
        """The first plan in the order of the bound; None: there is none, or (not `exhausted`) it stopped."""
        context, is_goal = self.context, self.context.problem.is_goal
        if is_goal(self.root.state):
            return self.root
        expanded = {context.key(self.root)}
        self._expand(self.root)
        while self.queue:
            entry = heapq.heappop(self.queue)
            node, action = entry.node, entry.action
            if self.below is not None and entry.bound >= self.below:
                break
            if self.most is not None and context.log.attempts >= self.most:
                return self.found
            if action < 0:
                action = self._next_waiting(node)
            if not context.nogoods.allowed(node, (action,)):
                continue
            answer = context.attempt(node, action)
            if isinstance(answer, Rejection):
                context.learn(node, action, answer)
                continue
            child = node.child(action, answer)
            if is_goal(child.state):
                self.found, self.below = child, child.depth
                if self.greedy:
                    return child
            elif context.key(child) not in expanded:
                expanded.add(context.key(child))
                self._expand(child)
        self.exhausted = True
        return self.found

    def _expand(self, node: _Node) -> None:
        if (known := _relaxed(self.context, node)) is not None:
            node.at_least, node.relaxed = known
        node.waiting = self.context.expand(node.state, node.used)
        for action in [a for a in node.relaxed if a in node.waiting]:
            node.waiting.remove(action)
            self._push(self._bound(node, 1), False, node, action)
        self._push_waiting(node)

    def _bound(self, node: _Node, progress: int) -> int:
        """Of plans through a child of the node, which is nearer to the goal by so many actions."""
        to_go = max(node.at_least - progress, 0)
        return to_go if self.greedy else node.depth + 1 + to_go

    def _push_waiting(self, node: _Node) -> None:
        if node.waiting:
            self._push(self._bound(node, 0 if self.greedy else 1), True, node, -1)

    def _next_waiting(self, node: _Node) -> int:
        """What rejections named last, else any."""
        action = self.context.preferred.first_of(node.waiting)
        if action is None:
            action = node.waiting[int(self.context.rng.integers(len(node.waiting)))]
        node.waiting.remove(action)
        self._push_waiting(node)
        return action

    def _push(self, bound: int, others: bool, node: _Node, action: int) -> None:
        self.pushed += 1
        heapq.heappush(self.queue, _Entry(bound, others, -node.depth, self.pushed, node, action))


def _without_needless(context: SearchContext, goal: Node, root: Node, most: int | None) -> Node:
    """The plan less every action without which the others still reach the goal, the last one tried first."""
    best = goal
    for action in reversed(goal.prefix()):
        if most is not None and context.log.attempts >= most:
            break
        node: Node | None = root
        for other in best.prefix():
            if other == action or node is None or context.problem.is_goal(node.state):
                continue
            context.check_budget()
            answer = context.attempt(node, other) if other in context.log.candidates(node.state) else None
            node = None if answer is None or isinstance(answer, Rejection) else node.child(other, answer)
        if node is not None and context.problem.is_goal(node.state):
            best = node
    return best
