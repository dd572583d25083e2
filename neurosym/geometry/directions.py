"""Directions in words."""

from __future__ import annotations

from collections.abc import Sequence


def in_words(vector: Sequence[float]) -> str:
    """A direction of three numbers in words: ``+z`` along an axis of the world, its three numbers otherwise."""
    for axis, name in enumerate("xyz"):
        if abs(abs(vector[axis]) - 1) < 1e-9:
            return ("+" if vector[axis] > 0 else "-") + name
    return "(" + ", ".join(f"{float(v) + 0.0:.3g}" for v in vector) + ")"
