"""The conformance suite for problem families: `check_domain("my-domain")`.

Tries to catch a family lying: promises that are broken, oracles that change their minds, replays that see
something else than planners do, training problems that turn up in the test.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from neurosym.errors import ContractError
from neurosym.language.problem import Problem
from neurosym.language.problem_family import ProblemFamily
from neurosym.language.search_problem import Rejection, SearchProblem, Step
from neurosym.planning.validation import replay, validate
from neurosym.registry import load_domain


def check_domain(
    domain: str | ProblemFamily,
    *,
    problems: Sequence[Problem] | None = None,
    facts: bool = True,
    pictures: bool = True,
    walks: int = 4,
    seed: int = 0,
) -> None:
    """Check a problem family.

    Args:
        problems: which to check in depth; default three of its test part.
        facts, pictures: whether known facts are recomputed, and pictures taken and compared.
        walks, seed: random walks a problem.

    Raises:
        ContractError: what was expected, and what came.
    """
    family = load_domain(domain)
    rng = np.random.default_rng(seed)
    _require(bool(family.name and family.reference), "a family to say its name and its reference")
    train, test = family.problems("train"), family.problems("test")
    both = {p.name for p in train} & {p.name for p in test}
    _require(not both, "training and test problems not to overlap", f"both have {sorted(both)[:5]}")
    _require(len({p.name for p in test}) == len(test), "test problems of different names")
    for problem in problems if problems is not None else test[:3]:
        check_problem(problem, walks=walks, rng=rng)
        if pictures and problem.observation is not None:
            _check_pictures(problem)
    if facts:
        for name, (published, recompute) in family.known_facts().items():
            found = recompute()
            _require(found == published, f"the known fact {name!r} to be {published}", f"recomputed {found}")


def check_problem(problem: Problem, *, walks: int = 4, rng: np.random.Generator | None = None) -> None:
    """Check one problem: its symbols, its oracle's promises, and that replays see what planners see."""
    chance = rng or np.random.default_rng(0)
    search = problem.ground()
    label = f"problem {problem.name!r}"
    _require(len(set(search.actions)) == len(search.actions), f"{label} to have actions of different names")
    _require(len(search.classes) == len(search.actions), f"{label} to have a class an action")
    _require(problem.actions == tuple(search.actions), f"{label} to list the actions that planners see")
    hash(search.initial)
    known: list[tuple[int, Rejection]] = []
    for _ in range(walks):
        _walk(problem, search, chance, label, known)


def _walk(
    problem: Problem,
    search: SearchProblem[Any],
    rng: np.random.Generator,
    label: str,
    known: list[tuple[int, Rejection]],
) -> None:
    """A random walk: every refusal on it must keep its promise for the rest of it."""
    state = search.initial
    done: list[int] = []
    standing: dict[int, tuple[set[int], Rejection]] = {}
    for _ in range(len(search.actions) + 1):
        candidates = list(search.candidates(state))
        usable = [a for a in candidates if a not in done]
        _require(len(set(candidates)) == len(candidates), f"{label} to list each candidate once", f"{candidates}")
        answers = {a: search.attempt(state, a) for a in usable}
        for a, answer in answers.items():
            again = search.attempt(state, a)
            same = type(again) is type(answer) and getattr(again, "state", None) == getattr(answer, "state", None)
            _require(same, f"{label} to answer alike when asked twice", f"{search.actions[a]}: {answer}, then {again}")
            if isinstance(answer, Step) and a in standing:
                until, refusal = standing[a]
                raise ContractError(
                    f"Expected {label} to keep its promise that {search.actions[a]} stays refused until one of "
                    f"{[search.actions[u] for u in until]} is done ({refusal.reason}); it was allowed after "
                    f"{[search.actions[b] for b in done]}. Make `until` larger, or None."
                )
            for learned, refusal in known:
                if learned == a and isinstance(answer, Step) and not set(refusal.until) & set(done):
                    raise ContractError(
                        f"Expected {label} to refuse {search.actions[a]} in every state before one of "
                        f"{[search.actions[u] for u in refusal.until]}, since it said so unconditionally; it was "
                        f"allowed after {[search.actions[b] for b in done]}."
                    )
            if isinstance(answer, Rejection):
                if answer.unconditional and answer.until:
                    known.append((a, answer))
                _require(bool(answer.reason), f"{label} to give a reason for each refusal", search.actions[a])
                sure = answer.proved or not answer.unconditional
                _require(sure, f"{label} to promise nothing everywhere that it has not proved", search.actions[a])
                if answer.until:
                    standing[a] = (set(answer.until), answer)
        names = [search.actions[b] for b in done]
        for a, answer in itertools.islice(answers.items(), 3):
            _require(
                replay_allows(problem, [*names, search.actions[a]]) is isinstance(answer, Step),
                f"{label}: the independent replay to agree with the oracle on {search.actions[a]} after {names}",
                f"the oracle said {answer}",
            )
        possible = [a for a, answer in answers.items() if isinstance(answer, Step)]
        if search.is_goal(state) or not possible:
            break
        chosen = int(rng.choice(possible))
        step = answers[chosen]
        assert isinstance(step, Step)
        state = step.state
        done.append(chosen)
        standing = {a: (u, r) for a, (u, r) in standing.items() if chosen not in u}
    names = [search.actions[b] for b in done]
    _require(
        bool(validate(problem, names)) is search.is_goal(state),
        f"{label}: the independent replay to agree on whether {names} reaches the goal",
    )
    _require(bool(replay(search, names)) is search.is_goal(state), f"{label}: a replay by the oracle to agree")


def replay_allows(problem: Problem, names: Sequence[str]) -> bool:
    """Whether the independent replay can do all of these actions (goal or no goal)."""
    replayed = validate(problem, names)
    return replayed.ok or replayed.failed_at == len(names)


def _check_pictures(problem: Problem) -> None:
    views = problem.observation
    shape = None if views is None else views.shape
    fits = views is not None and views.dtype == np.uint8 and views.ndim == 4 and views.shape[-1] == 3
    _require(fits, "pictures as uint8 (V, H, W, 3)", f"{problem.name!r} gave {shape}")
    again = problem.semantics.observe(problem)
    same = again is not None and views is not None and np.array_equal(again, views)
    _require(same, "the same seed to give the same pictures", f"{problem.name!r} did not")


def _require(condition: bool, expected: str, came: str = "") -> None:
    if not condition:
        raise ContractError(f"Expected {expected}{'; ' + came if came else ''}.")
