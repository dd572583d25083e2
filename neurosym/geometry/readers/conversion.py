"""What was read, turned so that z is up, and with its lengths in another unit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from neurosym.geometry.notes import Note
from neurosym.geometry.readers.contents import Y_UP, Contents, RawMesh
from neurosym.geometry.shapes import Body, Box, Part, Shape
from neurosym.geometry.units import factor, unit
from neurosym.support.arrays import Array


def upright(contents: Contents) -> Contents:
    """The contents of a file in which y is up, turned so that z is."""
    parts: list[RawMesh | Part] = []
    for part in contents.parts:
        if isinstance(part, RawMesh) and part.X_WP is None:
            parts.append(replace(part, vertices=part.vertices @ Y_UP[:3, :3].T))
        else:
            assert part.X_WP is not None
            parts.append(replace(part, X_WP=Y_UP @ part.X_WP))
    note = Note("", "axes", 0.0, "y is up in the file, as was said: turned so that z is.")
    return replace(contents, parts=tuple(parts), notes=(note, *contents.notes))


def in_units(contents: Contents, wanted: str | None, source: Path) -> tuple[Contents, list[Note]]:
    """The contents with lengths in the unit that the caller wants, or that the format states."""
    known = None if contents.units is None else unit(contents.units)
    if known is None:
        if wanted is None:
            sentence = f"{source.name} does not say what its lengths are in, and nothing was assumed."
            return contents, [Note("", "units", 0.0, sentence, "State the unit (units=, --units) if it matters.")]
        return replace(contents, units=wanted), []
    times = factor(known, wanted or known)
    if times == 1.0:
        return replace(contents, units=known), []
    parts = tuple(_scaled(part, times) for part in contents.parts)
    table = None if contents.table is None else contents.table * times
    sentence = f"{source.name} is in {known}: its lengths were multiplied by {times:g}, to be in {wanted}."
    return replace(contents, parts=parts, table=table, units=wanted), [Note("", "units", times, sentence)]


def _scaled(part: RawMesh | Part, times: float) -> RawMesh | Part:
    """The part with all lengths multiplied; a mass stays what it is."""
    density = part.density / times**3
    if isinstance(part, RawMesh):
        X = None if part.X_WP is None else _farther(part.X_WP, times)
        return replace(part, vertices=part.vertices * times, X_WP=X, density=density)
    bodies = tuple(Body(_larger(b.shape, times), _farther(b.X_PB, times), b.density) for b in part.bodies)
    return Part(part.name, bodies, _farther(part.X_WP, times), density)


def _farther(X: Array, times: float) -> Array:
    moved = np.array(X, dtype=np.float64)
    moved[:3, 3] *= times
    return moved


def _larger(shape: Shape, times: float) -> Shape:
    if isinstance(shape, Box):
        return Box(shape.size * times)
    return replace(shape, vertices=shape.vertices * times)
