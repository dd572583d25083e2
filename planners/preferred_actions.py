"""Preferred actions: those that recent rejections named are tried next (as in Fast Downward)."""

import re
from collections.abc import Iterable, Sequence
from functools import cached_property

from neurosym.language.search_problem import Rejection


class PreferredActions:
    """The actions that rejections wait for, and those whose `names` have one of their objects in them."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self._latest: list[int] = []

    @cached_property
    def _about(self) -> dict[str, list[int]]:
        """Word -> the actions that have it in their names."""
        about: dict[str, list[int]] = {}
        for action, name in enumerate(self._names):
            for word in dict.fromkeys((name, *re.split(r"[\s(),]+", name))):
                if word:
                    about.setdefault(word, []).append(action)
        return about

    def learn(self, rejection: Rejection, used: int) -> None:
        """Put what the rejection names before all else, but for the actions in `used`."""
        named = [*rejection.until, *(a for thing in rejection.because for a in self._about.get(thing, ()))]
        fresh = [a for a in dict.fromkeys(named) if not used >> a & 1]
        self._latest = [*fresh, *(a for a in self._latest if a not in fresh)]

    def first_of(self, options: Iterable[int]) -> int | None:
        """The one of `options` that was named last; None when none was."""
        here = set(options)
        return next((a for a in self._latest if a in here), None)
