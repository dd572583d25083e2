"""What the page shows, and the thread that plans it: no server, no browser."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError, NeurosymError, UnknownNameError
from neurosym.language.domain import Problem
from neurosym.motions import stage
from neurosym.pipeline import ORACLES, advice, solve
from neurosym.planner import Budget, PlanResult, Refusal, SearchLog, Status
from neurosym.prior import OrderScores
from neurosym.registry import load_domain, planner_names, prior_names
from neurosym.viewer.timeline import Timeline

if TYPE_CHECKING:
    from neurosym.plan_files import SavedPlan

_log = logging.getLogger(__name__)

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
        how: one entry a step, as `PlanResult.how` has them, or nothing.
        status: how it ended.
        sentence: that in words.
        refusals: refused attempts in order.
        counts: figures by name, for people.
        settings: planner, prior and oracle in a few words.
        scores: the prior's, or None.
        why_not: sentences that say why there is no plan, where the problem can tell.
    """

    steps: tuple[str, ...]
    how: tuple[Any, ...]
    status: Status
    sentence: str
    refusals: tuple[Refusal, ...]
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
        how = () if result.plan is None else result.how
        settings = _settings(query.planner, query.prior, query.oracle)
        sentence = said or result.status.sentence
        why_not = () if result.why_not is None else tuple(result.why_not.sentences)
        return cls(steps, how, result.status, sentence, result.blame, counts, settings, scores, why_not)

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
                Refusal(tuple(r["after"]), str(r["action"]), str(r["reason"]), tuple(r["because"]))
                for r in document["refusals"]
            )
            counts = {name: document[name] for name in _COUNTS if isinstance(document[name], int | float)}
            why_not = tuple(map(str, (document.get("why_not") or {}).get("sentences", ())))
        except (AttributeError, KeyError, TypeError) as error:
            raise InputError(f"Expected a plan's file as `neurosym plan --out` writes it; got {error!r}.") from None
        settings = _settings(*(document.get(key) for key in ("planner", "prior", "oracle")))
        return cls(saved.plan, saved.how, status, status.sentence, refusals, counts, settings, scores, why_not)


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
            timeline = Timeline(stage(problem, search.steps, search.how))
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
        return cls.of(saved.problem, Search.saved(saved, scores), tuple(notes))


@dataclass(frozen=True)
class Progress:
    """How far a search is.

    Attributes:
        phase: what is being done, in words.
        attempts, refusals, expansions: so far.
        depth: length of the longest prefix that works, of `steps` at most.
        steps: number of action primitives; 0 while unknown.
        seconds: since it began.
    """

    phase: str
    attempts: int = 0
    refusals: int = 0
    expansions: int = 0
    depth: int = 0
    steps: int = 0
    seconds: float = 0.0


class Planning:
    """One search in a thread of its own, which can be watched and stopped.

    A stop is heeded before the next attempt or expansion, and between the phases; an attempt that is under way (a
    simulation, a free-form path) is waited for.

    Args:
        make: gives the problem; it may take long, and raise what the library refuses.
        query: how to plan it.
    """

    def __init__(self, make: Callable[[], Problem], query: Query) -> None:
        self.query = query
        self.shown: Shown | None = None
        self.message: str | None = None
        self._make = make
        self._stop = threading.Event()
        self._start = time.perf_counter()
        self._progress = Progress("building the problem")
        self._thread = threading.Thread(target=self._run, name="neurosym planning", daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        return self._thread.is_alive()

    @property
    def stopped(self) -> bool:
        """Whether a stop was asked for."""
        return self._stop.is_set()

    @property
    def progress(self) -> Progress:
        return self._progress

    def stop(self) -> None:
        """Ask the search to end; it keeps the longest prefix that works."""
        self._stop.set()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended, or for so long; whether it has."""
        self._thread.join(seconds)
        return not self.running

    def _run(self) -> None:
        try:
            self.shown = self._plan()
            if self.shown is None:
                self.message = "Stopped before the search began."
        except REFUSED as error:
            self.message = str(error)
        except Exception as error:
            # A plug-in's fault: the page says so, whoever started it finds the traceback in the log.
            _log.exception("Planning failed.")
            self.message = f"Planning failed with an unexpected {type(error).__name__}: {error}"

    def _plan(self) -> Shown | None:
        query = self.query
        problem = self._make()
        if self._between("asking the prior", problem):
            return None
        scores = advice(problem, query.prior)
        if self._between("searching", problem):
            return None
        budget = Budget(seconds=query.seconds, attempts=query.attempts, watch=self._watch)
        settings: dict[str, Any] = {"planner": query.planner, "prior": scores, "oracle": query.oracle}
        result = solve(problem, budget=budget, rng=query.seed, **settings)
        self._between("preparing the film", problem)
        return Shown.of(problem, Search.of(result, query, scores, stopped=self.stopped))

    def _between(self, phase: str, problem: Problem) -> bool:
        """Enter a phase; whether a stop was asked for before it."""
        self._progress = Progress(phase, steps=len(problem.actions), seconds=time.perf_counter() - self._start)
        return self._stop.is_set()

    def _watch(self, log: SearchLog[Any]) -> bool:
        self._progress = Progress(
            "searching",
            log.attempts,
            log.iterations,
            log.expansions,
            len(log.best_prefix),
            len(log.problem.actions),
            time.perf_counter() - self._start,
        )
        return self._stop.is_set()


def problem_maker(query: Query, given: Mapping[str, Maker]) -> Callable[[], Problem]:
    """A function that makes the problem of a query.

    Args:
        given: what the command line was given, by the name it bears on the page.

    Raises:
        InputError: no such domain, or no number where one is needed.
    """
    if query.domain in given:
        make, what = given[query.domain], query.domain
    else:
        family, number = load_domain(query.domain), query.number
        if number is None:
            raise InputError(f"Expected the number of a problem of {query.domain!r}; got none.")
        make, what = partial(family.problem, number), f"a problem of {query.domain!r}"

    def problem() -> Problem:
        try:
            return make(**query.options)
        except TypeError as error:
            raise InputError(f"Expected options that {what} takes; {error}.") from None

    return problem


def check_query(query: Query) -> None:
    """Refuse at once what would be refused in the thread.

    Raises:
        UnknownNameError: a planner, a prior or an oracle that nobody offers.
        InputError: a budget that is none.
    """
    named = [("planner", query.planner, planner_names()), ("oracle", query.oracle, ORACLES)]
    if query.prior is not None and not query.prior.endswith(".safetensors"):
        named.append(("prior", query.prior, prior_names()))
    for kind, name, known in named:
        if name not in known:
            raise UnknownNameError(kind, name, known)
    Budget(seconds=query.seconds, attempts=query.attempts)
