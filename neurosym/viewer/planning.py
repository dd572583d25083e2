"""Planning in a thread, which can be watched and stopped."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from neurosym.errors import InputError, UnknownNameError
from neurosym.language.options import check_options, made
from neurosym.language.problem import Problem
from neurosym.pipeline import ORACLES, advice, solve
from neurosym.planning.budget import Budget
from neurosym.planning.search_log import SearchLog
from neurosym.registry import load_domain, planner_names, prior_names
from neurosym.viewer.exhibit import REFUSED, Exhibit, Maker, Query, Search

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Progress:
    """How far a search is: what it does, in words, its counts, and the seconds since it began.

    The longest prefix that works has length `depth`, of `steps` (action primitives; 0 while unknown) at most.
    """

    phase: str
    attempts: int = 0
    refusals: int = 0
    expansions: int = 0
    depth: int = 0
    steps: int = 0
    seconds: float = 0.0


class Planning:
    """One search in a thread of its own, which can be watched and stopped: of what `make` gives, which may raise.

    A stop is heeded before the next attempt or expansion, and between the phases; an attempt that is under way (a
    simulation, a free-form path) is waited for.
    """

    def __init__(self, make: Callable[[], Problem], query: Query) -> None:
        self.query = query
        self.exhibit: Exhibit | None = None
        self.message: str | None = None
        self._make = make
        self._stop = threading.Event()
        self._start = time.perf_counter()
        self.progress = Progress("building the problem")
        self._thread = threading.Thread(target=self._run, name="neurosym planning", daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        return self._thread.is_alive()

    @property
    def stopped(self) -> bool:
        """Whether a stop was asked for."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Ask the search to end; it keeps the longest prefix that works."""
        self._stop.set()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended, or for so long; whether it has."""
        self._thread.join(seconds)
        return not self.running

    def _run(self) -> None:
        try:
            self.exhibit = self._plan()
            if self.exhibit is None:
                self.message = "Stopped before the search began."
        except REFUSED as error:
            self.message = str(error)
        except Exception as error:
            # A plug-in's fault: the page says so, whoever started it finds the traceback in the log.
            _log.exception("Planning failed.")
            self.message = f"Planning failed with an unexpected {type(error).__name__}: {error}"

    def _plan(self) -> Exhibit | None:
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
        return Exhibit.of(problem, Search.of(result, query, scores, stopped=self.stopped))

    def _between(self, phase: str, problem: Problem) -> bool:
        """Enter a phase; whether a stop was asked for before it."""
        self.progress = Progress(phase, steps=len(problem.actions), seconds=time.perf_counter() - self._start)
        return self._stop.is_set()

    def _watch(self, log: SearchLog[Any]) -> bool:
        counts = (log.attempts, log.iterations, log.expansions, len(log.best_prefix), len(log.problem.actions))
        self.progress = Progress("searching", *counts, time.perf_counter() - self._start)
        return self._stop.is_set()


def maker_of(domain: str, given: Mapping[str, Maker]) -> Maker:
    """What makes a domain's problems: of a number and options, or of options alone where the command line gave it.

    Raises UnknownNameError: no such domain.
    """
    return given[domain] if domain in given else load_domain(domain).problem


def problem_maker(query: Query, given: Mapping[str, Maker]) -> Callable[[], Problem]:
    """A function that makes the problem of a query, where `given` makes those that the command line was given, by name.

    Raises InputError: no such domain, no number where one is needed, or an option that the domain does not take.
    """
    make = maker_of(query.domain, given)
    check_options(make, query.options, query.domain)
    if query.domain not in given:
        if query.number is None:
            raise InputError(f"Expected the number of a problem of {query.domain!r}; got none.")
        make = partial(make, query.number)

    return partial(made, make, options=query.options, whose=query.domain)


def check_query(query: Query) -> None:
    """Refuse at once what would be refused in the thread.

    Raises UnknownNameError: a planner, a prior or an oracle that nobody offers; InputError: a budget that is none.
    """
    named = [("planner", query.planner, planner_names()), ("oracle", query.oracle, ORACLES)]
    if query.prior is not None and not query.prior.endswith(".safetensors"):
        named.append(("prior", query.prior, prior_names()))
    for kind, name, known in named:
        if name not in known:
            raise UnknownNameError(kind, name, known)
    Budget(seconds=query.seconds, attempts=query.attempts)
