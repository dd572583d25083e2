"""STL, binary or text: triangles without names. Several solids in one file are one part."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import AssemblyError
from neurosym.geometry.readers.contents import FLOAT32, Contents, RawMesh
from neurosym.geometry.readers.limits import read_bytes, reading, within_limits
from neurosym.support.arrays import Array

_HEADER = 80
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path) -> Contents:
    """One mesh; normals and colours are passed over, for corners say which way a face looks.

    Raises:
        AssemblyError: neither its length nor its words are those of STL.
    """
    data = read_bytes(path)
    with reading("STL", path):
        binary = _binary(data)
        corners = _text(data, path) if binary is None else binary.astype(np.float64)
        within_limits(path, len(corners))
        faces = np.arange(3 * len(corners), dtype=np.int64).reshape(-1, 3)
        return Contents((RawMesh(path.stem, corners.reshape(-1, 3), faces, FLOAT32),))


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


def _text(data: bytes, path: Path) -> Array:
    words = data.decode("utf-8", errors="replace").split()
    if not words or words[0].lower() != "solid" or "endsolid" not in (w.lower() for w in words[-20:]):
        said = f"{len(data):,} bytes fit no count of triangles, and no text from `solid` to `endsolid`"
        raise AssemblyError(f"Expected STL in {path}; its {said}. It may be cut off: export it again.")
    lower = [w.lower() for w in words]
    at = [i for i, word in enumerate(lower) if word == "vertex"]
    facets, corners = lower.count("facet"), np.array([words[i + 1 : i + 4] for i in at])
    if len(at) != 3 * facets:
        raise AssemblyError(f"Expected three corners a facet in {path}; it has {facets} facets and {len(at)} corners.")
    return corners.astype(np.float64).reshape(-1, 3, 3)
