"""What one search knows, whatever its algorithm: answers, nogoods, preferred actions, budget and log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from neurosym.errors import InputError
from neurosym.language.reversal import reversed_problem
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import PlanResult, Status
from neurosym.planning.search_log import SearchLog
from planners.node import Node
from planners.nogoods import Nogoods
from planners.preferred_actions import PreferredActions


class BudgetSpent(Exception):
    """Ends a search where it stands; `SearchPlanner` makes a result of it."""


class SearchContext:
    """One search of one problem. Expansions and attempts look at the budget first, and raise `BudgetSpent`.

    Attributes:
        scores: checked against the problem's actions, with interchangeable actions sharing their probability.
        deviated: whether the search had to leave the first complete order that it tried.
        beside: that of a search of the same problem from its other end, if there is one.
        path: of a depth-first search, the nodes from its root to where it is, by their states.
        repeating: a bitset of the actions that may be done any number of times.
    """

    def __init__(
        self,
        problem: SearchProblem[Any],
        scores: OrderScores | None = None,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
        *,
        beside: SearchContext | None = None,
    ) -> None:
        self.problem, self.beside = problem, beside
        if beside is not None:
            beside.beside = self
        self.classes = tuple(problem.classes)
        self.repeating: int = getattr(problem, "repeating", 0)
        if scores is not None and self.repeating:
            repeated = problem.actions[(self.repeating & -self.repeating).bit_length() - 1]
            raise InputError(
                f"Expected a problem whose actions are done once each, to be ordered by a prior; {repeated} may be "
                "done again. Leave the prior out and plan with a heuristic, or say once=True of the actions."
            )
        self.scores = None if scores is None else _fitted(scores, tuple(problem.actions), self.classes)
        # Under scores the step matters, too, which the number of used actions tells.
        self._remembered: int = getattr(problem, "remembered", -1) if scores is None else -1
        self.rng = rng or np.random.default_rng(0)
        self.log: SearchLog[Any] = SearchLog(problem, budget, beside=None if beside is None else beside.log)
        self.path: dict[Any, Node] = {}
        self.nogoods: Nogoods = Nogoods(None if beside is None else beside.nogoods, repeating=self.repeating)
        self.preferred = PreferredActions(problem.actions)
        self.deviated = False
        self._answers: dict[tuple[Any, int], Step[Any] | Rejection] = {}

    @classmethod
    def from_empty(cls, full: SearchContext) -> SearchContext | None:
        """That of the search from the goal, beside one from the initial state; None where the problem has none."""
        problem = reversed_problem(full.problem)
        if problem is None:
            return None
        scores = None if full.scores is None else full.scores.reversed()
        return cls(problem, scores, full.log.budget, full.rng.spawn(1)[0], beside=full)

    @property
    def from_goal(self) -> bool:
        """Whether this is the search from the goal."""
        return self.log.side == "empty"

    def key(self, node: Node) -> tuple[Any, int]:
        """What tells two nodes apart: the state, and which actions were used, as far as the state does not say it."""
        return self.key_of(node.state, node.used)

    def key_of(self, state: Any, used: int) -> tuple[Any, int]:
        """The same of a state and a bitset of used actions."""
        return state, used & self._remembered

    def check_budget(self) -> None:
        if self.log.out_of_budget():
            raise BudgetSpent

    def expand(self, state: Any, used: int) -> list[int]:
        """The unused candidates, one a class, by index: counts one expansion.

        Of interchangeable actions that are both unused, neither has left a trace in the state, so one speaks for both.
        """
        self.check_budget()
        first: dict[int, int] = {}
        candidates = sorted(self.log.candidates(state))
        if self.log.timed_out:
            raise BudgetSpent
        # From the goal the last one first: so both sides do those of a class in one order, and their states may meet.
        for action in reversed(candidates) if self.from_goal else candidates:
            if not used >> action & 1:
                first.setdefault(self.classes[action], action)
        return sorted(first.values())

    def attempt(self, node: Node, action: int) -> Step[Any] | Rejection:
        """The oracle's answer, which is asked once for each state and action."""
        answer = self._answers.get((node.state, action))
        if answer is None:
            self.check_budget()
            answer = self.log.attempt(node, node.state, action)
            if self.log.timed_out:
                raise BudgetSpent
            self._answers[node.state, action] = answer
        return answer

    def learn(self, node: Node, action: int, rejection: Rejection) -> None:
        """Keep what the rejection of `action` at `node` promises, and what it names."""
        self.nogoods.learn(node, action, rejection)
        self.preferred.learn(rejection, node.used | 1 << action)

    def restated(self, completion: tuple[int, ...], options: Sequence[int]) -> tuple[int, ...]:
        """The completion, its first action exchanged for the interchangeable one of `options`; empty without one."""
        label = self.classes[completion[0]]
        first = next((a for a in options if self.classes[a] == label), None)
        if first is None:
            return ()
        if first == completion[0]:
            return completion
        return (first, *(completion[0] if a == first else a for a in completion[1:]))

    def cost(self, step: int, action: int) -> float:
        """Of `action` at `step` under the scores (nats); 0 without any."""
        return 0.0 if self.scores is None else self.scores.cost(step, action)

    def length_cost(self, steps: int) -> float:
        """Of a plan's length under the scores (nats); 0 without any."""
        return 0.0 if self.scores is None else self.scores.length_cost(steps)

    def solved(self, node: Node, *, fewest: bool | None = None, cheapest: bool | None = None) -> PlanResult:
        """The result for the plan that led to `node`; whether it has the fewest actions, as far as that is known."""
        if self.beside is not None and self.from_goal:
            return self._solved(node.path()[::-1], self.beside.scores)
        return replace(self._solved(node.path(), self.scores, fewest), cheapest=cheapest)

    def meets(self, node: Node) -> bool:
        """Whether the search from the other end is at the state of `node`."""
        return self.beside is not None and node.state in self.beside.path

    def met(self, node: Node) -> PlanResult:
        """The result where it is."""
        assert self.beside is not None
        other = self.beside.path[node.state]
        full, first, then = (self.beside, other, node) if self.from_goal else (self, node, other)
        return replace(full._solved([*first.path(), *then.path()[::-1]], full.scores), side="both")

    def _solved(
        self, nodes: Sequence[Node], scores: OrderScores | None, fewest: bool | None = None
    ) -> PlanResult:
        plan, motions = [node.action for node in nodes], [node.motion for node in nodes]
        failed = self.deviated or self.log.iterations > 0
        return self.log.solved(plan, motions, scores=scores, first_guess_failed=failed, fewest=fewest)

    def failed(self, status: Status) -> PlanResult:
        """The result for a search without a plan."""
        return self.log.failed(status, first_guess_failed=self.deviated or self.log.iterations > 0 or None)


def _fitted(scores: OrderScores, names: tuple[str, ...], classes: Sequence[int]) -> OrderScores:
    """The scores with the classes of the problem joined to their own.

    Raises:
        InputError: the scores are about other actions.
    """
    if scores.n_actions != len(names):
        raise InputError(
            f"Expected scores with one column an action, {len(names)} in all; got {scores.n_actions}. "
            "Take scores.restricted(problem.actions) when some actions are done already."
        )
    if scores.actions and scores.actions != names:
        raise InputError(
            f"Expected scores for the actions {', '.join(names)}, in this order; got {', '.join(scores.actions)}. "
            "Take scores.restricted(problem.actions)."
        )
    joined = list(range(len(names)))
    for given in (classes, scores.classes):
        members: dict[int, int] = {}
        for action, label in enumerate(given):
            old, new = joined[action], joined[members.setdefault(label, action)]
            if old != new:
                joined = [new if other == old else other for other in joined]
    return scores if len(set(joined)) == len(set(scores.classes)) else replace(scores, classes=tuple(joined))
