"""Assemblies with shares of their orders, for priors that learn from geometry.

An order counts by its probability under `outermost-first`, sharpened: the shares are what is believed of an order once
it is known which orders work. So a prior that learns them keeps to that heuristic wherever it works.
"""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from domains.structures import structure_numbers
from neurosym.errors import InputError
from neurosym.experiments.engines import run_tasks
from neurosym.geometry.assembly import Assembly
from neurosym.language.labelled_problems import LabelledProblems, problem_again
from neurosym.language.options import check_options
from neurosym.language.problem import Problem
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.outermost_first import OutermostFirst
from neurosym.planning.planner import OrderCounter
from neurosym.registry import load_planner
from neurosym.support.progress import Progress, silent

if TYPE_CHECKING:
    from neurosym.language.problem_family import ProblemFamily

#: Up to so many actions all orders are counted; of more, so many are sampled, each within so many attempts an action.
COUNTED, SAMPLES, ATTEMPTS = 10, 8, 40
#: Steps: how far an order is from outermost first when it counts e times less; by how much samples' places are changed.
DECAY, SPREAD = 1.0, 1.0


def labelled_problems(
    family: ProblemFamily,
    part: str = "train",
    *,
    folder: str | Path | None = None,
    count: int | None = None,
    only: str | None = None,
    without: str | None = None,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress = silent,
    **options: Any,
) -> LabelledProblems:
    """Structures made at random, or assemblies of a user's own, with shares of their orders.

    Args:
        family: whose problems; options go to its `problem`.
        part: "train", "test" or "all" of the structures.
        folder: assemblies to take instead: its files and folders, each as `Assembly.load` reads it.
        count: how many structures of each kind; default all of the part.
        only, without: a kind that alone is taken, or that is left out, to see what is learned from the others.
        seed: of the sampled orders.
        workers: processes; default one a core. The answer is the same for any number.
        progress: called with (done, total) problems.

    Raises:
        InputError: an option that problems do not take, an assembly that cannot be read, or none that comes apart.
    """
    check_options(family.problem, options, family.name)
    if folder is None:
        left_out = set() if without is None else set(structure_numbers("all", without))
        numbers = [n for n in structure_numbers(part, only) if n not in left_out]
        kinds: dict[str, int] = {}
        given: list[Any] = []
        for number in numbers:
            kinds[family.kind(number)] = kinds.get(family.kind(number), 0) + 1
            given += [number] if count is None or kinds[family.kind(number)] <= count else []
    else:
        given = _assemblies_in(Path(folder))

    def labelled(k: int) -> tuple[Assembly, str, dict[str, Any], NDArray[np.float64] | None]:
        problem = family.problem(given[k], **options)
        rng = np.random.default_rng([seed, zlib.crc32(problem.name.encode())])
        return problem.world, problem.name, dict(problem.details), order_shares(problem, rng)

    known = {}
    for k, answer in run_tasks(labelled, range(len(given)), workers=workers):
        known[k] = answer
        progress(len(known), len(given))
    apart = [known[k] for k in range(len(given)) if known[k][3] is not None]
    if not apart:
        raise InputError(f"Expected assemblies that come apart, to learn from; none of {len(given)} did.")
    problems = tuple(problem_again(family, world, name, details) for world, name, details, _ in apart)
    return LabelledProblems(problems, tuple(table for *_, table in apart if table is not None))


def order_shares(problem: Problem, rng: np.random.Generator) -> NDArray[np.float64] | None:
    """The share of orders with each action at each step, float64 (N, N); None: no order was seen that takes N steps."""
    search, n = problem.ground(), len(problem.actions)
    believed = OutermostFirst(decay=DECAY).scores([problem])[0]
    if n <= COUNTED:
        counter = load_planner("exhaustive")
        assert isinstance(counter, OrderCounter)
        shares = counter.order_marginals(search, believed)
        return shares if shares.shape == (n, n) else None
    place, shares, seen = np.argsort(believed.order()), np.zeros((n, n)), 0
    index = {name: k for k, name in enumerate(search.actions)}
    for sample in range(SAMPLES):
        own = place + SPREAD * rng.standard_normal(n) * (sample > 0)
        scores = OrderScores(-np.abs(np.subtract.outer(np.arange(n), own)) / DECAY, problem.actions)
        budget = Budget(attempts=ATTEMPTS * n)
        result = load_planner("backtracking").plan(search, scores, budget=budget, rng=rng)
        if result.plan is not None and len(result.plan) == n:
            shares[np.arange(n), [index[name] for name in result.plan]] += 1
            seen += 1
    return shares / seen if seen else None


def _assemblies_in(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise InputError(f"Expected a folder of assemblies, a file or folder each; there is none at {folder}.")
    found = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    if not found:
        raise InputError(f"Expected assemblies in {folder}, a file or folder each; it is empty.")
    return found
