"""PLY, text or binary: vertices and polygons. Colours, normals and other elements are passed over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
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
    """One mesh.

    Raises:
        AssemblyError: it is no PLY, is cut off, or has no polygons.
    """
    data = read_bytes(path)
    with reading("PLY", path):
        head, body = _header(data, path)
        order, elements = _elements(head, path)
        for element in elements:
            if element.properties and element.rows > len(body):
                raise AssemblyError(f"Expected {element.rows:,} rows of {element.name} in {path}; it is too short.")
        read = _text_rows if order is None else _binary_rows
        vertices, polygons, rounding = None, None, FLOAT64
        for element, columns in read(body, elements, order or "<", path):
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


Rows = Iterator[tuple[_Element, dict[str, Any]]]


def _text_rows(body: bytes, elements: list[_Element], order: str, path: Path) -> Rows:
    lines = iter(body.decode("ascii", errors="replace").splitlines())
    for element in elements:
        columns: dict[str, list[Any]] = {p.name: [] for p in element.properties}
        for _ in range(element.rows if element.properties else 0):
            words = next(lines, "").split()
            at = 0
            for p in element.properties:
                size = 1 if p.count is None else int(words[at])
                at += p.count is not None
                found = words[at : at + size]
                if len(found) != size:
                    raise AssemblyError(f"Expected {element.rows} rows of {element.name} in {path}; one is cut off.")
                columns[p.name].append(float(found[0]) if p.count is None else [int(w) for w in found])
                at += size
        yield element, columns


def _binary_rows(body: bytes, elements: list[_Element], order: str, path: Path) -> Rows:
    at = 0
    for element in elements:
        if not element.rows or not element.properties:
            yield element, {p.name: [] for p in element.properties}
            continue
        row = _first_row(body, at, element, order)
        table = None
        if at + row.itemsize * element.rows <= len(body):
            # As if all lists were as long as the first: so it is where all faces are triangles.
            table = np.frombuffer(body, row, element.rows, at)
            if any((table[n] != table[n][0]).any() for n in row.names or () if n.startswith("#")):
                table = None
        if table is not None:
            at += row.itemsize * element.rows
            yield element, {p.name: table[p.name] for p in element.properties}
        else:
            columns, at = _row_by_row(body, at, element, order)
            yield element, columns


def _first_row(body: bytes, at: int, element: _Element, order: str) -> np.dtype[Any]:
    fields: list[Any] = []
    for p in element.properties:
        if p.count is None:
            fields.append((p.name, order + p.type))
            continue
        size = int(np.frombuffer(body, order + p.count, 1, at + np.dtype(fields).itemsize)[0])
        fields += [("#" + p.name, order + p.count), (p.name, order + p.type, (size,))]
    return np.dtype(fields)


def _row_by_row(body: bytes, at: int, element: _Element, order: str) -> tuple[dict[str, list[NDArray[Any]]], int]:
    columns: dict[str, list[NDArray[Any]]] = {p.name: [] for p in element.properties}
    for _ in range(element.rows):
        for p in element.properties:
            size = 1
            if p.count is not None:
                size = int(np.frombuffer(body, order + p.count, 1, at)[0])
                at += np.dtype(p.count).itemsize
            values = np.frombuffer(body, order + p.type, size, at)
            columns[p.name].append(values if p.count is not None else values[0])
            at += values.nbytes
    return columns, at
