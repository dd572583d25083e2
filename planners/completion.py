"""The cheapest completion of a partial order under a prior's costs, and the price of leaving it.

With steps 0 .. d-1 filled, what the rest costs at least is a linear assignment of the remaining actions to
the remaining steps. It is admissible and consistent as a cost-to-go, because the true completion is one of
the assignments, and taking an action fixes one of its rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from neurosym.planning.prior import LOG_FLOOR, OrderScores

#: Costs closer than this (nats) are equal, and something else decides. Far above the rounding of a sum of
#: 1,000 costs of 30 nats (1e-11), far below any difference of probability that a network can mean.
RESOLUTION = 1e-6

#: Lengths less likely than exp(-29) are bounded together instead of by an assignment each: they hardly ever matter.
_UNLIKELY_LENGTH = -LOG_FLOOR - 1.0


@dataclass(frozen=True, slots=True)
class Survey:
    """All that one assignment tells about the next step.

    Attributes:
        values: float64 (n_actions,): the least cost of everything from this step on, when this step takes that
            action (nats); inf for used actions.
        best: the cheapest completion, actions from this step on; empty beyond the last step of the scores.
    """

    values: NDArray[np.float64]
    best: tuple[int, ...]


class Completion:
    """Answers `survey` for any set of used actions.

    Args:
        scores: the prior's advice.
        rng: breaks ties between equally cheap completions. Members of one class stay equal.
    """

    def __init__(self, scores: OrderScores, rng: np.random.Generator) -> None:
        self.n_steps, self.n_actions = scores.n_steps, scores.n_actions
        self._exact = scores.costs
        noise = rng.random((self.n_steps, self.n_actions)) * (RESOLUTION / (10.0 * (self.n_steps + 1)))
        _, first = np.unique(np.asarray(scores.classes, dtype=np.int64), return_inverse=True)
        self._costs = self._exact + (noise[:, first] if self.n_actions else 0.0)
        self._scores = scores
        spread = np.ptp(self._exact, axis=1) if self._exact.size else np.zeros(0)
        #: Whether the scores prefer nothing: every action costs the same at every step.
        self.indifferent = bool((spread < RESOLUTION).all())

    def step_costs(self, step: int) -> NDArray[np.float64]:
        """float64 (n_actions,): the cost of each action at `step`; the floor's beyond the last step."""
        if step < self.n_steps:
            row: NDArray[np.float64] = self._exact[step]
            return row
        return np.full(self.n_actions, -LOG_FLOOR)

    def survey(self, step: int, used: int) -> Survey:
        """What each unused action at `step` would cost in the end.

        With an unsure length, the least over the lengths beyond `step`, each with its -log probability. With a
        sure one the completion runs to the last step of the scores.

        Args:
            step: how many actions were done.
            used: bit a is set when action a was done.
        """
        left = np.array([a for a in range(self.n_actions) if not used >> a & 1], dtype=np.int64)
        values = np.full(self.n_actions, np.inf)
        if not left.size:
            return Survey(values, ())
        lengths, otherwise = self._lengths(step)
        values[left] = self.step_costs(step)[left] + otherwise
        if self.indifferent:
            prices = [float(self._exact[step:length, 0].sum()) + price for length, price in lengths]
            values[left] = np.minimum(values[left], min(prices, default=np.inf))
            return Survey(values, ())
        best: tuple[int, ...] = ()
        least = np.inf
        for length, price in lengths:
            found, order = self._forced(self._costs[step:length][:, left])
            values[left] = np.minimum(values[left], found + price)
            if found[order[0]] + price < least:
                least = found[order[0]] + price
                best = tuple(int(a) for a in left[order])
        return Survey(values, best)

    def _lengths(self, step: int) -> tuple[list[tuple[int, float]], float]:
        """The lengths worth an assignment, with their costs; and a bound on the length cost of all others."""
        if self._scores.log_length is None:
            sure = step < self.n_steps
            return ([(self.n_steps, 0.0)], np.inf) if sure else ([], 0.0)
        prices = [(n, self._scores.length_cost(n)) for n in range(step + 1, self.n_steps + 1)]
        likely = [(n, price) for n, price in prices if price < _UNLIKELY_LENGTH]
        # Plans longer than the scores cost the floor for their length too.
        otherwise = min([price for _, price in prices if price >= _UNLIKELY_LENGTH] + [-LOG_FLOOR])
        return likely, otherwise

    def _forced(self, costs: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """For each column, the least assignment cost with the first row given that column; and the best columns.

        One assignment gives them all: forcing the first row onto column j evicts j's owner, who moves on along a
        shortest path of evictions that ends in the column that the first row gave up. Since the assignment is
        optimal, no cycle of evictions gains, and Bellman-Ford settles in as many rounds as the longest path.
        """
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


def remainder(guess: tuple[int, ...], action: int) -> tuple[int, ...]:
    """What is left of a completion after `action`; empty when the completion said otherwise, or has ended."""
    return guess[1:] if guess and guess[0] == action else ()


def with_first(guess: tuple[int, ...], action: int) -> tuple[int, ...]:
    """The completion with `action` first, in exchange with the interchangeable fellow that stood there."""
    if guess[0] == action:
        return guess
    return (action, *(guess[0] if a == action else a for a in guess[1:]))
