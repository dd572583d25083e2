"""What `graph-sinkhorn` reads of a problem: numbers of its parts, their contacts, and what blocks what.

All lengths are shares of the assembly's own, and nothing depends on how it is turned about the vertical, beyond which
directions there are, nor on the parts' names or order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from neurosym.geometry.queries import AssemblyGeometry
from neurosym.planning.outermost_first import outermost_layers, parts_of_actions
from neurosym.support.arrays import Array, Numbers

if TYPE_CHECKING:
    from neurosym.geometry.blocking.directions import Directions
    from neurosym.language.problem import Problem

Floats = NDArray[np.float32]

#: Horizontal directions in which overhang is measured.
_AROUND = np.stack([np.cos(a := np.arange(16) * np.pi / 8), np.sin(a)], axis=1)
#: Forces below so many mean weights have no place where they act.
NEGLIGIBLE = 1e-4
#: Numbers of a part, of a contact as one of its parts sees it, and of a direction.
PART, CONTACT, DIRECTION = 21, 20, 2


@dataclass(frozen=True, eq=False)
class AssemblyGraph:
    """A problem as numbers: m parts, n of which its actions move, k directions, e contacts, each seen from both sides.

    Attributes:
        parts: float32 (m, PART).
        blocks: float32 (k, m, m): 1 where the first part would hit the second.
        directions: float32 (k, DIRECTION): how far up, and whether into the table.
        contacts: int64 (e, 2): which part sees which.
        contact: float32 (e, CONTACT).
        moved: int64 (n,): which part each action moves.
        place: float32 (n,): which comes when, outermost first: 0 for the first, 1 for the last; ties have their mean.
    """

    parts: Floats
    blocks: Floats
    directions: Floats
    contacts: Numbers
    contact: Floats
    moved: Numbers
    place: Floats


def read_graph(problem: Problem) -> AssemblyGraph:
    """The graph of a problem.

    Raises InputError: the problem's world is no assembly, or its actions are not named after parts.
    """
    moved, details = np.array(parts_of_actions(problem, "graph-sinkhorn")[1], dtype=np.int64), problem.details
    geometry = problem.geometry
    assert geometry is not None
    gravity, directions = bool(details.get("gravity", True)), details.get("directions")
    assembly, count = geometry.assembly, len(geometry)
    graph = geometry.blocking(directions)
    rows = [row for along in graph.by_part for row in along]
    width = (count + 7) // 8
    packed = np.frombuffer(b"".join(row.to_bytes(width, "little") for row in rows), dtype=np.uint8)
    blocks = np.unpackbits(packed.reshape(len(graph.vectors), count, width), axis=2, count=count, bitorder="little")
    layer_of, order = _peeled(geometry, directions, gravity)
    peel_of = _peeled(geometry, directions, False)[0] if gravity else layer_of

    springs = geometry.springs
    bounds, whole = assembly.part_bounds, assembly.bounds
    size = whole[1] - whole[0]
    across, up = max(float(np.hypot(*size[:2])), 1e-12), max(float(size[2]), 1e-12)
    extent = bounds[:, 1] - bounds[:, 0]
    middles = bounds.mean(axis=1)
    flat = np.hypot(extent[:, 0], extent[:, 1])
    share = springs.masses / springs.masses.mean()
    contacts, contact, loads = _contacts(geometry, gravity, flat)
    hands, fixed = details.get("held", 0), np.array([bool(assembly.fixed_mask >> i & 1) for i in range(count)])
    numbers = [
        np.log(share),
        extent[:, 2] / up,
        flat / across,
        np.minimum(extent[:, 0], extent[:, 1]) / np.maximum(flat, 1e-12),
        *((height - whole[0, 2]) / up for height in (bounds[:, 0, 2], middles[:, 2], bounds[:, 1, 2])),
        np.hypot(*(middles - whole.mean(axis=0))[:, :2].T) / across,
        np.array([bool(springs.on_table >> i & 1) for i in range(count)]),
        fixed,
        layer_of,
        peel_of,
        order,
        blocks.any(axis=2).all(axis=0),
        *loads,
        np.full(count, np.log(count) / 4),
        np.full(count, float(gravity)),
        np.full(count, min(hands, 2) * float(gravity)),
    ]
    ways = np.stack([graph.directions[:, 2], graph.into_table], axis=1)
    return AssemblyGraph(
        np.stack(numbers, axis=1).astype(np.float32),
        blocks.astype(np.float32),
        ways.astype(np.float32),
        contacts,
        contact.astype(np.float32),
        moved,
        order[moved].astype(np.float32),
    )


def _peeled(geometry: AssemblyGeometry, directions: Directions, gravity: bool) -> tuple[Array, Array]:
    """Of each part its layer and its place, outermost first, 0 to 1 (m,); fixed parts are in no layer, and last."""
    layers = outermost_layers(geometry, directions, gravity=gravity)
    depths, places, done = np.zeros(len(geometry)), np.ones(len(geometry)), 0
    last = max(sum(len(tied) for layer in layers for tied in layer) - 1, 1)
    for depth, layer in enumerate(layers):
        for tied in layer:
            depths[tied], places[tied] = (depth + 1) / len(layers), (done + (len(tied) - 1) / 2) / last
            done += len(tied)
    return depths, places


def _contacts(geometry: AssemblyGeometry, gravity: bool, flat: Array) -> tuple[Numbers, Array, tuple[Array, ...]]:
    """Pairs that touch (e, 2), their numbers (e, CONTACT), and numbers of how each part is loaded, each (m,).

    Forces are those in which the whole comes to rest. A part bears on what pushes it up; its load's centre is that of
    its weight and of what presses on it. How far that lies beyond what it bears on, where it is nearest to tip, and how
    far it would without one of its neighbours, says what each of them is there for.
    """
    count, stability = len(geometry), geometry.springs
    springs = stability.springs
    weights, centres, reach = springs.weights, springs.centres[:, :2], np.maximum(flat, 1e-12)
    # Each corner as both parts see it; the table sees nothing.
    pairs = np.stack([np.append(springs.a, springs.b), np.append(springs.b, springs.a)], axis=1)
    seen = pairs[:, 0] >= 0
    pairs = pairs[seen]
    at, area = np.tile(springs.at, (2, 1))[seen], np.tile(springs.across, 2)[seen]
    normals = np.concatenate([springs.axes[:, 0], -springs.axes[:, 0]])[seen]
    edges, which = np.unique(pairs, axis=0, return_inverse=True)
    which = which.reshape(-1)
    i = edges[:, 0]

    def summed(values: Array, groups: Numbers = which, size: int = len(edges)) -> Array:
        total = np.zeros((size, *values.shape[1:]))
        np.add.at(total, groups, values)
        return total

    areas = np.maximum(summed(area), 1e-12)
    middle = summed(at * area[:, None]) / areas[:, None]
    normal = summed(normals * area[:, None]) / areas[:, None]
    force, point = _forces(geometry, edges, middle) if gravity else (np.zeros_like(middle), middle)
    press = np.maximum(-force[:, 2], 0.0)
    loaded = weights + summed(press, i, count)
    moment = weights[:, None] * centres + summed(press[:, None] * point[:, :2], i, count)
    bears = normals[:, 2] > 0.1
    edge_ends = np.full((len(edges), 16), -np.inf)
    np.maximum.at(edge_ends, which[bears], at[bears, :2] @ _AROUND.T)
    ends, others = _two_largest(edge_ends, i, count)
    beyond = (moment / loaded[:, None]) @ _AROUND.T - ends
    corners = np.maximum(summed(bears.astype(np.float64), pairs[:, 0], count), 1.0)
    footing = summed(bears[:, None] * at[:, :2], pairs[:, 0], count) / corners[:, None]
    lacking = np.clip(beyond.max(axis=1) / reach, -1.0, 1.0)
    without = (moment[i] - press[:, None] * point[:, :2]) / (loaded[i] - press)[:, None]
    rest = np.where(edge_ends >= ends[i], others[i], ends[i])
    left = np.clip((without @ _AROUND.T - rest).max(axis=1) / reach[i], -1.0, 1.0)
    arm = np.clip((point[:, :2] @ _AROUND.T - ends[i]).max(axis=1) / reach[i], -1.0, 1.0)
    leans = (moment / loaded[:, None] - footing)[i]
    same_side = ((point[:, :2] - footing[i]) * leans).sum(axis=1) / reach[i] ** 2
    sideways = np.hypot(force[:, 0], force[:, 1])
    own = np.stack(
        [
            normal[:, 2],
            np.log(areas / areas.mean()) if len(areas) else areas,
            np.log1p(np.maximum(force[:, 2], 0.0) / weights[i]),
            np.log1p(press / weights[i]),
            np.log1p(sideways / weights[i]),
            arm,
            np.tanh(20 * same_side * press / weights[i]),
            left,
            np.tanh(20 * left),
            (middle[:, 2] - springs.centres[i, 2]) / springs.sizes[i],
        ],
        axis=1,
    )
    between = edges[:, 1] >= 0
    table = dict(zip(map(tuple, edges.tolist()), range(len(edges))))
    back = [table[b, a] for a, b in edges[between].tolist()]
    thrust = np.log1p(summed(sideways, i, count) / weights)
    loads = (lacking, np.log(loaded / weights), thrust, summed(np.maximum(np.tanh(20 * left), 0.0), i, count) / 4)
    return edges[between], np.concatenate([own[between], own[back]], axis=1), loads


def _forces(geometry: AssemblyGeometry, edges: Numbers, middle: Array) -> tuple[Array, Array]:
    """What the second of each pair does to the first: float64 (e, 3), in mean weights; and where, (e, 3)."""
    stability = geometry.springs
    rest = stability.forces((1 << len(geometry)) - 1)
    numbers = {pair: k for k, pair in enumerate(map(tuple, edges.tolist()))}
    force, point, total = np.zeros_like(middle), np.zeros_like(middle), np.zeros(len(edges))
    size = np.linalg.norm(rest.forces, axis=1)
    for first, second, sign in ((rest.a, rest.b, 1.0), (rest.b, rest.a, -1.0)):
        own = first >= 0
        k = np.array([numbers[a, b] for a, b in zip(first[own].tolist(), second[own].tolist())], dtype=np.int64)
        np.add.at(force, k, sign * rest.forces[own] / stability.springs.unit)
        np.add.at(point, k, size[own, None] * rest.points[own])
        np.add.at(total, k, size[own])
    pressed = total > NEGLIGIBLE * stability.springs.unit
    point[pressed] /= total[pressed, None]
    point[~pressed] = middle[~pressed]
    return force, point


def _two_largest(values: Array, groups: Numbers, count: int) -> tuple[Array, Array]:
    """Of each group of rows the largest in each column, and the largest of the other rows; a lone bearer's is -inf."""
    largest = np.full((count, values.shape[1]), -np.inf)
    np.maximum.at(largest, groups, values)
    second = np.full_like(largest, -np.inf)
    np.maximum.at(second, groups, np.where(values >= largest[groups], -np.inf, values))
    return largest, second
