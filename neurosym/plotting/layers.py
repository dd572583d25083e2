"""Small graphs drawn in rows: where boxes with names go, in inches, so that letters keep their size."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import networkx as nx
from matplotlib.axes import Axes

from neurosym.plotting.style import COLUMN, Figure, shortened

#: Letters of names (points), and what one of them takes (inches).
LETTERS, LETTER_WIDTH = 6.5, 0.058
#: Height of a box, room around it, between rows of one layer, and between layers (inches).
BOX, GAP, STAGGER, LAYER = 0.15, 0.09, 0.24, 0.45
#: Passes of sorting each layer by its neighbours.
_PASSES = 8


@dataclass(frozen=True)
class Layout:
    """Where names are, in inches from the lower left: name -> (x, y); and how high it all is."""

    places: Mapping[str, tuple[float, float]]
    height: float


def in_layers(
    layers: Sequence[Sequence[str]], edges: Sequence[tuple[str, str]], width: float, *, apart: float = LAYER
) -> Layout:
    """Names in layers, the first on top, each layer sorted so that few edges cross.

    `layers`: names, each once; their order is where the sorting starts. `edges`: pairs of names that are joined.
    `width`: of the drawing (inches); a layer that is wider is staggered. `apart`: from one layer to the next (inches).
    """
    graph = nx.Graph([(a, b) for a, b in edges if a != b])
    graph.add_nodes_from(name for layer in layers for name in layer)
    order = [list(layer) for layer in layers]
    for turn in range(_PASSES):
        share = {name: (k + 0.5) / len(layer) for layer in order for k, name in enumerate(layer)}
        for layer in order if turn % 2 else order[::-1]:
            own = set(layer)
            wanted = {
                name: [share[other] for other in graph[name] if other not in own] or [share[name]] for name in layer
            }
            layer.sort(key=lambda name: sum(wanted[name]) / len(wanted[name]))
            share |= {name: (k + 0.5) / len(layer) for k, name in enumerate(layer)}
    places: dict[str, tuple[float, float]] = {}
    depth = BOX
    for layer in order:
        widest = max(box_width(name) for name in layer) + GAP
        rows = 1
        if widest * len(layer) > width:  # staggered, and spread to both edges
            rows = min(len(layer), math.ceil(widest * (len(layer) - 1) / max(width - widest, widest)))
        for k, name in enumerate(layer):
            if rows == 1:
                x = width * (k + 0.5) / len(layer)
            else:
                x = widest / 2 + (width - widest) * k / (len(layer) - 1)
            places[name] = (x, -(depth + STAGGER * (k % rows)))
        depth += STAGGER * (rows - 1) + apart
    height = depth - apart + BOX
    return Layout({name: (x, y + height) for name, (x, y) in places.items()}, height)


def box_width(name: str) -> float:
    """Of the box around a name (inches)."""
    return LETTER_WIDTH * len(shortened(name)) + 0.08


def in_inches(height: float, width: float = COLUMN) -> tuple[Figure, Axes]:
    """A figure with one set of axes, without a frame, whose units are inches from the lower left."""
    figure = Figure(figsize=(width, height))
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axis.set_xlim(0, width)
    axis.set_ylim(0, height)
    axis.axis("off")
    return figure, axis


def write_names(axis: Axes, places: Mapping[str, tuple[float, float]], fixed: Sequence[str] = ()) -> None:
    """Each name in a box; those of `fixed` in a darker one."""
    for name, (x, y) in places.items():
        face = "0.8" if name in fixed else "white"
        box = {"boxstyle": "round,pad=0.25", "facecolor": face, "edgecolor": "0.35", "linewidth": 0.7}
        axis.text(x, y, shortened(name), ha="center", va="center", fontsize=LETTERS, bbox=box, zorder=4)
