"""What blocks what along each direction, and what touches what: graphs in layers, or matrices where parts are many."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import networkx as nx
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch, Rectangle

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.blocking.directions import Directions
from neurosym.geometry.blocking.graph import BlockingGraph
from neurosym.geometry.contact.contacts import TABLE, areas_between
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.step_motion import GROUND
from neurosym.plotting.layers import BOX, Layout, box_width, in_inches, in_layers, write_names
from neurosym.plotting.matrices import blocking_matrices, contact_matrix, depths
from neurosym.plotting.routes import Point, bends
from neurosym.plotting.style import COLOURS, COLUMN, SMALL, TITLE, Figure

#: More parts than this are drawn as a matrix.
MOST_NODES = 16
#: Directions that are drawn, each with its opposite; the title says how many there are.
MOST_PANELS = 4

_MARGIN = 0.08
_WIDTH = COLUMN - 2 * _MARGIN
_APART = 0.3  # between panels
_CONTACT_LAYER = 0.7  # lines within a layer need room beside it
_ONLY_TOGETHER = "#D55E00"
_HEAD = "-|>,head_length=0.35,head_width=0.18"
_ARROW = {"arrowstyle": _HEAD, "color": COLOURS[4], "lw": 0.8, "shrinkA": 0, "shrinkB": 0.5, "zorder": 3}


def blocking_figure(
    assembly: Assembly | AssemblyGeometry, directions: Directions = None, *, title: str = "assembly"
) -> Figure:
    """A panel a direction and its opposite: an arrow leads from a part to one that it would hit, moved that way.

    Parts on top are free; those in a frame hit one another, and can leave only together. Arrows that follow from others
    are left out. Of more than `MOST_NODES` parts a matrix is drawn: a row a part, dark where it hits the column's.

    `assembly`: all parts are there. `directions`: as `directions_for` takes them; default the axes. `title`: what it
    is.
    """
    geometry = AssemblyGeometry.of(assembly)
    assembly, graph = geometry.assembly, geometry.blocking(directions)
    chosen = _one_way(graph)
    shown = chosen[:MOST_PANELS]
    count = f"{len(shown)} of {len(chosen)}" if len(chosen) > len(shown) else f"{len(chosen)}"
    heading = f"{title}: what blocks what\nn = {len(assembly)} parts, {count} directions with their opposites"
    if len(assembly) > MOST_NODES:
        return blocking_matrices(heading, graph, shown)
    layouts = [_layered(graph.graph(d)) for d in shown]
    figure, axis = in_inches(sum(each.height + _APART for _, each, _ in layouts) + 0.72)
    top = figure.get_figheight()
    _write_title(axis, heading)
    top -= 0.42
    for d, (framed, layout, arrows) in zip(shown, layouts):
        axis.text(_MARGIN, top - 0.1, _in_words(graph, d), fontsize=SMALL, fontweight="bold", va="center")
        top -= _APART + layout.height
        places = {name: (x + _MARGIN, y + top + 0.1) for name, (x, y) in layout.places.items()}
        for group in framed:
            _frame(axis, [places[name] for name in group], group)
        room = (_MARGIN, top, COLUMN - _MARGIN, top + layout.height + 0.2)
        for pair, bend in zip(arrows, bends(arrows, places, room)):
            _join(axis, pair, places, bend, _ARROW)
        write_names(axis, places, assembly.fixed)
    _write_note(axis, "arrow: hits, moved that way; in a frame: only together")
    return figure


def contact_figure(assembly: Assembly | AssemblyGeometry, *, title: str = "assembly") -> Figure:
    """A line a pair of parts that touch, as thick as the root of the area; the parts in layers, from the ground up.

    Without a ground the layers count from the fixed parts, or from the first one. Of more than `MOST_NODES` parts a
    matrix is drawn, coloured by area.
    """
    geometry = AssemblyGeometry.of(assembly)
    assembly = geometry.assembly
    areas = {
        (assembly.names[a], GROUND if b == TABLE else assembly.names[b]): sum(own)
        for (a, b), own in areas_between(assembly, geometry.contacts).items()
    }
    unit = f"{assembly.units}²" if assembly.units else "units of length²"
    heading = f"{title}: what touches what\nn = {len(assembly)} parts, {len(areas)} contacts; areas in {unit}"
    if len(assembly) > MOST_NODES:
        return contact_matrix(heading, assembly, areas, unit)
    graph = nx.Graph(list(areas))
    graph.add_nodes_from(assembly.names)
    roots = [GROUND] if GROUND in graph else [n for n in assembly.names if n in assembly.fixed] or [assembly.names[0]]
    layout = in_layers(_from(graph, roots)[::-1], list(areas), _WIDTH, apart=_CONTACT_LAYER)
    figure, axis = in_inches(layout.height + 0.85)
    _write_title(axis, heading)
    places = {name: (x + _MARGIN, y + 0.35) for name, (x, y) in layout.places.items()}
    largest = max(areas.values(), default=1.0)
    room = (_MARGIN, 0.25, COLUMN - _MARGIN, layout.height + 0.4)
    for (pair, area), bend in zip(areas.items(), bends(list(areas), places, room)):
        look = {"arrowstyle": "-", "color": COLOURS[4], "lw": _thickness(area, largest), "shrinkA": 0, "shrinkB": 0}
        _join(axis, pair, places, bend, look)
    write_names(axis, places, [*assembly.fixed, GROUND])
    _write_widths(axis, list(areas.values()))
    return figure


def _one_way(graph: BlockingGraph) -> list[int]:
    """Of each direction and its opposite the first."""
    chosen: list[int] = []
    for d, direction in enumerate(graph.directions):
        if not any(np.linalg.norm(graph.directions[other] + direction) < 1e-9 for other in chosen):
            chosen.append(d)
    return chosen


def _in_words(graph: BlockingGraph, d: int) -> str:
    opposite = next((k for k, v in enumerate(graph.directions) if np.linalg.norm(v + graph.directions[d]) < 1e-9), None)
    text = f"along {graph.describe(d)}" + (", into the ground" if graph.into_table[d] else "")
    if opposite is None:
        return text
    ground = ", and into the ground" if graph.into_table[opposite] else ""
    return f"{text}  ({graph.describe(opposite)}: arrows the other way{ground})"


def _layered(graph: nx.DiGraph) -> tuple[list[tuple[str, ...]], Layout, list[tuple[str, str]]]:
    """Groups that leave only together, where the parts are, and the arrows that do not follow from others."""
    whole = nx.condensation(graph)
    depth = depths(whole)
    layers: list[list[str]] = [[] for _ in range(max(depth.values()) + 1)]
    for node in sorted(whole, key=lambda k: min(whole.nodes[k]["members"])):
        layers[depth[node]] += sorted(whole.nodes[node]["members"])
    arrows = []
    for a, b in nx.transitive_reduction(whole).edges:
        pairs = itertools.product(*(sorted(whole.nodes[node]["members"]) for node in (a, b)))
        arrows.append(next(pair for pair in pairs if graph.has_edge(*pair)))  # of two groups, one arrow says it
    framed = [tuple(sorted(whole.nodes[k]["members"])) for k in whole if len(whole.nodes[k]["members"]) > 1]
    return framed, in_layers(layers, arrows, _WIDTH), arrows


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


def _write_title(axis: Axes, title: str) -> None:
    axis.text(COLUMN / 2, axis.get_ylim()[1] - 0.06, title, fontsize=TITLE, ha="center", va="top", linespacing=1.3)


def _write_note(axis: Axes, note: str) -> None:
    axis.text(COLUMN / 2, 0.09, note, fontsize=SMALL, ha="center", va="center")


def _join(axis: Axes, pair: tuple[str, str], places: Mapping[str, Point], bend: float, look: Mapping[str, Any]) -> None:
    """A line from one box to another, from edge to edge."""
    patches = []
    for name in pair:
        (x, y), wide = places[name], box_width(name)
        patches.append(Rectangle((x - wide / 2, y - BOX / 2), wide, BOX, transform=axis.transData))
    ends = {"patchA": patches[0], "patchB": patches[1], "connectionstyle": f"arc3,rad={bend}"}
    axis.annotate("", places[pair[1]], places[pair[0]], arrowprops={**look, **ends}, zorder=look.get("zorder", 1))


def _frame(axis: Axes, places: Sequence[tuple[float, float]], names: Sequence[str]) -> None:
    left = min(x - box_width(n) / 2 for (x, _), n in zip(places, names)) - 0.04
    right = max(x + box_width(n) / 2 for (x, _), n in zip(places, names)) + 0.04
    low, high = min(y for _, y in places) - BOX, max(y for _, y in places) + BOX
    look: dict[str, Any] = {"facecolor": "#FBE6D8", "edgecolor": _ONLY_TOGETHER, "linewidth": 1.0, "zorder": 2}
    style = "round,pad=0,rounding_size=0.06"
    axis.add_patch(FancyBboxPatch((left, low), right - left, high - low, boxstyle=style, **look))


def _thickness(area: float, largest: float) -> float:
    return 0.4 + 1.6 * float(np.sqrt(area / largest))


def _write_widths(axis: Axes, areas: Sequence[float]) -> None:
    """The thinnest and the thickest line, and what area they have."""
    if not areas:
        return
    shown = sorted({min(areas), max(areas)})
    for k, area in enumerate(shown):
        x = COLUMN / 2 + (k - (len(shown) - 1) / 2) * 1.2 - 0.3
        axis.plot([x - 0.15, x + 0.1], [0.1, 0.1], color=COLOURS[4], lw=_thickness(area, max(areas)))
        axis.text(x + 0.17, 0.1, f"area {area:.3g}", fontsize=SMALL, va="center")
