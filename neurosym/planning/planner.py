"""Planners: the interface, budgets, results, and the log that every planner keeps while it searches.

Two things are required of a planner: subclass `Planner`, and declare `traits` truthfully. Counting,
budgets and results come from `SearchLog`, so that planners are compared in one unit.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from neurosym.errors import ContractError, InputError
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.planning.prior import OrderScores

if TYPE_CHECKING:
    from neurosym.geometry.step_motion import StepMotion
    from neurosym.language.explanation import WhyNot

S = TypeVar("S", bound=Hashable)

#: Refusals kept as evidence in a result. Beyond it only the count goes on: a hard search would fill the memory.
MAX_BLAME = 10_000


class Status(Enum):
    """How a search ended: a sentence for the user, and the exit code of the command line."""

    SOLVED = ("A plan was found.", 0)
    UNSOLVABLE = ("Proved: no order of these actions reaches the goal.", 11)
    GAVE_UP = ("No plan was found, and none was ruled out; a complete planner may know more.", 12)
    OUT_OF_BUDGET = ("The budget ended first; the best prefix is kept. Give more, or a better prior.", 23)

    def __init__(self, sentence: str, exit_code: int) -> None:
        self.sentence = sentence
        self.exit_code = exit_code


@dataclass(frozen=True)
class Budget:
    """When to stop: whichever limit is reached first. `None` sets no limit.

    Args:
        seconds: wall-clock time.
        attempts: questions to the oracle.
        expansions: states whose candidates were generated.
        watch: called with the search's log whenever its limits are looked at, which is before every attempt and every
            expansion; True ends the search. For progress, and for a button that stops.
    """

    seconds: float | None = None
    attempts: int | None = None
    expansions: int | None = None
    watch: Callable[[SearchLog[Any]], bool] | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.watch is not None and not callable(self.watch):
            raise InputError(f"Expected watch of a budget to be a function of the search's log; got {self.watch!r}.")
        for name in ("seconds", "attempts", "expansions"):
            value = getattr(self, name)
            whole = name == "seconds" or isinstance(value, int | np.integer)
            if value is not None and not (isinstance(value, int | float | np.number) and whole and value >= 0):
                kind = "a number" if name == "seconds" else "an integer"
                raise InputError(f"Expected {name} of a budget to be {kind}, 0 or more; got {value!r}.")

    @property
    def limits(self) -> dict[str, float | int | None]:
        """The three limits by name, for files."""
        return {"seconds": self.seconds, "attempts": self.attempts, "expansions": self.expansions}


@dataclass(frozen=True)
class PlannerTraits:
    """What a planner claims; the conformance suite checks it.

    Attributes:
        complete: finds a plan whenever there is one, and proves that there is none otherwise.
        optimal: its plan has the least total prior cost of all plans.
        uses_scores: a prior changes what it does.
        k_best: `plans(k=...)` gives the k best plans.
    """

    complete: bool
    optimal: bool = False
    uses_scores: bool = True
    k_best: bool = False


@dataclass(frozen=True)
class Refusal:
    """One refused attempt, as kept in a result: after which actions, what was tried, and why not."""

    after: tuple[str, ...]
    action: str
    reason: str
    because: tuple[str, ...] = ()


class Plan(tuple[str, ...]):
    """Names of actions in order: a tuple that knows how each of them is done.

    Attributes:
        motions: one an action (None: it moves nothing in space), or none at all.
    """

    motions: tuple[StepMotion | None, ...]

    def __new__(cls, actions: Iterable[str], motions: Iterable[StepMotion | None] = ()) -> Plan:
        made = super().__new__(cls, actions)
        made.motions = tuple(motions)
        return made

    def reversed(self) -> Plan:
        """The plan backwards, for what was taken apart to be put together: last first, each motion reversed."""
        return Plan(self[::-1], [motion and motion.reversed() for motion in self.motions[::-1]])


@dataclass(frozen=True)
class PlanResult:
    """What a search found. `plan` is present exactly when `status` is SOLVED; anything else raises.

    Attributes:
        status: how it ended.
        plan: names of the actions in order, or None.
        motions: one a step of the plan, as the oracle says it may be done, or none at all.
        iterations: refusals before the plan (for swap repair, the paper's count of failed rollouts).
        expansions: states whose candidates were generated.
        attempts: questions put to the oracle.
        seconds: wall-clock time.
        best_prefix: the longest verified prefix; equals `plan` when solved.
        blame: the refused attempts in order, the evidence of a failure (the first 10,000).
        cost: the plan's cost under the prior (nats), or None when there was no prior or no plan.
        first_guess_failed: whether the first complete order that was tried was refused somewhere;
            the paper's initial collapse. None when the search says nothing about it.
        why_not: why the search could not go on, for a problem that can explain it and has no plan; else None.
    """

    status: Status
    plan: Plan | None
    iterations: int
    expansions: int
    attempts: int
    seconds: float
    best_prefix: tuple[str, ...] = ()
    blame: tuple[Refusal, ...] = ()
    motions: tuple[StepMotion | None, ...] = ()
    cost: float | None = None
    first_guess_failed: bool | None = None
    why_not: WhyNot | None = None

    def __post_init__(self) -> None:
        if (self.plan is not None) != (self.status is Status.SOLVED):
            raise ContractError(
                f"Expected a plan exactly when the status is SOLVED; got {self.status.name} with plan {self.plan}."
            )
        if self.plan is not None and len(self.motions) not in (0, len(self.plan)):
            raise ContractError(f"Expected one motion a step, {len(self.plan)} in all; got {len(self.motions)}.")
        if self.plan is not None:
            object.__setattr__(self, "plan", Plan(self.plan, self.motions))

    @property
    def solved(self) -> bool:
        return self.status is Status.SOLVED

    def reversed(self) -> Plan:
        """The plan backwards, each motion reversed: how to put together what the plan takes apart.

        Raises:
            InputError: there is no plan.
        """
        if self.plan is None:
            raise InputError(f"Expected a result with a plan to reverse; got {self.status.name}.")
        return self.plan.reversed()


@dataclass(frozen=True)
class OrderCount:
    """In how many orders a goal can be reached.

    Attributes:
        orders: the number; None where the budget ended first.
        exact: whether there are no others; False where something was refused without proof.
        states: how many were looked at.
        seconds: wall-clock time.
    """

    orders: int | None
    exact: bool
    states: int
    seconds: float

    def as_json(self) -> dict[str, Any]:
        """For a file."""
        return asdict(self)


class SearchLog(Generic[S]):
    """Counts, budget, evidence and best prefix of one search. Every attempt of a planner goes through it."""

    def __init__(self, problem: SearchProblem[S], budget: Budget | None = None) -> None:
        self.problem = problem
        self.budget = budget or Budget()
        self.attempts = 0
        self.expansions = 0
        self.iterations = 0
        self.best_prefix: tuple[int, ...] = ()
        self.all_proved = True  # whether every refusal so far was certain
        self._refusals: list[tuple[tuple[int, ...], int, Rejection]] = []
        self._start = time.perf_counter()

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self._start

    def out_of_budget(self) -> bool:
        """Whether a limit has been reached: ask before every attempt and every expansion."""
        b = self.budget
        return (
            (b.attempts is not None and self.attempts >= b.attempts)
            or (b.expansions is not None and self.expansions >= b.expansions)
            or (b.seconds is not None and self.seconds >= b.seconds)
            or (b.watch is not None and b.watch(self))
        )

    def candidates(self, state: S) -> Sequence[int]:
        """The candidates of `state`; counts one expansion."""
        self.expansions += 1
        return tuple(self.problem.candidates(state))

    def attempt(self, prefix: tuple[int, ...], state: S, action: int) -> Step[S] | Rejection:
        """Ask the oracle for `action` after `prefix`, which led to `state`; counts one attempt."""
        self.attempts += 1
        answer = self.problem.attempt(state, action)
        if isinstance(answer, Rejection):
            self.iterations += 1
            self.all_proved = self.all_proved and answer.proved
            if len(self._refusals) < MAX_BLAME:
                self._refusals.append((prefix, action, answer))
        elif len(prefix) >= len(self.best_prefix):
            self.best_prefix = (*prefix, action)
        return answer

    def refuse(self, prefix: tuple[int, ...], action: int, reason: str) -> None:
        """Note a guess that failed without asking the oracle (not a candidate): an iteration, no attempt."""
        self.iterations += 1
        if len(self._refusals) < MAX_BLAME:
            self._refusals.append((prefix, action, Rejection(reason)))

    def names(self, actions: Sequence[int]) -> tuple[str, ...]:
        return tuple(self.problem.actions[a] for a in actions)

    def solved(
        self,
        plan: Sequence[int],
        motions: Sequence[StepMotion | None] = (),
        *,
        scores: OrderScores | None = None,
        first_guess_failed: bool | None = None,
    ) -> PlanResult:
        """The result for a plan, given as indices of actions."""
        cost = None if scores is None else scores.plan_cost(plan)
        return self._result(Status.SOLVED, tuple(plan), tuple(motions), cost, first_guess_failed)

    def failed(self, status: Status, *, first_guess_failed: bool | None = None) -> PlanResult:
        """The result for a search that ended without a plan.

        What was refused without proof leaves nothing proved: UNSOLVABLE then becomes GAVE_UP.
        """
        if status is Status.UNSOLVABLE and not self.all_proved:
            status = Status.GAVE_UP
        return self._result(status, None, (), None, first_guess_failed)

    def _result(
        self,
        status: Status,
        plan: tuple[int, ...] | None,
        motions: tuple[StepMotion | None, ...],
        cost: float | None,
        first_guess_failed: bool | None,
    ) -> PlanResult:
        names = self.problem.actions
        blame = tuple(Refusal(self.names(p), names[a], r.reason, r.because) for p, a, r in self._refusals)
        return PlanResult(
            status=status,
            plan=None if plan is None else Plan(self.names(plan), motions),
            iterations=self.iterations,
            expansions=self.expansions,
            attempts=self.attempts,
            seconds=self.seconds,
            best_prefix=self.names(self.best_prefix if plan is None else plan),
            blame=blame,
            motions=motions,
            cost=cost,
            first_guess_failed=first_guess_failed,
        )


class Planner(ABC):
    """A planner: one method, and an honest declaration of what it can do."""

    #: Usually set on the class; an instance may set its own where an option changes what can be claimed.
    traits: PlannerTraits

    @abstractmethod
    def plan(
        self,
        problem: SearchProblem[S],
        scores: OrderScores | None = None,
        *,
        budget: Budget | None = None,
        rng: np.random.Generator | None = None,
    ) -> PlanResult:
        """Search for an order of actions that reaches the goal.

        Args:
            problem: what to solve.
            scores: a prior's advice, shape (n_steps, n_actions), or None. Advice only: a complete planner
                stays complete under any scores.
            budget: when to stop; None never stops early.
            rng: breaks ties; None means a fixed seed.
        """

