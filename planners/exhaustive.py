"""Exhaustive search: the whole graph of states, each action in each state attempted once. The reference for tests.

Counting and shares come from the same graph by dynamic programming: an order is a path from the initial state to a
state at which the goal is first reached.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.planning.planner import Budget, OrderCount, Planner, PlannerTraits, PlanResult, SearchLog, Status
from neurosym.planning.prior import OrderScores
from planners.evidence import fitted, representatives

S = TypeVar("S", bound=Hashable)


@dataclass(slots=True, eq=False)
class _Node(Generic[S]):
    """A state with the set of used actions, and what follows from it."""

    state: S
    used: int
    is_goal: bool
    edges: list[tuple[int, Any, _Node[S]]] = field(default_factory=list)  # action, motion, where it leads
    orders: int = 0  # ways to the goal from here


class _Graph(Generic[S]):
    """Everything that can be reached, in layers: layer i holds the nodes after i actions."""

    def __init__(self, problem: SearchProblem[S], log: SearchLog[S], rng: np.random.Generator | None = None) -> None:
        self.complete = True
        root = _Node(problem.initial, 0, problem.is_goal(problem.initial))
        self.root = root
        self.layers: list[list[_Node[S]]] = []
        prefixes: dict[_Node[S], tuple[int, ...]] = {root: ()}
        answers: dict[tuple[S, int], Step[S] | Rejection] = {}
        layer = [root]
        while layer:
            self.layers.append(layer)
            below: dict[tuple[S, int], _Node[S]] = {}
            reached: dict[_Node[S], tuple[int, ...]] = {}
            for node in layer:
                if node.is_goal:
                    continue
                if log.out_of_budget():
                    self.complete = False
                    break
                actions = representatives(log.candidates(node.state), node.used, problem.classes)
                if rng is not None:
                    rng.shuffle(actions)
                for action in actions:
                    answer = answers.get((node.state, action))
                    if answer is None:
                        if log.out_of_budget():
                            self.complete = False
                            break
                        answer = log.attempt(prefixes[node], node.state, action)
                        answers[node.state, action] = answer
                    if isinstance(answer, Rejection):
                        continue
                    key = (answer.state, node.used | 1 << action)
                    if key not in below:
                        below[key] = _Node(*key, problem.is_goal(answer.state))
                        reached[below[key]] = (*prefixes[node], action)
                    node.edges.append((action, answer.motion, below[key]))
            prefixes, layer = reached, list(below.values())
        for nodes in reversed(self.layers):
            for node in nodes:
                node.orders = 1 if node.is_goal else sum(child.orders for _, _, child in node.edges)


class Exhaustive(Planner):
    """Looks at everything; complete and optimal, for problems with few actions (2^N states)."""

    traits = PlannerTraits(complete=True, optimal=True, k_best=True)

    def plan(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None = None,
        *,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        found, log, graph = self._best(problem, scores, 1, budget, rng)
        if found:
            return found[0]
        return log.failed(Status.UNSOLVABLE if graph.complete else Status.OUT_OF_BUDGET)

    def plans(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None = None,
        *,
        k: int,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> list[PlanResult]:
        """The k best plans, cheapest first; orders that differ only by interchangeable actions count once.

        When the budget ends first, the best of what was seen, which need not be the best of all.
        """
        if k < 0:
            raise InputError(f"Expected k of 0 or more; got {k}.")
        return self._best(problem, scores, k, budget, rng)[0]

    def count_orders(self, problem: SearchProblem[S], *, budget: Budget | None = None) -> OrderCount:
        """See `planners.exhaustive.count_orders`."""
        return count_orders(problem, budget=budget)

    def count_plans(self, problem: SearchProblem[S]) -> int:
        """See `planners.exhaustive.count_plans`."""
        return count_plans(problem)

    def order_marginals(self, problem: SearchProblem[S]) -> NDArray[np.float64]:
        """See `planners.exhaustive.order_marginals`."""
        return order_marginals(problem)

    def all_plans(self, problem: SearchProblem[S]) -> Iterator[tuple[str, ...]]:
        """See `planners.exhaustive.all_plans`."""
        return all_plans(problem)

    @staticmethod
    def _best(
        problem: SearchProblem[S],
        scores: OrderScores | None,
        k: int,
        budget: Budget | None,
        rng: np.random.Generator | None,
    ) -> tuple[list[PlanResult], SearchLog[S], _Graph[S]]:
        scores = fitted(problem, scores)
        log = SearchLog(problem, budget)
        graph = _Graph(problem, log, rng or np.random.default_rng(0))
        results = []
        for path in _cheapest(graph, scores, k):
            plan = [action for action, _, _ in path]
            results.append(log.solved(plan, [motion for _, motion, _ in path], scores=scores))
        return results, log, graph


def count_plans(problem: SearchProblem[S]) -> int:
    """How many distinct orders of actions reach the goal, each ending where it is first reached.

    Orders that differ only by interchangeable actions count once.
    """
    orders = count_orders(problem).orders
    assert orders is not None  # there was no budget to end it
    return orders


def count_orders(problem: SearchProblem[S], *, budget: Budget | None = None) -> OrderCount:
    """The same within a budget: orders are summed forwards, a layer of states at a time, and only two are kept."""
    problem = _grounded(problem)
    log = SearchLog(problem, budget)
    ways: dict[tuple[S, int], int] = {(problem.initial, 0): 1}
    orders = states = 0
    while ways:
        following: dict[tuple[S, int], int] = {}
        for (state, used), count in ways.items():
            states += 1
            if problem.is_goal(state):
                orders += count
                continue
            if log.out_of_budget():
                return OrderCount(None, False, states, log.seconds)
            for action in representatives(log.candidates(state), used, problem.classes):
                answer = log.attempt((), state, action)
                if not isinstance(answer, Rejection):
                    key = answer.state, used | 1 << action
                    following[key] = following.get(key, 0) + count
        ways = following
    return OrderCount(orders, log.all_proved, states, log.seconds)


def order_marginals(problem: SearchProblem[S]) -> NDArray[np.float64]:
    """The share of all valid orders that have action a at step i: float64, shape (longest order, N).

    Interchangeable actions share equally. Row i sums to the share of orders with more than i steps, which is 1
    where all orders are equally long. With no order at all: shape (0, N).
    """
    problem = _grounded(problem)
    graph = _Graph(problem, SearchLog(problem))
    n_actions = len(problem.actions)
    classes = np.asarray(problem.classes, dtype=np.int64)
    shares = np.zeros((len(graph.layers), n_actions))
    ways: dict[_Node[S], int] = {graph.root: 1}
    for step, layer in enumerate(graph.layers):
        for node in layer:
            for action, _, child in node.edges:
                through = ways.get(node, 0)
                ways[child] = ways.get(child, 0) + through
                # Python's integers first: counts of orders outgrow a float's 53 bits, shares do not.
                shares[step, action] += through * child.orders / graph.root.orders if child.orders else 0.0
    for label in np.unique(classes):
        members = classes == label
        shares[:, members] = shares[:, members].mean(axis=1, keepdims=True)
    longest = int(np.count_nonzero(shares.sum(axis=1)))
    return shares[:longest]


def all_plans(problem: SearchProblem[S]) -> Iterator[tuple[str, ...]]:
    """Every order that reaches the goal, as names of actions, one member of a class for all."""
    problem = _grounded(problem)
    graph = _Graph(problem, SearchLog(problem))
    stack: list[tuple[_Node[S], tuple[str, ...]]] = [(graph.root, ())]
    while stack:
        node, prefix = stack.pop()
        if node.is_goal:
            yield prefix
        for action, _, child in reversed(node.edges):
            if child.orders:
                stack.append((child, (*prefix, problem.actions[action])))


def _cheapest(graph: _Graph[S], scores: OrderScores | None, k: int) -> list[list[tuple[int, Any, _Node[S]]]]:
    """The k cheapest paths from the root to a goal, each a list of edges, cheapest first."""
    # Of each node the k cheapest ways on: (cost, index of the edge, which of the ways at its end). An edge's cost
    # depends on its step alone, and all ways to a node have equally many, so the ways on compose.
    ways: dict[_Node[S], list[tuple[float, int, int]]] = {}
    for step in range(len(graph.layers) - 1, -1, -1):
        for node in graph.layers[step]:
            if node.is_goal:
                ways[node] = [(0.0 if scores is None else scores.length_cost(step), -1, -1)]
                continue
            options = (
                (cost + (0.0 if scores is None else scores.cost(step, action)), index, rank)
                for index, (action, _, child) in enumerate(node.edges)
                for rank, (cost, _, _) in enumerate(ways[child])
            )
            ways[node] = heapq.nsmallest(k, options)
    paths = []
    for _, index, rank in itertools.islice(ways[graph.root], k):
        node, path = graph.root, []
        while index >= 0:
            edge = node.edges[index]
            path.append(edge)
            node = edge[2]
            _, index, rank = ways[node][rank]
        paths.append(path)
    return paths


def _grounded(problem: Any) -> Any:
    """The search problem: what was given, or what a user's problem grounds to."""
    return problem.ground() if hasattr(problem, "ground") else problem
