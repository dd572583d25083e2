"""Where parts touch: points, normals and areas.

Boxes: FCL finds the pairs and their normals, and their faces are clipped exactly. Anything else: coplanar facets
with opposite normals are clipped, since FCL's depths and normals between meshes are not usable; FCL says which pairs
are near at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from neurosym.geometry import collision
from neurosym.geometry.assembly import Box

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]

#: Stands for the table where a body is expected.
TABLE = -1


@dataclass(frozen=True, eq=False)
class Contact:
    """A flat patch in which body `a` touches body `b` of another part, or the table.

    Attributes:
        a, b: numbers of bodies; `b` is `TABLE` for the table.
        points: float64 (k, 3), k >= 3: the corners of the patch's convex hull, in the world.
        normal: float64 (3,): unit normal of the patch, from a to b.
        area: of the patch (length squared).
    """

    a: int
    b: int
    points: Array
    normal: Array
    area: float


def find_contacts(assembly: Assembly) -> tuple[Contact, ...]:
    """All contacts of an assembly, the table's among them."""
    found = [*_table_contacts(assembly)]
    touch = assembly.touch
    shapes = [b.shape for b in assembly.bodies]
    grown = [collision.shape_object(s, X, touch / 2) for s, X in zip(shapes, assembly.X_WB)]
    for a, b in near_pairs(assembly.body_bounds, assembly.owners, touch):
        if isinstance(shapes[a], Box) and isinstance(shapes[b], Box):
            contact = _box_contact(assembly, a, b, grown[a], grown[b])
            if contact is not None:
                found.append(contact)
        elif collision.collide(grown[a], grown[b]) or collision.distance(grown[a], grown[b]) <= touch:
            found.extend(_facet_contacts(assembly, a, b))
    return tuple(found)


def near_pairs(bounds: Array, owners: NDArray[np.int64], margin: float) -> list[tuple[int, int]]:
    """Pairs a < b of bodies of different parts whose bounds (n, 2, 3) come within `margin`."""
    low, high = bounds[:, 0] - margin, bounds[:, 1] + margin
    near = (low[:, None] <= high[None]).all(axis=2)
    near &= near.T & (owners[:, None] != owners[None])
    return [(int(a), int(b)) for a, b in np.argwhere(np.triu(near, 1))]


def _box_contact(assembly: Assembly, a: int, b: int, grown_a: object, grown_b: object) -> Contact | None:
    """FCL finds the pair and the normal; the two faces are clipped here, for FCL keeps four of up to eight corners."""
    patch = collision.box_patch(grown_a, grown_b)
    if patch is None:
        return None
    normal = patch[1]
    faces = [_face_along(assembly, body, sign * normal) for body, sign in ((a, 1.0), (b, -1.0))]
    first, second = faces
    if first is None or second is None:
        return None  # an edge or a corner, not a face
    (corner_a, u, v, size_a), (corner_b, ub, vb, size_b) = first, second
    normal = np.cross(u, v)
    delta = corner_b - corner_a
    if abs(delta @ normal) > assembly.touch:
        return None
    # The other face in this face's frame: an interval along each axis where they are parallel, clipped otherwise.
    square = np.array([[0, 0], [size_b[0], 0], size_b, [0, size_b[1]]]) @ np.array([ub, vb]) + delta
    flat = np.stack([square @ u, square @ v], axis=1)
    if min(np.abs([ub @ u, ub @ v])) <= assembly.tolerances.parallel:
        low, high = np.maximum(flat.min(axis=0), 0.0), np.minimum(flat.max(axis=0), size_a)
        if (high - low).min() <= assembly.touch:
            return None
        uv = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    else:
        both = shapely.intersection(shapely.box(0, 0, *size_a), shapely.Polygon(flat))
        uv = shapely.get_coordinates(both)[:-1]
        if len(uv) < 3:
            return None
    points = corner_a + uv[:, :1] * u + uv[:, 1:] * v
    return _contact(a, b, points, normal, assembly.touch)


def _face_along(assembly: Assembly, body: int, normal: Array) -> tuple[Array, Array, Array, Array] | None:
    """The face of a box whose outward normal is `normal`: a corner, two unit edges (u x v outward), their lengths."""
    shape = assembly.bodies[body].shape
    assert isinstance(shape, Box)
    X = assembly.X_WB[body]
    along = X[:3, :3].T @ normal
    axis = int(np.argmax(np.abs(along)))
    if np.linalg.norm(np.delete(along, axis)) > 10 * assembly.tolerances.parallel:
        return None
    sign = float(np.sign(along[axis]))
    second, third = (axis + 1) % 3, (axis + 2) % 3
    if sign < 0:
        second, third = third, second
    local = np.zeros(3)
    local[axis] = sign * shape.size[axis] / 2
    local[second], local[third] = -shape.size[second] / 2, -shape.size[third] / 2
    u, v = X[:3, second], X[:3, third]
    return X[:3, :3] @ local + X[:3, 3], u, v, np.array([shape.size[second], shape.size[third]])


