"""The conformance suite for priors: run it on one of your own, with problems of the domain it is for."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from neurosym.errors import ContractError
from neurosym.language.problem import Problem
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.prior import Prior

#: Largest difference in log-probability (nats) between one problem asked alone and in a batch: networks compute
#: batches in another order of additions.
BATCH_TOLERANCE = 1e-4


def check_prior(prior: Prior, problems: Sequence[Problem], *, pictures_only: bool = False) -> None:
    """Raise `ContractError`, which says what was promised, at the first promise that the prior breaks.

    It checks that `scores` answers with one `OrderScores` a problem, its columns the problem's actions in their
    order, interchangeable ones in one class, no more steps than actions; that the answers depend on the problem
    alone (not on the batch, the order of the batch, or an earlier call); and that it leaves the problems' pictures
    and numpy's global generator as they were.

    `prior`: what to check. `problems`: at least two, different ones; include one with a partial start if your domain
    has them. `pictures_only`: also check that the prior reads nothing of a problem but its pictures and names.
    """
    if len(problems) < 2:
        raise ValueError(f"Expected at least two problems to check a prior with; got {len(problems)}.")
    pictures = [None if p.observation is None else np.array(p.observation) for p in problems]
    generator = _global_generator()
    first = _answers(prior, problems)
    if _global_generator() != generator:
        raise ContractError("Expected `scores` to leave numpy's global generator alone; it drew from it or seeded it.")
    for problem, before in zip(problems, pictures):
        if before is not None and not np.array_equal(before, np.asarray(problem.observation)):
            raise ContractError(f"Expected `scores` not to change pictures; it changed those of {problem.name!r}.")
    for problem, scores in zip(problems, first):
        _check_table(problem, scores)

    if _answers(prior, []):
        raise ContractError("Expected `scores([])` to be []; it is not.")
    _check_same("asked again", problems, first, _answers(prior, problems), 0.0)
    backwards = _answers(prior, list(reversed(problems)))[::-1]
    _check_same("in a batch in another order", problems, first, backwards, BATCH_TOLERANCE)
    alone = [_answers(prior, [problem])[0] for problem in problems]
    _check_same("asked alone instead of in a batch", problems, first, alone, BATCH_TOLERANCE)
    if pictures_only:
        bare = [_bare(problem) for problem in problems]
        try:
            seen = _answers(prior, bare)
        except AttributeError as error:
            message = f"Expected `scores` to read pictures and names only; it also reads more: {error}."
            raise ContractError(message) from None
        _check_same("with the same pictures and names, all else taken away", problems, first, seen, BATCH_TOLERANCE)


def _answers(prior: Prior, problems: Sequence[Problem]) -> list[OrderScores]:
    found = prior.scores(problems)
    if not isinstance(found, list) or not all(isinstance(s, OrderScores) for s in found):
        raise ContractError(f"Expected `scores` to give a list of OrderScores; got {type(found).__name__}: {found!r}.")
    if len(found) != len(problems):
        raise ContractError(f"Expected one OrderScores a problem, {len(problems)}; got {len(found)}.")
    return found


def _check_table(problem: Problem, scores: OrderScores) -> None:
    actions = tuple(problem.actions)
    if scores.n_actions != len(actions):
        raise ContractError(
            f"Expected {len(actions)} columns for {problem.name!r}, one an action; got {scores.n_actions}."
        )
    if scores.actions and scores.actions != actions:
        raise ContractError(
            f"Expected the columns of {problem.name!r} in the order of its actions, {actions}; got {scores.actions}."
        )
    # A prior may leave out that actions are interchangeable, but not call different ones so.
    merged = _pairs(scores.classes) - _pairs(problem.classes)
    if merged:
        a, b = min(merged)
        raise ContractError(
            f"Expected one class only for interchangeable actions of {problem.name!r}; got {actions[a]}, {actions[b]}."
        )


def _pairs(classes: Sequence[int]) -> set[tuple[int, int]]:
    return {(a, b) for a in range(len(classes)) for b in range(a) if classes[a] == classes[b]}


def _check_same(
    when: str, problems: Sequence[Problem], one: list[OrderScores], other: list[OrderScores], tolerance: float
) -> None:
    for problem, a, b in zip(problems, one, other):
        off = np.inf if a.log_prob.shape != b.log_prob.shape else np.abs(a.log_prob - b.log_prob).max(initial=0.0)
        if off > tolerance:
            raise ContractError(
                f"Expected the same scores for {problem.name!r} {when}; they differ by {off:.2g} nats "
                f"(at most {tolerance:g} is allowed)."
            )


def _bare(problem: Problem) -> Problem:
    """Only what a picture prior may read."""
    kept = {name: getattr(problem, name) for name in ("observation", "name", "family")}
    bare = SimpleNamespace(actions=tuple(problem.actions), classes=tuple(problem.classes), **kept)
    return cast("Problem", bare)


def _global_generator() -> tuple[Any, ...]:
    name, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002 - it is this state that must not change
    return (name, np.asarray(keys).tobytes(), *rest)
