"""What the page asks for and what it shows: no server, no browser."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from neurosym.errors import NeurosymError
from neurosym.geometry.step_motion import StepMotion
from neurosym.language.problem import Problem
from neurosym.language.search_problem import Rejection, Step
from neurosym.pipeline import advice
from neurosym.plan_files.reading import COUNTS, SavedPlan
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.result import PlanResult, Status
from neurosym.planning.staging import stage
from neurosym.planning.validation import validate
from neurosym.support.arrays import Pixels
from neurosym.viewer.timeline import Timeline

#: Makes a problem of options given by name.
Maker = Callable[..., Problem]
#: What the library refuses on purpose, or the system does: a message, never a traceback.
REFUSED = (NeurosymError, OSError, NotImplementedError)


@dataclass(frozen=True)
class Query:
    """What to plan, and how: a problem family, or a name that the command line gave, which bears no number.

    No prior plans without one; a budget of None sets no limit.
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
    """What a search knew and did: `steps` are its plan or the longest prefix that works, with a motion each, or none.

    `undone` is what can be undone from the goal at the most, of a search that ended there without a plan. The refusals
    are in order; figures (`counts`), settings and reasons why there is no plan are for people to read.
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
    undone: tuple[str, ...] | None = None

    @property
    def solved(self) -> bool:
        """Whether `steps` is a plan."""
        return self.status is Status.SOLVED

    @classmethod
    def of(cls, result: PlanResult, query: Query, scores: OrderScores | None, *, stopped: bool = False) -> Self:
        """What a planner answered to a query."""
        counts = {name: getattr(result, name) for name in COUNTS}
        if result.cost is not None:
            counts["cost (nats)"] = result.cost
        sentence = result.status.sentence
        if stopped and not result.solved:
            sentence = "Stopped; the longest prefix that works is kept."
        steps = result.best_prefix if result.plan is None else result.plan
        motions = () if result.plan is None else result.motions
        settings = _settings(query.planner, query.prior, query.oracle)
        why_not = () if result.why_not is None else tuple(result.why_not.sentences)
        undone = result.best_suffix if result.side == "empty" and not result.solved else None
        return cls(steps, motions, result.status, sentence, result.blame, counts, settings, scores, why_not, undone)

    @classmethod
    def saved(cls, saved: SavedPlan, scores: OrderScores | None) -> Self:
        """What a plan's file says of it. A plan that does not hold, by geometry asked anew, is none.

        Plans that a simulation allowed are left to it (`neurosym replay`). Raises InputError: the file's account of the
        search is not what `neurosym plan --out` writes.
        """
        account = saved.account()
        status, sentence = account.status, account.status.sentence
        if status is Status.SOLVED and saved.document.get("oracle", "geometry") == "geometry":
            checked = validate(saved.problem, saved.plan, saved.motions)
            if not checked.ok:
                status, sentence = Status.GAVE_UP, f"The file has a plan, but it does not hold. {checked.reason}"
        settings = _settings(*(saved.document.get(key) for key in ("planner", "prior", "oracle")))
        undone = account.best_suffix if saved.document.get("side") == "empty" and status is not Status.SOLVED else None
        evidence = (account.refusals, account.counts, settings, scores, account.why_not, undone)
        return cls(saved.plan, saved.motions, status, sentence, *evidence)


def _settings(planner: object, prior: object, oracle: object) -> str:
    return f"{planner} {f'with the prior {prior}' if prior else 'without a prior'}, oracle {oracle}"


@dataclass(frozen=True, eq=False)
class Exhibit:
    """A problem and a search, ready to be looked at; the timeline is None where the problem has no parts in space.

    Pictures, the observation, are uint8 (V, H, W, 3) or None; notes say what cannot be shown, and why.
    """

    problem: Problem
    search: Search
    timeline: Timeline | None
    pictures: Pixels | None
    notes: tuple[str, ...] = ()

    @property
    def buildable(self) -> tuple[str, ...] | None:
        """The parts that are in place in the furthest state from the empty side, where that decided; else None."""
        if self.timeline is None or self.search.undone is None:
            return None
        missing = set(self.problem.actions) - set(self.search.undone)
        return tuple(name for name in self.timeline.names if name not in missing)

    @classmethod
    def of(cls, problem: Problem, search: Search, notes: tuple[str, ...] = ()) -> Self:
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
    def saved(cls, saved: SavedPlan) -> Self:
        """A plan from a file. Its prior is asked again; where that fails, a note says so."""
        scores, notes = None, []
        try:
            scores = advice(saved.problem, saved.document.get("prior"))
        except REFUSED as error:
            notes.append(f"The prior's scores are not shown: {error}")
        return cls.of(saved.problem, Search.saved(saved, scores), tuple(notes))


def _motions(problem: Problem, search: Search) -> tuple[StepMotion | None, ...]:
    """The motions of a prefix, which a search without a plan does not say: each step is asked for once more."""
    if search.solved:
        return ()
    grounded, motions = problem.ground(), []
    state = grounded.initial
    for name in search.steps:
        step = grounded.attempt(state, grounded.actions.index(name)) if name in grounded.actions else None
        if not isinstance(step, Step):
            return ()
        state = step.state
        motions.append(step.motion)
    return tuple(motions)
