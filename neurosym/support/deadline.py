"""When work has to end: whoever starts it says so, and long loops anywhere below look.

Nothing is handed down: the deadline goes with the call, through every room, and is not shared with other threads.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from time import perf_counter

import numpy as np

from neurosym.support.arrays import Array, Numbers
from neurosym.support.progress import tell

_ends: ContextVar[float] = ContextVar("_ends", default=math.inf)


class OutOfTime(BaseException):
    """The time that was given has ended. Like an interrupt it is no error, and not caught as one."""


@contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """What is done inside ends so many seconds from now, or earlier where that was said before; None: no sooner."""
    if seconds is None:
        yield
        return
    token = _ends.set(min(_ends.get(), perf_counter() + seconds))
    try:
        yield
    finally:
        _ends.reset(token)


def remaining() -> float:
    """Seconds that are left: infinite where no end was set, negative beyond it."""
    return _ends.get() - perf_counter()


def check() -> None:
    """To be called in loops that may take long.

    Raises:
        OutOfTime: the deadline has passed.
    """
    if perf_counter() > _ends.get():
        raise OutOfTime


def portions(weights: Array | Numbers, most: float, what: str = "") -> Iterator[slice]:
    """Runs of rows whose weights (n,) sum to `most` or less, or one row; the deadline is looked at before each.

    Args:
        what: is being done to the rows, for whoever listens to progress; "" tells nobody.
    """
    ends = np.cumsum(weights)
    start, before = 0, 0.0
    while start < len(ends):
        check()
        if what:
            tell(what, start, len(ends))
        end = max(int(np.searchsorted(ends, before + most, side="right")), start + 1)
        yield slice(start, end)
        start, before = end, ends[end - 1]
    if what:
        tell()
