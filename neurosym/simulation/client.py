"""PyBullet, kept quiet and closed: the only door through which this library reaches the simulator.

PyBullet prints a banner from C when it is imported, past `sys.stdout` and `sys.stderr`. It is imported here,
once, with the process's own file descriptors turned aside, and whatever other threads wrote meanwhile is
passed on. A `Client` is one connection (``DIRECT``, no window and no server) that closes
when it is left, when an exception passes, when it is forgotten and when Python ends.
"""

import contextlib
import importlib
import os
import sys
import tempfile
import threading
import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import partial
from types import BuiltinFunctionType, ModuleType
from typing import IO, Any, Self, cast

from neurosym.errors import MissingDependencyError, NeurosymError

#: What PyBullet says of its own accord: lines that begin so are dropped, all others are passed on.
_BANNERS = (b"pybullet build time:", b"numActiveThreads", b"stopping threads", b"Thread with taskId", b"Version = ")

_lock = threading.RLock()
_module: ModuleType | None = None


@contextlib.contextmanager
def without_output() -> Iterator[None]:
    """Drop what C code writes to file descriptors 1 and 2 meanwhile: V-HACD reports its progress there."""
    with _lock, _aside(lambda line: False):
        yield


def _without_banner() -> contextlib.AbstractContextManager[None]:
    """Turn file descriptors 1 and 2 aside, then pass on every line that is not PyBullet's banner."""
    return _aside(lambda line: not line.startswith(_BANNERS))


@contextlib.contextmanager
def _aside(passed_on: Callable[[bytes], bool]) -> Iterator[None]:
    kept: list[tuple[int, int, IO[bytes]]] = []
    _flush()
    for fd in (1, 2):
        # A daemon may run with its standard descriptors closed: then there is nothing to keep clean.
        with contextlib.suppress(OSError):
            saved = os.dup(fd)
            aside = cast("IO[bytes]", tempfile.TemporaryFile())  # noqa: SIM115 - closed below, its content passed on
            os.dup2(aside.fileno(), fd)
            kept.append((fd, saved, aside))
    try:
        yield
    finally:
        _flush()
        for fd, saved, aside in kept:
            os.dup2(saved, fd)
            os.close(saved)
            with aside:
                aside.seek(0)
                rest = b"".join(line for line in aside if passed_on(line))
            if rest:
                os.write(fd, rest)


def _flush() -> None:
    """Empty Python's buffers, so that what was written before or during stays on its own side."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()


def pybullet() -> Any:
    """The `pybullet` module, imported on first use and without its banner.

    Raises MissingDependencyError: PyBullet is not installed.
    """
    global _module
    with _lock:
        if _module is None:
            try:
                with _without_banner():
                    _module = importlib.import_module("pybullet")
            except ImportError as error:
                purpose = "simulates and draws (wheels up to Python 3.11; later ones compile it with a C++ compiler)"
                raise MissingDependencyError.of("PyBullet", purpose, "physics") from error
        return _module


class Closeable(ABC):
    """What is closed when its ``with`` ends; closing twice does nothing."""

    @abstractmethod
    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Bound:
    """The `pybullet` module, whose functions are told once and for all which connection they are for."""

    def __init__(self, module: ModuleType, number: int) -> None:
        self._module, self._number = module, number

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._module, name)
        if isinstance(value, BuiltinFunctionType):
            value = partial(value, physicsClientId=self._number)
        setattr(self, name, value)
        return value


class Client(Closeable):
    """One connection to a simulator of its own, without a window (`neurosym.simulation.window` has one).

    Use it as a context manager, or call `close`. Attribute `p` is the `pybullet` module, its functions bound to this
    connection, whose number is `id`. Raises NeurosymError: PyBullet has none left (it allows about a thousand).
    """

    def __init__(self) -> None:
        module = pybullet()
        with _lock, _without_banner():
            self.id: int = module.connect(module.DIRECT)
        if self.id < 0:
            raise NeurosymError(
                "Expected a connection to PyBullet; it has none left. Close worlds and studios after use ('with')."
            )
        self.p: Any = _Bound(module, self.id)
        self._finalizer = weakref.finalize(self, _disconnect, module, self.id)

    @property
    def is_open(self) -> bool:
        """Whether the connection still stands."""
        return bool(self._finalizer.alive)

    def close(self) -> None:
        """Disconnect; closing twice does nothing."""
        self._finalizer()


def open_clients() -> int:
    """How many PyBullet connections this process holds; 0 when everything was closed."""
    if _module is None:
        return 0
    # PyBullet numbers connections from 0 and reuses numbers, at most 1024 of them.
    return sum(bool(_module.isConnected(physicsClientId=i)) for i in range(1024))


def _disconnect(p: Any, client: int) -> None:
    # PyBullet's own exit handler may have been faster.
    with contextlib.suppress(p.error):
        p.disconnect(physicsClientId=client)
