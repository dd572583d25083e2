"""OFF: counts, vertices, polygons, as text. Colours and normals are passed over."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.mesh.triangulation import triangulate
from neurosym.geometry.readers.contents import Contents, RawMesh
from neurosym.geometry.readers.limits import MAX_TEXT_BYTES, read_bytes, reading, within_limits

#: What the first word may be: plain, with colours, with normals, with texture coordinates.
_KINDS = {"OFF", "COFF", "NOFF", "STOFF", "CNOFF"}


def read_off(path: Path) -> Contents:
    """One mesh."""
    with reading("OFF", path):
        text = read_bytes(path, MAX_TEXT_BYTES).decode("utf-8")
        lines = [words for line in text.splitlines() if (words := line.split("#", 1)[0].split())]
        if not lines or lines[0][0] not in _KINDS:
            raise AssemblyError(f"Expected OFF in {path}; its first word is none of {', '.join(sorted(_KINDS))}.")
        # The counts stand on the first line or on the next.
        counts, *rest = [lines[0][1:], *lines[1:]] if len(lines[0]) > 1 else lines[1:]
        n, m = int(counts[0]), int(counts[1])
        if min(n, m) < 0 or len(rest) < n + m:
            raise AssemblyError(f"Expected {n} vertices and {m} faces in {path}; it has {len(rest)} lines after them.")
        vertices = np.array([[float(w) for w in words[:3]] for words in rest[:n]], dtype=np.float64).reshape(-1, 3)
        polygons = []
        for words in rest[n : n + m]:
            polygon = np.array([int(w) for w in words[1 : 1 + int(words[0])]], dtype=np.int64)
            if len(polygon) != int(words[0]) or len(polygon) < 3 or polygon.min() < 0 or polygon.max() >= n:
                line = " ".join(words)[:60]
                raise AssemblyError(f"Expected faces of three or more of {n} vertices in {path}; got {line!r}.")
            polygons.append(polygon)
        within_limits(path, sum(len(p) - 2 for p in polygons))
        return Contents((RawMesh(path.stem, vertices, triangulate(vertices, polygons)),))
