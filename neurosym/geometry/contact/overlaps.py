"""How deep parts overlap at rest: mating faces of real parts do a little, and that is no fault.

The depth of an overlap is the largest of two lengths: the diameter of the largest ball that lies in both bodies, and
how deep a corner of one lies in the other. Where faces mate it is the thickness of the layer that both claim. No
smaller motion than this depth can part the two bodies (each point of the ball, or the corner, has to come out), and
two bodies that only touch have depth 0, convex or not. Between the surfaces balls are looked for at the middle of each
patch where two faces look at one another the wrong way round, so that the depth is exact for flat mating faces and
never too large for others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from neurosym.geometry.bodies import Bodies
from neurosym.geometry.mesh import triangles
from neurosym.geometry.mesh.broad_phase import CHUNK, near_pairs, overlapping_pairs
from neurosym.support.arrays import Array, Numbers

#: Overlaps below this share of the smallest extent are rounding.
NOISE = 1e-6

#: Normals of one body along which a gap is looked for; a body with more is asked about these many.
MAX_NORMALS = 256

#: For one pair of bodies, pairs of faces clipped, points asked whether they lie inside, and points measured that do:
#: evenly spread ones where there are more.
MAX_PATCHES, MAX_ASKED, MAX_MEASURED = 4_000, 4_000, 256

#: Places where edges go through faces that are joined two by two.
MAX_PLACES = 40

#: Bodies with more pairs of faces than this are searched for overlaps up to `FAR` of the smallest extent only; deeper
#: ones show by points that far under their faces.
DENSE, FAR = 100_000, 0.1

#: Faces look at one another when the cosine between their normals is below this.
_FACING = -0.1


@dataclass(frozen=True)
class Overlap:
    """Two bodies, by number, of different parts, and how deep they overlap (length)."""

    a: int
    b: int
    depth: float


def overlaps(bodies: Bodies, fixed: int = 0) -> list[Overlap]:
    """All overlaps of bodies of different parts, those between two parts of the bitset `fixed` left out."""
    noise = NOISE * bodies.smallest_extent
    low, high = bodies.bounds[:, 0], bodies.bounds[:, 1]
    inner = (np.minimum(low + noise / 2, high), np.maximum(high - noise / 2, low))
    rests = np.array([fixed >> o & 1 for o in bodies.owners.tolist()], dtype=bool)
    pairs = overlapping_pairs(*inner, bodies.owners)
    pairs = pairs[~rests[pairs].all(axis=1)]
    surfaces = {int(i): _Body.of(bodies, int(i)) for i in np.unique(pairs)}
    deep = []
    for i, j in pairs:
        a, b = surfaces[int(i)], surfaces[int(j)]
        reach = _least_width(a, b)
        if reach > noise:
            depth = min(_depth(a, b, noise, FAR * bodies.smallest_extent), reach)
            if depth > noise:
                deep.append(Overlap(int(i), int(j), depth))
    return deep


@dataclass(frozen=True, eq=False)
class _Body:
    """``vertices`` (n, 3) and ``triangles`` (m, 3, 3) of a body in the world; ``normals``: unit (m, 3), outward."""

    vertices: Array
    triangles: Array
    normals: Array

    @classmethod
    def of(cls, bodies: Bodies, body: int) -> _Body:
        vertices = bodies.vertices(body)
        t = vertices[bodies[body].shape.faces]
        cross = triangles.area_vectors(t)
        size = np.linalg.norm(cross, axis=1)
        kept = size > 1e-12 * np.ptp(vertices) ** 2
        return cls(vertices, t[kept], cross[kept] / size[kept, None])

    def directions(self) -> Array:
        """Unit normals (k, 3), each direction once, no more than `MAX_NORMALS`."""
        rounded = np.round(self.normals, 6)
        return _some(np.unique(rounded, axis=0), MAX_NORMALS)


def _some(rows: NDArray[Any], limit: int) -> NDArray[Any]:
    """The rows, or evenly spread ones where there are more than `limit`."""
    return rows[:: max(1, -(-len(rows) // limit))]


def _least_width(a: _Body, b: _Body) -> float:
    """How far one of two bodies would have to move along the normal of some face to come clear: an upper bound."""
    width = np.inf
    for one, other in ((a, b), (b, a)):
        normals = one.directions()
        widths = (one.vertices @ normals.T).max(axis=0) - (other.vertices @ normals.T).min(axis=0)
        width = min(width, float(widths.min()))
    return width


def _depth(a: _Body, b: _Body, noise: float, far: float) -> float:
    """The depth of the overlap of two bodies; see the top of this module. `far`: how deep to look among many faces."""
    low = np.maximum(a.vertices.min(axis=0), b.vertices.min(axis=0))
    high = np.minimum(a.vertices.max(axis=0), b.vertices.max(axis=0))
    # Surfaces farther off than the overlap is wide are nobody's nearest: depths beyond are not asked for.
    margin = float((high - low).min())
    middle = (low + high) / 2
    near_a, near_b = _near(a, low - margin, high + margin), _near(b, low - margin, high + margin)
    few = len(near_a.triangles) * len(near_b.triangles) <= DENSE
    depth = 0.0
    for one, other, around in ((a, b, near_b), (b, a, near_a)):
        corners = one.vertices[((one.vertices >= low) & (one.vertices <= high)).all(axis=1)]
        depth = max(depth, _deepest(corners - middle, [other.triangles - middle], [around.triangles - middle], noise))
    pairs = np.argwhere(near_a.normals @ near_b.normals.T < _FACING) if few else _near_faces(near_a, near_b, far)
    points = [_between(near_a, near_b, pairs, middle, noise)]
    if not few:
        points += [n.triangles.mean(axis=1) - far / 2 * n.normals - middle for n in (near_a, near_b)]
    if few:
        points.append(_amid(near_a, near_b, noise) - middle)
    centres = np.concatenate(points)
    surfaces = [a.triangles - middle, b.triangles - middle]
    near = [near_a.triangles - middle, near_b.triangles - middle]
    return max(depth, 2 * _deepest(centres, surfaces, near, noise / 2))


def _near(body: _Body, low: Array, high: Array) -> _Body:
    lowest, highest = triangles.bounds(body.triangles)
    kept = (lowest <= high).all(axis=1) & (highest >= low).all(axis=1)
    return _Body(body.vertices, body.triangles[kept], body.normals[kept])


def _deepest(points: Array, surfaces: list[Array], near: list[Array], noise: float) -> float:
    """The largest distance of any of the points (n, 3) that lie within all surfaces from the nearest of them."""
    points = _some(points, MAX_ASKED)
    for surface in surfaces:
        points = points[triangles.are_inside(points, surface)]
    points = _some(points, MAX_MEASURED)
    if not len(points):
        return 0.0
    faces = np.concatenate(near)
    if not len(faces):
        return 0.0
    away = float(triangles.distances(points, faces).max())
    return away if away > noise else 0.0


def _near_faces(a: _Body, b: _Body, far: float) -> Numbers:
    """Pairs (k, 2) of faces of two bodies that look at one another from no farther than `far`, or close to it."""
    low, high = triangles.bounds(a.triangles)
    rows, pairs = np.arange(len(low)), None
    while pairs is None:
        around = (low[rows] - far, high[rows] + far)
        pairs = near_pairs(around, triangles.bounds(b.triangles), CHUNK)
        rows = rows if pairs is not None else rows[::2]
    pairs[:, 0] = rows[pairs[:, 0]]
    facing = np.einsum("kd,kd->k", a.normals[pairs[:, 0]], b.normals[pairs[:, 1]]) < _FACING
    return np.asarray(pairs[facing])


def _between(a: _Body, b: _Body, pairs: Numbers, middle: Array, noise: float) -> Array:
    """Points (n, 3), from `middle`, halfway between those pairs (k, 2) of faces that have passed one another."""
    i, j = pairs.T
    # Passed: each face has some corner beyond the other's plane.
    ta, tb, na, nb = a.triangles[i] - middle, b.triangles[j] - middle, a.normals[i], b.normals[j]
    passed = np.einsum("kcd,kd->kc", ta - tb[:, :1], nb).min(axis=1) < -noise / 2
    passed &= np.einsum("kcd,kd->kc", tb - ta[:, :1], na).min(axis=1) < -noise / 2
    chosen = _some(np.flatnonzero(passed), MAX_PATCHES)
    ta, tb, na, nb = ta[chosen], tb[chosen], na[chosen], nb[chosen]
    # Each pair of faces is looked at along the mean of its two normals: n, with u and v across.
    n = na - nb
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    axes = np.stack(triangles.plane_axes(n), axis=2)
    patches = shapely.intersection(shapely.polygons(ta @ axes), shapely.polygons(tb @ axes))
    wide = np.flatnonzero(shapely.area(patches) > 0)
    uv, patch = _spots(patches[wide])
    rows = wide[patch]
    flat = np.einsum("kda,ka->kd", axes[rows], uv)
    over_a, over_b = (np.einsum("kd,kd->k", t[rows, 0] - flat, m[rows]) for t, m in ((ta, na), (tb, nb)))
    over_a /= np.einsum("kd,kd->k", na, n)[rows]
    over_b /= np.einsum("kd,kd->k", nb, n)[rows]
    passed = over_a - over_b > noise
    points: Array = flat[passed] + (over_a + over_b)[passed, None] / 2 * n[rows[passed]]
    return points


def _amid(a: _Body, b: _Body, noise: float) -> Array:
    """Points (n, 3) halfway between any two places where an edge of one body goes through a face of the other.

    Where one body goes right through the other, its faces look at none of the other's; these points lie in both.
    """
    found = [np.zeros((0, 3))]
    for one, other in ((a, b), (b, a)):
        edges = np.concatenate([one.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
        # Each edge belongs to two faces, and is gone along once either way.
        edges = edges[(edges[:, 0] < edges[:, 1]).argmax(axis=1) == (edges[:, 0] != edges[:, 1]).argmax(axis=1)]
        around = (edges.min(axis=1), edges.max(axis=1))
        pairs = near_pairs(around, triangles.bounds(other.triangles), CHUNK)
        if pairs is not None and len(pairs):
            i, j = pairs.T
            through, where = triangles.pierced(edges[i], other.triangles[j], other.normals[j], noise / 2)
            found.append(where[through])
    places = _some(np.concatenate(found), MAX_PLACES)
    i, j = np.triu_indices(len(places), 1)
    halfway: Array = (places[i] + places[j]) / 2
    return halfway


def _spots(patches: NDArray[np.object_]) -> tuple[Array, Numbers]:
    """Points (n, 2) of convex patches at which a gap may be widest, and the patch of each: centres, corners, edges."""
    corners, patch = shapely.get_coordinates(shapely.get_exterior_ring(patches), return_index=True)
    same = patch[1:] == patch[:-1]
    edges = (corners[1:] + corners[:-1])[same] / 2
    centres = shapely.get_coordinates(shapely.centroid(patches))
    number = np.arange(len(patches))
    return np.concatenate([centres, corners, edges]), np.concatenate([number, patch, patch[1:][same]])
