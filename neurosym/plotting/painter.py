"""What hides what: pieces of solids in the order in which a painter lays them on, the farthest first.

All is in the viewer's frame: x to the right, y up, z towards the viewer, who is infinitely far away. The order is that
of a binary space partition (Fuchs, Kedem, Naylor, SIGGRAPH 1980): what lies in front of a plane that faces the viewer
is laid on later than what lies behind it, and what does both is cut. So the order is right for parts that hold or
cross one another too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Points no farther than this from a plane lie in it, as a share of the extent of all pieces.
IN_PLANE = 1e-7
#: Planes that are compared before one is taken, and how many pieces out of balance one more cut is worth.
_TRIED, _CUT = 12, 3.0


@dataclass(frozen=True, eq=False)
class Piece:
    """Faces of which none hides another: those of a convex body that face the viewer, or some in one plane.

    Attributes:
        part: number of the part that it belongs to.
        faces: each float64 (k, 3), the corners of a convex polygon in order.
        shades: one a face, 0..1: how light it is.
        lines: each float64 (2, 3), the ends of a line on the faces, or of one that belongs to none.
        planes: float64 (m, 4), unit normals with a third component above 0, and offsets: no point x of the piece has
            ``normal @ x > offset``.
    """

    part: int
    faces: tuple[Array, ...]
    shades: tuple[float, ...]
    lines: tuple[Array, ...]
    planes: Array

    @property
    def points(self) -> Array:
        """float64 (n, 3): all corners and ends."""
        return np.concatenate([*self.faces, *self.lines])


def back_to_front(pieces: Sequence[Piece], axes: Array) -> list[Piece]:
    """Pieces, or parts of them, so that none hides any that comes after it.

    Args:
        pieces: with at least one point each.
        axes: float64 (k, 3), unit vectors along which gaps between pieces are looked for before any is cut.
    """
    if not pieces:
        return []
    every = np.concatenate([piece.points for piece in pieces])
    near = IN_PLANE * max(float(np.ptp(every, axis=0).max()), 1e-300)
    done: list[Piece] = []
    waiting = [list(pieces)]
    while waiting:
        own = waiting.pop()
        if len(own) < 2:
            done += own
            continue
        points = [piece.points for piece in own]
        starts = np.cumsum([0, *map(len, points[:-1])])
        stacked = np.concatenate(points)
        halves = _gap(own, stacked, starts, axes, near) or _halves(own, stacked, starts, near)
        if halves is None:
            # Nothing lies in front of a face, but a line without one may lie behind some.
            done += sorted(own, key=lambda piece: bool(piece.faces))
        else:
            waiting += halves[::-1]
    return done


def _gap(
    own: list[Piece], points: Array, starts: NDArray[np.int64], axes: Array, near: float
) -> list[list[Piece]] | None:
    """The pieces on both sides of the gap that halves them best, the farther ones first; None where there is no gap."""
    best, least = None, len(own)
    for axis in axes:
        along = points @ axis
        low, high = np.minimum.reduceat(along, starts), np.maximum.reduceat(along, starts)
        order = np.argsort(low, kind="stable")
        reached = np.maximum.accumulate(high[order])[:-1]
        # A flat piece in the plane of the gap is kept on one side of it, and hides nothing there.
        open_after = np.flatnonzero(reached <= low[order][1:] + near) + 1
        if len(open_after) == 0:
            continue
        at = int(open_after[np.argmin(np.abs(open_after - len(own) / 2))])
        uneven = abs(2 * at - len(own))
        if uneven < least:
            sides = [[own[i] for i in order[:at]], [own[i] for i in order[at:]]]
            best, least = sides if axis[2] >= 0 else sides[::-1], uneven
    return best


def _halves(own: list[Piece], points: Array, starts: NDArray[np.int64], near: float) -> list[list[Piece]] | None:
    """What lies behind one of the planes, in it, and in front of it; None where nothing lies in front of any."""
    planes = np.concatenate([piece.planes for piece in own])
    if len(planes) == 0:
        return None
    some = planes[np.unique(np.linspace(0, len(planes) - 1, _TRIED).astype(int))]
    plane = _best(some, points, starts, near)
    # Few of many planes were looked at: before giving up all are.
    for first in range(0, len(planes), 256) if plane is None and len(planes) > _TRIED else ():
        plane = _best(planes[first : first + 256], points, starts, near)
        if plane is not None:
            break
    if plane is None:
        return None
    behind: list[Piece] = []
    inside: list[Piece] = []
    front: list[Piece] = []
    low, high = _reach(plane[None], points, starts)
    for piece, least, most in zip(own, low[0], high[0]):
        if most <= near:
            (inside if least >= -near else behind).append(piece)
        elif least >= -near:
            front.append(piece)
        else:
            front += _cut(piece, plane, 1.0, near)
            behind += _cut(piece, plane, -1.0, near)
    return [group for group in (behind, inside, front) if group]


def _reach(planes: Array, points: Array, starts: NDArray[np.int64]) -> tuple[Array, Array]:
    """float64 (n_planes, n_pieces): the least and greatest distance of each piece from each plane."""
    heights = planes[:, :3] @ points.T - planes[:, 3:]
    return np.minimum.reduceat(heights, starts, axis=1), np.maximum.reduceat(heights, starts, axis=1)


def _best(planes: Array, points: Array, starts: NDArray[np.int64], near: float) -> Array | None:
    """The plane that cuts few pieces and halves the rest, of those with anything in front of them."""
    low, high = _reach(planes, points, starts)
    in_front, behind = high > near, low < -near
    cut = (in_front & behind).sum(axis=1)
    cost = _CUT * cut + np.abs(in_front.sum(axis=1) - behind.sum(axis=1))
    useful = in_front.any(axis=1)
    if not useful.any():
        return None
    best: Array = planes[int(np.argmin(np.where(useful, cost, np.inf)))]
    return best


def _cut(piece: Piece, plane: Array, side: float, near: float) -> list[Piece]:
    """What of a piece lies in front of a plane (`side` 1) or behind it (-1): one piece, or none."""
    halved = [(_clip(face, plane, side, near, closed=True), s) for face, s in zip(piece.faces, piece.shades)]
    kept = [(face, shade) for face, shade in halved if len(face) > 2]
    lines = [line for line in (_clip(line, plane, side, near, closed=False) for line in piece.lines) if len(line) == 2]
    if not kept and not lines:
        return []
    return [replace(piece, faces=tuple(f for f, _ in kept), shades=tuple(s for _, s in kept), lines=tuple(lines))]


def _clip(points: Array, plane: Array, side: float, near: float, *, closed: bool) -> Array:
    """float64 (m, 3): the part of a polygon, or of a line, on one side of a plane; empty where it only touches it."""
    heights = side * (points @ plane[:3] - plane[3])
    if heights.max() <= near:
        return points[:0]
    found: list[Array] = []
    for k, (point, height) in enumerate(zip(points, heights)):
        if height >= -near:
            found.append(point)
        after = (k + 1) % len(points)
        if (closed or after) and min(height, heights[after]) < -near and max(height, heights[after]) > near:
            share = height / (height - heights[after])
            found.append(point + share * (points[after] - point))
    return np.array(found)
