"""Preferred actions: those that recent rejections named are tried next (as in Fast Downward)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from neurosym.language.search_problem import Rejection


class PreferredActions:
    """The actions that rejections wait for, and those whose `names` have one of their objects in them."""

    def __init__(self, names: Sequence[str]) -> None:
        self._about: dict[str, list[int]] = {}
        for action, name in enumerate(names):
            for word in dict.fromkeys((name, *re.split(r"[\s(),]+", name))):
                if word:
                    self._about.setdefault(word, []).append(action)
        self._latest: list[int] = []

    def learn(self, rejection: Rejection, used: int) -> None:
        """Put what the rejection names before all else, but for the actions in `used`."""
        named = [*rejection.until, *(a for thing in rejection.because for a in self._about.get(thing, ()))]
        fresh = [a for a in dict.fromkeys(named) if not used >> a & 1]
        self._latest = [*fresh, *(a for a in self._latest if a not in fresh)]

    def first_of(self, options: Iterable[int]) -> int | None:
        """The one of `options` that was named last; None when none was."""
        here = set(options)
        return next((a for a in self._latest if a in here), None)
