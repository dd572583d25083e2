"""What a search answers: how it ended, the plan, the counts, and the evidence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from neurosym.errors import ContractError, InputError
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import Rejection
from neurosym.planning.result_text import as_html, as_text, figures
from neurosym.support.words import listed

if TYPE_CHECKING:
    from neurosym.language.explanation import WhyNot


class Status(Enum):
    """How a search ended: a sentence for the user, and the exit code of the command line."""

    SOLVED = ("A plan was found.", 0)
    UNSOLVABLE = ("Proved: no order of these actions reaches the goal.", 11)
    GAVE_UP = ("No plan was found, and none was ruled out.", 12)
    OUT_OF_BUDGET = ("The budget ended first; the best prefix is kept. Give more, or a better prior.", 23)

    def __init__(self, sentence: str, exit_code: int) -> None:
        self.sentence = sentence
        self.exit_code = exit_code


class Plan(tuple[str, ...]):
    """Names of actions in order: a tuple that knows how each of them is done.

    `motions`: one an action (None: it moves nothing in space), or none at all.
    """

    motions: tuple[StepMotion | None, ...]

    def __new__(cls, actions: Iterable[str], motions: Iterable[StepMotion | None] = ()) -> Plan:
        made = super().__new__(cls, actions)
        made.motions = tuple(motions)
        return made

    def reversed(self) -> Plan:
        """The plan backwards, for what was taken apart to be put together: last first, each motion reversed."""
        return Plan(self[::-1], [motion and motion.reversed() for motion in self.motions[::-1]])


@dataclass(frozen=True, repr=False)
class PlanResult:
    """What a search found; printed, it reads as the command line's answer.

    `plan` is present exactly when `status` is SOLVED; anything else raises.

    Attributes:
        iterations: rejections before the plan (for swap repair, the paper's count of failed rollouts).
        expansions: states whose candidates were generated.
        attempts: questions put to the oracle.
        seconds: wall-clock time.
        best_prefix: the longest verified prefix; equals `plan` when solved.
        blame: the rejections in order, each with its action and what was done before it (the first 10,000).
        motions: one a step of the plan, as the oracle says it may be done, or none at all.
        cost: the plan's cost under the prior (nats), or None when there was no prior or no plan.
        first_guess_failed: whether the first complete order that was tried was refused somewhere;
            the paper's initial collapse. None when the search says nothing about it.
        fewest: whether it is proved that no plan has fewer actions; None where nobody asked.
        total_cost: what the plan's actions cost in sum, where the domain says what they do; else None.
        cheapest: whether it is proved that no plan costs less; None where nobody asked.
        why_not: why the search could not go on, for a problem that can explain it and has no plan; else None.
        side: from which side the search came to its end: "full", from the initial state; "empty", from the goal; "both"
            where they met.
        best_suffix: the longest verified end of an order, from the empty side: what can be undone of all that is done.
            None where nothing was searched from there.
        n_actions: how many action primitives the problem has; None where nobody said.
    """

    status: Status
    plan: Plan | None
    iterations: int
    expansions: int
    attempts: int
    seconds: float
    best_prefix: tuple[str, ...] = ()
    blame: tuple[Rejection, ...] = ()
    motions: tuple[StepMotion | None, ...] = ()
    cost: float | None = None
    first_guess_failed: bool | None = None
    why_not: WhyNot | None = None
    fewest: bool | None = None
    side: str = "full"
    best_suffix: tuple[str, ...] | None = None
    total_cost: float | None = None
    cheapest: bool | None = None
    n_actions: int | None = None

    def __post_init__(self) -> None:
        if (self.plan is not None) != (self.status is Status.SOLVED):
            raise ContractError(
                f"Expected a plan exactly when the status is SOLVED; got {self.status.name} with plan {self.plan}."
            )
        if self.plan is not None:
            if len(self.motions) not in (0, len(self.plan)):
                raise ContractError(f"Expected one motion a step, {len(self.plan)} in all; got {len(self.motions)}.")
            object.__setattr__(self, "plan", Plan(self.plan, self.motions))

    def __repr__(self) -> str:
        plan = "" if self.plan is None else f" {listed(self.plan)};"
        return f"PlanResult({self.status.name},{plan} {figures(self)})"

    def __str__(self) -> str:
        return as_text(self)

    def _repr_html_(self) -> str:
        return as_html(self)

    @property
    def solved(self) -> bool:
        return self.status is Status.SOLVED

    def reversed(self) -> Plan:
        """The plan backwards, each motion reversed: how to put together what the plan takes apart.

        Raises InputError: there is no plan.
        """
        if self.plan is None:
            raise InputError(f"Expected a result with a plan to reverse; got {self.status.name}.")
        return self.plan.reversed()


@dataclass(frozen=True)
class OrderCount:
    """In how many orders a goal can be reached.

    `orders`: the number; None where the budget ended first. `exact`: whether there are no others; False where something
    was refused without proof. `states`: how many were looked at. `seconds`: wall-clock time. `told_apart`:
    how many there are where interchangeable actions, which `orders` counts once, are told apart.
    """

    orders: int | None
    exact: bool
    states: int
    seconds: float
    told_apart: int | None = None

    def as_json(self) -> dict[str, Any]:
        """For a file."""
        return asdict(self)
