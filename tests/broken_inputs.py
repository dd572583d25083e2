"""Broken inputs, each made by a few lines and with the words that its error has to say.

python tests/broken_inputs.py FOLDER     writes them all, one folder a case, to be looked at or loaded by hand.
"""

from __future__ import annotations

import base64
import gzip
import json
import os
import struct
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from step_files import step_bolted, step_boxes

Mesh = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Case:
    """``make`` writes it into an empty folder and gives the path to load; ``says`` is part of the message."""

    make: Callable[[Path], Path]
    says: str


CASES: dict[str, Case] = {}


def case(says: str) -> Callable[[Callable[[Path], Path]], Callable[[Path], Path]]:
    def declare(make: Callable[[Path], Path]) -> Callable[[Path], Path]:
        CASES[make.__name__.replace("_", "-")] = Case(make, says)
        return make

    return declare


# -- what they are made of ------------------------------------------------------------------------------------


def box(size: Any = (1, 1, 1), at: Any = (0, 0, 0)) -> Mesh:
    made = trimesh.creation.box(size)
    return np.array(made.vertices) + at, np.array(made.faces)


def obj(mesh: Mesh) -> str:
    vertices, faces = mesh
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist())]) + "\n"


def write(path: Path, content: str | bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def folder_of(folder: Path, **parts: Mesh) -> Path:
    for name, mesh in parts.items():
        write(folder / f"{name}.obj", obj(mesh))
    return folder


def own(folder: Path, **changed: Any) -> Path:
    """The library's JSON, with some of it changed; a value of None takes the entry away."""
    document = {
        "format": "neurosym-assembly",
        "schema": 1,
        "parts": [{"name": "a", "cells": [[0, 0, 0]]}, {"name": "b", "cells": [[1, 0, 0]]}],
    }
    document.update(changed)
    return write(folder / "a.json", json.dumps({k: v for k, v in document.items() if v is not None}))


def part(folder: Path, **fields: Any) -> Path:
    """The library's JSON with one part."""
    return own(folder, parts=[{"name": "a", **fields}])


def gltf(changed: Callable[[dict[str, Any]], None] = lambda tree: None) -> dict[str, Any]:
    """A box as glTF with its buffer inside, changed."""
    vertices, faces = box()
    data = vertices.astype("<f4").tobytes() + faces.astype("<u2").tobytes()
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "a", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "buffers": [
            {"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}
        ],
    }
    changed(tree)
    return tree


def glb(tree: dict[str, Any], binary: bytes = b"") -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def changed_gltf(folder: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    return write(folder / "a.gltf", json.dumps(gltf(change)))


def model_3mf(resources: str, build: str) -> str:
    return (
        '<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


def object_3mf(number: int = 1, mesh: Mesh | None = None) -> str:
    vertices, faces = box() if mesh is None else mesh
    corners = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in vertices.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces.tolist())
    inside = f"<mesh><vertices>{corners}</vertices><triangles>{triangles}</triangles></mesh>"
    return f'<object id="{number}" name="box {number}">{inside}</object>'


def zipped(folder: Path, model: str | bytes, name: str = "3D/3dmodel.model") -> Path:
    with zipfile.ZipFile(folder / "a.3mf", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, model)
    return folder / "a.3mf"


PUZZLE = """<?xml version="1.0"?><puzzle version="2"><gridType type="{grid}"/><shapes>
<voxel x="2" y="1" z="1" type="0">{cells}</voxel></shapes><problems><problem state="2">
<shapes><shape id="0" count="2"/></shapes><result id="0"/>
<solutions>{solution}</solutions></problem></problems></puzzle>"""


def puzzle(folder: Path, grid: str = "0", cells: str = "##", placed: str | None = "0 0 0 0 0 1 0 0") -> Path:
    solution = "" if placed is None else f"<solution><assembly>{placed}</assembly></solution>"
    text = PUZZLE.format(grid=grid, cells=cells, solution=solution)
    return write(folder / "a.xmpuzzle", gzip.compress(text.encode()))


def robot(*more: str, shape: str = '<box size="1 1 1"/>') -> str:
    """URDF of a base, and on it an arm; `more` is what else the robot has."""
    base, arm = (f"<visual><geometry>{one}</geometry></visual>" for one in (shape, '<sphere radius="0.5"/>'))
    links = f'<link name="base">{base}</link><link name="arm">{arm}</link>'
    joint = '<joint name="j" type="revolute"><origin xyz="0 0 1"/><parent link="base"/><child link="arm"/></joint>'
    return f'<robot name="r">{links}{joint}{"".join(more)}</robot>'


def urdf(folder: Path, *more: str, shape: str = '<box size="1 1 1"/>') -> Path:
    return write(folder / "a.urdf", robot(*more, shape=shape))


# -- paths and folders ----------------------------------------------------------------------------------------


@case("there is none at")
def nothing_there(folder: Path) -> Path:
    return folder / "nothing.glb"


@case("got none")
def empty_folder(folder: Path) -> Path:
    return folder


@case("a file that ends in")
def unknown_ending(folder: Path) -> Path:
    return write(folder / "a.docx", "text")


@case("Expected")
def name_with_null(folder: Path) -> Path:
    return folder / "a\0b"


@case("lies outside")
def link_outside(folder: Path) -> Path:
    write(folder / "elsewhere.obj", obj(box()))
    (folder / "in").mkdir()
    (folder / "in" / "a.obj").symlink_to(folder / "elsewhere.obj")
    return folder / "in"


@case("is no path")
def link_to_itself(folder: Path) -> Path:
    (folder / "a.obj").symlink_to(folder / "a.obj")
    return folder


@case("regular file")
def pipe_for_a_mesh(folder: Path) -> Path:
    os.mkfifo(folder / "a.obj")
    return folder


@case("regular file")
def folder_for_a_mesh(folder: Path) -> Path:
    (folder / "a.obj").mkdir()
    return folder


@case("supports.json")
def supports_no_json(folder: Path) -> Path:
    write(folder / "supports.json", "{fixed")
    return folder_of(folder, a=box())


@case("supports.json")
def supports_without_names(folder: Path) -> Path:
    write(folder / "supports.json", '{"fixed": [1, 2]}')
    return folder_of(folder, a=box())


@case("Did you mean 'arch'")
def supports_with_another_name(folder: Path) -> Path:
    write(folder / "supports.json", '{"fixed": ["arhc"]}')
    return folder_of(folder, arch=box())


# -- meshes that cannot be used -------------------------------------------------------------------------------


@case("is open: 3 edges")
def open_mesh(folder: Path) -> Path:
    vertices, faces = box()
    return folder_of(folder, a=(vertices, faces[1:]))


@case("is open")
def one_triangle(folder: Path) -> Path:
    return folder_of(folder, a=(np.eye(3), np.array([[0, 1, 2]])))


@case("encloses nothing")
def sheet_with_two_sides(folder: Path) -> Path:
    return folder_of(folder, a=(np.eye(3), np.array([[0, 1, 2], [2, 1, 0]])))


@case("no volume")
def flat_solid(folder: Path) -> Path:
    vertices, faces = box()
    return folder_of(folder, a=(vertices * [1, 1, 0], faces))


@case("one-sided")
def moebius_strip(folder: Path) -> Path:
    n = 12
    turn, half = 2 * np.pi * np.arange(n) / n, np.pi * np.arange(n) / n
    wide = [2 + s * np.cos(half) for s in (-0.5, 0.5)]
    sides = [
        np.stack([r * np.cos(turn), r * np.sin(turn), s * np.sin(half)], axis=1) for r, s in zip(wide, (-0.5, 0.5))
    ]
    faces = []
    for i in range(n):
        a, b = i, n + i
        c, d = (i + 1, n + i + 1) if i + 1 < n else (n, 0)
        faces += [[a, b, c], [c, b, d]]
    return folder_of(folder, a=_closed_moebius(np.concatenate(sides), np.array(faces)))


def _closed_moebius(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """The strip with its rim drawn together in one point: every edge has two faces, and there is one side only."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    rim, count = np.unique(edges, axis=0, return_counts=True)
    cap = [[a, b, len(vertices)] for a, b in rim[count == 1]]
    return np.concatenate([vertices, [[0.0, 0.0, 3.0]]]), np.concatenate([faces, cap])


@case("crosses itself")
def crossing_itself(folder: Path) -> Path:
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices = np.array(ball.vertices)
    vertices[0] *= -3
    return folder_of(folder, a=(vertices, np.array(ball.faces)))


@case("NaN")
def nan_in_a_mesh(folder: Path) -> Path:
    vertices, faces = box()
    vertices[3, 1] = np.nan
    return folder_of(folder, a=(vertices, faces))


@case("NaN or infinite")
def infinity_in_a_mesh(folder: Path) -> Path:
    vertices, faces = box()
    vertices[3, 1] = np.inf
    return folder_of(folder, a=(vertices, faces))


@case("from the origin")
def far_from_the_origin(folder: Path) -> Path:
    return folder_of(folder, a=box(at=(1e14, 0, 0)))


@case("from the origin")
def far_in_32_bits(folder: Path) -> Path:
    vertices, faces = box(at=(1e5, 0, 0))
    made = trimesh.Trimesh(vertices, faces, process=False)
    return write(folder / "a.stl", made.export(file_type="stl"))


@case("1e-09 to 1e+09")
def too_large_to_measure(folder: Path) -> Path:
    vertices, faces = box()
    return folder_of(folder, a=(vertices * 1e200, faces))


@case("1e-09 to 1e+09")
def too_small_to_measure(folder: Path) -> Path:
    vertices, faces = box()
    return folder_of(folder, a=(vertices * 1e-200, faces))


@case("'a' and 'b' overlap by 0.5")
def deep_overlap(folder: Path) -> Path:
    return folder_of(folder, a=box(), b=box(at=(0.5, 0, 0)))


@case("'a' and 'b' are the same solid in the same place")
def the_same_part_twice(folder: Path) -> Path:
    return folder_of(folder, a=box(), b=box())


@case("leave 3 edges open")
def both_sides_of_an_open_mesh(folder: Path) -> Path:
    vertices, faces = box()
    return folder_of(folder, a=(vertices, np.concatenate([faces[1:], faces[1:, ::-1], faces[2:]])))


@case("is open: 3 edges")
def groups_of_which_one_is_open(folder: Path) -> Path:
    vertices, faces = box(at=(3, 0, 0))
    more = obj((vertices, faces[1:] + 8)).replace("f", "g lid\nf", 1)
    return write(folder / "a.obj", obj(box()).replace("f", "g box\nf", 1) + more)


@case("'a-1' and 'a-2' overlap by 0.5")
def shells_that_overlap(folder: Path) -> Path:
    (v, f), (w, g) = box(), box(at=(0.5, 0, 0))
    return write(folder / "a.obj", obj((np.concatenate([v, w]), np.concatenate([f, g + 8]))))


@case("'a-1' and 'a-2' are the same solid in the same place")
def the_same_shell_twice(folder: Path) -> Path:
    (v, f), (w, g) = box(), box()
    made = trimesh.Trimesh(np.concatenate([v, w + 1e-5]), np.concatenate([f, g + 8]), process=False)
    return write(folder / "a.stl", made.export(file_type="stl"))


@case("3 faults in 4 parts")
def several_faults(folder: Path) -> Path:
    vertices, faces = box(at=(9, 0, 0))
    bad = {"c": (vertices, faces[2:]), "d": (vertices + 9, faces * 0)}
    return folder_of(folder, a=box(), b=box(at=(0.5, 0, 0)), e=box(at=(0, 0, 1)), **bad)


# -- OBJ, OFF, STL, PLY ---------------------------------------------------------------------------------------


@case("is empty")
def empty_obj(folder: Path) -> Path:
    return write(folder / "a.obj", "").parent


@case("line 1")
def obj_with_words_for_numbers(folder: Path) -> Path:
    return write(folder / "a.obj", "v one two three\n").parent


@case("line 2")
def obj_with_two_coordinates(folder: Path) -> Path:
    return write(folder / "a.obj", "v 0 0 0\nv 1 2\n").parent


@case("goes beyond")
def obj_face_beyond(folder: Path) -> Path:
    return write(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").parent


@case("line 4")
def obj_face_number_zero(folder: Path) -> Path:
    return write(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n").parent


@case("line 1")
def obj_with_a_huge_number(folder: Path) -> Path:
    return write(folder / "a.obj", f"f 1 2 {'9' * 400}\n").parent


@case("is empty")
def obj_of_bytes(folder: Path) -> Path:
    return write(folder / "a.obj", bytes(range(256)) * 40).parent


@case("OFF")
def off_without_its_word(folder: Path) -> Path:
    return write(folder / "a.off", "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").parent


@case("lines after them")
def off_cut_off(folder: Path) -> Path:
    return write(folder / "a.off", "OFF\n8 12 0\n0 0 0\n").parent


@case("lines after them")
def off_with_huge_counts(folder: Path) -> Path:
    return write(folder / "a.off", "OFF\n999999999999 999999999999 0\n0 0 0\n").parent


@case("three or more of 3 vertices")
def off_face_beyond(folder: Path) -> Path:
    return write(folder / "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n").parent


@case("may be cut off")
def stl_cut_off(folder: Path) -> Path:
    data = trimesh.creation.box().export(file_type="stl")
    return write(folder / "a.stl", data[:-30]).parent


@case("is empty")
def stl_without_faces(folder: Path) -> Path:
    return write(folder / "a.stl", bytes(84)).parent


@case("may be cut off")
def stl_of_text_cut_off(folder: Path) -> Path:
    return write(folder / "a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n").parent


@case("may be cut off")
def stl_of_two_solids_cut_off(folder: Path) -> Path:
    text = trimesh.creation.box().export(file_type="stl_ascii")
    return write(folder / "a.stl", text + "\n" + text[: text.rindex("outer")]).parent


@case("three corners a facet")
def stl_with_two_corners(folder: Path) -> Path:
    text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid a\n"
    return write(folder / "a.stl", text).parent


@case("may be cut off")
def stl_with_a_huge_count(folder: Path) -> Path:
    return write(folder / "a.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)).parent


PLY = "ply\nformat {kind} 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\n" + (
    "element face {m}\nproperty list uchar int vertex_indices\nend_header\n"
)


@case("the word ply first")
def ply_without_its_word(folder: Path) -> Path:
    return write(folder / "a.ply", "plx\nend_header\n").parent


@case("end_header")
def ply_without_end(folder: Path) -> Path:
    return write(folder / "a.ply", "ply\nformat ascii 1.0\n").parent


@case("too short")
def ply_with_huge_counts(folder: Path) -> Path:
    return write(folder / "a.ply", PLY.format(kind="binary_little_endian", n=10**12, m=10**12)).parent


@case("PLY")
def ply_of_an_unknown_kind(folder: Path) -> Path:
    return write(folder / "a.ply", PLY.format(kind="morse", n=0, m=0)).parent


@case("cut off")
def ply_cut_off(folder: Path) -> Path:
    return write(folder / "a.ply", PLY.format(kind="ascii", n=3, m=1) + "0 0 0\n1 0 0\n0 1\n").parent


@case("PLY")
def ply_with_a_list_beyond(folder: Path) -> Path:
    body = np.zeros(9, "<f4").tobytes() + b"\xff" + struct.pack("<iii", 0, 1, 2)
    return write(folder / "a.ply", PLY.format(kind="binary_little_endian", n=3, m=1).encode() + body).parent


@case("some are missing")
def ply_of_points(folder: Path) -> Path:
    head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    return write(folder / "a.ply", head + "0 0 0\n").parent


# -- glTF -----------------------------------------------------------------------------------------------------


@case("glTF 2.0")
def glb_of_noise(folder: Path) -> Path:
    return write(folder / "a.glb", np.random.default_rng(0).bytes(4000))


@case("bytes")
def glb_cut_off(folder: Path) -> Path:
    return write(folder / "a.glb", glb(gltf())[:-100])


@case("version 1")
def glb_of_version_1(folder: Path) -> Path:
    return write(folder / "a.glb", struct.pack("<4sII", b"glTF", 1, 12))


@case("cut off")
def glb_with_a_chunk_beyond(folder: Path) -> Path:
    data = bytearray(glb(gltf()))
    data[12:16] = struct.pack("<I", 2**31)
    return write(folder / "a.glb", bytes(data))


@case("at least one part")
def gltf_of_nothing(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["scenes"][0].update(nodes=[]))


@case("lies outside")
def gltf_reaching_outside(folder: Path) -> Path:
    write(folder / "secret.bin", bytes(168))
    (folder / "in").mkdir()
    tree = gltf(lambda tree: tree["buffers"][0].update(uri="../secret.bin"))
    return write(folder / "in" / "a.gltf", json.dumps(tree))


@case("lies outside")
def gltf_reaching_outside_in_disguise(folder: Path) -> Path:
    write(folder / "secret.bin", bytes(168))
    tree = gltf(lambda tree: tree["buffers"][0].update(uri="x/%2e%2e/%2E%2E/secret.bin"))
    return write(folder / "in" / "a.gltf", json.dumps(tree))


@case("lies outside")
def gltf_reaching_for_a_system_file(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["buffers"][0].update(uri="/etc/hostname"))


@case("can be read")
def gltf_reaching_for_the_network(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["buffers"][0].update(uri="http://localhost:9/x.bin"))


@case("goes beyond")
def gltf_with_a_view_beyond(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["bufferViews"][0].update(byteOffset=10**9))


@case("goes beyond")
def gltf_with_a_negative_offset(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["bufferViews"][0].update(byteOffset=-8))


@case("elements an array")
def gltf_with_a_huge_count(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["accessors"].insert(0, {**tree["accessors"].pop(0), "count": 10**15}))


@case("a tree of nodes")
def gltf_with_nodes_in_a_circle(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["nodes"][0].update(children=[0]))


@case("Draco")
def gltf_with_draco(folder: Path) -> Path:
    compressed = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    return changed_gltf(folder, lambda tree: tree["meshes"][0]["primitives"][0].update(extensions=compressed))


@case("without extensions")
def gltf_that_needs_an_extension(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree.update(extensionsRequired=["EXT_meshopt_compression"]))


@case("glTF 2.0")
def gltf_with_uneven_instances(folder: Path) -> Path:
    given = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0, "SCALE": 2}}}

    def change(tree: dict[str, Any]) -> None:
        tree["accessors"].append({**tree["accessors"][0], "count": 3})
        tree["nodes"][0]["extensions"] = given

    return changed_gltf(folder, change)


@case("same solid in the same place")
def gltf_with_instances_in_one_place(folder: Path) -> Path:
    given = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}

    def change(tree: dict[str, Any]) -> None:
        tree["accessors"].append({"componentType": 5126, "count": 2, "type": "VEC3"})
        tree["nodes"][0]["extensions"] = given

    return changed_gltf(folder, change)


@case("parts")
def gltf_with_a_million_instances(folder: Path) -> Path:
    given = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}

    def change(tree: dict[str, Any]) -> None:
        tree["accessors"].append({"componentType": 5126, "count": 10**6, "type": "VEC3"})
        tree["nodes"][0]["extensions"] = given

    return changed_gltf(folder, change)


@case("index 8 vertices")
def gltf_face_beyond(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["accessors"][1].update(bufferView=0))


@case("1e-09 to 1e+09")
def gltf_with_an_infinite_node(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["nodes"][0].update(scale=[1e308] * 3, translation=[1e308] * 3))


@case("encloses no")
def gltf_squashed_by_its_node(folder: Path) -> Path:
    return changed_gltf(folder, lambda tree: tree["nodes"][0].update(scale=[1, 1, 0]))


@case("glTF 2.0")
def gltf_deep(folder: Path) -> Path:
    return write(folder / "a.gltf", '{"a":' * 100_000 + "1" + "}" * 100_000)


# -- 3MF ------------------------------------------------------------------------------------------------------


@case("3MF")
def no_zip(folder: Path) -> Path:
    return write(folder / "a.3mf", "text")


@case("3MF")
def zip_without_a_model(folder: Path) -> Path:
    return zipped(folder, "text", "readme.txt")


@case("at most")
def zip_bomb(folder: Path) -> Path:
    with (
        zipfile.ZipFile(folder / "a.3mf", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("3D/3dmodel.model", "w", force_zip64=True) as file,
    ):
        for _ in range(260):
            file.write(bytes(1 << 20))
    return folder / "a.3mf"


@case("3MF")
def xml_with_entities(folder: Path) -> Path:
    entities = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 12))
    return zipped(folder, f'<!DOCTYPE m [<!ENTITY e0 "ha">{entities}]><model>&e11;</model>')


@case("3MF")
def xml_that_reads_a_file(folder: Path) -> Path:
    return zipped(folder, '<!DOCTYPE m [<!ENTITY e SYSTEM "file:///etc/hostname">]><model>&e;</model>')


@case("in a circle")
def objects_in_a_circle(folder: Path) -> Path:
    turn = '<object id="1"><components><component objectid="1"/></components></object>'
    return zipped(folder, model_3mf(turn, '<item objectid="1"/>'))


@case("parts")
def objects_that_multiply(folder: Path) -> Path:
    # Each object holds the one before ten times: ten million boxes from two kilobytes.
    objects = [object_3mf(0)]
    for i in range(1, 8):
        inside = f'<component objectid="{i - 1}"/>' * 10
        objects.append(f'<object id="{i}"><components>{inside}</components></object>')
    return zipped(folder, model_3mf("".join(objects), '<item objectid="7"/>'))


@case("3MF")
def item_of_no_object(folder: Path) -> Path:
    return zipped(folder, model_3mf(object_3mf(), '<item objectid="5"/>'))


@case("at least one part")
def supports_only(folder: Path) -> Path:
    return zipped(
        folder, model_3mf(object_3mf().replace("<object ", '<object type="support" '), '<item objectid="1"/>')
    )


@case("unit")
def unknown_unit(folder: Path) -> Path:
    model = model_3mf(object_3mf(), '<item objectid="1"/>').replace("millimeter", "furlong")
    return zipped(folder, model)


@case("index more than its 8 vertices")
def model_face_beyond(folder: Path) -> Path:
    vertices, faces = box()
    return zipped(folder, model_3mf(object_3mf(1, (vertices, faces + 3)), '<item objectid="1"/>'))


# -- STEP -----------------------------------------------------------------------------------------------------


@case("STEP")
def step_of_text(folder: Path) -> Path:
    return write(folder / "a.step", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=BOX(#1);\nENDSEC;\nEND-ISO-10303-21;\n")


@case("STEP")
def step_of_noise(folder: Path) -> Path:
    return write(folder / "a.stp", np.random.default_rng(0).bytes(4000))


@case("STEP")
def step_cut_off(folder: Path) -> Path:
    whole = step_bolted()
    return write(folder / "a.step", whole[: len(whole) // 2])


@case("STEP")
def step_of_open_texts(folder: Path) -> Path:
    return write(folder / "a.step", "ISO-10303-21;\n" + "#1=PRODUCT('" * 20_000 + "''" * 20_000)


@case("STEP")
def step_with_faces_of_an_unknown_kind(folder: Path) -> Path:
    text = step_boxes({"a": ((0, 0, 0), (1, 1, 1))}, "in")
    return write(folder / "a.step", text.replace("ADVANCED_FACE", "UNKNOWN_FACE"))


# -- URDF -----------------------------------------------------------------------------------------------------


@case("URDF")
def urdf_of_text(folder: Path) -> Path:
    return write(folder / "a.urdf", "no robot")


@case("Run xacro first")
def urdf_of_something_else(folder: Path) -> Path:
    return write(folder / "a.urdf", '<sdf version="1.6"><model name="m"/></sdf>')


@case("URDF")
def urdf_with_entities(folder: Path) -> Path:
    return write(folder / "a.urdf", '<!DOCTYPE r [<!ENTITY e SYSTEM "file:///etc/hostname">]><robot>&e;</robot>')


@case("a tree of links")
def urdf_with_two_bases(folder: Path) -> Path:
    return urdf(folder, '<link name="lone"/>')


@case("hang on no base")
def urdf_in_a_circle(folder: Path) -> Path:
    joints = (
        f'<joint name="{a}{b}" type="fixed"><parent link="{a}"/><child link="{b}"/></joint>' for a, b in ("xy", "yx")
    )
    return urdf(folder, '<link name="x"/><link name="y"/>', *joints)


@case("a tree of links")
def urdf_joint_to_nowhere(folder: Path) -> Path:
    return urdf(folder, '<joint name="k" type="fixed"><parent link="arm"/><child link="hand"/></joint>')


@case("lies outside")
def urdf_reaching_outside(folder: Path) -> Path:
    write(folder / "secret.obj", obj(box()))
    return urdf(folder / "in", shape='<mesh filename="../secret.obj"/>')


@case("lies outside")
def urdf_package_reaching_outside(folder: Path) -> Path:
    write(folder / "secret.obj", obj(box()))
    return urdf(folder / "in", shape='<mesh filename="package://in/../../secret.obj"/>')


@case("lies outside")
def urdf_reaching_for_a_system_file(folder: Path) -> Path:
    return urdf(folder, shape='<mesh filename="file:///etc/hostname"/>')


@case("can be read")
def urdf_without_its_mesh(folder: Path) -> Path:
    return urdf(folder, shape='<mesh filename="package://r/gone.stl"/>')


@case("mesh format")
def urdf_with_a_mesh_of_another_format(folder: Path) -> Path:
    write(folder / "a.dae", "<COLLADA/>")
    return urdf(folder, shape='<mesh filename="a.dae"/>')


@case("'plane'")
def urdf_with_an_unknown_shape(folder: Path) -> Path:
    return urdf(folder, shape='<plane normal="0 0 1"/>')


@case("no volume")
def urdf_with_a_flat_box(folder: Path) -> Path:
    return urdf(folder, shape='<box size="1 1 0"/>')


@case("URDF")
def urdf_without_a_radius(folder: Path) -> Path:
    return urdf(folder, shape="<sphere/>")


@case("'base' and 'arm' overlap by")
def urdf_with_links_in_one_place(folder: Path) -> Path:
    return write(folder / "a.urdf", robot().replace('xyz="0 0 1"', 'xyz="0 0 0.2"'))


# -- BurrTools ------------------------------------------------------------------------------------------------


@case("BurrTools")
def puzzle_of_text(folder: Path) -> Path:
    return write(folder / "a.xmpuzzle", "no puzzle")


@case("gzip'd data")
def puzzle_cut_off(folder: Path) -> Path:
    whole = puzzle(folder).read_bytes()
    return write(folder / "a.xmpuzzle", whole[: len(whole) // 2])


@case("at most")
def gzip_bomb(folder: Path) -> Path:
    with gzip.open(folder / "a.xmpuzzle", "wb", compresslevel=1) as file:
        for _ in range(260):
            file.write(bytes(1 << 20))
    return folder / "a.xmpuzzle"


@case("BurrTools")
def puzzle_with_entities(folder: Path) -> Path:
    return write(folder / "a.xmpuzzle", '<!DOCTYPE p [<!ENTITY e "x">]><puzzle>&e;</puzzle>')


@case("cubic grid")
def puzzle_of_spheres(folder: Path) -> Path:
    return puzzle(folder, grid="3")


@case("store a solution")
def puzzle_unsolved(folder: Path) -> Path:
    return puzzle(folder, placed=None)


@case("2 cells of shape 0")
def puzzle_with_missing_cells(folder: Path) -> Path:
    return puzzle(folder, cells="#")


@case("orientations 0 to 23")
def puzzle_turned_oddly(folder: Path) -> Path:
    return puzzle(folder, placed="0 0 0 30 0 1 0 0")


@case("belongs to")
def puzzle_overlapping(folder: Path) -> Path:
    return puzzle(folder, placed="0 0 0 0 1 0 0 0")


@case("BurrTools")
def puzzle_with_few_placements(folder: Path) -> Path:
    return puzzle(folder, placed="0 0 0 0")


@case("'S1.1' and 'S1.2' are the same solid in the same place")
def puzzle_with_one_piece_twice(folder: Path) -> Path:
    return puzzle(folder, placed="0 0 0 0 0 0 0 0")


@case("BurrTools")
def puzzle_with_a_group_that_is_no_number(folder: Path) -> Path:
    text = gzip.decompress(puzzle(folder).read_bytes()).decode()
    return write(folder / "a.xmpuzzle", text.replace('count="2"', 'count="2" group="red"'))


@case("BurrTools")
def puzzle_with_a_group_that_is_none(folder: Path) -> Path:
    text = gzip.decompress(puzzle(folder).read_bytes()).decode()
    return write(folder / "a.xmpuzzle", text.replace('count="2"/>', 'count="2"><group count="1"/></shape>'))


# -- the library's JSON ---------------------------------------------------------------------------------------


@case("JSON")
def json_of_text(folder: Path) -> Path:
    return write(folder / "a.json", "not json")


@case("JSON")
def json_deep(folder: Path) -> Path:
    return write(folder / "a.json", "[" * 200_000)


@case("two parts or more")
def json_that_keeps_one_part_together(folder: Path) -> Path:
    return own(folder, keep=[["a"]])


@case("'a' comes twice")
def json_that_keeps_a_part_in_two_groups(folder: Path) -> Path:
    return own(folder, keep=[["a", "b"], ["b", "a"]])


@case("part or sub-assembly")
def json_that_keeps_what_is_not_there(folder: Path) -> Path:
    return own(folder, keep=[["a", "c"]])


@case("keep[0] is 'a'")
def json_that_keeps_no_groups(folder: Path) -> Path:
    return own(folder, keep=["a", "b"])


@case("part of a piece group")
def json_with_a_piece_group_of_others(folder: Path) -> Path:
    return own(folder, piece_groups=[["a", {"of": ["c"]}]])


@case("piece_groups[0][1].most is 0")
def json_with_none_of_a_piece_group(folder: Path) -> Path:
    return own(folder, piece_groups=[["a", {"of": ["b"], "most": 0}]])


@case("part of a sub-assembly")
def json_with_a_sub_assembly_of_others(folder: Path) -> Path:
    return own(folder, subassemblies={"c": ["a", "d"]})


@case("subassemblies is []")
def json_with_a_list_of_sub_assemblies(folder: Path) -> Path:
    return own(folder, subassemblies=[])


@case('"format" is None')
def json_of_something_else(folder: Path) -> Path:
    return write(folder / "a.json", '{"parts": []}')


@case('"schema" is 99')
def json_of_a_later_schema(folder: Path) -> Path:
    return own(folder, schema=99)


@case("no parts")
def json_without_parts(folder: Path) -> Path:
    return own(folder, parts=[])


@case("'colour'")
def json_with_an_unknown_entry(folder: Path) -> Path:
    return own(folder, colour="red")


@case("comes twice")
def json_with_an_entry_twice(folder: Path) -> Path:
    return write(folder / "a.json", '{"format": "neurosym-assembly", "schema": 1, "schema": 1, "parts": []}')


@case("is no number")
def json_with_nan(folder: Path) -> Path:
    return own(folder, friction=float("nan"))


@case("0 or more")
def json_with_negative_friction(folder: Path) -> Path:
    return own(folder, friction=-0.5)


@case("above 0")
def json_without_density(folder: Path) -> Path:
    return part(folder, cells=[[0, 0, 0]], density=0)


@case("cells and mesh, expected one")
def json_with_two_shapes(folder: Path) -> Path:
    return part(folder, cells=[[0, 0, 0]], mesh="a.obj")


@case("expected one")
def json_without_a_shape(folder: Path) -> Path:
    return part(folder)


@case("not whole")
def json_with_half_a_cell(folder: Path) -> Path:
    return part(folder, cells=[[0, 0, 0.5]])


@case("shape (n, 3)")
def json_with_flat_cells(folder: Path) -> Path:
    return part(folder, cells=[[0, 0]])


@case("a cell twice")
def json_with_a_cell_twice(folder: Path) -> Path:
    return part(folder, cells=[[0, 0, 0], [0, 0, 0]])


@case("overlap by 1")
def json_with_a_cell_of_two(folder: Path) -> Path:
    return own(folder, parts=[{"name": "a", "cells": [[0, 0, 0], [1, 0, 0]]}, {"name": "b", "cells": [[0, 0, 0]]}])


@case("lengths above 0")
def json_with_a_negative_box(folder: Path) -> Path:
    return part(folder, boxes=[{"size": [1, -1, 1]}])


@case("no rigid motion")
def json_with_a_stretched_pose(folder: Path) -> Path:
    return part(folder, cells=[[0, 0, 0]], pose=np.diag([2.0, 1, 1, 1]).tolist())


@case("no rigid motion")
def json_with_a_mirrored_pose(folder: Path) -> Path:
    return part(folder, cells=[[0, 0, 0]], pose=np.diag([-1.0, 1, 1, 1]).tolist())


@case("lies outside")
def json_reaching_outside(folder: Path) -> Path:
    write(folder / "secret.obj", obj(box()))
    (folder / "in").mkdir()
    return part(folder / "in", mesh="../secret.obj")


@case("mesh format")
def json_with_another_file_for_a_mesh(folder: Path) -> Path:
    write(folder / "a.py", "raise SystemExit")
    return part(folder, mesh="a.py")


@case("does not index")
def json_face_beyond(folder: Path) -> Path:
    return part(folder, bodies=[{"mesh": {"vertices": [[0, 0, 0]], "faces": [[0, 1, 2]]}}])


@case("said to be convex")
def json_with_a_hollow_convex(folder: Path) -> Path:
    corners = trimesh.creation.box()
    vertices = np.array(corners.vertices)
    vertices[0] *= 0.1
    return part(folder, bodies=[{"convex": {"vertices": vertices.tolist(), "faces": corners.faces.tolist()}}])


@case("inside out")
def json_with_a_mesh_inside_out(folder: Path) -> Path:
    vertices, faces = box()
    return part(folder, bodies=[{"mesh": {"vertices": vertices.tolist(), "faces": faces[:, ::-1].tolist()}}])


@case("fixed part")
def json_with_an_unknown_fixed_part(folder: Path) -> Path:
    return own(folder, fixed=["c"])


def main(target: str) -> None:
    for name, made in CASES.items():
        folder = Path(target, name)
        folder.mkdir(parents=True)
        made.make(folder)
    print(f"{len(CASES)} broken inputs in {target}")


if __name__ == "__main__":
    main(*sys.argv[1:2])
