"""Best-first search, lazy: a candidate waits under its cost and is put to the oracle only when it is its turn."""

import heapq
import math
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, NamedTuple

from neurosym.errors import InputError, UnknownNameError
from neurosym.language.search_problem import Rejection
from neurosym.planning.planner import PlannerTraits
from neurosym.planning.result import PlanResult, Status
from planners.assignment_heuristic import RESOLUTION, AssignmentHeuristic
from planners.heuristic_search import HeuristicSearch
from planners.heuristics import ADMISSIBLE, HEURISTICS, Heuristic
from planners.node import Node
from planners.priorities import PartialPlan, Priority, astar, greedy, levin, weighted
from planners.search_context import BudgetSpent, SearchContext
from planners.search_planner import KBestSearchPlanner, Steps, TwoSidedSearchPlanner


class BestFirst(TwoSidedSearchPlanner, KBestSearchPlanner):
    """Lazy best-first search; complete, and with A* optimal.

    A* visits orders from the likeliest down; let run on, it gives the k best plans, whatever the priority.
    Optimal means: of all plans, the least `OrderScores.plan_cost`, to within 1e-6 nats a plan. Scores without
    `log_length` say that a plan takes exactly `n_steps` actions; where the goal comes at another length their
    cost-to-go is a guide only, and so is the order of the k best.

    Among equals the deepest comes first, then the rng decides. Nodes are keyed on (state, used actions).

    Without scores, where actions have costs or may be done again, it goes by these costs and a heuristic
    (`planners.heuristic_search`): A* by an admissible one is optimal, and says so (`PlanResult.cheapest`, or `fewest`).
    With scores and a heuristic, "greedy" goes by the sum of the heuristic and of the nats that an action costs more
    than the prior's best completion; "astar" and "weighted" go by the scores, and the heuristic only takes out states
    from which there is no way.

    Args:
        priority: "astar", "weighted", "greedy", "levin", or a function of `planners.priorities.PartialPlan`.
        weight: of the cost-to-go in "weighted"; at least 1.
        heuristic: one of `planners.heuristics.HEURISTICS`, for problems that offer their ground task. Default: where it
            is needed "ff" for greedy search, else "max".
    """

    traits = PlannerTraits(complete=True, optimal=True, k_best=True, either_side=True)

    def __init__(
        self, *, priority: str | Priority = "astar", weight: float = 2.0, heuristic: str | None = None
    ) -> None:
        if not weight >= 1:
            raise InputError(f"Expected a weight of at least 1; got {weight}.")
        known = {"astar": astar, "weighted": weighted(weight), "greedy": greedy, "levin": levin}
        if isinstance(priority, str):
            if priority not in known:
                raise UnknownNameError("priority", priority, known)
            priority = known[priority]
        if heuristic is not None and heuristic not in HEURISTICS:
            raise UnknownNameError("heuristic", heuristic, HEURISTICS)
        self.priority: Priority = priority
        self.heuristic = heuristic
        #: Of the heuristic, beside the cost so far.
        self.weight = 1.0 if priority is astar else math.inf if priority is greedy else weight
        self.traits = PlannerTraits(complete=True, optimal=priority is astar, k_best=True, either_side=True)

    def steps(self, context: SearchContext) -> Steps:
        heuristic = self._heuristic(context)
        if heuristic is not None and (context.scores is None or self.priority is greedy):
            return (yield from self._by_heuristic(context, heuristic))
        for at in _BestFirst(context, self.priority, 1, heuristic).results():
            if isinstance(at, PlanResult):
                return at
            yield at
        return context.failed(Status.UNSOLVABLE)

    def _heuristic(self, context: SearchContext) -> Heuristic | None:
        """What the search goes by besides scores, if anything."""
        problem = context.problem
        if self.heuristic is None and not (context.repeating or getattr(problem, "costs", None) is not None):
            return None
        name = self.heuristic or ("ff" if self.priority is greedy else "max")
        return Heuristic.of(problem, name, inflated=self.priority is greedy)

    def _by_heuristic(self, context: SearchContext, heuristic: Heuristic) -> Steps:
        goal = yield from HeuristicSearch(context, heuristic, self.weight).run()
        if goal is None:
            return context.failed(Status.UNSOLVABLE)
        proved: bool | None = self.weight == 1 and heuristic.name in ADMISSIBLE and context.log.all_proved
        if math.isinf(self.weight):
            proved = None  # nobody asked
        if getattr(context.problem, "costs", None) is None:
            return context.solved(goal, fewest=proved)
        return context.solved(goal, cheapest=proved)

    def search_k_best(self, context: SearchContext, k: int) -> list[PlanResult]:
        results: list[PlanResult] = []
        with suppress(BudgetSpent):
            plans = (at for at in _BestFirst(context, astar, k).results() if isinstance(at, PlanResult))
            for result in islice(plans, k):
                results.append(result)  # noqa: PERF402 (what came before the budget's end is kept)
        return sorted(results, key=lambda result: result.cost or 0.0)


def greedy_best_first(*, heuristic: str | None = None) -> BestFirst:
    """Greedy best-first search: a plan soon, which need not be a cheap one."""
    return BestFirst(priority="greedy", heuristic=heuristic)


@dataclass(slots=True, eq=False)
class _Node(Node):
    path_cost: float = 0.0
    log_policy: float = 0.0
    log_total: float = 0.0  # log of the summed probability of the candidates here
    bound: float = 0.0  # least cost of a plan through here, as known when it was queued
    waiting: list[int] = field(default_factory=list)  # candidates not queued yet


class _Attempt(NamedTuple):
    node: _Node
    action: int


