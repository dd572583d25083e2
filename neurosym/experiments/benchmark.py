"""Compare planners and priors: (problem x planner x prior x seed) -> runs, on many processes, resumable.

Generic over domains: a comparison names a family, numbers of its problems, planners and priors. Finished runs are
kept in a journal, and a comparison that was interrupted, or is asked again with one more prior, does only the rest.
"""

import hashlib
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from neurosym import __version__, pipeline
from neurosym.errors import InputError
from neurosym.experiments.baselines import best_fixed_order, order_fails
from neurosym.experiments.engines import cores, run_tasks
from neurosym.experiments.journal import Journal, key_of
from neurosym.language.options import check_options
from neurosym.language.problem_family import Progress
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.prior import Prior
from neurosym.registry import load_domain, load_planner, load_prior

#: The name of planning without a prior, in tables and on the command line.
NO_PRIOR = "none"
#: Raise it whenever the same comparison would give other runs, so that no journal answers for it.
RUNS_VERSION = 3
#: (planner, prior, seed)
Cell = tuple[str, str, int]
#: Prior -> its scores, one a problem.
Scores = Mapping[str, Sequence[OrderScores] | None]


@dataclass(frozen=True)
class Comparison:
    """What is compared, on what.

    Attributes:
        numbers: which problems of the domain.
        priors: names of priors or of weights files; `NO_PRIOR` plans without.
        options: passed to ``family.problem(number, **options)``, for Soma collapse and pictures.
        oracle: ``"geometry"`` or ``"physics"``.
        seeds: how many times each problem is solved, with seeds 0 .. seeds - 1.
        budget: of each run.
    """

    domain: str
    numbers: tuple[int, ...]
    planners: tuple[str, ...]
    priors: tuple[str, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    oracle: str = "geometry"
    seeds: int = 1
    budget: Budget = field(default_factory=Budget)

    def __post_init__(self) -> None:
        if not (self.numbers and self.planners and self.priors):
            raise InputError("Expected at least one problem, one planner and one prior to compare; got none of one.")
        if self.seeds < 1:
            raise InputError(f"Expected at least 1 seed; got {self.seeds}.")
        if self.oracle not in pipeline.ORACLES:
            raise InputError(f"Expected an oracle, one of {', '.join(pipeline.ORACLES)}; got {self.oracle!r}.")
        check_options(load_domain(self.domain).problem, self.options, self.domain)
        for planner in self.planners:
            load_planner(planner)

    @property
    def cells(self) -> tuple[Cell, ...]:
        """(planner, prior, seed), in the order of the table."""
        return tuple((pl, pr, s) for pr in self.priors for pl in self.planners for s in range(self.seeds))


@dataclass(frozen=True)
class Run:
    """One problem solved once. `first_order_failed`: whether the prior's own first order is refused somewhere."""

    planner: str
    prior: str
    seed: int
    number: int
    status: str
    iterations: int
    expansions: int
    attempts: int
    seconds: float
    first_order_failed: bool

    @property
    def solved(self) -> bool:
        return self.status == "SOLVED"


@dataclass(frozen=True)
class Outcome:
    """What a comparison gave.

    `runs`: one a cell and problem, in the order of `Comparison.cells`. `image_blind`: share of the problems on which
    the best fixed order of the training problems fails, or None. `image_blind_order`: that order.
    """

    comparison: Comparison
    runs: tuple[Run, ...]
    image_blind: float | None = None
    image_blind_order: tuple[str, ...] = ()


def ask_priors(
    comparison: Comparison,
    *,
    workers: int = 1,
    loaded: Mapping[str, Prior] | None = None,
    leave_out: Callable[[str, InputError], None] | None = None,
    progress: Progress | None = None,
) -> dict[str, list[OrderScores] | None]:
    """Each prior's scores for all problems, asked in one batch; pictures are taken once.

    Args:
        loaded: priors that are loaded already, by their names in the comparison.
        leave_out: called with the name of a prior that does not know these problems, and the error; the prior is
            then missing in the answer. None lets the error pass.
        progress: called with (done, total) pictures.
    """
    scores: dict[str, list[OrderScores] | None] = {}
    asked = set(comparison.priors) - {NO_PRIOR}
    family = load_domain(comparison.domain)
    problems = [family.problem(n, **comparison.options) for n in comparison.numbers] if asked else []
    # Whether a prior looks at pictures is its own business; these two are known not to.
    if asked - {"uniform", "random"}:
        problems = family.observed(problems, workers=workers, progress=progress)
    for name in comparison.priors:
        try:
            prior = None if name == NO_PRIOR else load_prior((loaded or {}).get(name, name))
            scores[name] = None if prior is None else prior.scores(problems)
        except InputError as error:
            if leave_out is None:
                raise
            leave_out(name, error)
    return scores


def run(
    comparison: Comparison,
    scores: Scores | None = None,
    *,
    workers: int | None = 1,
    journal: str | Path | None = None,
    progress: Progress = lambda done, total: None,
    **where: Any,
) -> tuple[Run, ...]:
    """All runs of a comparison; the same, times excepted, for any number of workers.

    `scores`: what `ask_priors` gives; None asks. `journal`: file (JSON lines) that keeps finished runs; those it has
    are not run again. `progress`: called with (done, total) runs. `workers, where`: where problems are solved, see
    `neurosym.experiments.engines.run_tasks`. Raises ContractError: a planner's plan does not survive its replay.
    """
    scores = ask_priors(comparison, workers=min(workers or cores(), cores())) if scores is None else scores
    kept = Journal(journal)
    done: dict[tuple[Cell, int], Run] = {}
    jobs = []
    for position, number in enumerate(comparison.numbers):
        own = {name: None if given is None else given[position] for name, given in scores.items()}
        keys = {cell: _key(comparison, cell, number, own[cell[1]]) for cell in comparison.cells}
        done |= {(cell, number): Run(**kept[key]) for cell, key in keys.items() if key in kept}
        missing = {cell: key for cell, key in keys.items() if key not in kept}
        if missing:
            jobs.append((comparison, number, missing, own))
    total = len(comparison.numbers) * len(comparison.cells)
    progress(len(done), total)
    # Processes, not threads: FCL holds the interpreter's lock. Problems are rebuilt there; FCL's objects cannot travel.
    for _, finished in run_tasks(lambda job: _solve_one(*job), jobs, workers=workers, **where):
        kept.add({key: asdict(result) for key, result in finished})
        done |= {((r.planner, r.prior, r.seed), r.number): r for _, r in finished}
        progress(len(done), total)
    return tuple(done[cell, number] for cell in comparison.cells for number in comparison.numbers)


def image_blind(comparison: Comparison, *, split: int = 0) -> tuple[float | None, tuple[str, ...]]:
    """The share of the compared problems that the best fixed order fails on, and that order.

    The order is the one that fails least on the training problems (by geometry); nothing is looked at. None, and no
    order, where the family's problems do not share their actions.
    """
    family = load_domain(comparison.domain)
    training = [p.ground() for p in family.problems("train", split=split, **comparison.options)]
    order = best_fixed_order(training)
    if order is None:
        return None, ()
    failures = 0
    for number in comparison.numbers:
        problem = family.problem(number, **comparison.options)
        if set(order) - set(problem.actions):
            return None, ()
        with pipeline.open_oracle(problem, comparison.oracle) as search:
            failures += order_fails(search, [problem.actions.index(a) for a in order])
    return failures / len(comparison.numbers), order


def _solve_one(
    comparison: Comparison, number: int, cells: Mapping[Cell, str], scores: Mapping[str, OrderScores | None]
) -> list[tuple[str, Run]]:
    """All the missing runs of one problem, so that its geometry is computed once."""
    problem = load_domain(comparison.domain).problem(number, **comparison.options)
    advice = {prior: pipeline.advice(problem, own) for prior, own in scores.items()}
    given: dict[str, Any] = {"budget": comparison.budget, "oracle": comparison.oracle}
    runs = []
    with pipeline.open_oracle(problem, comparison.oracle) as search:

        @cache
        def first_order_failed(prior: str, seed: int) -> bool:
            """Asked by the benchmark itself, whatever planners do."""
            rng, own = _generator(seed, number, "first order", prior), advice[prior]
            order = rng.permutation(len(search.actions)).tolist() if own is None else own.order(rng)
            return order_fails(search, order)

        for (name, prior, seed), key in cells.items():
            planner, rng = load_planner(name), _generator(seed, number, name, prior)
            [result] = pipeline.search_and_check(problem, search, planner, advice[prior], rng=rng, **given)
            counts = (result.iterations, result.expansions, result.attempts, round(result.seconds, 7))
            failed = first_order_failed(prior, seed)
            runs.append((key, Run(name, prior, seed, number, result.status.name, *counts, failed)))
    return runs


def _generator(seed: int, number: int, *names: str) -> np.random.Generator:
    return np.random.default_rng([seed, number, *(zlib.crc32(name.encode()) for name in names)])


def _key(comparison: Comparison, cell: Cell, number: int, scores: OrderScores | None) -> str:
    """What decides a run. The scores themselves are part of it: a prior that was trained anew is another prior."""
    table = b"" if scores is None else scores.log_prob.tobytes() + repr(scores.actions).encode()
    setting = (comparison.domain, number, dict(comparison.options), comparison.oracle, asdict(comparison.budget))
    return key_of([RUNS_VERSION, __version__, *setting, *cell, hashlib.sha256(table).hexdigest()])
