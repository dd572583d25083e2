"""What needs no picture, and stands beside every prior: a memoriser, the best fixed answers, the best fixed order.

A prior that looks must beat them. They are calculated, not trained.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

import numpy as np

from neurosym.experiments.order_accuracy import classes_at, classes_of, seen_in
from neurosym.language.demonstrations import Demonstrations
from neurosym.language.search_problem import Rejection, SearchProblem
from neurosym.support.arrays import Array

#: As `compare_orders` gives them: metric -> float64 (M,), a value a test picture.
Figures = dict[str, Array]
#: Questions to the oracle after which the search for the best fixed order stops with the best it has.
MAX_ATTEMPTS = 2_000_000


def memoriser(train: Demonstrations, test: Demonstrations) -> Figures:
    """Perfect on sequences, of classes, that were demonstrated; in others a random order of the right length.

    The dashed line of the paper's Fig. 5 and 6 (Burke, Subr, Ramamoorthy, RA-L 2021, Sec. IV-B). These are
    expectations: with n_c of the N actions in class c, a step is right with probability n_c / N, and the whole order
    with the product of (n_c - used so far) / (N - steps so far). That it knows the length flatters it.
    """
    classes = classes_of(test)
    members = np.bincount(classes)
    wanted = classes_at(test.sequences, classes)
    whole, step = np.ones(len(wanted)), np.ones(len(wanted))
    for i in np.flatnonzero(~seen_in(train, test)):
        row = wanted[i][wanted[i] >= 0]
        step[i] = members[row].mean() / len(classes)
        left = members.copy()
        for done, kind in enumerate(row):
            whole[i] *= left[kind] / (len(classes) - done)
            left[kind] -= 1
    return {"whole_sequence": whole, "per_step": step, "re_use": np.zeros(len(wanted))}


def blind(train: Demonstrations, test: Demonstrations) -> Figures:
    """The same answer to every picture: for each metric the answer that does best on the training demonstrations.

    `whole_sequence`: the most frequent sequence of classes; `per_step`: the assignment of actions to steps that is
    right in most; `stop_accuracy`: the most frequent length.
    """
    from scipy.optimize import linear_sum_assignment

    classes = np.array(classes_of(train))
    known, wanted = classes_at(train.sequences, tuple(classes)), classes_at(test.sequences, classes_of(test))
    rows, counts = np.unique(known, axis=0, return_counts=True)
    share = 1 / train.lengths[:, None, None]  # a step of a short order weighs more, as in `compare_orders`
    gain = ((known[:, :, None] == classes) * share).sum(axis=0)
    steps, actions = linear_sum_assignment(gain, maximize=True)
    order = np.full(known.shape[1], -1)
    order[steps] = classes[actions]
    taken = wanted >= 0
    return {
        "whole_sequence": (wanted == rows[counts.argmax()]).all(axis=1).astype(float),
        "per_step": ((wanted == order) & taken).sum(axis=1) / test.lengths,
        "re_use": np.zeros(len(wanted)),
        "stop_accuracy": (test.lengths == np.bincount(train.lengths).argmax()).astype(float),
    }


#: By their names in tables.
BASELINES: Mapping[str, Callable[[Demonstrations, Demonstrations], Figures]] = {"memoriser": memoriser, "blind": blind}


def order_fails(search: SearchProblem[Any], order: Sequence[int]) -> bool:
    """Whether an order (indices of actions) is refused somewhere, or ends before the goal."""
    state = search.initial
    for action in order:
        if search.is_goal(state):
            return False
        state = _after(search, state, action)
        if state is None:
            return True
    return not search.is_goal(state)


def best_fixed_order(searches: Sequence[SearchProblem[Any]]) -> tuple[str, ...] | None:
    """The order that solves the most of these problems, as names of actions; None where they share no actions.

    Branch and bound over orders: a prefix is extended while more problems survive it than the best order so far
    solves. Exact unless `MAX_ATTEMPTS` ends it.
    """
    if not searches or any(tuple(s.actions) != tuple(searches[0].actions) for s in searches):
        return None
    search = _OrderSearch(searches)
    search.extend((), [(i, s.initial) for i, s in enumerate(searches)], 0)
    return tuple(searches[0].actions[a] for a in search.best)


def _after(search: SearchProblem[Any], state: Any, action: int) -> Any:
    """The state after an action, or None where it is not applicable or refused."""
    if action not in set(search.candidates(state)):
        return None
    answer = search.attempt(state, action)
    return None if isinstance(answer, Rejection) else answer.state


class _OrderSearch:
    def __init__(self, searches: Sequence[SearchProblem[Any]]) -> None:
        self.searches = searches
        self.answers: dict[tuple[int, Hashable, int], Any] = {}
        kinds = {tuple(s.classes) for s in searches}
        # Where all problems agree on which actions are interchangeable, one of a class speaks for all.
        self.classes = kinds.pop() if len(kinds) == 1 else tuple(range(len(searches[0].actions)))
        self.solved = -1
        self.best: tuple[int, ...] = ()

    def extend(self, prefix: tuple[int, ...], alive: list[tuple[int, Any]], done: int) -> None:
        """Extend a prefix with which `done` problems end at their goal, and which the `alive` survive."""
        going = [(i, state) for i, state in alive if not self.searches[i].is_goal(state)]
        done += len(alive) - len(going)
        if done > self.solved:
            self.solved, self.best = done, prefix
        if not going:
            return
        branches = []
        tried: set[int] = set()
        for action, kind in enumerate(self.classes):
            if action not in prefix and kind not in tried:
                tried.add(kind)
                after = [(i, self._ask(i, state, action)) for i, state in going]
                survivors = [(i, state) for i, state in after if state is not None]
                branches.append((-len(survivors), action, survivors))
        # The hardiest first: a good order early cuts the rest short.
        for lost, action, survivors in sorted(branches, key=lambda branch: branch[:2]):
            if done - lost > self.solved and len(self.answers) < MAX_ATTEMPTS:
                self.extend((*prefix, action), survivors, done)

    def _ask(self, i: int, state: Any, action: int) -> Any:
        """Each question is asked once."""
        if (i, state, action) not in self.answers:
            self.answers[i, state, action] = _after(self.searches[i], state, action)
        return self.answers[i, state, action]
