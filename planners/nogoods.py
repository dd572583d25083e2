"""Nogoods: what rejections promise, so that it need not be asked again."""

from __future__ import annotations

from collections.abc import Iterable

from neurosym.language.search_problem import Rejection
from planners.node import Node


class Nogoods:
    """An action is refused until one of some others is done (`Rejection.until`).

    Unconditional rejections promise it in every state, others below the node where they were met.
    """

    def __init__(self) -> None:
        self._everywhere: dict[int, set[int]] = {}

    def learn(self, node: Node, action: int, rejection: Rejection) -> None:
        """Keep what the rejection of `action` at `node` promises, if anything."""
        if rejection.until:
            until = sum(1 << a for a in set(rejection.until))
            if rejection.unconditional:
                self._everywhere.setdefault(action, set()).add(until)
            # Actions done already cannot be done again, so they never end it: 0 means for ever.
            node.promises[action] = until & ~node.used

    def allowed(self, node: Node, actions: Iterable[int]) -> list[int]:
        """Those of `actions` that nothing promises to be refused at `node`."""
        used, refused = node.used, set[int]()
        origin: Node | None = node
        while origin is not None:
            if origin.promises:
                refused.update(action for action, until in origin.promises.items() if not until & used)
            origin = origin.parent
        everywhere = self._everywhere
        return [a for a in actions if a not in refused and all(until & used for until in everywhere.get(a, ()))]
