"""PLY, text or binary: vertices and polygons. Colours, normals and other elements are passed over."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import AssemblyError
from neurosym.geometry.mesh.triangulation import triangulate
from neurosym.geometry.readers.contents import FLOAT32, FLOAT64, Contents, RawMesh
from neurosym.geometry.readers.limits import read_bytes, reading, within_limits

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_FORMATS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}

#: A header ends within so many bytes, or it is none.
_MAX_HEADER = 1 << 16


@dataclass(frozen=True)
class _Property:
    """``type``: numpy's name of the type, of the members for a list; ``count``: of a list's length, else None."""

    name: str
    type: str
    count: str | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    rows: int
    properties: tuple[_Property, ...]


def read_ply(path: Path) -> Contents:
    """One mesh."""
    data = read_bytes(path)
    with reading("PLY", path):
        head, body = _header(data, path)
        order, elements = _elements(head, path)
        for element in elements:
            if element.properties and element.rows > len(body):
                raise AssemblyError(f"Expected {element.rows:,} rows of {element.name} in {path}; it is too short.")
        take = _text(body) if order is None else _Binary(body, order)
        vertices, polygons, rounding = None, None, FLOAT64
        for element in elements:
            known = take.table(element) if isinstance(take, _Binary) and element.rows and element.properties else None
            columns = _rows(take, element, path) if known is None else known
            if element.name == "vertex":
                vertices = np.stack([np.asarray(columns[k], dtype=np.float64) for k in ("x", "y", "z")], axis=1)
                kinds = {p.type for p in element.properties if p.name in ("x", "y", "z")}
                rounding = FLOAT32 if "f4" in kinds else FLOAT64
            elif element.name == "face":
                polygons = columns.get("vertex_indices", columns.get("vertex_index"))
        if vertices is None or polygons is None:
            raise AssemblyError(f"Expected vertices x, y, z and faces with vertex_indices in {path}; some are missing.")
        lists = [np.asarray(p, dtype=np.int64) for p in polygons]
        n = len(vertices)
        if any(len(p) < 3 or p.min() < 0 or p.max() >= n for p in lists):
            raise AssemblyError(f"Expected faces of three or more of {n} vertices in {path}; one is not.")
        within_limits(path, sum(len(p) - 2 for p in lists))
        return Contents((RawMesh(path.stem, vertices, triangulate(vertices, lists), rounding),))


def _header(data: bytes, path: Path) -> tuple[list[list[str]], bytes]:
    end = data.find(b"end_header", 0, _MAX_HEADER)
    stop = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or not stop:
        raise AssemblyError(f"Expected PLY in {path}: the word ply first, and end_header; got something else.")
    lines = data[:end].decode("ascii", errors="replace").splitlines()
    return [line.split() for line in lines[1:] if line.strip()], data[stop:]


def _elements(head: list[list[str]], path: Path) -> tuple[str | None, list[_Element]]:
    order: str | None = None
    elements: list[_Element] = []
    for words in head:
        if words[0] == "format":
            order = _FORMATS[words[1]]
        elif words[0] == "element":
            rows = int(words[2])
            if rows < 0:
                raise AssemblyError(f"Expected counts of 0 or more in {path}; got {rows} rows of {words[1]}.")
            elements.append(_Element(words[1], rows, ()))
        elif words[0] == "property":
            if words[1] == "list":
                new = _Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
            else:
                new = _Property(words[2], _TYPES[words[1]])
            last = elements[-1]
            elements[-1] = _Element(last.name, last.rows, (*last.properties, new))
    return order, elements


#: So many values of a type, the next of those that were not yet taken.
Take = Callable[[str, int], Sequence[Any] | NDArray[Any]]


def _text(body: bytes) -> Take:
    words = iter(body.decode("ascii", errors="replace").split())
    return lambda kind, size: [(float if kind[0] == "f" else int)(word) for word in islice(words, size)]


class _Binary:
    """Bytes in the order "<" or ">"; `at`: how many were taken."""

    def __init__(self, body: bytes, order: str) -> None:
        self.body, self.order, self.at = body, order, 0

    def __call__(self, kind: str, size: int) -> NDArray[Any]:
        values: NDArray[Any] = np.frombuffer(self.body, self.order + kind, size, self.at)
        self.at += values.nbytes
        return values

    def table(self, element: _Element) -> dict[str, Any] | None:
        """All rows at once, if all lists are as long as in the first row: so it is where all faces are triangles."""
        fields: list[Any] = []
        for p in element.properties:
            if p.count is not None:
                size = int(np.frombuffer(self.body, self.order + p.count, 1, self.at + np.dtype(fields).itemsize)[0])
                fields += [("#" + p.name, self.order + p.count), (p.name, self.order + p.type, (size,))]
            else:
                fields.append((p.name, self.order + p.type))
        row = np.dtype(fields)
        if self.at + row.itemsize * element.rows > len(self.body):
            return None
        table = np.frombuffer(self.body, row, element.rows, self.at)
        if any(
            (table["#" + p.name] != table["#" + p.name][0]).any() for p in element.properties if p.count is not None
        ):
            return None
        self.at += row.itemsize * element.rows
        return {p.name: table[p.name] for p in element.properties}


def _rows(take: Take, element: _Element, path: Path) -> dict[str, list[Any]]:
    columns: dict[str, list[Any]] = {p.name: [] for p in element.properties}
    for _ in range(element.rows if element.properties else 0):
        for p in element.properties:
            size = 1 if p.count is None else int(take(p.count, 1)[0])
            values = take(p.type, size)
            if len(values) != size:
                raise AssemblyError(f"Expected {element.rows} rows of {element.name} in {path}; one is cut off.")
            columns[p.name].append(values if p.count is not None else values[0])
    return columns
