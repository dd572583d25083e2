"""glTF 2.0 and GLB: a part for each node that bears a mesh, named after the node. Lengths are metres.

Read here, field by field, because a scene decides which files are opened and how much memory is asked for; trimesh
takes cut-off, compressed and circular scenes for whole ones, and loses instances and sparse arrays. What only looks
(materials, cameras, animations) is passed over.

glTF says that y is up. Files that trimesh wrote hold coordinates as they were, mostly with z up, and say so by their
`generator`; theirs are taken as they are, all others are turned so that z is up.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from neurosym.errors import AssemblyError
from neurosym.geometry.notes import Note
from neurosym.geometry.readers import limits
from neurosym.geometry.readers.contents import FLOAT32, Y_UP, Contents, RawMesh, united
from neurosym.support.arrays import Array, Numbers
from neurosym.support.documents import MAX_BYTES, too_large

Piece = tuple[Array, Numbers]

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6

#: Extensions that change nothing of the shape, by their beginning, and two that are understood.
_HARMLESS = ("KHR_materials", "KHR_texture", "KHR_lights", "KHR_xmp", "EXT_texture")
_UNDERSTOOD = (*_HARMLESS, "KHR_mesh_quantization", "EXT_mesh_gpu_instancing")


def read_gltf(path: Path, *, up: str | None = None) -> Contents:
    """The parts of a scene. `up`: "y" or "z", what is up in the file; None: see above."""
    with limits.reading("glTF 2.0", path):
        scene = open_gltf(limits.read_bytes(path), path)
        up = up or ("z" if "trimesh" in str(scene.tree["asset"].get("generator", "")) else "y")
        sentence = "y is up, as glTF has it: turned so that z is" if up == "y" else "z is taken to be up, unturned"
        note = Note("", "axes", 0.0, f"{path.name}: {sentence}.", "Load it with up='z' or up='y' if that is wrong.")
        parts = scene.parts(Y_UP if up == "y" else np.eye(4))
        return Contents(tuple(parts), "m", notes=(note, *scene.notes))


def open_gltf(data: bytes, path: Path) -> Scene:
    """The scene in the bytes of a file; `path` says where its buffers lie, and names it."""
    with limits.reading("glTF 2.0", path):
        text, binary = _chunks(data, path) if data.startswith(b"glTF") else (data, None)
        if len(text) > limits.MAX_TEXT_BYTES:
            raise AssemblyError(too_large(path, limits.MAX_TEXT_BYTES))
        return Scene(json.loads(text.decode("utf-8")), binary, path)


def _chunks(data: bytes, path: Path) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a GLB file."""
    version, length = (int(n) for n in np.frombuffer(data, "<u4", 2, 4))
    if version != 2 or length > len(data):
        raise AssemblyError(
            f"Expected GLB of version 2 and of {length:,} bytes in {path}; got version {version}, {len(data):,} bytes."
        )
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = int(np.frombuffer(data, "<u4", 1, at)[0]), data[at + 4 : at + 8]
        if at + 8 + size > length:
            raise AssemblyError(f"Expected whole chunks in {path}; one is cut off. Export it again.")
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    return chunks[b"JSON"], chunks.get(b"BIN\0")


