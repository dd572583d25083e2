"""Shapes, bodies and parts: what an assembly is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.support.arrays import Array, Numbers

#: Corners of a unit box about the origin, and its twelve triangles with outward normals.
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_BOX_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Box:
    """A box about its frame's origin. ``size``: float64 (3,), full edge lengths."""

    size: Array

    @property
    def vertices(self) -> Array:
        return _CORNERS * self.size

    @property
    def faces(self) -> Numbers:
        return _BOX_FACES


@dataclass(frozen=True, eq=False)
class Convex:
    """A convex body. ``vertices``: float64 (n, 3); ``faces``: int64 (m, 3), outward."""

    vertices: Array
    faces: Numbers


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed triangle mesh, convex or not. ``vertices``: float64 (n, 3); ``faces``: int64 (m, 3), outward."""

    vertices: Array
    faces: Numbers


Shape = Box | Convex | Mesh


@dataclass(frozen=True, eq=False)
class Body:
    """One shape of a part. ``X_PB``: float64 (4, 4), its pose in the part's frame; ``density``: times the part's."""

    shape: Shape
    X_PB: Array
    density: float = 1.0


@dataclass(frozen=True, eq=False)
class Part:
    """A rigid part: bodies that move together. ``X_WP``: float64 (4, 4); ``density``: mass per unit of volume."""

    name: str
    bodies: tuple[Body, ...]
    X_WP: Array
    density: float = 1.0

    def __post_init__(self) -> None:
        if not self.bodies:
            raise AssemblyError(f"Expected part {self.name!r} to have at least one body; it is empty.")
        arrays = (array for b in self.bodies for array in (b.shape.vertices, self.X_WP @ b.X_PB))
        if not all(np.isfinite(array).all() for array in arrays):
            raise AssemblyError(f"Expected finite coordinates; part {self.name!r} has NaN or infinity.")


def boxes_part(name: str, centres: Array, size: Array, X_WP: Array | None = None, density: float = 1.0) -> Part:
    """A part of equal boxes: ``centres`` float64 (n, 3) in its frame, ``size`` float64 (3,)."""
    bodies = []
    for centre in centres:
        X = np.eye(4)
        X[:3, 3] = centre
        bodies.append(Body(Box(size), X))
    return Part(name, tuple(bodies), np.eye(4) if X_WP is None else X_WP, density)
