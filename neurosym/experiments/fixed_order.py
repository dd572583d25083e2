"""The image-blind baseline: one fixed order for every problem. A prior that looks must beat it."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

from neurosym.language.search_problem import Rejection, SearchProblem

#: Questions to the oracle after which the search for the best fixed order stops with the best it has.
MAX_ATTEMPTS = 2_000_000


def order_fails(search: SearchProblem[Any], order: Sequence[int]) -> bool:
    """Whether an order (indices of actions) is refused somewhere, or ends before the goal."""
    state = search.initial
    for action in order:
        if search.is_goal(state):
            return False
        if action not in set(search.candidates(state)):
            return True
        answer = search.attempt(state, action)
        if isinstance(answer, Rejection):
            return True
        state = answer.state
    return not search.is_goal(state)


def best_fixed_order(searches: Sequence[SearchProblem[Any]]) -> tuple[str, ...] | None:
    """The order that solves the most of these problems, as names of actions; None where they share no actions.

    Branch and bound over orders: a prefix is followed while more problems survive it than the best order so far
    solves. Exact unless `MAX_ATTEMPTS` ends it.
    """
    if not searches or any(tuple(s.actions) != tuple(searches[0].actions) for s in searches):
        return None
    search = _Search(searches)
    search.follow((), [(i, s.initial) for i, s in enumerate(searches)], 0)
    return tuple(searches[0].actions[a] for a in search.best)


class _Search:
    def __init__(self, searches: Sequence[SearchProblem[Any]]) -> None:
        self.searches = searches
        self.answers: list[dict[tuple[Hashable, int], Any]] = [{} for _ in searches]
        kinds = {tuple(s.classes) for s in searches}
        self.classes = kinds.pop() if len(kinds) == 1 else tuple(range(len(searches[0].actions)))
        self.attempts = 0
        self.solved = -1
        self.best: tuple[int, ...] = ()

    def follow(self, prefix: tuple[int, ...], alive: list[tuple[int, Any]], done: int) -> None:
        """Extend a prefix that `done` problems end at their goal with, and the `alive` survive."""
        going = []
        for i, state in alive:
            if self.searches[i].is_goal(state):
                done += 1
            else:
                going.append((i, state))
        if done > self.solved:
            self.solved, self.best = done, prefix
        if not going:
            return
        branches = []
        tried: set[int] = set()
        for action in range(len(self.searches[0].actions)):
            # Where all problems agree on which actions are interchangeable, one of a class speaks for all.
            if action not in prefix and self.classes[action] not in tried:
                tried.add(self.classes[action])
                survivors = [(i, after) for i, state in going if (after := self._after(i, state, action)) is not None]
                branches.append((-len(survivors), action, survivors))
        # The hardiest first: a good order found early cuts the rest short.
        for lost, action, survivors in sorted(branches, key=lambda branch: branch[:2]):
            if done - lost > self.solved and self.attempts < MAX_ATTEMPTS:
                self.follow((*prefix, action), survivors, done)

    def _after(self, i: int, state: Any, action: int) -> Any:
        """The state after an action, or None where it is refused; each question is asked once."""
        known = self.answers[i]
        if (state, action) not in known:
            self.attempts += 1
            answer = None
            if action in set(self.searches[i].candidates(state)):
                answer = self.searches[i].attempt(state, action)
            known[state, action] = None if answer is None or isinstance(answer, Rejection) else answer.state
        return known[state, action]
