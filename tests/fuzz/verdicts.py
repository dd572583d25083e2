"""Verdicts of the library about random polycubes against brute force, and against themselves in another guise."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from polycubes import Cells, Oracle, interlocked_halves, random_cells
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.geometry.tolerances import Tolerances
from neurosym.language.search_problem import Step
from neurosym.pipeline import count_orders
from neurosym.planning.order_scores import OrderScores

#: Planners that find a plan wherever there is one.
COMPLETE = ("backtracking", "best-first")

#: Random walks through each problem's states.
WALKS = 12


class Adversarial(ns.Prior):
    """Scores that are all wrong, or nearly none."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def scores(self, problems: Sequence[ns.Problem]) -> list[OrderScores]:
        found = []
        for problem in problems:
            n = len(problem.actions)
            values = self.rng.choice([1e-12, 1.0, 1e6], (n, n))
            found.append(OrderScores(values / values.sum(axis=1, keepdims=True), problem.actions))
        return found


@dataclass
class Outcome:
    """What was asked, how often, and what came out wrong, with the seed that shows it."""

    asked: Counter[str]
    wrong: list[tuple[int, str]]


def run(seconds: float, seed: int = 0, most: int = 1 << 60) -> Outcome:
    """Ask for so long, or so many instances."""
    outcome = Outcome(Counter(), [])
    end = time.monotonic() + seconds
    number = seed
    while time.monotonic() < end and number < seed + most:
        rng = np.random.default_rng(number)
        for kind in (one_by_one, in_groups, under_gravity, in_another_guise):
            try:
                complaint = kind(rng, outcome.asked)
            except Exception as error:
                complaint = f"{type(error).__name__}: {error}"
            if complaint:
                outcome.wrong.append((number, f"{kind.__name__}: {complaint}"))
        number += 1
    return outcome


def some_cells(rng: np.random.Generator) -> Cells:
    if rng.random() < 0.15:
        return interlocked_halves(rng)
    size = tuple(int(n) for n in rng.integers(2, 4, 3))
    return random_cells(rng, int(rng.integers(3, 9)), size, float(rng.uniform(0.7, 1.0)))


def one_by_one(rng: np.random.Generator, asked: Counter[str]) -> str:
    """Count, verdict and plan without gravity, with fixed parts and pairs in order."""
    cells = some_cells(rng)
    names = list(cells)
    fixed = tuple(rng.choice(names, int(rng.integers(0, 2)), replace=False).tolist())
    a, b = rng.choice(names, 2, replace=False).tolist()
    before = ((a, b),) if rng.random() < 0.3 and not {a, b} & set(fixed) else ()
    truth = Oracle(cells, fixed=fixed, before=before)
    problem = ns.load_domain("assembly").problem(
        ns.Assembly.from_cells(cells), gravity=False, fixed=fixed, before=before
    )
    orders = truth.count()
    asked["counts"] += 1
    if (counted := told_apart(problem)) != orders:
        return f"{counted} orders, right: {orders}"
    return _walked(problem, truth, rng, asked) or _planned(problem, truth, bool(orders), rng, asked)


def under_gravity(rng: np.random.Generator, asked: Counter[str]) -> str:
    """The same under gravity, without friction, by limit analysis."""
    cells = some_cells(rng)
    truth = Oracle(cells, gravity=True)
    assembly = ns.Assembly.from_cells(cells, friction=0.0, tolerances=Tolerances(patch_shrink=0.0))
    problem = ns.load_domain("assembly").problem(assembly, stability="limit")
    orders = truth.count()
    asked["counts under gravity"] += 1
    if (counted := told_apart(problem)) != orders:
        return f"{counted} orders, right: {orders}"
    return _walked(problem, truth, rng, asked) or _planned(problem, truth, bool(orders), rng, asked)


def told_apart(problem: Any) -> int:
    """How many orders, equal parts told apart."""
    counted = count_orders(problem)
    return counted.orders if counted.told_apart is None else counted.told_apart


def _walked(problem: Any, truth: Oracle, rng: np.random.Generator, asked: Counter[str]) -> str:
    """Each removal from each state of random walks: possible or refused, as brute force has it."""
    search = problem.ground()
    for _ in range(WALKS):
        state, there = search.initial, truth.full
        while True:
            right = {truth.names[i] for i in truth.removals(there)}
            answers = {search.actions[a]: search.attempt(state, a) for a in search.candidates(state)}
            possible = {name: answer.state for name, answer in answers.items() if isinstance(answer, Step)}
            asked["verdicts"] += there.bit_count()
            if set(possible) != right:
                return f"of {truth.in_words(there)} {sorted(possible)} may leave, right: {sorted(right)}"
            if not possible:
                break
            name = sorted(possible)[int(rng.integers(len(possible)))]
            state, there = possible[name], there & ~(1 << truth.names.index(name))
    return ""


def _planned(problem: Any, truth: Oracle, solvable: bool, rng: np.random.Generator, asked: Counter[str]) -> str:
    for planner in COMPLETE:
        for prior in (None, "outermost-first", Adversarial(rng)):
            for side in ("full", "empty", "both"):
                result = ns.solve(problem, planner=planner, prior=prior, side=side, rng=int(rng.integers(1 << 30)))
                asked["verdicts"] += 1
                if (result.plan is not None) != solvable or (result.status is ns.Status.UNSOLVABLE) == solvable:
                    return f"{planner}, {side}: {result.status.name}, right: {'solvable' if solvable else 'unsolvable'}"
                there = truth.full
                for name, motion in zip(result.plan or (), result.motions):
                    part = truth.names.index(name)
                    along = tuple(round(x) for x in motion.direction)
                    if part not in truth.removals(there) or along not in truth.leaves(1 << part, there):
                        return f"{planner}, {side}: step {name} along {along} of {result.plan}"
                    there &= ~(1 << part)
    return ""


def in_groups(rng: np.random.Generator, asked: Counter[str]) -> str:
    """Whether groups that leave together get everything apart."""
    cells = interlocked_halves(rng) if rng.random() < 0.5 else some_cells(rng)
    truth = Oracle(cells)
    right = truth.apart()
    problem = ns.load_domain("assembly").problem(ns.Assembly.from_cells(cells), gravity=False, groups=True)
    result = ns.solve(problem, rng=0)
    asked["verdicts with groups"] += 1
    asked["that need groups"] += right and not truth.count()
    if (result.plan is not None) != right:
        return f"{result.status.name}, right: {'solvable' if right else 'unsolvable'}"
    return ""


def in_another_guise(rng: np.random.Generator, asked: Counter[str]) -> str:
    """The number of orders of the same parts under gravity, renamed, in another order, moved, turned or scaled."""
    cells = some_cells(rng)
    assembly = ns.Assembly.from_cells(cells)
    size = 10.0 ** float(rng.integers(-3, 4))
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("z", 37.0 * int(rng.integers(0, 2)), degrees=True).as_matrix()
    turned[:2, 3] = rng.choice([0.0, 1e6], 2)
    order = rng.permutation(len(cells)).tolist()
    names = list(cells)
    renamed = ns.Assembly.from_cells({f"q{k}": cells[names[i]] for k, i in enumerate(order)}, size=size)
    other = renamed.transformed(turned) if size == 1.0 or not turned[:2, 3].any() else renamed
    problems = [ns.load_domain("assembly").problem(given) for given in (assembly, other)]
    counts = [told_apart(problem) for problem in problems]
    asked["metamorphic counts"] += 1
    return "" if counts[0] == counts[1] else f"{counts[0]} orders, in another guise {counts[1]}"
