"""Wavefront OBJ: vertices, polygons, the names of objects and groups. All else, materials included, is passed over."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.mesh.triangulation import triangulate
from neurosym.geometry.readers.contents import Contents, RawMesh
from neurosym.geometry.readers.limits import read_bytes, within_limits
from neurosym.geometry.readers.solids import by_name


def read_obj(path: Path, *, split: bool = False) -> Contents:
    """One mesh; with `split`, one for each object (``o``) that has faces, or for each group (``g``) of a lone one."""
    vertices: list[tuple[float, ...]] = []
    objects: list[tuple[str, dict[str, list[list[int]]]]] = [(path.stem, {})]
    group = ""
    text = read_bytes(path).decode("utf-8", errors="replace").replace("\\\n", " ").replace("\\\r\n", " ")
    count = 0
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            if words[0] == "v":
                x, y, z = map(float, words[1:4])
                vertices.append((x, y, z))
            elif words[0] == "f":
                # Numbers count from 1; negative ones count back from the last vertex so far.
                given = [int(word.partition("/")[0]) for word in words[1:]]
                polygon = [n - 1 if n > 0 else n + len(vertices) if n < 0 else -1 for n in given]
                if len(polygon) < 3 or min(polygon) < 0 or max(polygon) > sys.maxsize:
                    raise ValueError("a face has three or more numbers of vertices, counted from 1")
                objects[-1][1].setdefault(group, []).append(polygon)
                count += len(polygon) - 2
            elif words[0] == "o" and split:
                objects.append((" ".join(words[1:]), {}))
                group = ""
            elif words[0] == "g" and split:
                group = " ".join(words[1:])
        except (ValueError, OverflowError) as error:
            raise AssemblyError(f"Expected OBJ in {path}; line {number} is {line[:60]!r}: {error}.") from None
        within_limits(path, count if not split else 0, count, len(objects) - 1)
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)

    def mesh(name: str, polygons: list[list[int]]) -> RawMesh:
        if polygons and max(map(max, polygons)) >= len(points):
            raise AssemblyError(f"Expected faces in {path} that index its {len(points)} vertices; one goes beyond.")
        faces = triangulate(points, polygons)
        used, inverse = np.unique(faces, return_inverse=True)
        return RawMesh(name, points[used], inverse.reshape(-1, 3).astype(np.int64))

    filled = [(name, groups) for name, groups in objects if groups] or [(path.stem, {"": []})]
    if len(filled) == 1:
        ((name, groups),) = filled
        return by_name(path, [mesh(group if len(groups) > 1 else name, own) for group, own in groups.items()])
    return Contents(tuple(mesh(name, [p for own in groups.values() for p in own]) for name, groups in filled))
