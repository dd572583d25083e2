"""Budgets: when a search stops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from neurosym.errors import InputError

if TYPE_CHECKING:
    from neurosym.planning.search_log import SearchLog


@dataclass(frozen=True)
class Budget:
    """When to stop: whichever limit is reached first. `None` sets no limit.

    Args:
        seconds: wall-clock time.
        attempts: questions to the oracle.
        expansions: states whose candidates were generated.
        watch: called with the search's log whenever its limits are looked at, which is before every attempt and every
            expansion; True ends the search. For progress, and for a button that stops.
    """

    seconds: float | None = None
    attempts: int | None = None
    expansions: int | None = None
    watch: Callable[[SearchLog[Any]], bool] | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.watch is not None and not callable(self.watch):
            raise InputError(f"Expected watch of a budget to be a function of the search's log; got {self.watch!r}.")
        for name in ("seconds", "attempts", "expansions"):
            value = getattr(self, name)
            whole = name == "seconds" or isinstance(value, int | np.integer)
            if value is not None and not (isinstance(value, int | float | np.number) and whole and value >= 0):
                kind = "a number" if name == "seconds" else "an integer"
                raise InputError(f"Expected {name} of a budget to be {kind}, 0 or more; got {value!r}.")

    def less(self, seconds: float) -> Budget:
        """What is left of it after so many seconds."""
        return self if self.seconds is None else replace(self, seconds=max(self.seconds - seconds, 0.0))

    @property
    def limits(self) -> dict[str, float | int | None]:
        """The three limits by name, for files."""
        return {"seconds": self.seconds, "attempts": self.attempts, "expansions": self.expansions}
