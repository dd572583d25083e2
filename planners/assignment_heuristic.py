"""The assignment heuristic: the cheapest completion of a partial order under a prior's costs.

It is admissible and consistent as a cost-to-go, because the true completion is one of the assignments of the remaining
actions to the remaining steps, and taking an action fixes one of its rows.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from neurosym.planning.order_scores import LOG_FLOOR, OrderScores

#: Costs closer than this (nats) are equal, and something else decides. Far above the rounding of a sum of
#: 1,000 costs of 30 nats (1e-11), far below any difference of probability that a network can mean.
RESOLUTION = 1e-6

#: Lengths less likely than exp(-29) are bounded together instead of by an assignment each: they hardly ever matter.
_UNLIKELY_LENGTH = -LOG_FLOOR - 1.0


@dataclass(frozen=True, slots=True)
class Assignment:
    """The cheapest completion of a partial order, and what each next action would cost in the end.

    Attributes:
        values: float64 (n_actions,): the least cost from the next step on, when that takes this action (nats); inf for
            used actions.
        completion: the actions from the next step on; empty beyond the last step of the scores.
    """

    values: NDArray[np.float64]
    completion: tuple[int, ...]


class AssignmentHeuristic:
    """Assigns the remaining actions to the remaining steps.

    The rng breaks ties between equally cheap completions; members of one class stay equal.
    """

    def __init__(self, scores: OrderScores, rng: np.random.Generator) -> None:
        self.n_steps, self.n_actions = scores.n_steps, scores.n_actions
        self._scores, self._exact = scores, scores.costs
        noise = rng.random((self.n_steps, self.n_actions)) * (RESOLUTION / (10.0 * (self.n_steps + 1)))
        _, first = np.unique(np.asarray(scores.classes, dtype=np.int64), return_inverse=True)
        self._costs = self._exact + (noise[:, first] if self.n_actions else 0.0)
        spread = np.ptp(self._exact, axis=1) if self._exact.size else np.zeros(0)
        #: Whether the scores prefer nothing: every action costs the same at every step.
        self.indifferent = bool((spread < RESOLUTION).all())

    def assign(self, step: int, used: int) -> Assignment:
        """The assignment when the actions in the bitset `used` fill the steps before `step`.

        With an unsure length, the least over the lengths beyond `step`, each with its -log probability. With a
        sure one the completion runs to the last step of the scores.
        """
        left = np.array([a for a in range(self.n_actions) if not used >> a & 1], dtype=np.int64)
        values = np.full(self.n_actions, np.inf)
        if not left.size:
            return Assignment(values, ())
        lengths, otherwise = self._lengths(step)
        values[left] = (self._exact[step, left] if step < self.n_steps else -LOG_FLOOR) + otherwise
        if self.indifferent:
            prices = [float(self._exact[step:length, 0].sum()) + price for length, price in lengths]
            values[left] = np.minimum(values[left], min(prices, default=np.inf))
            return Assignment(values, ())
        best: tuple[int, ...] = ()
        least = np.inf
        for length, price in lengths:
            forced, order = _forced(self._costs[step:length][:, left])
            values[left] = np.minimum(values[left], forced + price)
            if forced[order[0]] + price < least:
                least = forced[order[0]] + price
                best = tuple(int(a) for a in left[order])
        return Assignment(values, best)

    def _lengths(self, step: int) -> tuple[list[tuple[int, float]], float]:
        """The lengths worth an assignment, with their costs; and a bound on the length cost of all others."""
        if self._scores.log_length is None:
            return ([(self.n_steps, 0.0)], np.inf) if step < self.n_steps else ([], 0.0)
        prices = [(n, self._scores.length_cost(n)) for n in range(step + 1, self.n_steps + 1)]
        likely = [(n, price) for n, price in prices if price < _UNLIKELY_LENGTH]
        # Plans longer than the scores cost the floor for their length too.
        otherwise = min([price for _, price in prices if price >= _UNLIKELY_LENGTH] + [-LOG_FLOOR])
        return likely, otherwise


def _forced(costs: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """For each column, the least assignment cost with the first row given that column; and the best columns.

    One assignment gives them all: forcing the first row onto column j evicts j's owner, who moves on along a
    shortest path of evictions that ends in the column that the first row gave up. Since the assignment is
    optimal, no cycle of evictions gains, and Bellman-Ford settles in as many rounds as the longest path.
    """
    from scipy.optimize import linear_sum_assignment

    columns = linear_sum_assignment(costs)[1].astype(np.int64)
    rows = np.arange(len(columns))
    total = float(costs[rows, columns].sum())
    owned = columns[1:]
    moves = costs[1:] - costs[rows[1:], owned][:, None]
    # Columns of nobody belong to idle rows, which move at no cost.
    idle = np.ones(costs.shape[1], dtype=bool)
    idle[columns] = False
    eviction = np.full(costs.shape[1], np.inf)
    eviction[columns[0]] = 0.0
    for _ in range(costs.shape[1]):
        update = eviction.copy()
        if owned.size:
            update[owned] = (moves + eviction).min(axis=1)
        update[idle] = eviction.min()
        update = np.minimum(update, eviction)
        if not (update < eviction - 1e-12).any():
            break
        eviction = update
    return total + costs[0] - costs[0, columns[0]] + eviction, columns
