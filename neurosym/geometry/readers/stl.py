"""STL, binary or text: triangles, in text perhaps of several solids with names."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import AssemblyError
from neurosym.geometry.readers.contents import FLOAT32, Contents, RawMesh
from neurosym.geometry.readers.limits import read_bytes, reading, within_limits
from neurosym.geometry.readers.solids import by_name
from neurosym.support.arrays import Array

_HEADER = 80
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path) -> Contents:
    """A mesh for each solid; normals and colours are passed over, for corners say which way a face looks."""
    data = read_bytes(path)
    with reading("STL", path):
        binary = _binary(data)
        solids = [("", binary.astype(np.float64))] if binary is not None else _text(data, path)
        for _, corners in solids:
            within_limits(path, len(corners), sum(len(own) for _, own in solids))
        names = [name if len(solids) > 1 else path.stem for name, _ in solids]
        faces = (np.arange(3 * len(corners), dtype=np.int64).reshape(-1, 3) for _, corners in solids)
        meshes = [RawMesh(n, c.reshape(-1, 3), f, FLOAT32) for n, (_, c), f in zip(names, solids, faces)]
        return by_name(path, meshes)


def _binary(data: bytes) -> NDArray[np.float32] | None:
    """Corners (m, 3, 3), or None when the length is not the one that the count of triangles asks for.

    Text may begin with any word, `solid` too in a binary file: the length alone tells.
    """
    if len(data) < _HEADER + 4:
        return None
    count = int(np.frombuffer(data, "<u4", 1, _HEADER)[0])
    if len(data) != _HEADER + 4 + count * _TRIANGLE.itemsize:
        return None
    corners: NDArray[np.float32] = np.frombuffer(data, _TRIANGLE, count, _HEADER + 4)["corners"]
    return corners


def _text(data: bytes, path: Path) -> list[tuple[str, Array]]:
    """Solids that have facets: the name, and corners (m, 3, 3)."""
    text = "\n".join(data.decode("utf-8", errors="replace").splitlines())
    starts = list(re.finditer(r"^[ \t]*solid\b(.*)$", text, re.MULTILINE | re.IGNORECASE))
    if not starts or text[: starts[0].start()].strip() or "endsolid" not in text[-1000:].lower():
        fault = f"{len(data):,} bytes fit no count of triangles, and no text from `solid` to `endsolid`"
        raise AssemblyError(f"Expected STL in {path}; its {fault}. It may be cut off: export it again.")
    solids = []
    for start, end in zip(starts, [*(s.start() for s in starts[1:]), len(text)]):
        words = text[start.end() : end].split()
        lower = [w.lower() for w in words]
        at = [i for i, word in enumerate(lower) if word == "vertex"]
        facets, corners = lower.count("facet"), np.array([words[i + 1 : i + 4] for i in at])
        if len(at) != 3 * facets:
            what = f"{facets} facets and {len(at)} corners"
            raise AssemblyError(f"Expected three corners a facet in {path}; it has {what}.")
        solids.append((start[1].strip(), corners.astype(np.float64).reshape(-1, 3, 3)))
    return [solid for solid in solids if len(solid[1])] or solids[:1]
