"""Best-first search, lazy: a candidate waits under its cost and is put to the oracle only when it is its turn.

With the assignment cost-to-go (`planners.completion`), A* visits orders from the likeliest down, and the same
search, let run on, gives the k best plans.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError, UnknownNameError
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.planning.planner import Budget, Planner, PlannerTraits, PlanResult, SearchLog, Status
from neurosym.planning.prior import OrderScores
from planners.completion import RESOLUTION, Completion, remainder, with_first
from planners.evidence import Lessons, Names, agenda, fitted, promise, representatives
from planners.priorities import Outlook, Priority, astar, greedy, levin, weighted

S = TypeVar("S", bound=Hashable)

#: In place of an action in the queue: the siblings that have not been queued one by one; a goal that waits its turn.
_SIBLINGS, _GOAL = -1, -2


class BestFirst(Planner):
    """Lazy best-first search; complete, and with A* optimal.

    Optimal means: of all plans, the least `OrderScores.plan_cost`, to within 1e-6 nats a plan. Scores without
    `log_length` say that a plan takes exactly `n_steps` actions; where the goal comes at another length their
    cost-to-go is a guide only, and so is the order of the k best.

    Among equals the deepest comes first, then the rng decides. Nodes are keyed on (state, used actions).

    Args:
        priority: "astar", "weighted", "greedy", "levin", or a function of `planners.priorities.Outlook`.
        weight: of the cost-to-go in "weighted"; at least 1.
    """

    traits = PlannerTraits(complete=True, optimal=True, k_best=True)

    def __init__(self, *, priority: str | Priority = "astar", weight: float = 2.0) -> None:
        if not weight >= 1:
            raise InputError(f"Expected a weight of at least 1; got {weight}.")
        known = {"astar": astar, "weighted": weighted(weight), "greedy": greedy, "levin": levin}
        if isinstance(priority, str):
            if priority not in known:
                raise UnknownNameError("priority", priority, known)
            priority = known[priority]
        self.priority: Priority = priority
        if self.priority is not astar:
            self.traits = PlannerTraits(complete=True, optimal=False, k_best=True)

    def plan(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None = None,
        *,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        search = _Search(problem, scores, budget, rng, self.priority, 1)
        found = next(search.plans(), None)
        if found is not None:
            return found
        status = Status.OUT_OF_BUDGET if search.out_of_budget else Status.UNSOLVABLE
        return search.log.failed(status, first_guess_failed=search.log.iterations > 0 or None)

    def plans(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None = None,
        *,
        k: int,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> list[PlanResult]:
        """The k best plans, cheapest first; fewer where there are fewer, or where the budget ends.

        Always by A*. Orders that differ only by interchangeable actions count once. Each result carries the
        counts at the time when it was found.
        """
        if k < 0:
            raise InputError(f"Expected k of 0 or more; got {k}.")
        search = _Search(problem, scores, budget, rng, astar, k)
        found = [result for _, result in zip(range(k), search.plans())]
        return sorted(found, key=lambda result: result.cost or 0.0)


@dataclass(slots=True, eq=False)
class _Node(Generic[S]):
    """A state reached by one order of actions."""

    state: S
    used: int
    depth: int
    parent: _Node[S] | None
    action: int
    motion: Any
    path_cost: float = 0.0
    log_policy: float = 0.0
    log_total: float = 0.0  # log of the summed probability of the candidates here
    bound: float = 0.0  # least cost of a plan through here, as known when it was queued
    guess: tuple[int, ...] = ()  # the best completion, when it is known
    waiting: list[int] = field(default_factory=list)  # siblings not queued yet
    promises: dict[int, int] = field(default_factory=dict)  # refusals that hold below: action -> until mask

    def trace(self) -> tuple[list[int], list[Any]]:
        """Actions and motions from the root to here."""
        actions, motions, node = [], [], self
        while node.parent is not None:
            actions.append(node.action)
            motions.append(node.motion)
            node = node.parent
        return actions[::-1], motions[::-1]

    def refutes(self, action: int) -> bool:
        """Whether a refusal on the way here promises that `action` would be refused."""
        node: _Node[S] | None = self
        while node is not None:
            mask = node.promises.get(action)
            if mask is not None and not mask & self.used:
                return True
            node = node.parent
        return False


class _Search(Generic[S]):
    def __init__(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None,
        budget: Budget | None,
        rng: np.random.Generator | None,
        priority: Priority,
        k: int,
    ) -> None:
        self.problem, self.priority, self.k = problem, priority, k
        self.rng = rng or np.random.default_rng(0)
        self.scores = fitted(problem, scores)
        self.log = SearchLog(problem, budget)
        self.out_of_budget = False
        self.completion = None if self.scores is None else Completion(self.scores, self.rng)
        self.lazy = priority is astar  # only there is a node's cost a bound on all that come from it
        self.queue: list[tuple[float, int, float, int, _Node[S], int]] = []
        self.pushed = 0
        self.expanded: Counter[tuple[S, int]] = Counter()
        self.answers: dict[tuple[S, int], Step[S] | Rejection] = {}
        self.lessons = Lessons()
        self.named = Names(problem)
        self.agenda: list[int] = []  # named by refusals, the latest first

    def plans(self) -> Iterator[PlanResult]:
        """Plans in the order of the priority. When it ends, `out_of_budget` says whether that proves anything."""
        root: _Node[S] = _Node(self.problem.initial, 0, 0, None, -1, None)
        if self.problem.is_goal(root.state):
            yield self._result(root)
            return
        if self._stopped():
            return
        self._expand(root)
        while self.queue:
            key, _, _, _, node, action = heapq.heappop(self.queue)
            if action == _GOAL:
                yield self._result(node)
            elif action == _SIBLINGS:
                self._queue_all(node)
            elif not node.refutes(action) and not self.lessons.refute(action, node.used):
                child = self._attempt(node, action, key)
                if self.out_of_budget:
                    return
                if child is None:
                    continue
                if self.problem.is_goal(child.state):
                    child_key = self._goal_key(child)
                    if self.queue and child_key > self.queue[0][0]:
                        self._push(child_key, child.depth, child, _GOAL)
                    else:
                        yield self._result(child)
                elif self.expanded[child.state, child.used] < self.k:
                    # The k cheapest ways to a node are all that the k best plans can need of it.
                    if self._stopped():
                        return
                    self._expand(child)

    def _attempt(self, node: _Node[S], action: int, bound: float) -> _Node[S] | None:
        """The node that `action` leads to; None when it is refused, or when the budget ends first."""
        known = (node.state, action)
        answer = self.answers.get(known)
        if answer is None:
            if self._stopped():
                return None
            answer = self.log.attempt(tuple(node.trace()[0]), node.state, action)
            self.answers[known] = answer
        if isinstance(answer, Rejection):
            self.lessons.learn(action, answer)
            self.agenda = agenda(self.named(answer), self.agenda, node.used | 1 << action)
            mask = promise(answer, node.used)
            if mask is not None:
                node.promises[action] = mask
            return None
        cost = self._cost(node, action)
        child = _Node(answer.state, node.used | 1 << action, node.depth + 1, node, action, answer.motion)
        child.path_cost, child.bound = node.path_cost + cost, bound
        child.log_policy = node.log_policy - cost - node.log_total
        child.guess = remainder(node.guess, action)
        return child

    def _expand(self, node: _Node[S]) -> None:
        """Queue what may be tried next: one by one, or, while the best completion is known, that and the others."""
        self.expanded[node.state, node.used] += 1
        classes = self.problem.classes
        node.waiting = representatives(self.log.candidates(node.state), node.used, classes)
        if not node.waiting:
            return
        if not self.lazy:  # A* asks for no policy
            node.log_total = math.log(sum(math.exp(-self._cost(node, a)) for a in node.waiting))
        if self.lazy and node.guess:
            action = next((a for a in node.waiting if classes[a] == classes[node.guess[0]]), None)
            if action is not None:
                node.guess = with_first(node.guess, action)
                node.waiting.remove(action)
                self._push(node.bound, node.depth + 1, node, action)
            # No sibling can be cheaper than the best completion, so their costs are worked out only if need be.
            if node.waiting:
                self._push(node.bound, node.depth + 1, node, _SIBLINGS)
        else:
            self._queue_all(node)

    def _queue_all(self, node: _Node[S]) -> None:
        if self.lazy and (self.completion is None or self.completion.indifferent):
            self._queue_one(node)
            return
        totals: NDArray[np.float64] | None = None
        if self.completion is not None and self.priority is not levin:
            survey = self.completion.survey(node.depth, node.used)
            totals = survey.values
            node.guess = node.guess or self._restated(survey.best, node.waiting)
        for action in node.waiting:
            cost = self._cost(node, action)
            to_go = 0.0 if totals is None else float(totals[action]) - cost
            log_policy = node.log_policy - cost - node.log_total
            key = self.priority(Outlook(node.depth + 1, node.path_cost + cost, to_go, log_policy))
            self._push(key, node.depth + 1, node, action)
        node.waiting = []

    def _queue_one(self, node: _Node[S]) -> None:
        """Where nothing is preferred, what refusals named last, then at random; siblings wait while it leads on."""
        chosen = next((node.waiting.index(a) for a in self.agenda if a in node.waiting), None)
        if chosen is None:
            chosen = int(self.rng.integers(len(node.waiting)))
        node.waiting[chosen], node.waiting[-1] = node.waiting[-1], node.waiting[chosen]
        action = node.waiting.pop()
        bound = 0.0
        if self.completion is not None:
            bound = node.path_cost + float(self.completion.survey(node.depth, node.used).values[action])
        self._push(bound, node.depth + 1, node, action)
        if node.waiting:
            self._push(bound, node.depth + 1, node, _SIBLINGS)

    def _restated(self, guess: tuple[int, ...], options: list[int]) -> tuple[int, ...]:
        """The completion, beginning with the member of its class that is asked for here."""
        classes = self.problem.classes
        fellow = next((a for a in options if guess and classes[a] == classes[guess[0]]), None)
        return guess if fellow is None else with_first(guess, fellow)

    def _push(self, key: float, depth: int, node: _Node[S], action: int) -> None:
        # Siblings come after the attempts that they are as good as; the running number keeps nodes uncompared.
        tie = 1.0 if action == _SIBLINGS else float(self.rng.random())
        self.pushed += 1
        heapq.heappush(self.queue, (round(key / RESOLUTION) * RESOLUTION, -depth, tie, self.pushed, node, action))

    def _cost(self, node: _Node[S], action: int) -> float:
        return 0.0 if self.scores is None else self.scores.cost(node.depth, action)

    def _goal_key(self, node: _Node[S]) -> float:
        length = 0.0 if self.scores is None else self.scores.length_cost(node.depth)
        key = self.priority(Outlook(node.depth, node.path_cost, length, node.log_policy))
        return round(key / RESOLUTION) * RESOLUTION

    def _result(self, node: _Node[S]) -> PlanResult:
        plan, motions = node.trace()
        return self.log.solved(plan, motions, scores=self.scores, first_guess_failed=self.log.iterations > 0)

    def _stopped(self) -> bool:
        self.out_of_budget = self.log.out_of_budget()
        return self.out_of_budget
