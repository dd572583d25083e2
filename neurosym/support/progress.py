"""How far long work is: a function that is told, and one that tells nobody.

What lies deep in geometry tells whoever listens: like a deadline, the listener goes with the call.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

#: Called with (done, total).
Progress = Callable[[int, int], None]

#: Called with what is being done, how much of it is, and the total; 0 where that is not known, and "" for nothing.
Listener = Callable[[str, int, int], None]

_listener: ContextVar[Listener | None] = ContextVar("_listener", default=None)


def silent(done: int, total: int) -> None:
    """Progress that nobody wants to see."""


@contextmanager
def heard_by(listener: Listener) -> Iterator[None]:
    """What is done inside tells this listener."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def tell(what: str = "", done: int = 0, total: int = 0) -> None:
    """Say how far work is, if anybody listens."""
    listener = _listener.get()
    if listener is not None:
        listener(what, done, total)
