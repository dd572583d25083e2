"""Loops that numba compiles when they are first called, and keeps on disk: beside the source, else in the user's cache.

Numba looks for changes only in the file of the function that is called: compiled functions that call one another belong
into one file.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """The function as machine code, once it is called; division by zero gives infinity, as in numpy."""
    try:
        fast: F = njit(function, cache=True, nogil=True, error_model="numpy")
    except RuntimeError:  # neither place can be written: it is compiled anew in each process
        fast = inlined(function)
    return fast


def inlined(function: F) -> F:
    """The same for generators: numba 0.68 cannot load one from disk, but it keeps them with what calls them."""
    fast: F = njit(function, nogil=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
    return fast
