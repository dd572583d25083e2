"""What blocks and what touches what where parts are many: a row and a column a part."""

from collections.abc import Mapping, Sequence

import networkx as nx
import numpy as np
from matplotlib.axes import Axes

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.graph import BlockingGraph
from neurosym.geometry.step_motion import GROUND
from neurosym.plotting.style import COLUMN, SMALL, TITLE, Figure, shortened, tidy
from neurosym.support.arrays import Array
from neurosym.support.bitsets import bits

#: More rows than this bear no names but numbers, and the size of the names (points).
MOST_NAMES, _LETTERS = 31, 6
#: Longest name beside a row.
_MOST_LETTERS = 10


def blocking_matrices(title: str, graph: BlockingGraph, shown: Sequence[int]) -> Figure:
    """A matrix a direction: a row a part, dark where it hits the column's; the free ones come first."""
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(COLUMN, 0.8 + rows * (COLUMN - 0.5) / columns), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    n = len(graph.names)
    for axis in axes[len(shown) :]:
        axis.remove()
    for axis, d in zip(axes, shown):
        hits = np.zeros((n, n))
        for i in range(n):
            hits[i, bits(graph.by_part[d][i])] = 1.0
        whole = nx.condensation(graph.graph(d))
        depth = depths(whole)
        own = {name: depth[k] for k in whole for name in whole.nodes[k]["members"]}
        order = sorted(range(n), key=lambda i: (own[graph.names[i]], i))
        axis.imshow(hits[np.ix_(order, order)], cmap="Blues", vmin=0, vmax=1.2, interpolation="nearest")
        free = int((hits.sum(axis=1) == 0).sum())
        axis.set_title(f"{graph.describe(d)}: {int(hits.sum()):,} hits, {free} free", fontsize=SMALL, pad=3)
        _dress(axis, n)
    figure.suptitle(title, fontsize=TITLE)
    figure.supxlabel("hits this part (each panel: the free ones first)", fontsize=SMALL)
    figure.supylabel("this part, moved that way", fontsize=SMALL)
    return figure


def contact_matrix(title: str, assembly: Assembly, areas: Mapping[tuple[str, str], float], unit: str) -> Figure:
    """A row and a column a part, and the ground, in the assembly's order; colours are areas of contact."""
    names = [*assembly.names, *([GROUND] if assembly.has_table else [])]
    index = {name: i for i, name in enumerate(names)}
    table: Array = np.full((len(names), len(names)), np.nan)
    for (a, b), area in areas.items():
        table[index[a], index[b]] = table[index[b], index[a]] = area
    figure = Figure(figsize=(COLUMN, COLUMN + 0.75), layout="constrained")
    axis = figure.subplots()
    largest = max(areas.values(), default=1.0)
    drawn = axis.imshow(table, cmap="viridis_r", vmin=0, vmax=largest, interpolation="nearest")
    if len(names) <= MOST_NAMES:
        short = [shortened(name, _MOST_LETTERS) for name in names]
        axis.set_xticks(range(len(names)), short, rotation=90)
        axis.set_yticks(range(len(names)), short)
        axis.tick_params(length=0, pad=1, labelsize=_LETTERS)
    else:
        _dress(axis, len(names))
        last = f"; the last: {GROUND}" if assembly.has_table else ""
        axis.set_xlabel(f"part, its number in the assembly{last}", fontsize=SMALL)
    bar = figure.colorbar(drawn, ax=axis, location="bottom", aspect=30, shrink=0.8, pad=0.03)
    bar.set_label(f"area ({unit})", fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
    figure.suptitle(title, fontsize=TITLE)
    return figure


def depths(whole: nx.DiGraph) -> dict[int, int]:
    """How many others have to leave, one after the other, before a node is free."""
    depth: dict[int, int] = {}
    for node in reversed(list(nx.topological_sort(whole))):
        depth[node] = 1 + max((depth[b] for b in whole.successors(node)), default=-1)
    return depth


def _dress(axis: Axes, n: int) -> None:
    """Numbers from 1 on."""
    tidy(axis, sides=())
    ticks = [1, *range(10, n + 1, 10 * -(-n // 60))]
    for set_ticks in (axis.set_xticks, axis.set_yticks):
        set_ticks([t - 1 for t in ticks], [str(t) for t in ticks])
    axis.tick_params(length=2, pad=1)
