"""Loops that numba compiles when they are first called, and keeps on disk: beside the source, else in the user's cache.

Importing them loads no numba. It looks for changes only in the file of the function that is called: compiled functions
that call one another belong into one file.
"""

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

from neurosym.support.progress import tell

F = TypeVar("F", bound=Callable[..., Any])
#: Functions of one file, by the file's names; whether each is kept on disk by itself.
_waiting: dict[int, list[tuple[Callable[..., Any], bool]]] = {}
_ready: dict[Callable[..., Any], Callable[..., Any]] = {}


def compiled(function: F) -> F:
    """The function as machine code, once it is called; division by zero gives infinity, as in numpy."""
    return _later(function, True)


def inlined(function: F) -> F:
    """The same for what only other compiled functions call, generators among them: it is kept on disk with those."""
    return _later(function, False)


def _later(function: F, kept: bool) -> F:
    file = id(function.__globals__)
    _waiting.setdefault(file, []).append((function, kept))

    @functools.wraps(function)
    def call(*given: Any) -> Any:
        if function not in _ready:
            tell(f"compiling {(function.__module__ or function.__name__).rpartition('.')[2]} (once, kept on disk)")
            for each, alone in _waiting.pop(file):
                # In place of what waits: compiled functions look for one another there.
                _ready[each] = each.__globals__[each.__name__] = _made(each, alone)
        return _ready[function](*given)

    return cast(F, call)


def _made(function: Callable[..., Any], kept: bool) -> Callable[..., Any]:
    from numba import njit

    options: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
    if not kept:
        return cast(Callable[..., Any], njit(function, **options, no_cpython_wrapper=True, no_cfunc_wrapper=True))
    try:
        return cast(Callable[..., Any], njit(function, **options, cache=True))
    except RuntimeError:  # neither place can be written: compiled anew in each process
        return cast(Callable[..., Any], njit(function, **options))