class _Siblings(NamedTuple):
    node: _Node  # all attempts here that have not been queued one by one


class _Goal(NamedTuple):
    node: _Node  # a plan that waits its turn


class _BestFirst:
    def __init__(
        self, context: SearchContext, priority: Priority, k: int, pruning: Heuristic | None = None
    ) -> None:
        self.pruning = pruning
        self.context, self.priority, self.k = context, priority, k
        self.heuristic = None if context.scores is None else AssignmentHeuristic(context.scores, context.rng)
        self.lazy = priority is astar  # only there is a node's cost a bound on all that come from it
        self.queue: list[tuple[float, int, float, int, _Attempt | _Siblings | _Goal]] = []
        self.pushed = 0
        self.expanded: Counter[tuple[Any, int]] = Counter()

    def results(self) -> Iterator[PlanResult | int]:
        """Plans in the order of the priority; that it ends proves that there are no others.

        After each attempt that ends in no plan the depth of the state in which it was made.
        """
        context, is_goal = self.context, self.context.problem.is_goal
        root = _Node(context.problem.initial, repeating=context.repeating)
        if is_goal(root.state):
            yield context.solved(root)
            return
        self._expand(root)
        while self.queue:
            key, _, _, _, entry = heapq.heappop(self.queue)
            if isinstance(entry, _Goal):
                yield context.solved(entry.node)
            elif isinstance(entry, _Siblings):
                self._queue_all(entry.node)
            elif (child := self._attempt(entry.node, entry.action, key)) is None:
                yield entry.node.depth
            elif is_goal(child.state):
                to_go = context.length_cost(child.depth)
                key = _rounded(self.priority(PartialPlan(child.depth, child.path_cost, to_go, child.log_policy)))
                if self.queue and key > self.queue[0][0]:
                    self._push(key, child.depth, _Goal(child))
                else:
                    yield context.solved(child)
            elif self.expanded[context.key(child)] < self.k:
                # The k cheapest orders that lead to a node are all that the k best plans can need of it.
                self._expand(child)
                yield entry.node.depth

    def _attempt(self, node: _Node, action: int, bound: float) -> _Node | None:
        """The node that `action` leads to; None when it is refused, or known to be."""
        context = self.context
        if not context.nogoods.allowed(node, (action,)):
            return None
        answer = context.attempt(node, action)
        if isinstance(answer, Rejection):
            context.learn(node, action, answer)
            return None
        cost = context.cost(node.depth, action)
        child = node.child(action, answer)
        child.path_cost, child.bound = node.path_cost + cost, bound
        child.log_policy = node.log_policy - cost - node.log_total
        return child

    def _expand(self, node: _Node) -> None:
        """Queue what may be tried next: one by one, or, while the best completion is known, that and the others."""
        if self.pruning is not None and math.isinf(self.pruning(node.state).value):
            return
        node.waiting = self.context.expand(node.state, node.used)
        self.expanded[self.context.key(node)] += 1
        if not node.waiting:
            return
        if not self.lazy:  # A* asks for no policy
            node.log_total = math.log(sum(math.exp(-self.context.cost(node.depth, a)) for a in node.waiting))
        if not (self.lazy and node.completion):
            self._queue_all(node)
            return
        if completion := self.context.restated(node.completion, node.waiting):
            node.completion = completion
            node.waiting.remove(completion[0])
            self._push(node.bound, node.depth + 1, _Attempt(node, completion[0]))
        # No sibling can be cheaper than the best completion, so their costs are worked out only if need be.
        if node.waiting:
            self._push(node.bound, node.depth + 1, _Siblings(node))

    def _queue_all(self, node: _Node) -> None:
        if self.lazy and (self.heuristic is None or self.heuristic.indifferent):
            self._queue_one(node)
            return
        values = None
        if self.heuristic is not None and self.priority is not levin:
            assignment = self.heuristic.assign(node.depth, node.used)
            values = assignment.values
            if not node.completion and (best := assignment.completion):
                node.completion = self.context.restated(best, node.waiting) or best
        for action in node.waiting:
            cost = self.context.cost(node.depth, action)
            to_go = 0.0 if values is None else float(values[action]) - cost
            log_policy = node.log_policy - cost - node.log_total
            key = self.priority(PartialPlan(node.depth + 1, node.path_cost + cost, to_go, log_policy))
            self._push(key, node.depth + 1, _Attempt(node, action))
        node.waiting = []

    def _queue_one(self, node: _Node) -> None:
        """Where nothing is preferred, what rejections named last, then at random; siblings wait while it leads on."""
        waiting, action = node.waiting, self.context.preferred.first_of(node.waiting)
        chosen = int(self.context.rng.integers(len(waiting))) if action is None else waiting.index(action)
        waiting[chosen], waiting[-1] = waiting[-1], waiting[chosen]
        action = waiting.pop()
        bound = 0.0
        if self.heuristic is not None:
            bound = node.path_cost + float(self.heuristic.assign(node.depth, node.used).values[action])
        self._push(bound, node.depth + 1, _Attempt(node, action))
        if waiting:
            self._push(bound, node.depth + 1, _Siblings(node))

    def _push(self, key: float, depth: int, entry: _Attempt | _Siblings | _Goal) -> None:
        # Siblings come after the attempts that they are as good as; the running number keeps entries uncompared.
        tie = 1.0 if isinstance(entry, _Siblings) else float(self.context.rng.random())
        self.pushed += 1
        heapq.heappush(self.queue, (_rounded(key), -depth, tie, self.pushed, entry))


def _rounded(key: float) -> float:
    return round(key / RESOLUTION) * RESOLUTION
