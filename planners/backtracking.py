"""Backtracking: depth first, complete, in the order of the best completion under the prior.

It keeps the verified prefix, learns from every refusal what need not be asked again below it (`Rejection.until`),
and goes back only from states that are proved dead.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.planning.planner import Budget, Planner, PlannerTraits, PlanResult, SearchLog, Status
from neurosym.planning.prior import OrderScores
from planners.completion import RESOLUTION, Completion, remainder, with_first
from planners.evidence import Lessons, Names, agenda, fitted, promise, representatives

S = TypeVar("S", bound=Hashable)


@dataclass(slots=True)
class _Frame(Generic[S]):
    """A state on the current path: what is still untried here, and what was learned here."""

    state: S
    used: int
    untried: list[int]
    guess: tuple[int, ...]  # the best completion from here on; empty when it is not known
    values: NDArray[np.float64] | None = None  # what each next action costs in the end
    promised: list[int] = field(default_factory=list)  # actions with a promise that holds below this state


class Backtracking(Planner):
    """Depth-first search that learns; complete, and proves unsolvability.

    With scores, the next action is the first of the cheapest completion (`planners.completion`) that is not known
    to be refused; a completion is kept for as long as it is followed, so a good prior costs one assignment.
    Among equals, and without scores: what the last refusals named, then the rng. A node is a state with the set
    of used actions; one found dead is never entered again.
    """

    traits = PlannerTraits(complete=True)

    def plan(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None = None,
        *,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        rng = rng or np.random.default_rng(0)
        return _Search(problem, fitted(problem, scores), SearchLog(problem, budget), rng).run()


class _Search(Generic[S]):
    def __init__(
        self, problem: SearchProblem[S], scores: OrderScores | None, log: SearchLog[S], rng: np.random.Generator
    ) -> None:
        self.problem, self.scores, self.log = problem, scores, log
        completion = None if scores is None else Completion(scores, rng)
        self.completion = None if completion is None or completion.indifferent else completion
        self.rank = rng.permutation(len(problem.actions))  # the last tie-breaker
        self.named = Names(problem)
        self.agenda: list[int] = []  # named by refusals, the latest first
        self.promises: dict[int, list[int]] = {}  # action -> masks, of all frames on the path
        self.answers: dict[tuple[S, int], Step[S] | Rejection] = {}
        self.lessons = Lessons()
        self.dead: set[tuple[S, int]] = set()
        self.path: list[_Frame[S]] = []
        self.prefix: list[int] = []
        self.motions: list[Any] = []
        self.deviated = False

    def run(self) -> PlanResult:
        if self.problem.is_goal(self.problem.initial):
            return self.log.solved((), scores=self.scores, first_guess_failed=False)
        if self.log.out_of_budget():
            return self.log.failed(Status.OUT_OF_BUDGET)
        self._enter(self.problem.initial, 0, ())
        while self.path:
            frame = self.path[-1]
            action = self._choose(frame)
            if action is None:
                self._leave()
                continue
            answer = self.answers.get((frame.state, action))
            if answer is None:
                if self.log.out_of_budget():
                    return self.log.failed(Status.OUT_OF_BUDGET, first_guess_failed=self._first_guess_failed() or None)
                answer = self.log.attempt(tuple(self.prefix), frame.state, action)
                self.answers[frame.state, action] = answer
            frame.untried.remove(action)
            if isinstance(answer, Rejection):
                self._learn(frame, action, answer)
                continue
            if self.problem.is_goal(answer.state):
                failed = self._first_guess_failed()
                plan, motions = (*self.prefix, action), (*self.motions, answer.motion)
                return self.log.solved(plan, motions, scores=self.scores, first_guess_failed=failed)
            used = frame.used | 1 << action
            if (answer.state, used) in self.dead:
                continue
            if self.log.out_of_budget():
                return self.log.failed(Status.OUT_OF_BUDGET, first_guess_failed=self._first_guess_failed() or None)
            self.prefix.append(action)
            self.motions.append(answer.motion)
            self._enter(answer.state, used, remainder(frame.guess, action))
        return self.log.failed(Status.UNSOLVABLE, first_guess_failed=True)

    def _enter(self, state: S, used: int, guess: tuple[int, ...]) -> None:
        untried = representatives(self.log.candidates(state), used, self.problem.classes)
        self.path.append(_Frame(state, used, untried, guess))

    def _leave(self) -> None:
        """Go back from a dead state; what was promised there is forgotten, for it holds only below it."""
        frame = self.path.pop()
        self.dead.add((frame.state, frame.used))
        for action in frame.promised:
            self.promises[action].pop()
        if self.path:
            self.prefix.pop()
            self.motions.pop()
            self.deviated = True

    def _learn(self, frame: _Frame[S], action: int, rejection: Rejection) -> None:
        self.lessons.learn(action, rejection)
        mask = promise(rejection, frame.used)
        if mask is not None:
            self.promises.setdefault(action, []).append(mask)
            frame.promised.append(action)
        self.agenda = agenda(self.named(rejection), self.agenda, frame.used | 1 << action)

    def _refuted(self, frame: _Frame[S], action: int) -> bool:
        """Whether a refusal higher up on the path, or an unconditional one, promises that `action` is refused here."""
        if self.lessons.refute(action, frame.used):
            return True
        return any(not mask & frame.used for mask in self.promises.get(action, ()))

    def _choose(self, frame: _Frame[S]) -> int | None:
        """The next action to ask for in this frame, or None when nothing is left."""
        if self.completion is None:
            options = [a for a in frame.untried if not self._refuted(frame, a)]
            return self._foremost(options) if options else None
        if frame.guess:
            classes = self.problem.classes
            action = next((a for a in frame.untried if classes[a] == classes[frame.guess[0]]), None)
            if action is not None and not self._refuted(frame, action):
                frame.guess = with_first(frame.guess, action)
                return action
        options = [a for a in frame.untried if not self._refuted(frame, a)]
        if not options:
            return None
        if frame.values is None:
            self.deviated = self.deviated or bool(frame.guess)
            survey = self.completion.survey(len(self.prefix), frame.used)
            frame.values, frame.guess = survey.values, survey.best
        least = min(frame.values[a] for a in options)
        return self._foremost([a for a in options if frame.values[a] <= least + RESOLUTION])

    def _foremost(self, options: list[int]) -> int:
        """Among equals: what the latest refusals named, then the rng's order."""
        if self.agenda:
            here = set(options)
            for action in self.agenda:
                if action in here:
                    return action
        return int(min(options, key=lambda a: self.rank[a]))

    def _first_guess_failed(self) -> bool:
        return self.deviated or self.log.iterations > 0
