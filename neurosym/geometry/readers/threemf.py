"""3MF: a zip of XML. A part for each mesh placed by the build, named after its object; the unit is stated.

Read here because trimesh would need lxml, and would unpack and resolve whatever the file asks for.
"""

from __future__ import annotations

import io
import posixpath
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from defusedxml.ElementTree import iterparse

from neurosym.errors import AssemblyError
from neurosym.geometry.notes import Note
from neurosym.geometry.readers.contents import Contents, RawMesh
from neurosym.geometry.readers.limits import MAX_TEXT_BYTES, limited, read_bytes, reading, within_limits
from neurosym.support.arrays import Array

#: Objects within objects may be this deep.
MAX_DEPTH = 32

#: Types of objects that are parts; others hold parts up while they are printed, or are surfaces.
_PARTS = ("model", "solidsupport")

_RELATIONS, _MODEL = "_rels/.rels", "3D/3dmodel.model"


@dataclass
class _Object:
    """An object: a mesh, or other objects at poses. ``components``: (model, id, transform)."""

    name: str
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    faces: list[tuple[int, int, int]] = field(default_factory=list)
    components: list[tuple[str, str, Array]] = field(default_factory=list)
    kind: str = "model"


@dataclass
class _Model:
    unit: str = "millimeter"
    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[tuple[str, str, Array, str]] = field(default_factory=list)


def read_3mf(path: Path) -> Contents:
    """The meshes that the build places, copies by component included."""
    data = read_bytes(path)
    with reading("3MF", path), zipfile.ZipFile(io.BytesIO(data)) as archive:
        models: dict[str, _Model] = {}
        main = _root(archive, path)
        root = _model(archive, main, models, path)
        parts: list[RawMesh] = []
        left: list[str] = []
        total = 0
        # (model, object, transform, name, what it is a component of), the last on top.
        above: tuple[tuple[int, str], ...] = ()
        stack = [(m or main, i, X, name, above) for m, i, X, name in reversed(root.items)]
        taken = 0
        while stack:
            model, number, X, name, above = stack.pop()
            thing = _model(archive, model, models, path).objects[number]
            if len(above) > MAX_DEPTH:
                raise AssemblyError(f"Expected objects at most {MAX_DEPTH} deep in {path}; they go on, or in a circle.")
            name = thing.name or name
            if thing.kind not in _PARTS:
                left.append(f"{name or number!r} ({thing.kind})")
                continue
            below = (*above, (taken := taken + 1, name))
            stack += [(m or model, i, X @ Y, name, below) for m, i, Y in reversed(thing.components)]
            within_limits(path, len(thing.faces), total, len(parts) + len(stack))
            if thing.components:
                continue
            total += len(thing.faces)
            vertices = np.array(thing.vertices, dtype=np.float64).reshape(-1, 3) @ X[:3, :3].T + X[:3, 3]
            faces = np.array(thing.faces, dtype=np.int64).reshape(-1, 3)
            faces = faces if np.linalg.det(X[:3, :3]) > 0 else faces[:, ::-1]
            parts.append(RawMesh(name or f"object-{number}", vertices, faces, within=above))
        sentence = f"{path.name}: {len(left)} objects that are no parts were left out: {', '.join(left[:5])}."
        return Contents(tuple(parts), root.unit, notes=(Note("", "skipped", len(left), sentence),) if left else ())


def _root(archive: zipfile.ZipFile, path: Path) -> str:
    """The path, in the archive, of the model that the package points to."""
    if _RELATIONS in archive.namelist():
        for _, element in iterparse(io.BytesIO(_unpack(archive, _RELATIONS, path)), forbid_dtd=True):
            if element.get("Type", "").endswith("/3dmodel"):
                return str(element.get("Target", _MODEL)).lstrip("/")
    return _MODEL


def _unpack(archive: zipfile.ZipFile, name: str, path: Path) -> bytes:
    with archive.open(name) as file:
        return limited(file, path, MAX_TEXT_BYTES)


def _model(archive: zipfile.ZipFile, name: str, known: dict[str, _Model], path: Path) -> _Model:
    """A model of the archive, read once."""
    if name in known:
        return known[name]
    model = known[name] = _Model()
    thing = _Object("")
    for event, element in iterparse(io.BytesIO(_unpack(archive, name, path)), ("start", "end"), forbid_dtd=True):
        tag = element.tag.rpartition("}")[2]
        if event == "start":
            if tag == "model":
                model.unit = element.get("unit", "millimeter")
            elif tag == "object":
                thing = model.objects[element.attrib["id"]] = _Object(element.get("name", ""))
                thing.kind = element.get("type", "model")
            continue
        if tag == "vertex":
            thing.vertices.append((float(element.attrib["x"]), float(element.attrib["y"]), float(element.attrib["z"])))
        elif tag == "triangle":
            thing.faces.append((int(element.attrib["v1"]), int(element.attrib["v2"]), int(element.attrib["v3"])))
        elif tag in ("component", "item"):
            # Of the production extension: the object may lie in another model of the same archive.
            elsewhere = next((v for k, v in element.attrib.items() if k.rpartition("}")[2] == "path"), "")
            where = posixpath.normpath(elsewhere).lstrip("/") if elsewhere else ""
            number, X = element.attrib["objectid"], _transform(element.get("transform"))
            if tag == "component":
                thing.components.append((where, number, X))
            else:
                model.items.append((where, number, X, element.get("partnumber", "")))
        # What was read is let go, so that memory follows the numbers, not the text.
        element.clear()
    return model


def _transform(text: str | None) -> Array:
    """Twelve numbers, the rows of a matrix that row vectors are multiplied by, as a transform (4, 4)."""
    X = np.eye(4)
    if text is not None:
        rows = np.array([float(w) for w in text.split()]).reshape(4, 3)
        X[:3] = rows.T
    return X
