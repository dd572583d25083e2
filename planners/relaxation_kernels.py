"""Loops over the delete relaxation, compiled: costs of facts, and relaxed plans."""

import heapq

import numpy as np

from neurosym.support.arrays import Array, Numbers
from neurosym.support.compiled import compiled


@compiled
def fact_costs(
    state: Numbers,
    facts: int,
    pre_start: Numbers,
    used_start: Numbers,
    used: Numbers,
    add: Numbers,
    cost: Array,
    summed: bool,
) -> tuple[Array, Numbers]:
    """What each fact costs from a state, float64 (facts,), inf out of reach; and by which operator, -1: none.

    An operator costs the sum of its preconditions (`summed`, h_add), or the dearest of them (h_max). Facts come in the
    order of their costs, as in Dijkstra's algorithm, so each operator is looked at once for each precondition.

    `state`: int64, the facts that hold. The rest is of `neurosym.language.ground_task.GroundTask`.
    """
    values = np.full(facts, np.inf)
    reached = np.full(facts, -1)
    missing = pre_start[1:] - pre_start[:-1]
    needed = cost.copy()
    queue = [(0.0, np.int64(0))]
    queue.pop()
    for fact in state:
        values[fact] = 0.0
        queue.append((0.0, fact))
    for operator in range(len(add)):
        if missing[operator] == 0 and cost[operator] < values[add[operator]]:
            values[add[operator]] = cost[operator]
            reached[add[operator]] = operator
            queue.append((cost[operator], add[operator]))
    heapq.heapify(queue)
    while queue:
        value, fact = heapq.heappop(queue)
        if value > values[fact]:
            continue
        for at in range(used_start[fact], used_start[fact + 1]):
            operator = used[at]
            missing[operator] -= 1
            if summed or missing[operator] == 0:
                needed[operator] += value
            if missing[operator] == 0:
                added = add[operator]
                if needed[operator] < values[added]:
                    values[added] = needed[operator]
                    reached[added] = operator
                    heapq.heappush(queue, (needed[operator], added))
    return values, reached


@compiled
def relaxed_plan(
    goal: Numbers,
    values: Array,
    reached: Numbers,
    pre_start: Numbers,
    pre: Numbers,
    action: Numbers,
    actions: int,
) -> tuple[Numbers, Numbers]:
    """Of each action, whether the plan that reaches the goal by the cheapest operators has it, and whether it may come
    first there: int64 (actions,), 0 or 1.

    `values`, `reached`: of `fact_costs`, with the goal in reach.
    """
    chosen, first = np.zeros(actions, dtype=np.int64), np.zeros(actions, dtype=np.int64)
    seen = np.zeros(len(values), dtype=np.int64)
    waiting = list(goal)
    while waiting:
        fact = waiting.pop()
        operator = reached[fact]
        if seen[fact] or operator < 0:
            continue
        seen[fact] = 1
        at_once = True
        for at in range(pre_start[operator], pre_start[operator + 1]):
            waiting.append(pre[at])
            if reached[pre[at]] >= 0 and action[reached[pre[at]]] >= 0:
                at_once = False
        if action[operator] >= 0:
            chosen[action[operator]] = 1
            if at_once:
                first[action[operator]] = 1
    return chosen, first
