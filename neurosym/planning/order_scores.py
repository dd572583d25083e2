"""Order scores: guesses, made before any search, about which action belongs at which step.

The best whole order under them is a maximum-weight assignment (the Hungarian algorithm), as in Burke, Subr,
Ramamoorthy (RA-L 2021), Sec. III-B.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from neurosym.errors import InputError
from neurosym.support.arrays import Array
from neurosym.support.deadline import check, portions
from neurosym.support.html import SHOWN, table
from neurosym.support.words import counted, listed

#: Least log-probability a score may have (nats). A prior that is sure still leaves every order a finite cost.
LOG_FLOOR = -30.0

#: Scores that are made at a time: what bounds memory, and for how long nobody looks at the clock.
AT_A_TIME = 1_000_000


@dataclass(frozen=True, eq=False, repr=False)
class OrderScores:
    """A prior's answer: how likely each action is at each step.

    Attributes:
        log_prob: float64, shape (n_steps, n_actions). Rows of exp() sum to one. It is copied, refused if it has NaN or
            +inf, floored at `LOG_FLOOR` and normalised by rows.
        actions: names of the actions, one a column; may be empty when there are no names.
        log_length: float64, shape (n_steps + 1,): log-probability that it takes 0 .. n_steps steps; None: n_steps.
        classes: one integer an action; interchangeable actions share their probability. Default: each is its own.
    """

    log_prob: Array
    actions: tuple[str, ...] = ()
    log_length: Array | None = None
    classes: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        table = np.array(self.log_prob, dtype=np.float64)
        if table.ndim != 2:
            raise InputError(f"Expected log_prob of shape (n_steps, n_actions); got shape {table.shape}.")
        check()
        if np.isnan(table).any() or np.isposinf(table).any():
            raise InputError("Expected log_prob without NaN and +inf; got some. Check the network that made it.")
        n_steps, n_actions = table.shape
        if n_steps > n_actions:
            raise InputError(f"Expected at most as many steps as actions, each usable once; got {table.shape}.")
        object.__setattr__(self, "log_prob", _normalised(table))
        object.__setattr__(self, "actions", tuple(self.actions))
        object.__setattr__(self, "classes", tuple(int(c) for c in self.classes) or tuple(range(n_actions)))
        if self.actions and len(self.actions) != n_actions:
            raise InputError(f"Expected {n_actions} action names, one a column; got {len(self.actions)}.")
        if len(self.classes) != n_actions:
            raise InputError(f"Expected {n_actions} classes, one an action; got {len(self.classes)}.")
        if self.log_length is not None:
            length = np.array(self.log_length, dtype=np.float64)
            if length.shape != (n_steps + 1,) or np.isnan(length).any():
                raise InputError(f"Expected log_length of shape ({n_steps + 1},) without NaN; got {length.shape}.")
            object.__setattr__(self, "log_length", _normalised(length[None])[0])

    def __repr__(self) -> str:
        size = f"{counted(self.n_steps, 'step')}, {counted(self.n_actions, 'action')}"
        return f"OrderScores({size}: {listed(self.names())})"

    def _repr_html_(self) -> str:
        """Per cent, rows are steps; the darker the likelier."""
        shown = min(self.n_actions, SHOWN)
        names = (self.actions or tuple(map(str, range(self.n_actions))))[:shown]
        rows = [
            (i, *((f"{p:.0f}", f"background: rgba(0, 114, 178, {0.7 * p / 100:.2f})") for p in row[:shown]))
            for i, row in enumerate((100 * np.exp(self.log_prob[: SHOWN + 1])).tolist(), 1)
        ]
        after = f"Per cent. The likeliest order: {listed(self.names())}."
        return table(("step", *names), rows, title=repr(self).partition(":")[0] + ")", after=after)

    @classmethod
    def uniform(cls, n_steps: int, actions: Sequence[str], classes: Sequence[int] = ()) -> OrderScores:
        """Every action equally likely at every step."""
        n = len(actions)
        return cls(np.full((n_steps, n), -math.log(max(n, 1))), tuple(actions), classes=tuple(classes))

    @classmethod
    def from_order(cls, order: Sequence[int], actions: Sequence[str], *, confidence: float = 0.99) -> OrderScores:
        """Scores that believe in one order (indices of actions), each step with probability `confidence`."""
        n = len(actions)
        table = np.full((len(order), n), math.log(max((1 - confidence) / max(n - 1, 1), 1e-300)))
        table[np.arange(len(order)), list(order)] = math.log(confidence)
        return cls(table, tuple(actions))

    @property
    def n_steps(self) -> int:
        return int(self.log_prob.shape[0])

    @property
    def n_actions(self) -> int:
        return int(self.log_prob.shape[1])

    @cached_property
    def costs(self) -> Array:
        """float64 (n_steps, n_actions): -log of the summed probability of each action's class (nats, >= 0)."""
        ids, column = np.unique(np.asarray(self.classes), return_inverse=True)
        if len(ids) == self.n_actions:
            return np.maximum(-self.log_prob, 0.0)
        member = np.zeros((self.n_actions, len(ids)))
        member[np.arange(self.n_actions), column] = 1.0
        summed = np.log(np.exp(self.log_prob) @ member)
        return np.asarray(np.maximum(-summed, 0.0)[:, column])

    def cost(self, step: int, action: int) -> float:
        """-log P(class of `action` at `step`) in nats; beyond the last step, that of the floor."""
        return float(self.costs[step, action]) if step < self.n_steps else -LOG_FLOOR

    def plan_cost(self, plan: Sequence[int]) -> float:
        """The cost of a whole order (indices of actions), with that of its length where lengths are unsure."""
        total = sum(self.cost(i, a) for i, a in enumerate(plan))
        return float(total) + self.length_cost(len(plan))

    def length_cost(self, n: int) -> float:
        """-log P(the task takes n steps) in nats; 0 where the length is sure."""
        if self.log_length is None:
            return 0.0
        return -float(self.log_length[n]) if n <= self.n_steps else -LOG_FLOOR

    def order(self, rng: np.random.Generator | None = None) -> tuple[int, ...]:
        """The likeliest order: the assignment of actions to steps of least total cost.

        With an unsure length, the least over the lengths. Equal costs are broken by `rng` (None: a fixed seed).
        """
        from scipy.optimize import linear_sum_assignment

        rng = rng or np.random.default_rng(0)
        costs = self.costs + rng.random(self.costs.shape) * 1e-9
        if self.log_length is None:
            return tuple(int(c) for c in linear_sum_assignment(costs)[1])
        best: tuple[float, tuple[int, ...]] = (math.inf, ())
        for n in range(self.n_steps + 1):
            rows, columns = linear_sum_assignment(costs[:n])
            total = float(costs[rows, columns].sum()) + self.length_cost(n)
            if total < best[0]:
                best = (total, tuple(int(c) for c in columns))
        return best[1]

    def names(self, rng: np.random.Generator | None = None) -> tuple[str, ...]:
        """`order()` as names of actions."""
        order = self.order(rng)
        return tuple(self.actions[a] for a in order) if self.actions else tuple(map(str, order))

    def reversed(self) -> OrderScores:
        """The scores of the same actions in reverse order, all of them, with the steps counted from the end."""
        missing = self.n_actions - self.n_steps
        rows = np.concatenate([self.log_prob, np.zeros((missing, self.n_actions))])
        return OrderScores(rows[::-1], self.actions, classes=self.classes)

    def restricted(self, actions: Sequence[str]) -> OrderScores:
        """The scores for a task of which some actions are done already: the last steps, the remaining columns.

        `actions`: the names that are left, each one of `self.actions`.
        """
        if tuple(actions) == self.actions:
            return self
        missing = [a for a in actions if a not in self.actions]
        if missing:
            raise InputError(
                f"Expected actions that this prior knows ({', '.join(self.actions)}); got also {', '.join(missing)}. "
                "Train a prior on this domain, or plan without one."
            )
        columns = [self.actions.index(a) for a in actions]
        done = self.n_actions - len(columns)
        rows = self.log_prob[min(done, self.n_steps) :]
        length = None if self.log_length is None else self.log_length[min(done, self.n_steps) :]
        classes = tuple(self.classes[c] for c in columns)
        return OrderScores(rows[:, columns], tuple(actions), length, classes)


def _normalised(table: Array) -> Array:
    """Rows that sum to one in exp(), none below the floor (rows of nothing but -inf become uniform), in their place."""
    for some in portions(np.full(len(table) if table.size else 0, table.shape[1]), AT_A_TIME):
        rows = table[some]
        top = rows.max(axis=1, keepdims=True)
        shifted = np.where(np.isfinite(top), rows - np.where(np.isfinite(top), top, 0.0), 0.0)
        shifted -= np.log(np.exp(shifted).sum(axis=1, keepdims=True))
        floored = np.maximum(shifted, LOG_FLOOR)
        table[some] = floored - np.log(np.exp(floored).sum(axis=1, keepdims=True))
    return table
