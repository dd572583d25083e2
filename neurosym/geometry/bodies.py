"""The bodies of parts, in the world, as arrays: what questions about many of them are asked of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from neurosym.geometry.shapes import Body, Box, Mesh, Part
from neurosym.support import arrays
from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.bitsets import members


@dataclass(frozen=True, eq=False)
class Bodies:
    """All bodies of some parts, part by part; a sequence of `Body`. Masks of bodies number their bits so."""

    parts: tuple[Part, ...]

    def __len__(self) -> int:
        return len(self._bodies)

    def __getitem__(self, body: int) -> Body:
        return self._bodies[body]

    def __iter__(self) -> Iterator[Body]:
        return iter(self._bodies)

    @cached_property
    def _bodies(self) -> tuple[Body, ...]:
        return tuple(b for p in self.parts for b in p.bodies)

    @cached_property
    def owners(self) -> Numbers:
        """int64 (n,): the number of the part that each body belongs to."""
        return np.repeat(np.arange(len(self.parts)), [len(p.bodies) for p in self.parts])

    @cached_property
    def X_WB(self) -> Array:
        """float64 (n, 4, 4): poses in the world."""
        return np.array([p.X_WP @ b.X_PB for p in self.parts for b in p.bodies])

    @cached_property
    def is_box(self) -> Truths:
        """bool (n,): which are boxes."""
        return np.array([isinstance(b.shape, Box) for b in self])

    @cached_property
    def is_convex(self) -> Truths:
        """bool (n,): which are convex by their kind of shape."""
        return np.array([not isinstance(b.shape, Mesh) for b in self])

    @cached_property
    def all_boxes(self) -> bool:
        """Whether every body is a box."""
        return bool(self.is_box.all())

    @cached_property
    def box_sizes(self) -> Array:
        """float64 (n, 3): full edge lengths of the boxes, 0 for other bodies."""
        return np.array([b.shape.size if isinstance(b.shape, Box) else np.zeros(3) for b in self])

    def vertices(self, body: int) -> Array:
        """float64 (k, 3): the vertices of a body, in the world."""
        X = self.X_WB[body]
        return np.asarray(self[body].shape.vertices @ X[:3, :3].T + X[:3, 3])

    def of(self, parts: int) -> list[int]:
        """Numbers of the bodies of the parts in a bitset."""
        there = members(parts, int(self.owners[-1]) + 1)
        return np.flatnonzero(there[self.owners]).tolist()

    def points(self, parts: int) -> Array:
        """float64 (k, 3): the vertices of the parts in a bitset, in the world."""
        return np.concatenate([np.zeros((0, 3)), *map(self.vertices, self.of(parts))])

    @cached_property
    def bounds(self) -> Array:
        """float64 (n, 2, 3): axis-aligned bounds, in the world."""
        half = np.einsum("bij,bj->bi", np.abs(self.X_WB[:, :3, :3]), self.box_sizes / 2)
        centres = self.X_WB[:, :3, 3]
        bounds: Array = np.stack([centres - half, centres + half], axis=1)
        for i in np.flatnonzero(~self.is_box):
            vertices = self.vertices(int(i))
            bounds[i] = arrays.bounds(vertices)
        return bounds

    @cached_property
    def part_bounds(self) -> Array:
        """float64 (n_parts, 2, 3): the same for the parts."""
        first = np.searchsorted(self.owners, np.arange(len(self.parts)))
        low, high = self.bounds[:, 0], self.bounds[:, 1]
        return np.stack([np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)], axis=1)

    def centre(self, parts: int) -> Array:
        """float64 (3,): the middle of the bounds of the parts in a bitset, in the world."""
        own = self.bounds[self.of(parts)]
        return np.asarray((own[:, 0].min(axis=0) + own[:, 1].max(axis=0)) / 2)

    @cached_property
    def smallest_extent(self) -> float:
        """The smallest extent of any body in its own frame: what tolerances are shares of."""
        sizes = self.box_sizes.copy()
        for i in np.flatnonzero(~self.is_box):
            sizes[i] = arrays.extents(self[int(i)].shape.vertices)
        return float(sizes.min())

    def axes(self, parallel: float) -> Array:
        """float64 (k, 3): the axes of the boxes (without any, of the world) and the vertical, the most upward first.

        Args:
            parallel: sine of the angle up to which two axes are one.
        """
        distinct = [np.array([0.0, 0.0, 1.0])]
        rotations = self.X_WB[self.is_box, :3, :3]
        candidates = np.swapaxes(rotations, 1, 2).reshape(-1, 3) if len(rotations) else np.eye(3)
        for axis in np.unique(np.round(candidates, 9), axis=0):
            if all(np.linalg.norm(np.cross(axis, other)) > parallel for other in distinct):
                distinct.append(axis / np.linalg.norm(axis))
        both = np.array([s * a for a in distinct for s in (1.0, -1.0)])
        both[np.abs(both) < 1e-12] = 0.0
        return both[np.lexsort((-both[:, 0], -both[:, 1], -both[:, 2].round(9)))]
