"""Priority functions of best-first search: which waiting attempt is put to the oracle next (the least first)."""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PartialPlan:
    """The order so far with a waiting attempt at its end, as if that had succeeded.

    Attributes:
        depth: how many actions would be done then.
        path_cost: what they cost under the scores (nats).
        cost_to_go: the cheapest assignment of the rest (nats), with the cost of the length where it is unsure.
        log_policy: log-probability of the order so far, each step normalised over the candidates it had.
    """

    depth: int
    path_cost: float
    cost_to_go: float
    log_policy: float


Priority = Callable[[PartialPlan], float]


def astar(partial: PartialPlan) -> float:
    """Path cost plus cost-to-go: orders come from the likeliest down. Hart, Nilsson, Raphael 1968."""
    return partial.path_cost + partial.cost_to_go


def weighted(weight: float) -> Priority:
    """Weighted A*: a plan costs at most `weight` times the least. Pohl 1970."""
    return lambda partial: partial.path_cost + weight * partial.cost_to_go


def greedy(partial: PartialPlan) -> float:
    """Cost-to-go alone: nearest to the end in the prior's eyes."""
    return partial.cost_to_go


def levin(partial: PartialPlan) -> float:
    """Levin tree search, log(depth / policy): a plan of depth d and probability p takes at most d / p expansions.

    Orseau, Lelis, Lattimore, Weber, "Single-agent policy tree search with guarantees", NeurIPS 2018, Sec. 4.1.
    It needs no assignment, only the table read as a policy.
    """
    return math.log(partial.depth) - partial.log_policy
