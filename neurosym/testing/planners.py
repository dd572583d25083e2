"""The conformance suite for planners: `check_planner("my-planner")`, against problems with known answers.

Claims (`PlannerTraits`) are compared with brute force; counts with those of an oracle that counts for itself.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from neurosym.errors import ContractError
from neurosym.language.search_problem import SearchProblem, Step
from neurosym.planning.budget import Budget
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.planner import KBestPlanner, Planner
from neurosym.planning.result import PlanResult, Status
from neurosym.planning.search_log import MAX_BLAME
from neurosym.registry import load_planner
from neurosym.testing.sides import check_sides
from neurosym.testing.toys import NumberLine, Removal, Table, Tiles, brute_force_plans
from neurosym.testing.wrapped import Counting, Relabelled, Unproved

#: Costs further apart than this (nats) differ. Planners may take costs within 1e-6 nats a plan for equal.
TOLERANCE = 1e-5


@dataclass(frozen=True)
class Toy:
    """A problem, what it is called in messages, and all its plans."""

    name: str
    problem: SearchProblem[Any]
    plans: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, name: str, problem: SearchProblem[Any]) -> Self:
        return cls(name, problem, tuple(brute_force_plans(problem)))

    @property
    def lengths(self) -> set[int]:
        return {len(plan) for plan in self.plans}


def toys(seeds: int = 12) -> list[Toy]:
    """The problems of the suite: solvable and not, with dead ends, with equal actions, with plans of many lengths."""
    made = [
        Toy.of("number line", NumberLine((1, 1, 2, 3, -1), goal=4)),
        Toy.of("number line without a way", NumberLine((2, 2, 4), goal=5)),
        Toy.of("goal at the start", NumberLine((1, 2), goal=0)),
        Toy.of("no actions, no goal", NumberLine((), goal=1)),
        Toy.of("one state reached in two ways", Table.crossing()),
        Toy.of("loose parts", Removal.loose(4)),
        Toy.of("tiles", Tiles("eestt", ("test", "sete", "es", "tee"))),
        Toy.of("tiles without a word", Tiles("aab", ("abba",))),
    ]
    for seed in range(seeds):
        made.append(Toy.of(f"removal {seed}", Removal.random(seed)))
        made.append(Toy.of(f"removal {seed}, in part", Removal.random(seed, partial=True, spoiling=0.15)))
    return made


def priors(toy: Toy, seed: int) -> Iterator[tuple[str, OrderScores | None]]:
    """Scores of every temper for a problem: none, ignorant, right, wrong, wild, too short, unsure of the length."""
    rng = np.random.default_rng([seed, len(toy.plans)])
    names, classes = tuple(toy.problem.actions), tuple(toy.problem.classes)
    n = len(names)
    yield "no scores", None
    yield "uniform scores", OrderScores.uniform(n, names, classes)
    yield "random scores", OrderScores(rng.normal(size=(n, n)) * 2, names, classes=classes)
    yield "wild scores", OrderScores(rng.normal(size=(n, n)) * 1e6, names, classes=classes)
    wrong = toy.plans[0][::-1] if toy.plans else tuple(range(n))
    wrong = (*wrong, *(a for a in range(n) if a not in wrong))
    yield "scores sure of a wrong order", OrderScores.from_order(wrong, names, confidence=1.0)
    yield "scores without steps", OrderScores(np.zeros((0, n)), names, classes=classes)
    if n:
        yield "scores for one step", OrderScores(rng.normal(size=(1, n)), names, classes=classes)
    length = OrderScores(rng.normal(size=(n, n)), names, rng.normal(size=n + 1) * 5, classes)
    yield "scores unsure of the length", length
    impossible = np.full(n + 1, -np.inf)
    impossible[0] = 0.0
    yield "scores sure of no step at all", OrderScores(rng.normal(size=(n, n)), names, impossible, classes)


def check_planner(planner: str | Planner, *, seeds: int = 12) -> None:
    """Check that a planner keeps the contract of `neurosym.planning.planner.Planner` and what its traits claim.

    `planner`: a registered name, or a planner. `seeds`: random problems; more is slower and more searching. Raises
    ContractError: what was expected and what came, on which problem and with which scores.
    """
    made = load_planner(planner)
    for toy in toys(seeds):
        for title, scores in priors(toy, 1):
            where = f"{type(made).__name__} on {toy.name!r} with {title}"
            counting: Counting[Any] = Counting(toy.problem)
            result = made.plan(counting, scores, rng=np.random.default_rng(3))
            _check_answer(made, toy, result, where)
            _check_counts(counting, result, where)
            if result.plan is not None:
                _check_plan(toy, scores, result, where)
            _check_repeats(made, toy, scores, result, where)
            if scores is not None and _costs_are_promised(toy, scores):
                _check_optimality(made, toy, scores, result, where)
                _check_k_best(made, toy, scores, where)
            if made.traits.either_side:
                check_sides(made, toy.problem, toy.plans, scores, where)
        _check_budgets(made, toy)
    _check_use_of_scores(made)
    _check_unproved(made, seeds)
    _check_relabelling(made, seeds)


def _require(holds: bool, where: str, expected: str, got: object) -> None:
    if not holds:
        raise ContractError(f"{where}: expected {expected}; got {got}.")


def _check_answer(planner: Planner, toy: Toy, result: PlanResult, where: str) -> None:
    """Solved only where there is a plan, proved unsolvable only where there is none; complete: exactly then."""
    allowed = {Status.SOLVED, Status.GAVE_UP} if toy.plans else {Status.UNSOLVABLE, Status.GAVE_UP}
    if planner.traits.complete:
        allowed -= {Status.GAVE_UP}
    names = " or ".join(sorted(s.name for s in allowed))
    _require(result.status in allowed, where, f"{names} (there are {len(toy.plans)} plans)", result.status.name)
    if result.status is Status.SOLVED:
        _require(result.best_prefix == result.plan, where, "the plan as best_prefix", result.best_prefix)
    _replay(toy.problem, result.best_prefix, where)


def _replay(problem: SearchProblem[Any], names: tuple[str, ...], where: str) -> tuple[list[Any], list[Any]]:
    """The states and motions of an order given by names; each action a candidate, allowed, and used once."""
    index = {name: i for i, name in enumerate(problem.actions)}
    _require(len(set(names)) == len(names), where, "each action at most once", names)
    states, motions = [problem.initial], []
    for name in names:
        _require(name in index, where, f"actions of the problem ({', '.join(index)})", name)
        _require(index[name] in problem.candidates(states[-1]), where, f"{name} to be a candidate in its turn", names)
        answer = problem.attempt(states[-1], index[name])
        if not isinstance(answer, Step):
            raise ContractError(f"{where}: expected {names} to replay; got a refusal of {name}: {answer.reason}")
        states.append(answer.state)
        motions.append(answer.motion)
    return states, motions


def _check_plan(toy: Toy, scores: OrderScores | None, result: PlanResult, where: str) -> None:
    assert result.plan is not None
    states, motions = _replay(toy.problem, result.plan, where)
    reached = [toy.problem.is_goal(state) for state in states]
    _require(reached[-1], where, "a plan that reaches the goal", result.plan)
    _require(not any(reached[:-1]), where, "a plan that ends where the goal is first reached", result.plan)
    _require(result.motions == () or list(result.motions) == motions, where, f"motions = {motions}", result.motions)
    if scores is None:
        _require(result.cost is None, where, "no cost without scores", result.cost)
    else:
        cost = result.cost
        _require(cost is not None, where, "the plan's cost under the scores", cost)
        expected = _cost(toy.problem, scores, [list(toy.problem.actions).index(name) for name in result.plan])
        _require(abs((cost or 0.0) - expected) < TOLERANCE, where, f"a cost of {expected:.6f}", cost)


def _cost(problem: SearchProblem[Any], scores: OrderScores, plan: Any) -> float:
    """A plan's cost when interchangeable actions share their probability, whether or not the scores say so."""
    if scores.classes == tuple(range(scores.n_actions)):
        scores = replace(scores, classes=tuple(problem.classes))
    return scores.plan_cost(plan)


