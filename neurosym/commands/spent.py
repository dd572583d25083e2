"""What a command's time was spent on, for whoever gave it a budget."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter


class Spent:
    """What a command's time was spent on: seconds by name, of everything since it began."""

    def __init__(self) -> None:
        self.start, self.parts = perf_counter(), dict[str, float]()

    @contextmanager
    def on(self, what: str) -> Iterator[None]:
        """Time that is spent inside is counted under a name, if it ends early, too."""
        start = perf_counter()
        try:
            yield
        finally:
            self.parts[what] = self.parts.get(what, 0.0) + perf_counter() - start

    @property
    def seconds(self) -> float:
        return perf_counter() - self.start

    def __str__(self) -> str:
        return f"{self.seconds:.1f} s ({', '.join(f'{what} {took:.1f} s' for what, took in self.parts.items())})"
