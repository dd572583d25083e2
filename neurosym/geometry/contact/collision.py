"""FCL, spoken to in one place.

What python-fcl does well (measured): box against box, exact normals and depths, a few microseconds.
What is avoided: `continuousCollide` (misses head-on boxes) and meshes at exact touch (reported as hits).
"""

from __future__ import annotations

import threading

import fcl
import numpy as np

from neurosym.geometry.shapes import Box, Shape
from neurosym.support.arrays import Array

#: Corners of a face patch between two boxes: at most eight after clipping.
MAX_CONTACTS = 8

#: So many boxes of different sizes are kept.
MAX_BOXES = 1 << 14


def box_object(size: Array, X: Array) -> fcl.CollisionObject:
    """A box of full edge lengths `size` (3,) at pose `X` (4, 4)."""
    return fcl.CollisionObject(fcl.Box(*map(float, size)), fcl.Transform(X[:3, :3], X[:3, 3]))


class _Boxes(threading.local):
    """Two boxes of each size that was asked for, a thread: python-fcl never gives back all of an object's memory."""

    def __init__(self) -> None:
        self.kept: dict[tuple[float, ...], fcl.CollisionObject] = {}


_BOXES = _Boxes()


def boxes_meet(size_a: Array, X_a: Array, size_b: Array, X_b: Array) -> bool:
    """Whether two boxes of full edge lengths (3,) at poses (4, 4) overlap."""
    pair = []
    for number, size, X in ((0.0, size_a, X_a), (1.0, size_b, X_b)):
        key = (number, *map(float, size))
        box = _BOXES.kept.get(key)
        if box is None:
            if len(_BOXES.kept) >= MAX_BOXES:
                _BOXES.kept.clear()
            box = _BOXES.kept[key] = box_object(size, X)
        else:
            place(box, X)
        pair.append(box)
    return collide(*pair)


def mesh_object(shape: Shape, X: Array) -> fcl.CollisionObject:
    """A shape as a triangle mesh (a bounding volume hierarchy) at pose `X` (4, 4)."""
    model = fcl.BVHModel()
    vertices, faces = np.asarray(shape.vertices), np.asarray(shape.faces)
    model.beginModel(len(vertices), len(faces))
    model.addSubModel(vertices, faces)
    model.endModel()
    return fcl.CollisionObject(model, fcl.Transform(X[:3, :3], X[:3, 3]))


def shape_object(shape: Shape, X: Array, grow: float = 0.0) -> fcl.CollisionObject:
    """A shape at pose `X`; a box may be grown (shrunk, if negative) by `grow` on every side."""
    return box_object(shape.size + 2 * grow, X) if isinstance(shape, Box) else mesh_object(shape, X)


def place(thing: fcl.CollisionObject, X: Array) -> None:
    """Move an object to pose `X` (4, 4)."""
    thing.setTransform(fcl.Transform(X[:3, :3], X[:3, 3]))


def collide(a: fcl.CollisionObject, b: fcl.CollisionObject) -> bool:
    """Whether two objects overlap."""
    return bool(fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()) > 0)


def distance(a: fcl.CollisionObject, b: fcl.CollisionObject) -> float:
    """Least distance between the surfaces of two objects (length)."""
    return float(fcl.distance(a, b, fcl.DistanceRequest(), fcl.DistanceResult()))


def box_patch(a: fcl.CollisionObject, b: fcl.CollisionObject) -> tuple[Array, Array] | None:
    """Where two overlapping boxes meet: points (k, 3), and the unit normal (3,) from a to b; None when apart."""
    request = fcl.CollisionRequest(num_max_contacts=MAX_CONTACTS, enable_contact=True)
    result = fcl.CollisionResult()
    if fcl.collide(a, b, request, result) == 0:
        return None
    points = np.array([c.pos for c in result.contacts])
    normal = np.array(result.contacts[0].normal)
    # The sign depends on the order in which FCL dispatches the pair: settle it by the centres.
    if np.dot(normal, np.asarray(b.getTranslation()) - np.asarray(a.getTranslation())) < 0:
        normal = -normal
    return points, normal
