"""Heuristics for problems that offer their ground task: estimates of the cost to the goal from the delete relaxation.

h_max and h_add: Bonet and Geffner, "Planning as heuristic search", Artificial Intelligence 129, 2001. h_FF with helpful
actions: Hoffmann and Nebel, "The FF planning system", JAIR 14, 2001, its relaxed plan by the supporters of h_add.
Derived predicates are taken as possible, so what is out of reach for the relaxation is so for the problem.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from neurosym.language.ground_task import GroundTask
from neurosym.language.search_problem import SearchProblem
from neurosym.support.arrays import Array, Numbers
from planners.relaxation_kernels import fact_costs, relaxed_plan

#: The names of heuristics. "goals" counts the facts of the goal that do not hold yet, "none" is 0.
HEURISTICS = ("ff", "add", "max", "goals", "none")

#: Those that never overestimate.
ADMISSIBLE = ("max", "none")


class Estimate(NamedTuple):
    """Of a state: the cost to the goal (inf: there is no way), and helpful actions, those of a relaxed plan that can be
    done at once."""

    value: float
    helpful: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Heuristic:
    """A heuristic of one ground task.

    `name`: one of `HEURISTICS`. `inflated`: each action counts 1 more than it costs, so that the free ones count, too.
    """

    task: GroundTask
    name: str
    inflated: bool = False

    @classmethod
    def of(cls, problem: SearchProblem[Any], name: str, *, inflated: bool = False) -> Heuristic | None:
        """That of a problem; None where it offers no ground task."""
        task: GroundTask | None = getattr(problem, "task", None)
        return None if task is None else cls(task, name, inflated and getattr(problem, "costs", None) is not None)

    def __call__(self, state: int) -> Estimate:
        """The estimate of a state."""
        if self.name == "none":
            return Estimate(0.0)
        task, facts = self.task, self._facts(state)
        if self.name == "goals":
            return Estimate(float(len(np.setdiff1d(task.goal, facts))))
        index = task.pre_start, task.used_start, task.used, task.add
        values, reached = fact_costs(facts, task.facts, *index, self._cost, self.name != "max")
        goal = values[task.goal]
        value = float((goal.max() if self.name == "max" else goal.sum()) if len(goal) else 0.0)
        if self.name == "max" or math.isinf(value):
            return Estimate(value)
        plan, first = relaxed_plan(
            task.goal, values, reached, task.pre_start, task.pre, task.action, len(self._prices)
        )
        if self.name == "ff":
            value = float(self._prices @ plan)
        return Estimate(value, tuple(np.flatnonzero(first).tolist()))

    @cached_property
    def _cost(self) -> Array:
        """Of each operator."""
        return self.task.cost + (self.task.action >= 0) if self.inflated else self.task.cost

    @cached_property
    def _prices(self) -> Array:
        """Of each action."""
        own = self.task.action >= 0
        prices = np.zeros(int(self.task.action.max(initial=-1)) + 1)
        prices[self.task.action[own]] = self._cost[own]
        return prices

    def _facts(self, state: int) -> Numbers:
        """The facts that hold in a state: bits that are set, and complements of those that are not."""
        task = self.task
        raw = np.frombuffer(state.to_bytes((task.width + 7) // 8, "little"), dtype=np.uint8)
        holds = np.unpackbits(raw, bitorder="little", count=task.width)
        facts = np.flatnonzero(holds)
        if len(task.negated):
            facts = np.concatenate([facts, task.width + np.flatnonzero(holds[task.negated] == 0)])
        return facts