def _contact(a: int, b: int, points: Array, normal: Array, touch: float) -> Contact | None:
    centre = points.mean(axis=0)
    following = np.roll(points, -1, axis=0)
    area = 0.5 * abs(float(np.cross(points - centre, following - centre).sum(axis=0) @ normal))
    width = area / max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-300)
    return Contact(a, b, points, normal, area) if width > touch else None


def _table_contacts(assembly: Assembly) -> list[Contact]:
    found: list[Contact] = []
    for i in range(len(assembly.bodies) if assembly.has_table else 0):
        if assembly.body_bounds[i, 0, 2] > assembly.ground + assembly.touch:
            continue
        vertices = assembly.body_vertices(i)
        low = vertices[vertices[:, 2] <= assembly.ground + assembly.touch]
        points = hull_points(low, np.array([0.0, 0.0, -1.0]))
        contact = None if len(points) < 3 else _contact(i, TABLE, points, np.array([0.0, 0.0, -1.0]), assembly.touch)
        if contact is not None:
            found.append(contact)
    return found


def hull_points(points: Array, normal: Array) -> Array:
    """Corners, in order, of the convex hull of coplanar points (n, 3); empty when they span no area."""
    if len(points) < 3:
        return points[:0]
    u, v = plane_axes(normal)
    flat = np.stack([points @ u, points @ v], axis=1)
    try:
        corners: Array = points[ConvexHull(flat).vertices]
        return corners
    except QhullError:
        return points[:0]


def plane_axes(normal: Array) -> tuple[Array, Array]:
    """Two unit vectors (3,) that span the plane across a unit normal."""
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    u = np.cross(normal, helper)
    u /= np.linalg.norm(u)
    return u, np.cross(normal, u)


def _facet_contacts(assembly: Assembly, a: int, b: int) -> list[Contact]:
    """Contacts between two bodies by clipping coplanar triangles with opposite normals, gathered by plane."""
    tol, touch = assembly.tolerances, assembly.touch
    triangles = [assembly.body_vertices(i)[assembly.bodies[i].shape.faces] for i in (a, b)]
    normals = []
    for k, t in enumerate(triangles):
        cross = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
        size = np.linalg.norm(cross, axis=1)
        keep = size > 1e-12 * assembly.smallest_extent**2
        triangles[k] = t[keep]
        normals.append(cross[keep] / size[keep, None])
    ta, tb = triangles
    na, nb = normals
    # Opposite, by the sine of the angle between them, and in one plane.
    opposite = (na @ nb.T < 0) & (np.linalg.norm(np.cross(na[:, None], nb[None]), axis=2) <= tol.parallel)
    gap = np.abs(np.einsum("id,ijd->ij", na, tb.mean(axis=1)[None] - ta.mean(axis=1)[:, None]))
    pairs = np.argwhere(opposite & (gap <= touch))
    found = []
    for plane in _by_plane(na, ta, pairs, assembly):
        normal = na[plane[0, 0]]
        u, v = plane_axes(normal)
        flat_a = shapely.polygons(np.stack([ta[plane[:, 0]] @ u, ta[plane[:, 0]] @ v], axis=-1))
        flat_b = shapely.polygons(np.stack([tb[plane[:, 1]] @ u, tb[plane[:, 1]] @ v], axis=-1))
        clipped = shapely.intersection(flat_a, flat_b)
        area = float(shapely.area(clipped).sum())
        uv = shapely.get_coordinates(clipped[shapely.area(clipped) > 0])
        if len(uv) < 3:
            continue
        offset = float(ta[plane[0, 0]].mean(axis=0) @ normal)
        points = hull_points(uv[:, :1] * u + uv[:, 1:] * v + offset * normal, normal)
        contact = None if len(points) < 3 else _contact(a, b, points, normal, touch)
        if contact is not None:
            found.append(Contact(a, b, points, normal, area))
    return found


def _by_plane(
    normals: Array, triangles: Array, pairs: NDArray[np.int64], assembly: Assembly
) -> list[NDArray[np.int64]]:
    """Pairs of facets grouped by the plane of their first facet."""
    groups: list[tuple[Array, float, list[NDArray[np.int64]]]] = []
    for pair in pairs:
        normal = normals[pair[0]]
        offset = float(triangles[pair[0]].mean(axis=0) @ normal)
        for known, distance, members in groups:
            if known @ normal > 1 - 1e-6 and abs(distance - offset) <= 2 * assembly.touch:
                members.append(pair)
                break
        else:
            groups.append((normal, offset, [pair]))
    return [np.array(members) for _, _, members in groups]
