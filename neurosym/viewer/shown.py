"""What the page asks for and what it shows: no server, no browser."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError, NeurosymError
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.problem import Problem
from neurosym.language.search_problem import Rejection, Step
from neurosym.pipeline import advice
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import PlanResult, Status
from neurosym.planning.staging import stage
from neurosym.planning.validation import validate
from neurosym.viewer.timeline import Timeline

if TYPE_CHECKING:
    from neurosym.plan_files.reading import SavedPlan

#: Makes a problem of options given by name.
Maker = Callable[..., Problem]

#: What the library refuses on purpose, or the system does: a message, never a traceback.
REFUSED = (NeurosymError, OSError, NotImplementedError)


@dataclass(frozen=True)
class Query:
    """What to plan, and how.

    Attributes:
        domain: name of a problem family, or of what the command line was given.
        number: which of its problems; None for what the command line was given.
        options: of the family's problems.
        planner, prior: names; None plans without a prior.
        oracle: what answers attempts.
        seed: breaks ties.
        seconds, attempts: budget; None sets no limit.
    """

    domain: str
    number: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    planner: str = "backtracking"
    prior: str | None = None
    oracle: str = "geometry"
    seed: int = 0
    seconds: float | None = None
    attempts: int | None = None


@dataclass(frozen=True, eq=False)
class Search:
    """What a search knew and did.

    Attributes:
        steps: names of the actions that are played: the plan, or the longest prefix that works.
        motions: one a step, as `PlanResult.motions` has them, or nothing.
        status: how it ended.
        sentence: that in words.
        refusals: refused attempts in order.
        counts: figures by name, for people.
        settings: planner, prior and oracle in a few words.
        scores: the prior's, or None.
        why_not: sentences that say why there is no plan, where the problem can tell.
    """

    steps: tuple[str, ...]
    motions: tuple[StepMotion | None, ...]
    status: Status
    sentence: str
    refusals: tuple[Rejection, ...]
    counts: Mapping[str, float]
    settings: str
    scores: OrderScores | None = None
    why_not: tuple[str, ...] = ()

    @property
    def solved(self) -> bool:
        """Whether `steps` is a plan."""
        return self.status is Status.SOLVED

    @classmethod
    def of(cls, result: PlanResult, query: Query, scores: OrderScores | None, *, stopped: bool = False) -> Search:
        """What a planner answered to a query."""
        counts = {name: getattr(result, name) for name in _COUNTS}
        if result.cost is not None:
            counts["cost (nats)"] = result.cost
        said = "Stopped; the longest prefix that works is kept." if stopped and not result.solved else None
        steps = result.best_prefix if result.plan is None else result.plan
        motions = () if result.plan is None else result.motions
        settings = _settings(query.planner, query.prior, query.oracle)
        sentence = said or result.status.sentence
        why_not = () if result.why_not is None else tuple(result.why_not.sentences)
        return cls(steps, motions, result.status, sentence, result.blame, counts, settings, scores, why_not)

    @classmethod
    def saved(cls, saved: SavedPlan, scores: OrderScores | None) -> Search:
        """What a plan's file says of it.

        Raises:
            InputError: the file's account of the search is not what `neurosym plan --out` writes.
        """
        document = saved.document
        try:
            status = Status[document["status"]]
            refusals = tuple(
                Rejection(str(r["reason"]), tuple(r["because"]), action=str(r["action"]), after=tuple(r["after"]))
                for r in document["refusals"]
            )
            counts = {name: document[name] for name in _COUNTS if isinstance(document[name], int | float)}
            why_not = tuple(map(str, (document.get("why_not") or {}).get("sentences", ())))
        except (AttributeError, KeyError, TypeError) as error:
            raise InputError(f"Expected a plan's file as `neurosym plan --out` writes it; got {error!r}.") from None
        settings = _settings(*(document.get(key) for key in ("planner", "prior", "oracle")))
        return cls(saved.plan, saved.motions, status, status.sentence, refusals, counts, settings, scores, why_not)


_COUNTS = ("iterations", "attempts", "expansions", "seconds")


def _settings(planner: object, prior: object, oracle: object) -> str:
    return f"{planner} {f'with the prior {prior}' if prior else 'without a prior'}, oracle {oracle}"


@dataclass(frozen=True, eq=False)
class Shown:
    """A problem and a search, ready to be looked at.

    Attributes:
        problem: what was planned.
        search: how.
        timeline: the film, or None where the problem has no parts in space.
        pictures: the observation, uint8 (V, H, W, 3), or None.
        notes: what cannot be shown, and why.
    """

    problem: Problem
    search: Search
    timeline: Timeline | None
    pictures: NDArray[np.uint8] | None
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, problem: Problem, search: Search, notes: tuple[str, ...] = ()) -> Shown:
        """Stage the film and take the pictures, as far as the problem has them."""
        timeline, pictures = None, None
        try:
            staging = stage(problem, search.steps, search.motions or _motions(problem, search))
            timeline = Timeline(staging, problem.geometry)
        except REFUSED as error:
            notes = (*notes, f"There is nothing to show in space: {error}")
        try:
            pictures = problem.observation
        except REFUSED as error:
            notes = (*notes, f"There are no pictures: {error}")
        return cls(problem, search, timeline, pictures, notes)

    @classmethod
    def saved(cls, saved: SavedPlan) -> Shown:
        """A plan from a file. Its prior is asked again; where that fails, a note says so."""
        scores, notes = None, []
        try:
            scores = advice(saved.problem, saved.document.get("prior"))
        except REFUSED as error:
            notes.append(f"The prior's scores are not shown: {error}")
        return cls.of(saved.problem, _checked(saved, Search.saved(saved, scores)), tuple(notes))


def _checked(saved: SavedPlan, search: Search) -> Search:
    """The search that a file tells of; where its plan does not hold, by geometry asked anew, that is said instead.

    Plans that a simulation allowed are left to it (`neurosym replay`).
    """
    if not search.solved or saved.document.get("oracle", "geometry") != "geometry":
        return search
    checked = validate(saved.problem, saved.plan, saved.motions)
    if checked.ok:
        return search
    sentence = f"The file has a plan, but it does not hold. {checked.reason}"
    return replace(search, status=Status.GAVE_UP, sentence=sentence)


def _motions(problem: Problem, search: Search) -> tuple[StepMotion | None, ...]:
    """The motions of a prefix, which a search without a plan does not say: each step is asked for once more.

    Nothing where one is refused: another oracle than geometry may have allowed it.
    """
    if search.solved:
        return ()
    grounded, motions = problem.ground(), []
    state = grounded.initial
    for name in search.steps:
        if name not in grounded.actions:
            return ()
        step = grounded.attempt(state, grounded.actions.index(name))
        if not isinstance(step, Step):
            return ()
        state = step.state
        motions.append(step.motion)
    return tuple(motions)
