"""The whole graph of states, each action in each state attempted once, and what is counted in it.

An order is a path from the initial state to a state at which the goal is first reached. Orders that differ only by
interchangeable actions count once.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import SearchProblem, Step
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import OrderCount
from planners.node import Node
from planners.search_context import BudgetSpent, SearchContext


class Edge(NamedTuple):
    """An action, and where it leads."""

    action: int
    motion: StepMotion | None
    node: StateNode


@dataclass(slots=True, eq=False)
class StateNode(Node):
    """A state with the set of used actions; its parent is the first of those that lead to it."""

    is_goal: bool = False
    edges: list[Edge] = field(default_factory=list)
    orders: int = 0  # how many lead from here to the goal


class StateGraph:
    """All that can be reached (while the budget lasts), in layers: layer i holds the nodes after i actions."""

    def __init__(self, context: SearchContext, *, shuffled: bool = False) -> None:
        self.context, self.shuffled, self.complete = context, shuffled, True
        initial = context.problem.initial
        self.root = StateNode(initial, is_goal=context.problem.is_goal(initial), repeating=context.repeating)
        self.layers: list[list[StateNode]] = []
        below: dict[tuple[Any, int], StateNode] = {(initial, 0): self.root}
        #: Where actions may be done again, what an earlier layer has: no shortest order comes back there.
        self.earlier: set[tuple[Any, int]] = set()
        while below and self.complete:
            self.layers.append(list(below.values()))
            if context.repeating:
                self.earlier.update(below)
            below = {}
            try:
                for node in self.layers[-1]:
                    if not node.is_goal:
                        self._expand(node, below)
            except BudgetSpent:
                self.complete = False
                self.layers.append(list(below.values()))
        for layer in reversed(self.layers):
            for node in layer:
                node.orders = 1 if node.is_goal else sum(edge.node.orders for edge in node.edges)

    def _expand(self, node: StateNode, below: dict[tuple[Any, int], StateNode]) -> None:
        actions = self.context.expand(node.state, node.used)
        if self.shuffled:
            self.context.rng.shuffle(actions)
        for action in actions:
            answer = self.context.attempt(node, action)
            if isinstance(answer, Step):
                child = node.child(action, answer)
                key = (answer.state, child.used)
                if key in self.earlier:
                    continue
                if key not in below:
                    below[key] = child
                    below[key].is_goal = self.context.problem.is_goal(answer.state)
                node.edges.append(Edge(action, answer.motion, below[key]))


def count_plans(problem: SearchProblem[Any]) -> int:
    """How many orders there are."""
    orders = count_orders(problem).orders
    assert orders is not None  # there was no budget to end it
    return orders


def count_orders(problem: SearchProblem[Any], *, budget: Budget | None = None) -> OrderCount:
    """The same within a budget: orders are summed a layer of states at a time, and only two are kept.

    Where the problem can be searched from its goal, too, each layer is the next one of the side that has less to ask
    for it, until the two meet.
    """
    full = _context(problem, budget)
    empty = SearchContext.from_empty(full)
    if empty is not None:
        return _count_from_both(full, empty)
    log = full.log
    leading: dict[tuple[Any, int], int] = {(full.problem.initial, 0): 1}  # how many orders lead there
    orders = told_apart = states = 0
    while leading:
        waiting = {}
        for (state, used), count in leading.items():
            if full.problem.is_goal(state):
                orders += count
                told_apart += count * _ways_to_name(full.classes, used)
            else:
                waiting[state, used] = count
        states += len(leading)
        try:
            leading = _next_layer(full, waiting)
        except BudgetSpent:
            return OrderCount(None, False, log.expansions, log.seconds)
    return OrderCount(orders, log.all_proved, states, log.seconds, told_apart)


def _ways_to_name(classes: Sequence[int], used: int) -> int:
    """In how many ways the actions of an order may be named, those of a class being interchangeable."""
    there = Counter(classes)
    done = Counter(label for action, label in enumerate(classes) if used >> action & 1)
    return math.prod(math.perm(there[label], count) for label, count in done.items())


def _count_from_both(full: SearchContext, empty: SearchContext) -> OrderCount:
    """The count where every order does all actions, and states of both sides that are one state meet."""
    log, left = full.log, len(full.classes)
    layers = {side: {(side.problem.initial, 0): 1} for side in (full, empty)}
    done = dict.fromkeys(layers, 0)
    while done[full] + done[empty] < left and all(layers.values()):
        # A question is taken to cost the square of the number of actions that are not done, as parts are there.
        work = {full: len(layers[full]) * (left - done[full]) ** 2, empty: len(layers[empty]) * (1 + done[empty]) ** 2}
        side = min(work, key=work.__getitem__)
        try:
            layers[side] = _next_layer(side, layers[side])
        except BudgetSpent:
            return OrderCount(None, False, log.expansions, log.seconds)
        done[side] += 1
    ends = {state: count for (state, _), count in layers[empty].items()}
    orders = sum(count * ends.get(state, 0) for (state, _), count in layers[full].items())
    looked_at = log.expansions + len(layers[full])
    told_apart = orders * _ways_to_name(full.classes, (1 << left) - 1)
    return OrderCount(orders, log.all_proved and empty.log.all_proved, looked_at, log.seconds, told_apart)


def _next_layer(context: SearchContext, layer: dict[tuple[Any, int], int]) -> dict[tuple[Any, int], int]:
    """The states that one action more leads to, each with how many orders lead there."""
    below: dict[tuple[Any, int], int] = {}
    for (state, used), count in layer.items():
        node = Node(state, used)
        for action in context.nogoods.allowed(node, context.expand(state, used)):
            answer = context.log.attempt((), state, action)
            if context.log.timed_out:
                raise BudgetSpent
            if isinstance(answer, Step):
                key = answer.state, used | 1 << action
                below[key] = below.get(key, 0) + count
            else:
                context.nogoods.learn(node, action, answer)
    return below


def order_marginals(problem: SearchProblem[Any], scores: OrderScores | None = None) -> NDArray[np.float64]:
    """The share of all orders that have action a at step i: float64, shape (longest order, N).

    With scores, orders count by their probability under these: what is believed once it is known which orders work.
    Interchangeable actions share equally. Row i sums to the share of orders with more than i steps, which is 1
    where all orders are equally long. With no order at all: shape (0, N).
    """
    graph = StateGraph(_context(problem))
    classes = np.asarray(graph.context.classes, dtype=np.int64)
    if scores is not None:
        return _weighted_marginals(graph, scores, classes)
    shares = np.zeros((len(graph.layers), len(classes)))
    leading = {graph.root: 1}
    for step, layer in enumerate(graph.layers):
        for node in layer:
            for action, _, child in node.edges:
                leading[child] = leading.get(child, 0) + leading[node]
                # Python's integers first: counts of orders outgrow a float's 53 bits, shares do not.
                shares[step, action] += leading[node] * child.orders / graph.root.orders if child.orders else 0.0
    return _shared(shares, classes)


def _weighted_marginals(graph: StateGraph, scores: OrderScores, classes: NDArray[np.int64]) -> NDArray[np.float64]:
    """By sums of logarithms from the end and from the beginning, as in a hidden Markov model."""
    ahead: dict[StateNode, float] = {}
    for step, layer in reversed(list(enumerate(graph.layers))):
        for node in layer:
            onward = [ahead[e.node] - scores.cost(step, e.action) for e in node.edges if e.node.orders]
            ahead[node] = 0.0 if node.is_goal else float(np.logaddexp.reduce(onward)) if onward else -np.inf
    shares = np.zeros((len(graph.layers), len(classes)))
    behind = {graph.root: 0.0}
    for step, layer in enumerate(graph.layers):
        for node in layer:
            for action, _, child in node.edges:
                if child.orders:
                    to_child = behind[node] - scores.cost(step, action)
                    behind[child] = float(np.logaddexp(behind.get(child, -np.inf), to_child))
                    shares[step, action] += np.exp(to_child + ahead[child] - ahead[graph.root])
    return _shared(shares, classes)


def _shared(shares: NDArray[np.float64], classes: NDArray[np.int64]) -> NDArray[np.float64]:
    for label in np.unique(classes):
        members = classes == label
        shares[:, members] = shares[:, members].mean(axis=1, keepdims=True)
    return shares[: int(np.count_nonzero(shares.sum(axis=1)))]


def all_plans(problem: SearchProblem[Any]) -> Iterator[tuple[str, ...]]:
    """Every order, as names of actions, one member of a class for all."""
    graph = StateGraph(_context(problem))
    stack: list[tuple[StateNode, tuple[int, ...]]] = [(graph.root, ())]
    while stack:
        node, prefix = stack.pop()
        if node.is_goal:
            yield graph.context.log.names(prefix)
        stack.extend((edge.node, (*prefix, edge.action)) for edge in reversed(node.edges) if edge.node.orders)


def _context(problem: Any, budget: Budget | None = None) -> SearchContext:
    """Of the search problem that was given, or that a user's problem grounds to."""
    context = SearchContext(problem.ground() if hasattr(problem, "ground") else problem, budget=budget)
    if context.repeating:
        raise InputError(
            "Expected a problem whose actions are done once each, to count orders or to list them; where actions may "
            "be done again there is no end of orders. Say once=True of the actions, or ask for one plan."
        )
    return context