def _check_counts(counting: Counting[Any], result: PlanResult, where: str) -> None:
    _require(not counting.no_candidates, where, "candidates alone to be attempted", counting.no_candidates[:3])
    _require(result.attempts == counting.attempts, where, f"{counting.attempts} attempts", result.attempts)
    _require(result.expansions == counting.expansions, where, f"{counting.expansions} expansions", result.expansions)
    enough = result.iterations >= counting.refusals
    _require(enough, where, f"{counting.refusals} iterations or more", result.iterations)
    kept = min(result.iterations, MAX_BLAME)
    _require(len(result.blame) == kept, where, f"{kept} refusals in blame", len(result.blame))


def _check_repeats(planner: Planner, toy: Toy, scores: OrderScores | None, result: PlanResult, where: str) -> None:
    again = planner.plan(toy.problem, scores, rng=np.random.default_rng(3))
    same = replace(again, seconds=0.0) == replace(result, seconds=0.0)
    _require(same, where, "the same result from the same seed", "another")


def _costs_are_promised(toy: Toy, scores: OrderScores) -> bool:
    """Whether the scores say how long plans are: without `log_length`, they are sure of `n_steps`."""
    return scores.log_length is not None or toy.lengths <= {scores.n_steps}


def _check_optimality(planner: Planner, toy: Toy, scores: OrderScores, result: PlanResult, where: str) -> None:
    if not planner.traits.optimal or not toy.plans:
        return
    least = min(_cost(toy.problem, scores, plan) for plan in toy.plans)
    _require(result.cost is not None and result.cost < least + TOLERANCE, where, f"the least cost {least}", result.cost)