class Scene:
    """A parsed file: its JSON (`tree`), its buffers as they are asked for, and what was passed over (`notes`)."""

    def __init__(self, tree: Mapping[str, Any], binary: bytes | None, path: Path) -> None:
        self.tree, self.binary, self.path = tree, binary, path
        self.notes: list[Note] = []
        if not str(tree["asset"]["version"]).startswith("2."):
            raise AssemblyError(f"Expected glTF 2.0 in {path}; got version {tree['asset']['version']}.")
        needed = [e for e in tree.get("extensionsRequired", []) if not str(e).startswith(_UNDERSTOOD)]
        if needed:
            raise AssemblyError(f"Expected glTF without extensions in {path}; it needs {needed[0]}. Export it without.")
        self._buffers: dict[int, bytes] = {}
        self._meshes: dict[int, list[Piece]] = {}

    def parts(self, root: Array) -> list[RawMesh]:
        """All nodes of the scene that bear a mesh, in the order of the tree."""
        tree, nodes = self.tree, self.tree.get("nodes", [])
        if "scenes" in tree:
            roots = tree["scenes"][tree.get("scene", 0)].get("nodes", [])
        else:
            children = {child for node in nodes for child in node.get("children", [])}
            roots = [i for i in range(len(nodes)) if i not in children]
        parts: list[RawMesh] = []
        total, seen = 0, set()
        stack: list[tuple[int, Array, tuple[tuple[int, str], ...]]] = [(i, root, ()) for i in reversed(roots)]
        while stack:
            i, X, within = stack.pop()
            if i in seen or not 0 <= i < len(nodes):
                raise AssemblyError(f"Expected a tree of nodes in {self.path}; node {i} is missing, or is met twice.")
            seen.add(i)
            node = nodes[i]
            X = X @ _motion(node)
            below = (*within, (i, str(node.get("name") or "")))
            stack += [(child, X, below) for child in reversed(node.get("children", []))]
            if "mesh" not in node:
                continue
            pieces = self._mesh(node["mesh"])
            if not pieces:
                continue
            mesh = united(str(node.get("name") or self.tree["meshes"][node["mesh"]].get("name") or ""), pieces, FLOAT32)
            for Y in self._instances(node):
                total += len(mesh.faces)
                limits.within_limits(self.path, len(mesh.faces), total, len(parts) + 1)
                place = X @ Y
                # A mirrored copy has its faces inside out.
                faces = mesh.faces if np.linalg.det(place[:3, :3]) > 0 else mesh.faces[:, ::-1]
                vertices = mesh.vertices @ place[:3, :3].T + place[:3, 3]
                parts.append(RawMesh(mesh.name, vertices, faces, FLOAT32, within=within))
        return parts

    def _instances(self, node: Mapping[str, Any]) -> Iterable[Array]:
        """Where the mesh of a node is put, in the node's frame: once, or as often as EXT_mesh_gpu_instancing says."""
        given = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {"attributes": {}})["attributes"]
        names = [name for name in ("TRANSLATION", "ROTATION", "SCALE") if name in given]
        rows = zip(*(self._accessor(given[name]) for name in names), strict=True)
        return (_motion(dict(zip(map(str.lower, names), row))) for row in rows) if names else [np.eye(4)]

    def _mesh(self, number: int) -> list[Piece]:
        """The pieces of a mesh that are made of triangles."""
        if number not in self._meshes:
            mesh = self.tree["meshes"][number]
            pieces, others = [], 0
            for primitive in mesh["primitives"]:
                if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
                    raise AssemblyError(f"Expected plain glTF in {self.path}; it is Draco-compressed. Export it plain.")
                if primitive.get("mode", _TRIANGLES) in (_TRIANGLES, _STRIP, _FAN):
                    pieces.append(self._piece(primitive))
                else:
                    others += 1
            if others:
                name = mesh.get("name", number)
                sentence = f"{self.path.name}: {others} sets of points or lines in the mesh {name!r} were left out."
                self.notes.append(Note("", "skipped", others, sentence))
            self._meshes[number] = pieces
        return self._meshes[number]

    def _piece(self, primitive: Mapping[str, Any]) -> Piece:
        vertices = self._accessor(primitive["attributes"]["POSITION"]).astype(np.float64)
        if vertices.shape[1] != 3:
            raise AssemblyError(f"Expected positions of three numbers in {self.path}; got {vertices.shape[1]}.")
        flat = np.arange(len(vertices))
        if "indices" in primitive:
            flat = self._accessor(primitive["indices"]).astype(np.int64).ravel()
        mode = primitive.get("mode", _TRIANGLES)
        if mode == _TRIANGLES:
            if len(flat) % 3:
                raise AssemblyError(f"Expected triangles in {self.path}; {len(flat)} corners are not three each.")
            faces = flat.reshape(-1, 3)
        elif mode == _STRIP:
            faces = np.stack([flat[:-2], flat[1:-1], flat[2:]], axis=1)
            faces[1::2] = faces[1::2, ::-1]
        else:
            faces = np.stack([np.repeat(flat[:1], max(len(flat) - 2, 0)), flat[1:-1], flat[2:]], axis=1)
        if len(faces) and faces.max() >= len(vertices):
            raise AssemblyError(f"Expected faces in {self.path} that index {len(vertices)} vertices; one goes beyond.")
        return vertices, faces.astype(np.int64)

    def _accessor(self, number: int) -> NDArray[Any]:
        """An array (count, width), floats where whole numbers stand for shares of one."""
        accessor = self.tree["accessors"][number]
        kind, width = np.dtype(_COMPONENTS[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        count = accessor["count"]
        most = 3 * limits.MAX_FACES
        if not isinstance(count, int) or not 0 <= count <= most:
            raise AssemblyError(f"Expected at most {most:,} elements an array in {self.path}; got {count!r}.")
        if "bufferView" in accessor:
            values = self._view(accessor["bufferView"], accessor.get("byteOffset", 0), kind, width, count)
        else:
            values = np.zeros((count, width), kind)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            n, at = sparse["count"], sparse["indices"]
            whole = np.dtype(_COMPONENTS[at["componentType"]])
            where = self._view(at["bufferView"], at.get("byteOffset", 0), whole, 1, n)
            by = sparse["values"]
            new = self._view(by["bufferView"], by.get("byteOffset", 0), kind, width, n)
            values = values.copy()
            values[where.ravel()] = new
        if accessor.get("normalized") and kind.kind in "iu":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def _view(self, number: int, offset: int, kind: np.dtype[Any], width: int, count: int) -> NDArray[Any]:
        view = self.tree["bufferViews"][number]
        if "EXT_meshopt_compression" in view.get("extensions", {}):
            raise AssemblyError(f"Expected plain glTF in {self.path}; it is meshopt-compressed. Export it without.")
        start, size = view.get("byteOffset", 0), view["byteLength"]
        stride, row = view.get("byteStride", kind.itemsize * width), kind.itemsize * width
        buffer = self._buffer(view["buffer"])
        needed = offset + stride * (count - 1) + row if count else 0
        if min(start, size, offset, count) < 0 or stride < row or needed > size or start + size > len(buffer):
            raise AssemblyError(f"Expected buffers in {self.path} as long as its views say; view {number} goes beyond.")
        raw = np.frombuffer(buffer, "u1", needed, start)[offset:]
        rows = np.lib.stride_tricks.as_strided(raw, (count, row), (stride, 1)) if count else raw.reshape(0, row)
        return np.ascontiguousarray(rows).view(kind).reshape(count, width)

    def _buffer(self, number: int) -> bytes:
        if number not in self._buffers:
            self._buffers[number] = self._fetch(self.tree["buffers"][number].get("uri"))
            if sum(map(len, self._buffers.values())) > MAX_BYTES:
                raise AssemblyError(too_large(self.path, MAX_BYTES))
        return self._buffers[number]

    def _fetch(self, uri: str | None) -> bytes:
        if uri is None:
            if self.binary is None:
                raise AssemblyError(f"Expected a binary chunk in {self.path}; it has none. Export it again.")
            return self.binary
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2], validate=True)
        return limits.read_bytes(limits.inside(self.path.parent, unquote(uri)))


def _motion(node: Mapping[str, Any]) -> Array:
    """The transform of a node, float64 (4, 4): its matrix, or its scale, then its rotation, then its translation."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    X = np.eye(4)
    X[:3, :3] = Rotation.from_quat(np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)).as_matrix()
    X[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)
    X[:3, 3] = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    return X
