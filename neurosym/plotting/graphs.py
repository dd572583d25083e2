"""What blocks what along each direction, and what touches what: graphs in layers, or matrices where parts are many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from neurosym.plotting.layers import BOX, LAYER, Layout, box_width, in_inches, in_layers, write_names
from neurosym.plotting.style import COLOURS, COLUMN, SMALL, TITLE, tidy
from neurosym.ways import GROUND

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from neurosym.geometry.assembly import Assembly
    from neurosym.geometry.blocking import BlockingGraph
    from neurosym.geometry.directions import Directions

#: More parts than this are drawn as a matrix; more than these have no names in it.
MOST_NODES, MOST_NAMES = 16, 28
#: Directions that are drawn, each with its opposite; the title says how many there are.
MOST_PANELS = 4

_MARGIN = 0.08
_WIDTH = COLUMN - 2 * _MARGIN
_APART = 0.3  # between panels
_ONLY_TOGETHER = "#D55E00"


def blocking_figure(assembly: Assembly, directions: Directions = None, *, title: str = "assembly") -> Figure:
    """A panel a direction and its opposite: an arrow leads from a part to one that it would hit, moved that way.

    Parts on top are free; those in a frame hit one another, and can leave only together. Arrows that follow from others
    are left out. Of more than `MOST_NODES` parts a matrix is drawn: a row a part, dark where it hits the column's.

    Args:
        assembly: all parts are there.
        directions: as `directions_for` takes them; default the axes.
        title: what it is.
    """
    graph = assembly.blocking(directions)
    chosen = _one_way(graph)
    shown = chosen[:MOST_PANELS]
    some = "" if len(chosen) == len(shown) else f"{len(shown)} of "
    said = f"{title}: what blocks what\nn = {len(assembly)} parts, {some}{len(chosen)} directions with their opposites"
    if len(assembly) > MOST_NODES:
        return _matrices(said, graph, shown)
    layouts = [_layered(graph.graph(d)) for d in shown]
    figure, axis = in_inches(sum(each.height + _APART for _, each, _ in layouts) + 0.72)
    top = figure.get_figheight()
    _write_title(axis, said)
    top -= 0.42
    for d, (framed, layout, arrows) in zip(shown, layouts):
        axis.text(_MARGIN, top - 0.1, _in_words(graph, d), fontsize=SMALL, fontweight="bold", va="center")
        top -= _APART + layout.height
        places = {name: (x + _MARGIN, y + top + 0.1) for name, (x, y) in layout.places.items()}
        for group in framed:
            _frame(axis, [places[name] for name in group], group)
        for a, b in arrows:
            _arrow(axis, places[a], places[b])
        write_names(axis, places, assembly.fixed)
    _write_note(axis, "arrow: hits, moved that way; in a frame: only together")
    return figure


def contact_figure(assembly: Assembly, *, title: str = "assembly") -> Figure:
    """A line a pair of parts that touch, as thick as the root of the area; the parts in layers, from the ground up.

    Without a ground the layers count from the fixed parts, or from the first one. Of more than `MOST_NODES` parts a
    matrix is drawn, coloured by area.
    """
    from neurosym.geometry.contacts import TABLE  # loads FCL

    areas: dict[tuple[str, str], float] = {}
    for contact in assembly.contacts():
        b = GROUND if contact.b == TABLE else assembly.names[assembly.owners[contact.b]]
        pair = (assembly.names[assembly.owners[contact.a]], b)
        pair = pair if pair[::-1] not in areas else pair[::-1]
        areas[pair] = areas.get(pair, 0.0) + contact.area
    unit = f"{assembly.units}²" if assembly.units else "units of length²"
    said = f"{title}: what touches what\nn = {len(assembly)} parts, {len(areas)} contacts; areas in {unit}"
    if len(assembly) > MOST_NODES:
        return _contact_matrix(said, assembly, areas, unit)
    graph = nx.Graph(list(areas))
    graph.add_nodes_from(assembly.names)
    roots = [GROUND] if GROUND in graph else [n for n in assembly.names if n in assembly.fixed] or [assembly.names[0]]
    layout = in_layers(_from(graph, roots)[::-1], list(areas), _WIDTH)
    figure, axis = in_inches(layout.height + 0.85)
    _write_title(axis, said)
    places = {name: (x + _MARGIN, y + 0.35) for name, (x, y) in layout.places.items()}
    largest = max(areas.values(), default=1.0)
    for pair, area in areas.items():
        _line(axis, places[pair[0]], places[pair[1]], _thickness(area, largest))
    write_names(axis, places, [*assembly.fixed, GROUND])
    _write_widths(axis, list(areas.values()))
    return figure


# -- graphs ---------------------------------------------------------------------------------------------------


def _one_way(graph: BlockingGraph) -> list[int]:
    """Of each direction and its opposite the first."""
    chosen: list[int] = []
    for d, direction in enumerate(graph.directions):
        if not any(np.linalg.norm(graph.directions[other] + direction) < 1e-9 for other in chosen):
            chosen.append(d)
    return chosen


def _in_words(graph: BlockingGraph, d: int) -> str:
    opposite = next((k for k, v in enumerate(graph.directions) if np.linalg.norm(v + graph.directions[d]) < 1e-9), None)
    said = f"along {graph.describe(d)}" + (", into the ground" if graph.into_table[d] else "")
    if opposite is None:
        return said
    ground = ", and into the ground" if graph.into_table[opposite] else ""
    return f"{said}  ({graph.describe(opposite)}: arrows the other way{ground})"


def _layered(graph: nx.DiGraph) -> tuple[list[tuple[str, ...]], Layout, list[tuple[str, str]]]:
    """Groups that leave only together, where the parts are, and the arrows that do not follow from others."""
    whole = nx.condensation(graph)
    depth = _depths(whole)
    layers: list[list[str]] = [[] for _ in range(max(depth.values()) + 1)]
    for node in sorted(whole, key=lambda k: min(whole.nodes[k]["members"])):
        layers[depth[node]] += sorted(whole.nodes[node]["members"])
    arrows = []
    for a, b in nx.transitive_reduction(whole).edges:
        pairs = [
            (x, y)
            for x in sorted(whole.nodes[a]["members"])
            for y in sorted(whole.nodes[b]["members"])
            if graph.has_edge(x, y)
        ]
        arrows.append(pairs[0])  # of two groups, one arrow says it
    framed = [tuple(sorted(whole.nodes[k]["members"])) for k in whole if len(whole.nodes[k]["members"]) > 1]
    return framed, in_layers(layers, arrows, _WIDTH), arrows


def _depths(whole: nx.DiGraph) -> dict[int, int]:
    """How many others have to leave, one after the other, before a node is free."""
    depth: dict[int, int] = {}
    for node in reversed(list(nx.topological_sort(whole))):
        depth[node] = 1 + max((depth[b] for b in whole.successors(node)), default=-1)
    return depth


def _from(graph: nx.Graph, roots: Sequence[str]) -> list[list[str]]:
    """Layers by distance from the roots, and last what none of them reaches."""
    layers = [list(roots)]
    seen = set(roots)
    while layers[-1]:
        reached = {b for a in layers[-1] for b in graph[a]} - seen
        layers.append([n for n in graph if n in reached])
        seen |= reached
    rest = [n for n in graph if n not in seen]
    return [layer for layer in (*layers, rest) if layer]


# -- drawing --------------------------------------------------------------------------------------------------


def _write_title(axis: Axes, said: str) -> None:
    axis.text(COLUMN / 2, axis.get_ylim()[1] - 0.06, said, fontsize=TITLE, ha="center", va="top", linespacing=1.3)


def _write_note(axis: Axes, said: str) -> None:
    axis.text(COLUMN / 2, 0.09, said, fontsize=SMALL, ha="center", va="center")


def _arrow(axis: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    bend = 0.25 if abs(start[1] - end[1]) > 1.2 * LAYER else 0.0
    look = {"arrowstyle": "-|>,head_length=0.35,head_width=0.18", "color": COLOURS[4], "lw": 0.8}
    bent = {"shrinkA": 6, "shrinkB": 6.5, "connectionstyle": f"arc3,rad={bend}"}
    axis.annotate("", end, start, arrowprops={**look, **bent}, zorder=3)


def _frame(axis: Axes, places: Sequence[tuple[float, float]], names: Sequence[str]) -> None:
    from matplotlib.patches import FancyBboxPatch

    left = min(x - box_width(n) / 2 for (x, _), n in zip(places, names)) - 0.04
    right = max(x + box_width(n) / 2 for (x, _), n in zip(places, names)) + 0.04
    low, high = min(y for _, y in places) - BOX, max(y for _, y in places) + BOX
    patch = FancyBboxPatch(
        (left, low),
        right - left,
        high - low,
        boxstyle="round,pad=0,rounding_size=0.06",
        facecolor="#FBE6D8",
        edgecolor=_ONLY_TOGETHER,
        linewidth=1.0,
        zorder=2,
    )
    axis.add_patch(patch)


def _line(axis: Axes, a: tuple[float, float], b: tuple[float, float], width: float) -> None:
    # In one layer a straight line would run through what lies between.
    bend = 0.35 if abs(a[1] - b[1]) < 1.2 * LAYER / 2 else 0.12 if abs(a[1] - b[1]) > 1.2 * LAYER else 0.0
    a, b = sorted((a, b))
    look = {"arrowstyle": "-", "color": COLOURS[4], "lw": width, "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", b, a, arrowprops={**look, "connectionstyle": f"arc3,rad={bend}"}, zorder=1)


def _thickness(area: float, largest: float) -> float:
    return 0.4 + 2.0 * float(np.sqrt(area / largest))


def _write_widths(axis: Axes, areas: Sequence[float]) -> None:
    """The thinnest and the thickest line, and what area they have."""
    if not areas:
        return
    shown = sorted({min(areas), max(areas)})
    for k, area in enumerate(shown):
        x = COLUMN / 2 + (k - (len(shown) - 1) / 2) * 1.2 - 0.3
        axis.plot([x - 0.15, x + 0.1], [0.1, 0.1], color=COLOURS[4], lw=_thickness(area, max(areas)))
        axis.text(x + 0.17, 0.1, f"area {area:.3g}", fontsize=SMALL, va="center")


# -- matrices -------------------------------------------------------------------------------------------------


def _matrices(title: str, graph: BlockingGraph, shown: Sequence[int]) -> Figure:
    from matplotlib.figure import Figure

    from neurosym.geometry.blocking import bits

    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(COLUMN, 0.8 + rows * (COLUMN / columns + 0.1)), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    n = len(graph.names)
    for axis in axes[len(shown) :]:
        axis.remove()
    for axis, d in zip(axes, shown):
        hits = np.zeros((n, n))
        for i in range(n):
            hits[i, bits(graph.by_part[d][i])] = 1.0
        whole = nx.condensation(graph.graph(d))
        depth = _depths(whole)
        own = {name: depth[k] for k in whole for name in whole.nodes[k]["members"]}
        order = sorted(range(n), key=lambda i: (own[graph.names[i]], i))
        axis.imshow(hits[np.ix_(order, order)], cmap="Blues", vmin=0, vmax=1.2, interpolation="nearest")
        axis.set_title(f"along {graph.describe(d)}: {int(hits.sum())} hits", fontsize=SMALL, pad=3)
        _dress(axis, [graph.names[i] for i in order], names=n <= MOST_NAMES and columns == 1)
    figure.suptitle(title, fontsize=TITLE)
    figure.supxlabel("hits this part (the free ones first)", fontsize=SMALL)
    figure.supylabel("this part, moved that way", fontsize=SMALL)
    return figure


def _contact_matrix(title: str, assembly: Assembly, areas: dict[tuple[str, str], float], unit: str) -> Figure:
    from matplotlib.figure import Figure

    names = [*assembly.names, *([GROUND] if assembly.has_table else [])]
    index = {name: i for i, name in enumerate(names)}
    table: NDArray[np.float64] = np.full((len(names), len(names)), np.nan)
    for (a, b), area in areas.items():
        table[index[a], index[b]] = table[index[b], index[a]] = area
    figure = Figure(figsize=(COLUMN, COLUMN + 0.5), layout="constrained")
    axis = figure.subplots()
    drawn = axis.imshow(table, cmap="viridis_r", vmin=0, vmax=max(areas.values(), default=1.0), interpolation="nearest")
    _dress(axis, names, names=len(names) <= MOST_NAMES)
    bar = figure.colorbar(drawn, ax=axis, shrink=0.7)
    bar.set_label(f"area ({unit})", fontsize=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
    figure.suptitle(title, fontsize=TITLE)
    return figure


def _dress(axis: Axes, labels: Sequence[str], *, names: bool) -> None:
    tidy(axis, sides=())
    if names:
        axis.set_xticks(range(len(labels)), labels, rotation=90, fontsize=5)
        axis.set_yticks(range(len(labels)), labels, fontsize=5)
    axis.tick_params(length=0 if names else 2)