def _check_k_best(planner: Planner, toy: Toy, scores: OrderScores, where: str) -> None:
    if not planner.traits.k_best:
        return
    if not isinstance(planner, KBestPlanner):
        raise ContractError(f"{where}: expected a method plans(problem, scores, *, k, budget, rng), as k_best claims.")
    costs = sorted(_cost(toy.problem, scores, plan) for plan in toy.plans)
    for k in (1, 3, len(costs) + 1):
        found = planner.plans(toy.problem, scores, k=k, rng=np.random.default_rng(3))
        got = [result.cost if result.cost is not None else np.nan for result in found]
        close = len(got) == len(costs[:k]) and np.allclose(got, costs[:k], rtol=0, atol=TOLERANCE)
        _require(bool(close), where, f"the {k} least costs {costs[:k]}", got)
        distinct = {_classes(toy.problem, result.plan or ()) for result in found}
        _require(len(distinct) == len(found), where, f"{len(found)} plans that differ", len(distinct))
        for result in found:
            _check_plan(toy, scores, result, f"{where}, k = {k}")


def _classes(problem: SearchProblem[Any], names: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(problem.classes[list(problem.actions).index(name)] for name in names)


def _check_budgets(planner: Planner, toy: Toy) -> None:
    """No limit is overrun; a budget of nothing does nothing; what was verified is kept."""
    at_goal = toy.problem.is_goal(toy.problem.initial)
    limits = [Budget(attempts=n) for n in (0, 1, 3)] + [Budget(expansions=n) for n in (0, 1, 3)] + [Budget(seconds=0)]
    for budget in limits:
        where = f"{type(planner).__name__} on {toy.name!r} with {budget}"
        counting: Counting[Any] = Counting(toy.problem)
        result = planner.plan(counting, None, budget=budget, rng=np.random.default_rng(3))
        if budget.attempts is not None:
            _require(counting.attempts <= budget.attempts, where, "no more attempts", counting.attempts)
        if budget.expansions is not None:
            _require(counting.expansions <= budget.expansions, where, "no more expansions", counting.expansions)
        nothing = 0 in (budget.attempts, budget.expansions, budget.seconds) and not at_goal
        if nothing and toy.plans:
            _require(result.status is Status.OUT_OF_BUDGET, where, "OUT_OF_BUDGET", result.status.name)
        if result.status is Status.UNSOLVABLE:
            _require(not toy.plans, where, "no proof where there is a plan", result.status.name)
        if result.status is Status.SOLVED:
            _check_plan(toy, None, result, where)
        _replay(toy.problem, result.best_prefix, where)


def _check_use_of_scores(planner: Planner) -> None:
    """Where every order is a plan, scores that are sure of one order get it, if the planner uses scores at all."""
    toy = Toy.of("loose parts", Removal.loose(4))
    for order in itertools.islice(itertools.permutations(range(4)), 0, None, 5):
        where = f"{type(planner).__name__} on {toy.name!r}, scores sure of {order}"
        names = tuple(toy.problem.actions)
        result = planner.plan(toy.problem, OrderScores.from_order(order, names), rng=np.random.default_rng(3))
        plain = planner.plan(toy.problem, None, rng=np.random.default_rng(3))
        expected = tuple(names[a] for a in order) if planner.traits.uses_scores else plain.plan
        _require(result.plan == expected, where, f"the plan {expected}", result.plan)


def _check_unproved(planner: Planner, seeds: int) -> None:
    """What was refused without proof is never called unsolvable."""
    for seed in range(seeds):
        toy = Toy.of(f"removal {seed}, nothing proved", Unproved(Removal.random(seed)))
        counting: Counting[Any] = Counting(toy.problem)
        result = planner.plan(counting, None, rng=np.random.default_rng(3))
        wrong = Status.UNSOLVABLE if counting.refusals else None
        where = f"{type(planner).__name__} on {toy.name!r}"
        _require(result.status is not wrong, where, "GAVE_UP after refusals that prove nothing", result.status.name)


def _check_relabelling(planner: Planner, seeds: int) -> None:
    """Actions in another order, with their scores in the same, give the same plan: no order but the scores' counts."""
    if not planner.traits.uses_scores:
        return
    for seed in range(seeds):
        rng = np.random.default_rng([seed, 5])
        problem = Removal.random(seed)
        n = len(problem.actions)
        table, order = rng.normal(size=(n, n)), tuple(int(a) for a in rng.permutation(n))
        there: Relabelled[int] = Relabelled(problem, order)
        scores = OrderScores(table, problem.actions)
        mirrored = OrderScores(table[:, list(order)], there.actions)
        plain = planner.plan(problem, scores, rng=np.random.default_rng(3))
        moved = planner.plan(there, mirrored, rng=np.random.default_rng(3))
        where = f"{type(planner).__name__} on 'removal {seed}' with its actions in the order {order}"
        _require(moved.plan == plain.plan, where, f"the plan {plain.plan}", moved.plan)
