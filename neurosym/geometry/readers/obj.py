"""Wavefront OBJ: vertices, polygons and the names of objects. All else, materials included, is passed over."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.mesh.triangulation import triangulate
from neurosym.geometry.readers.contents import Contents, RawMesh
from neurosym.geometry.readers.limits import read_bytes, within_limits
from neurosym.support.arrays import Numbers


def read_obj(path: Path, *, split: bool = False) -> Contents:
    """One mesh; with `split`, one for each object (``o``) that has faces.

    Raises:
        AssemblyError: a line that cannot be read, with its number.
    """
    vertices: list[tuple[float, ...]] = []
    objects: list[tuple[str, list[Numbers]]] = [(path.stem, [])]
    text = read_bytes(path).decode("utf-8", errors="replace").replace("\\\n", " ").replace("\\\r\n", " ")
    count = 0
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        try:
            if words[0] == "v":
                x, y, z = map(float, words[1:4])
                vertices.append((x, y, z))
            elif words[0] == "f":
                polygon = np.array([int(w.split("/", 1)[0]) for w in words[1:]], dtype=np.int64)
                # Numbers count from 1; negative ones count back from the last vertex so far.
                polygon = np.where(polygon < 0, polygon + len(vertices), polygon - 1)
                if len(polygon) < 3 or polygon.min() < 0:
                    raise ValueError("a face has three or more numbers of vertices, counted from 1")
                objects[-1][1].append(polygon)
                count += len(polygon) - 2
            elif words[0] == "o" and split:
                objects.append((line.split("#", 1)[0].strip()[1:].strip(), []))
        except (ValueError, OverflowError) as error:
            raise AssemblyError(f"Expected OBJ in {path}; line {number} is {line[:60]!r}: {error}.") from None
        within_limits(path, count if not split else 0, count, len(objects) - 1)
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    meshes = []
    for name, polygons in objects:
        if not polygons and split and len(objects) > 1:
            continue
        if polygons and max(int(p.max()) for p in polygons) >= len(points):
            raise AssemblyError(f"Expected faces in {path} that index its {len(points)} vertices; one goes beyond.")
        faces = triangulate(points, polygons)
        used, inverse = np.unique(faces, return_inverse=True)
        meshes.append(RawMesh(name, points[used], inverse.reshape(-1, 3).astype(np.int64)))
    return Contents(tuple(meshes))
