"""How far long work is: a function that is told, and one that tells nobody."""

from collections.abc import Callable

#: Called with (done, total).
Progress = Callable[[int, int], None]


def silent(done: int, total: int) -> None:
    """Progress that nobody wants to see."""
