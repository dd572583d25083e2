"""Shapes, bodies and parts: what an assembly is made of."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.support.arrays import Array, Numbers

#: How long a body may be, in its unit: beyond, squares and cubes of lengths lose all digits.
SMALLEST, LARGEST = 1e-9, 1e9

#: What a density may be, bodies of one part among each other left out.
LIGHTEST, HEAVIEST = 1e-30, 1e30

#: Of a body's thickness: steps of coordinates that count, as `Tolerances.touch` by default.
TOUCH = 1e-3

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


@dataclass(frozen=True, eq=False, repr=False)
class Convex:
    """A convex body. ``vertices``: float64 (n, 3); ``faces``: int64 (m, 3), outward."""

    vertices: Array
    faces: Numbers

    def __repr__(self) -> str:
        return f"Convex({len(self.vertices)} vertices, {len(self.faces)} faces)"


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A closed triangle mesh, convex or not. ``vertices``: float64 (n, 3); ``faces``: int64 (m, 3), outward."""

    vertices: Array
    faces: Numbers

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces)"


Shape = Box | Convex | Mesh


@dataclass(frozen=True, eq=False)
class Body:
    """One shape of a part. ``X_PB``: float64 (4, 4), its pose in the part's frame; ``density``: times the part's."""

    shape: Shape
    X_PB: Array = field(repr=False)
    density: float = 1.0


@dataclass(frozen=True, eq=False, repr=False)
class Part:
    """A rigid part: bodies that move together. ``X_WP``: float64 (4, 4); ``density``: mass per unit of volume."""

    name: str
    bodies: tuple[Body, ...]
    X_WP: Array
    density: float = 1.0

    def __post_init__(self) -> None:
        if not self.bodies:
            raise AssemblyError(f"Expected part {self.name!r} to have at least one body; it is empty.")
        for body in self.bodies:
            vertices, X = body.shape.vertices, self.X_WP @ body.X_PB
            if not (np.isfinite(vertices).all() and np.isfinite(X).all()):
                raise AssemblyError(f"Expected finite coordinates; part {self.name!r} has NaN or infinity.")
            sizes = body.shape.size if isinstance(body.shape, Box) else np.ptp(vertices, axis=0)
            self._check_range(float(sizes.max()), float(np.abs(X[:3, 3]).max()), float(sizes.min()))
        if not LIGHTEST <= self.density <= HEAVIEST:
            raise AssemblyError(
                f"Expected a density of {LIGHTEST:g} to {HEAVIEST:g}; part {self.name!r} has {self.density:g}."
            )

    def _check_range(self, size: float, away: float, thin: float) -> None:
        """Refuse what is so small, so large or so far that rounding would decide."""
        if not SMALLEST <= size <= LARGEST:
            found = f"a body {size:g} long"
        elif away > LARGEST or 4 * away * np.finfo(float).eps > TOUCH * max(thin, SMALLEST):
            found = f"one {thin:g} thin that lies {away:g} away"
        else:
            return
        raise AssemblyError(
            f"Expected bodies {SMALLEST:g} to {LARGEST:g} long, not so far from the origin that coordinates come in "
            f"steps that count; part {self.name!r} has {found}. Use another unit, or move the assembly to the origin."
        )

    def __repr__(self) -> str:
        return f"Part({self.name!r}, {len(self.bodies)} {'body' if len(self.bodies) == 1 else 'bodies'})"


def boxes_part(name: str, centres: Array, size: Array, X_WP: Array | None = None, density: float = 1.0) -> Part:
    """A part of equal boxes: ``centres`` float64 (n, 3) in its frame, ``size`` float64 (3,)."""
    bodies = []
    for centre in centres:
        X = np.eye(4)
        X[:3, 3] = centre
        bodies.append(Body(Box(size), X))
    return Part(name, tuple(bodies), np.eye(4) if X_WP is None else X_WP, density)
