"""What the question of standing is made of: contact patches between parts, masses and centres of mass."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.contacts import TABLE, Contact
from neurosym.geometry.contact.planes import hull_points
from neurosym.geometry.mesh.topology import volume_and_centre
from neurosym.geometry.shapes import Box
from neurosym.support.arrays import Array
from neurosym.support.bitsets import bits

#: A part is under another when the normal between them points down by more (45 degrees).
UNDER = 0.7


def patch_axes(patch: Contact) -> tuple[Array, Array]:
    """Tangents (3,) of a patch along and across its longest edge: the cone turns with the parts, not with the world."""
    following = np.roll(patch.points, -1, axis=0) - patch.points
    u = following[np.argmax(np.linalg.norm(following, axis=1))]
    u = u - (u @ patch.normal) * patch.normal
    u = u / np.linalg.norm(u)
    return u, np.cross(patch.normal, u)


def merged_patches(assembly: Assembly, contacts: tuple[Contact, ...]) -> tuple[Contact, ...]:
    """Contacts between parts, those in one plane merged into the convex hull of their corners; a, b are parts.

    For rigid parts nothing is lost: a force anywhere in the hull with a cone's direction is a sum of such
    forces at its corners.
    """
    owners, touch = assembly.owners, assembly.touch
    groups: dict[tuple[int, int], list[tuple[Array, float, list[Array], float, float]]] = {}
    for c in contacts:
        a, b = int(owners[c.a]), TABLE if c.b == TABLE else int(owners[c.b])
        normal = c.normal
        if b != TABLE and a > b:
            a, b, normal = b, a, -normal
        offset = float(c.points.mean(axis=0) @ normal)
        planes = groups.setdefault((a, b), [])
        for k, (known, distance, points, area, gap) in enumerate(planes):
            if known @ normal > 1 - 1e-6 and abs(distance - offset) <= 2 * touch:
                planes[k] = (known, distance, [*points, c.points], area + c.area, min(gap, c.gap))
                break
        else:
            planes.append((normal, offset, [c.points], c.area, c.gap))
    found = []
    for (a, b), planes in groups.items():
        for normal, _, points, area, gap in planes:
            corners = points[0] if len(points) == 1 else hull_points(np.concatenate(points), normal)
            found.append(Contact(a, b, corners, normal, area, gap))
    return tuple(found)


def masses(assembly: Assembly) -> tuple[Array, Array]:
    """Masses (n,) and centres of mass (n, 3), in the world, of the parts."""
    found, moments = np.zeros(len(assembly)), np.zeros((len(assembly), 3))
    for i, body in enumerate(assembly.bodies):
        owner = assembly.owners[i]
        if isinstance(body.shape, Box):
            volume, centre = float(np.prod(body.shape.size)), assembly.X_WB[i][:3, 3]
        else:
            volume, centre = volume_and_centre(assembly.bodies.vertices(i), body.shape.faces)
        mass = volume * body.density * assembly.parts[owner].density
        found[owner] += mass
        moments[owner] += mass * centre
    return found, moments / found[:, None]


def neighbours(patches: Iterable[Contact], n: int) -> tuple[list[int], list[int], int]:
    """Of n parts, as bitsets: for each those that touch it, and those under it; and those on the table."""
    touching, supports, on_table = [0] * n, [0] * n, 0
    for p in patches:
        if p.b == TABLE:
            on_table |= 1 << p.a
            continue
        touching[p.a] |= 1 << p.b
        touching[p.b] |= 1 << p.a
        if p.normal[2] < -UNDER:  # from a down to b: b carries a
            supports[p.a] |= 1 << p.b
        elif p.normal[2] > UNDER:
            supports[p.b] |= 1 << p.a
    return touching, supports, on_table


def groups(movable: int, touching: Sequence[int]) -> list[int]:
    """Bitsets of the movable parts, themselves a bitset, that hang together by contacts."""
    found = []
    while movable:
        group = fresh = movable & -movable
        while fresh:
            near = functools.reduce(int.__or__, (touching[p] for p in bits(fresh)), 0)
            fresh = near & movable & ~group
            group |= fresh
        found.append(group)
        movable &= ~group
    return found
