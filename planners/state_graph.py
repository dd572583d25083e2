"""The whole graph of states, each action in each state attempted once, and what is counted in it.

An order is a path from the initial state to a state at which the goal is first reached. Orders that differ only by
interchangeable actions count once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import SearchProblem, Step
from neurosym.planning.budget import Budget
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
        self.root = StateNode(initial, is_goal=context.problem.is_goal(initial))
        self.layers: list[list[StateNode]] = []
        below: dict[tuple[Any, int], StateNode] = {(initial, 0): self.root}
        while below and self.complete:
            self.layers.append(list(below.values()))
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
                key = (answer.state, node.used | 1 << action)
                if key not in below:
                    below[key] = node.child(action, answer)
                    below[key].is_goal = self.context.problem.is_goal(answer.state)
                node.edges.append(Edge(action, answer.motion, below[key]))


def count_plans(problem: SearchProblem[Any]) -> int:
    """How many orders there are."""
    orders = count_orders(problem).orders
    assert orders is not None  # there was no budget to end it
    return orders


def count_orders(problem: SearchProblem[Any], *, budget: Budget | None = None) -> OrderCount:
    """The same within a budget: orders are summed forwards, a layer of states at a time, and only two are kept."""
    context = _context(problem, budget)
    log = context.log
    leading: dict[tuple[Any, int], int] = {(context.problem.initial, 0): 1}  # how many orders lead there
    orders = states = 0
    while leading:
        below: dict[tuple[Any, int], int] = {}
        for (state, used), count in leading.items():
            states += 1
            if context.problem.is_goal(state):
                orders += count
                continue
            try:
                actions = context.expand(state, used)
            except BudgetSpent:
                return OrderCount(None, False, states, log.seconds)
            for action in actions:
                answer = log.attempt((), state, action)
                if log.timed_out:
                    return OrderCount(None, False, states, log.seconds)
                if isinstance(answer, Step):
                    key = answer.state, used | 1 << action
                    below[key] = below.get(key, 0) + count
        leading = below
    return OrderCount(orders, log.all_proved, states, log.seconds)


def order_marginals(problem: SearchProblem[Any]) -> NDArray[np.float64]:
    """The share of all orders that have action a at step i: float64, shape (longest order, N).

    Interchangeable actions share equally. Row i sums to the share of orders with more than i steps, which is 1
    where all orders are equally long. With no order at all: shape (0, N).
    """
    graph = StateGraph(_context(problem))
    classes = np.asarray(graph.context.classes, dtype=np.int64)
    shares = np.zeros((len(graph.layers), len(classes)))
    leading = {graph.root: 1}
    for step, layer in enumerate(graph.layers):
        for node in layer:
            for action, _, child in node.edges:
                leading[child] = leading.get(child, 0) + leading[node]
                # Python's integers first: counts of orders outgrow a float's 53 bits, shares do not.
                shares[step, action] += leading[node] * child.orders / graph.root.orders if child.orders else 0.0
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
    return SearchContext(problem.ground() if hasattr(problem, "ground") else problem, budget=budget)
