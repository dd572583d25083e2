"""Nogoods: what rejections promise, so that it need not be asked again."""

from __future__ import annotations

from collections.abc import Iterable

from neurosym.language.search_problem import Rejection
from planners.node import Node


class Nogoods:
    """An action is refused until one of some others is done (`Rejection.until`).

    Unconditional rejections promise it in every state in which those of `given` are done, others below the node where
    they were met.

    Args:
        repeating: a bitset of actions that may be done again; that one was done says nothing of a state, so what waits
            for one is promised below the node alone.
        beside: those of a search from the problem's other end. What is done in a state of one is what is not done there
            in the other, so that what is promised everywhere serves both: `given` and `until` change places.
    """

    def __init__(self, beside: Nogoods | None = None, *, repeating: int = 0) -> None:
        #: Action -> pairs of bitsets, forwards: all of the first are done, none of the second.
        self._everywhere: dict[int, set[tuple[int, int]]] = {} if beside is None else beside._everywhere
        self._backwards = beside is not None
        self._repeating = repeating
        self._any = False

    def learn(self, node: Node, action: int, rejection: Rejection) -> None:
        """Keep what the rejection of `action` at `node` promises, if anything."""
        if rejection.until:
            until = sum(1 << a for a in set(rejection.until))
            self._any = True
            if rejection.unconditional and not until & self._repeating & ~(1 << action):
                done, left = sum(1 << a for a in set(rejection.given)), until & ~(1 << action)
                self._everywhere.setdefault(action, set()).add((left, done) if self._backwards else (done, left))
            node.promises[action] = until

    def allowed(self, node: Node, actions: Iterable[int]) -> list[int]:
        """Those of `actions` that nothing promises to be refused at `node`."""
        if not self._any and not self._everywhere:
            return list(actions)
        used, since, refused = node.used, 0, set[int]()
        origin: Node | None = node
        while origin is not None:
            if origin.promises:
                refused.update(action for action, until in origin.promises.items() if not until & since)
            if origin.parent is not None:
                since |= 1 << origin.action
            origin = origin.parent
        # Backwards the pairs change places: all of the second are done, none of the first.
        done, left = (~used, used) if self._backwards else (used, ~used)
        known = self._everywhere
        possible = [a for a in actions if a not in refused]
        return [a for a in possible if a not in known or all(u & done or g & left for g, u in known[a])]
