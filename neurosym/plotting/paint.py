"""Solids on a page: pieces in their order as one collection of a figure, and where in it each part can be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from neurosym.plotting.painter import Piece

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
RGB = tuple[float, float, float]

#: With more faces and lines than this a vector file keeps the drawing as dots: it would grow beyond use.
MOST_FACES = 20_000
#: Dots across the page's longer side in which is looked for where a part can be seen.
_DOTS = 500


def on_page(piece: Piece, scale: float, origin: Array) -> Piece:
    """A piece as it is drawn: corners and ends become float64 (k, 2), in inches."""

    def flat(points: Array) -> Array:
        return np.asarray(scale * points[:, :2] + origin)

    return replace(piece, faces=tuple(map(flat, piece.faces)), lines=tuple(map(flat, piece.lines)))


def paint(axis: Axes, pieces: Sequence[Piece], colours: Sequence[RGB]) -> None:
    """Pieces on a page as one collection: what comes later hides what comes before. Lines without faces are dashed.

    Args:
        axis: whose units are inches.
        pieces: from back to front.
        colours: one a part.
    """
    from matplotlib.collections import PathCollection
    from matplotlib.path import Path

    paths: list[Path] = []
    fills, edges, widths = [], [], []
    dashes: list[Any] = []
    for piece in pieces:
        for face, shade in zip(piece.faces, piece.shades):
            fill = (*(shade * np.array(colours[piece.part])).tolist(), 1.0)
            paths.append(Path(np.vstack([face, face[:1]]), closed=True))
            fills.append(fill)
            edges.append(fill)  # an edge of its own colour closes the seams where a surface was cut
            widths.append(0.5)
            dashes.append("-")
        for line in piece.lines:
            paths.append(Path(line))
            fills.append((0.0, 0.0, 0.0, 0.0))
            edges.append((0.15, 0.15, 0.15, 1.0))
            widths.append(0.6)
            dashes.append("-" if piece.faces else (0, (3, 2)))
    look: dict[str, Any] = {"facecolors": fills, "edgecolors": edges, "linewidths": widths, "linestyles": dashes}
    drawn = PathCollection(paths, **look, capstyle="round", joinstyle="round", zorder=2)
    drawn.set_rasterized(len(paths) > MOST_FACES)
    axis.add_collection(drawn, autolim=False)


def seen_at(pieces: Sequence[Piece]) -> dict[int, tuple[float, float]]:
    """Number of a part -> the middle of the largest circle in what can be seen of it, in inches.

    A part that is wholly hidden, or smaller than a dot, is not among them.
    """
    from PIL import Image, ImageDraw
    from scipy.ndimage import distance_transform_edt

    every = np.concatenate([piece.points for piece in pieces])
    low, size = every.min(axis=0), np.ptp(every, axis=0)
    grain = float(size.max()) / _DOTS
    # At the edges, where circles end, a dot is free.
    canvas = Image.new("I", (int(size[0] / grain) + 4, int(size[1] / grain) + 4), 0)
    draw = ImageDraw.Draw(canvas)
    for piece in pieces:
        for face in piece.faces:
            draw.polygon([(float(x), float(y)) for x, y in (face - low) / grain + 1], fill=piece.part + 1)
    owner = np.asarray(canvas)
    found = {}
    for part in sorted({piece.part for piece in pieces if piece.faces}):
        mine = owner == part + 1
        rows, columns = np.flatnonzero(mine.any(axis=1)), np.flatnonzero(mine.any(axis=0))
        if len(rows):
            depth = distance_transform_edt(mine[rows[0] - 1 : rows[-1] + 2, columns[0] - 1 : columns[-1] + 2])
            y, x = np.unravel_index(int(np.argmax(depth)), depth.shape)
            place = low + (np.array([x + columns[0], y + rows[0]]) - 2) * grain
            found[part] = (float(place[0]), float(place[1]))
    return found
