"""Assemblies from files: formats agree, what is read is looked over, and what is saved comes back."""

from __future__ import annotations

import base64
import gzip
import json
import re
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from broken_inputs import PUZZLE, box, folder_of, gltf, model_3mf, obj, object_3mf, robot, write, zipped
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from step_files import step_boxes
from typer.testing import CliRunner

import neurosym as ns
from neurosym.cli import app
from neurosym.commands.common import FileOptions
from neurosym.geometry.contact import collision
from neurosym.geometry.contact.overlaps import overlaps
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.mesh import topology, triangles
from neurosym.geometry.mesh.broad_phase import near_pairs
from neurosym.geometry.mesh.triangulation import triangulate
from neurosym.geometry.notes import FaultyPartsError
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.readers.burrtools import rotations
from neurosym.geometry.readers.contents import RawMesh
from neurosym.geometry.readers.loading import _READERS
from neurosym.geometry.readers.mating import MAX_TOUCH
from neurosym.geometry.readers.mesh_checks import examine
from neurosym.geometry.readers.meshes import parts_from_meshes
from neurosym.geometry.readers.names import distinct
from neurosym.geometry.readers.obj import read_obj
from neurosym.geometry.shapes import Body, Box, Convex, Part
from neurosym.geometry.shapes import Mesh as MeshShape
from neurosym.geometry.tolerances import Tolerances

DATA = Path(__file__).parent.parent.parent / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the shared data is not here")
in_tmp_path = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

#: Two boxes, the upper one resting on the lower; lengths such that no two are alike.
LOW, HIGH = box((1, 2, 3)), box((2, 2.5, 1), at=(0.25, 0, 2))


def mesh(given: tuple[np.ndarray, np.ndarray]) -> trimesh.Trimesh:
    return trimesh.Trimesh(*given, process=False)


def kinds(assembly: ns.Assembly) -> list[str]:
    return [note.kind for note in assembly.notes]


def same(a: ns.Assembly, b: ns.Assembly) -> bool:
    """Whether two assemblies are equal number by number."""
    if (a.names, a.table, a.friction, a.tolerances, a.fixed, a.units) != (
        b.names, b.table, b.friction, b.tolerances, b.fixed, b.units
    ):  # fmt: skip
        return False
    pairs = [(x, y) for p, q in zip(a.parts, b.parts) for x, y in zip(p.bodies, q.bodies, strict=True)]
    return (
        all(np.array_equal(p.X_WP, q.X_WP) and p.density == q.density for p, q in zip(a.parts, b.parts))
        and all(type(x.shape) is type(y.shape) and np.array_equal(x.X_PB, y.X_PB) for x, y in pairs)
        and all(np.array_equal(x.shape.vertices, y.shape.vertices) for x, y in pairs)
        and all(np.array_equal(x.shape.faces, y.shape.faces) for x, y in pairs)
    )


# -- formats --------------------------------------------------------------------------------------------------


def box_as(ending: str, folder: Path) -> Path:
    """The box of 1 x 2 x 3, in a file of its own."""
    path = folder / f"low{ending}"
    if ending in (".step", ".stp"):
        return write(path, step_boxes({"low": ((0, 0, 0), (1, 2, 3))}))
    if ending == ".3mf":
        return zipped(folder, model_3mf(object_3mf(1, LOW), '<item objectid="1"/>'))
    if ending == ".urdf":
        return write(path, robot(shape='<box size="1 2 3"/>').replace("0 0 1", "0 0 9"))
    if ending == ".xmpuzzle":
        cells = PUZZLE.format(grid="0", cells="#" * 6, solution="<solution><assembly>0 0 0 0</assembly></solution>")
        return write(path, cells.replace('x="2" y="1" z="1"', 'x="1" y="2" z="3"').replace('count="2"', 'count="1"'))
    if ending == ".json":
        ns.Assembly.from_meshes({"low": LOW}).save(path)
        return path
    return write(path, mesh(LOW).export(file_type=ending[1:]) if ending != ".gltf" else json.dumps(gltf(stretch)))


def stretch(tree: dict) -> None:
    tree["nodes"][0]["scale"] = [1, 2, 3]


@pytest.mark.parametrize("ending", sorted(_READERS))
def test_each_kind_of_file_has_the_right_volume_and_size(ending: str, tmp_path: Path):
    if ending in (".step", ".stp"):
        pytest.importorskip("cascadio")
    assembly = ns.Assembly.load(box_as(ending, tmp_path), up="z" if ending in (".glb", ".gltf") else None)
    assert volume(*body_mesh(assembly, 0)) == pytest.approx(6)
    low, high = assembly.bodies.part_bounds[0]
    np.testing.assert_allclose(high - low, [1, 2, 3], atol=1e-6)


@pytest.mark.parametrize("ending", ["obj", "stl", "ply", "off"])
def test_a_folder_of_meshes_gives_a_part_each_in_the_order_of_names(ending: str, tmp_path: Path):
    mesh(LOW).export(tmp_path / f"b low.{ending}")
    mesh(HIGH).export(tmp_path / f"a high.{ending}")
    write(tmp_path / "README.txt", "not a part")
    write(tmp_path / f".hidden.{ending}", "not a part")
    assembly = ns.Assembly.load(tmp_path)
    assert assembly.names == ("a high", "b low")
    np.testing.assert_allclose(assembly.bounds, [[-0.75, -1.25, -1.5], [1.25, 1.25, 2.5]])
    assert (assembly.units, kinds(assembly)) == (None, ["units"])


@pytest.mark.parametrize("ending", ["stl", "ply"])
def test_text_and_binary_say_the_same(ending: str, tmp_path: Path):
    text = "stl_ascii" if ending == "stl" else "ply"
    options = {} if ending == "stl" else {"encoding": "ascii"}
    data = mesh(LOW).export(file_type=text, **options)
    write(tmp_path / "text" / f"a.{ending}", data)
    write(tmp_path / "binary" / f"a.{ending}", mesh(LOW).export(file_type=ending))
    one, other = (ns.Assembly.load(tmp_path / kind) for kind in ("text", "binary"))
    np.testing.assert_allclose(one.bounds, other.bounds)


def test_ply_holds_polygons_of_any_number_of_corners(tmp_path: Path):
    head = "ply\nformat {} 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\n"
    head += "element face 5\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n"
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
    faces = [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]
    text = "".join(f"{x} {y} {z}\n" for x, y, z in corners)
    text += "".join(f"7 {len(f)} {' '.join(map(str, f))}\n" for f in faces)
    write(tmp_path / "text" / "a.ply", head.format("ascii") + text)
    for order, kind in (("<", "binary_little_endian"), (">", "binary_big_endian")):
        data = np.array(corners, f"{order}f8").tobytes()
        for f in faces:
            data += bytes([7, len(f)]) + np.array(f, f"{order}i4").tobytes()
        write(tmp_path / kind / "a.ply", head.format(kind).encode() + data)
    for kind in ("text", "binary_little_endian", "binary_big_endian"):
        body = ns.Assembly.load(tmp_path / kind).bodies[0]
        assert trimesh.Trimesh(body.shape.vertices, body.shape.faces).volume == pytest.approx(0.5)


def test_a_scene_gives_a_part_for_each_node_moved_as_the_node_says(tmp_path: Path):
    scene = trimesh.Scene()
    peg = mesh(box((1, 1, 2)))
    for name, x in (("left", 0.0), ("right", 5.0)):
        turn = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0], [0, 0, 0])
        turn[0, 3] = x
        scene.add_geometry(peg, node_name=name, geom_name="peg", transform=turn)
    for ending in ("glb", "gltf"):
        scene.export(tmp_path / f"a.{ending}")
        assembly = ns.Assembly.load(tmp_path / f"a.{ending}", units="mm")
        assert assembly.names == ("left", "right")
        np.testing.assert_allclose(assembly.bounds, [[-500, -1000, -500], [5500, 1000, 500]], atol=1e-3)
        assert assembly.units == "mm"


def test_gltf_is_y_up_unless_it_says_otherwise(tmp_path: Path):
    tree = gltf(lambda tree: tree["nodes"][0].update(translation=[0, 7, 0]))
    path = write(tmp_path / "a.gltf", json.dumps(tree))
    assert ns.Assembly.load(path).bounds.mean(axis=0) == pytest.approx([0, 0, 7])
    assert ns.Assembly.load(path, up="z").bounds.mean(axis=0) == pytest.approx([0, 7, 0])
    with pytest.raises(ns.InputError, match="up as"):
        ns.Assembly.load(path, up="x")


def test_a_mirrored_node_is_not_inside_out(tmp_path: Path):
    path = write(tmp_path / "a.gltf", json.dumps(gltf(lambda tree: tree["nodes"][0].update(scale=[-1, 1, 1]))))
    assert "inverted" not in kinds(ns.Assembly.load(path))


def test_instances_of_a_node_are_a_part_each(tmp_path: Path):
    def instanced(tree: dict) -> None:
        extra = np.array([[0, 0, 0], [3, 0, 0]], "<f4").tobytes() + np.array([[1, 1, 1], [1, 2, 1]], "<f4").tobytes()
        data = base64.b64decode(tree["buffers"][0]["uri"].partition(",")[2]) + extra
        uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        tree["buffers"][0] = {"byteLength": len(data), "uri": uri}
        tree["bufferViews"] += [{"buffer": 0, "byteOffset": 168 + 24 * k, "byteLength": 24} for k in (0, 1)]
        tree["accessors"] += [{"bufferView": k, "componentType": 5126, "count": 2, "type": "VEC3"} for k in (2, 3)]
        tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2, "SCALE": 3}}}
        tree["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]

    path = write(tmp_path / "a.gltf", json.dumps(gltf(instanced)))
    assembly = ns.Assembly.load(path, up="z")
    assert assembly.names == ("a", "a (2)")
    np.testing.assert_allclose(assembly.bodies.part_bounds[0], [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]])
    np.testing.assert_allclose(assembly.bodies.part_bounds[1], [[2.5, -1, -0.5], [3.5, 1, 0.5]])


def test_3mf_objects_that_are_no_parts_are_named(tmp_path: Path):
    support = object_3mf(2, box(at=(0, 0, -1))).replace("<object ", '<object type="support" ')
    model = model_3mf(object_3mf(1) + support, '<item objectid="1"/><item objectid="2"/>')
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
    assembly = ns.Assembly.load(tmp_path / "a.3mf")
    assert assembly.names == ("box 1",)
    assert [str(note) for note in assembly.notes] == [
        "a.3mf: 1 objects that are no parts were left out: 'box 2' (support)."
    ]


def test_3mf_places_copies_and_states_its_unit(tmp_path: Path):
    pair = '<object id="2"><components><component objectid="1"/>'
    pair += '<component objectid="1" transform="0 1 0 -1 0 0 0 0 1 5 0 0"/></components></object>'
    model = model_3mf(object_3mf(1, LOW) + pair, '<item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 10"/>')
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
    assembly = ns.Assembly.load(tmp_path / "a.3mf")
    assert (assembly.names, assembly.units) == (("box 1", "box 1 (2)"), "mm")
    np.testing.assert_allclose(assembly.bounds, [[-0.5, -1, 8.5], [6, 1, 11.5]])
    assert kinds(assembly) == ["name"]
    inches = ns.Assembly.load(tmp_path / "a.3mf", units="inches")
    np.testing.assert_allclose(inches.bounds * 25.4, assembly.bounds)
    assert inches.units == "in"


def test_the_orientations_of_burrtools_are_the_24_turns_of_a_cube():
    R = rotations()
    assert len({r.tobytes() for r in R}) == 24
    assert np.linalg.det(R) == pytest.approx(1)
    assert all(any((a @ b == c).all() for c in R) for a in R for b in R)


@needs_data
def test_the_orientations_of_burrtools_come_in_its_order():
    assert rotations().tolist() == json.loads((DATA / "burrtools_orientations.json").read_text())


def test_a_puzzle_is_placed_as_its_solution_says(tmp_path: Path):
    shapes = '<voxel x="3" y="2" z="1" type="0" hx="1" name="ell">##3#__#</voxel>'
    shapes += '<voxel x="1" y="1" z="1" type="0">#</voxel>'
    text = (
        f'<puzzle version="2"><gridType type="0"/><shapes>{shapes}</shapes><problems><problem/><problem><shapes>'
        '<shape id="0" count="2"/><shape id="1" count="2"/></shapes><solutions><solution><assembly>0 0 0 0 x 4 0 0 0 x'
        "</assembly></solution><solution><assembly>0 0 0 0 0 0 1 16 5 5 5 3 x</assembly></solution></solutions>"
        "</problem></problems></puzzle>"
    )
    path = write(tmp_path / "a.xmpuzzle", gzip.compress(text.encode()))
    with pytest.raises(ns.AssemblyError, match="Take problem 2"):
        ns.Assembly.load(path)
    assembly = ns.Assembly.load(path, problem=2, solution=2)
    assert assembly.names == ("ell.1", "ell.2", "S2.1")
    cells = [{tuple(np.floor(X[:3, 3]).astype(int)) for X in assembly.X_WB[assembly.owners == i]} for i in range(3)]
    # x fastest: # at (0,0) (1,0) (2,0) and (2,1), from the hotspot (1,0); number 16 turns x to y and y to -x.
    assert cells[0] == {(-1, 0, 0), (0, 0, 0), (1, 0, 0), (1, 1, 0)}
    assert cells[1] == {(0, -1, 1), (0, 0, 1), (0, 1, 1), (-1, 1, 1)}
    assert cells[2] == {(5, 5, 5)}
    assert len(ns.Assembly.load(path, problem=2)) == 2
    with pytest.raises(ns.InputError, match="1 to 2; got 3"):
        ns.Assembly.load(path, problem=2, solution=3)


def test_the_smallest_puzzle_of_the_corpus_is_sound(tmp_path: Path):
    solution = "<solution><assembly>0 0 0 0 0 1 0 0</assembly></solution>"
    path = write(tmp_path / "a.xmpuzzle", PUZZLE.format(grid="0", cells="##", solution=solution))
    assert ns.Assembly.load(path).names == ("S1.1", "S1.2")


def test_the_own_json_by_hand(tmp_path: Path):
    write(tmp_path / "pegs" / "peg.obj", obj(box((1, 1, 1), at=(0.5, 0.5, 0.5))))
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    pose = np.block([[turn, np.array([[1.0], [0], [2]])], [np.zeros((1, 3)), np.ones((1, 1))]])
    document = {
        "format": "neurosym-assembly",
        "schema": 1,
        "units": "cm",
        "friction": 0.3,
        "table": -1,
        "fixed": ["base"],
        "parts": [
            {"name": "base", "boxes": [{"size": [4, 4, 1], "centre": [2, 2, 0.5]}]},
            {"name": "tee", "cells": [[0, 0, 1], [1, 0, 1]], "density": 2},
            {"name": "peg", "mesh": "pegs/peg.obj", "pose": pose.tolist()},
        ],
    }
    path = write(tmp_path / "a.json", json.dumps(document))
    assembly = ns.Assembly.load(path)
    assert (assembly.units, assembly.friction, assembly.table, assembly.fixed) == ("cm", 0.3, -1, ("base",))
    assert [p.density for p in assembly.parts] == [1, 2, 1]
    peg = assembly.body_bounds[assembly.owners == 2][0]
    np.testing.assert_allclose(peg, [[0, 0, 2], [1, 1, 3]], atol=1e-12)
    inch = ns.Assembly.load(path, units="mm", fixed=["peg"], friction=0.9)
    np.testing.assert_allclose(inch.bounds, assembly.bounds * 10)
    assert (inch.table, inch.friction, inch.fixed) == (-10, 0.9, ("base", "peg"))
    assert inch["tee"].density * 1e3 == pytest.approx(2)


# -- folders with supports, links and the data of others ------------------------------------------------------


def test_meshes_beside_a_folder_of_parts_are_fixed(tmp_path: Path):
    folder_of(tmp_path / "parts", a=LOW, b=HIGH)
    folder_of(tmp_path, table=box((9, 9, 1), at=(0, 0, -2)))
    write(tmp_path / "supports.json", '{"fixed": ["a"]}')
    whole = ns.Assembly.load(tmp_path)
    assert (whole.names, set(whole.fixed)) == (("a", "b", "table"), {"a", "table"})
    alone = ns.Assembly.load(tmp_path / "parts", fixed=["b"])
    assert (alone.names, set(alone.fixed)) == (("a", "b"), {"a", "b"})


@needs_data
@pytest.mark.parametrize(
    ("name", "parts", "fixed"),
    [("arch", 30, 2), ("arch/parts", 30, 2), ("wall", 52, 10), ("crossvault", 184, 4), ("bricks", 13, 1)],
)
def test_real_assemblies_load_without_a_fault(name: str, parts: int, fixed: int):
    assembly = ns.Assembly.load(DATA / name)
    assert (len(assembly), len(assembly.fixed)) == (parts, fixed)
    assert set(kinds(assembly)) <= {"units", "mating"}


@needs_data
def test_mating_blocks_that_overlap_slightly_are_taken_for_touching():
    assembly = ns.Assembly.load(DATA / "crossvault")
    (note,) = [n for n in assembly.notes if n.kind == "mating"]
    assert assembly.touch > note.measure > 1e-3 * assembly.smallest_extent
    assert max(o.depth for o in overlaps(BodySurfaces(assembly.bodies))) == pytest.approx(note.measure)


# -- names and units ------------------------------------------------------------------------------------------


@given(st.lists(st.one_of(st.text(max_size=6), st.sampled_from(["a", "a (2)", "", "a\n", " a"])), max_size=12))
def test_names_become_distinct_and_printable_and_stay_where_they_can(names: list[str]):
    found, notes = distinct(names)
    assert len(found) == len(set(found)) == len(names)
    assert all(n.isprintable() and n == n.strip() and n for n in found)
    assert len(notes) == sum(a != b for a, b in zip(names, found))
    assert distinct(found) == (found, [])


def test_two_files_of_one_stem_are_two_parts(tmp_path: Path):
    folder_of(tmp_path, a=LOW)
    mesh(HIGH).export(tmp_path / "a.stl")
    assembly = ns.Assembly.load(tmp_path, units="mm")
    assert assembly.names == ("a", "a (2)")
    assert kinds(assembly) == ["name"]


def test_a_unit_that_is_none_is_refused(tmp_path: Path):
    with pytest.raises(ns.InputError, match="unit"):
        ns.Assembly.load(folder_of(tmp_path, a=LOW), units="furlong")


# -- what is mended, and what is measured ---------------------------------------------------------------------


def raw(vertices: np.ndarray, faces: np.ndarray) -> RawMesh:
    return RawMesh("a", np.asarray(vertices, dtype=float), np.asarray(faces))


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    return float(topology.shell_volumes(vertices, faces, np.zeros(len(faces), dtype=np.int64))[0])


@settings(deadline=None)
@given(seed=st.integers(0, 10**6), flip=st.sets(st.integers(0, 11)), split=st.booleans(), far=st.floats(-50, 50))
def test_a_box_is_mended_however_its_faces_are_wound_and_its_corners_split(
    seed: int, flip: set[int], split: bool, far: float
):
    vertices, faces = box((1, 2, 3), at=(far, far, 0))
    rng = np.random.default_rng(seed)
    faces = faces[rng.permutation(12)].copy()
    for k in flip:
        faces[k] = faces[k][::-1]
    if split:
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(36).reshape(-1, 3)
    faces = np.concatenate([faces, faces[:2], [[0, 0, 1]]])
    found = examine(raw(vertices, faces))
    assert not found.faults
    assert (len(found.vertices), len(found.faces)) == (8, 12)
    assert volume(found.vertices, found.faces) == pytest.approx(6)
    assert "degenerate" in [n.kind for n in found.notes]


@given(st.sets(st.integers(0, 11), min_size=1, max_size=11))
def test_the_open_edges_of_a_box_are_counted(gone: set[int]):
    vertices, faces = box()
    kept = np.delete(faces, sorted(gone), axis=0)
    found = examine(raw(vertices, kept))
    lone = trimesh.grouping.group_rows(np.sort(mesh((vertices, kept)).edges, axis=1), require_count=1)
    assert [(n.kind, n.measure) for n in found.faults] == [("open", len(lone))]


def test_a_cavity_stays_a_cavity_and_a_lone_inverted_solid_does_not():
    ball = trimesh.creation.icosphere(radius=0.3)
    vertices, faces = box((2, 2, 2))
    for at, expected in (((0, 0, 0), 8 - ball.volume), ((5, 0, 0), 8 + ball.volume)):
        both = np.concatenate([vertices, ball.vertices + at])
        found = examine(raw(both, np.concatenate([faces, ball.faces[:, ::-1] + 8])))
        assert not found.faults
        assert volume(found.vertices, found.faces) == pytest.approx(expected)
        assert ("inverted" in [n.kind for n in found.notes]) == (at != (0, 0, 0))


def test_edges_that_meet_others_halfway_are_closed():
    vertices, faces = box()
    # One face cut in two at the middle of one of its edges; the neighbour keeps the whole edge.
    a, b, c = faces[0]
    middle = (vertices[a] + vertices[b]) / 2
    cut = np.concatenate([faces[1:], [[a, 8, c], [8, b, c]]])
    found = examine(raw(np.vstack([vertices, middle]), cut))
    assert not found.faults
    assert [n.kind for n in found.notes] == ["t-junction"]
    assert [n.kind for n in examine(raw(np.vstack([vertices, middle * 1.3]), cut)).faults] == ["open"]


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 10**6), pull=st.floats(1.5, 4))
def test_a_ball_with_a_corner_pulled_through_it_crosses_itself(seed: int, pull: float):
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices = np.array(ball.vertices) @ Rotation.random(random_state=seed).as_matrix()
    corner = seed % len(vertices)
    assert not examine(raw(vertices, ball.faces)).faults
    vertices[corner] *= -pull
    assert [n.kind for n in examine(raw(vertices, ball.faces)).faults] == ["self-intersecting"]


def test_solids_that_overlap_within_a_part_are_noted_only():
    vertices, faces = box()
    found = examine(raw(np.concatenate([vertices, vertices + 0.5]), np.concatenate([faces, faces + 8])))
    assert not found.faults
    assert [n.kind for n in found.notes] == ["self-intersecting"]


# -- polygons -------------------------------------------------------------------------------------------------


@settings(deadline=None)
@given(seed=st.integers(0, 10**6), corners=st.integers(3, 24), start=st.integers(0, 23), star=st.booleans())
def test_polygons_are_cut_into_triangles_that_cover_them_once(seed: int, corners: int, start: int, star: bool):
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.9, corners)) / corners
    assume(np.diff([*angles, angles[0] + 2 * np.pi]).max() < 3.0)
    radius = rng.uniform(0.3, 1.0, corners) if star else np.ones(corners)
    flat = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(corners)], axis=1)
    polygon = np.roll(np.arange(corners), start)
    turned = flat @ Rotation.random(random_state=seed).as_matrix().T
    cut = triangulate(turned, [polygon])
    assert len(cut) == corners - 2
    areas = np.cross(flat[cut[:, 1]] - flat[cut[:, 0]], flat[cut[:, 2]] - flat[cut[:, 0]])[:, 2] / 2
    x, y = flat[:, 0], flat[:, 1]
    assert areas.min() > -1e-9
    assert areas.sum() == pytest.approx((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


@given(seed=st.integers(0, 10**6), turn=st.integers(0, 3))
def test_two_parts_that_share_a_crooked_quadrangle_cut_it_alike(seed: int, turn: int):
    crooked = np.random.default_rng(seed).uniform(-0.1, 0.1, (4, 3))
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) + crooked
    one = triangulate(corners, [np.arange(4)])
    other = triangulate(corners, [np.roll(np.arange(4), turn)[::-1]])
    assert {frozenset(t) for t in one.tolist()} == {frozenset(t) for t in other.tolist()}


def test_a_polygon_joined_to_its_hole_keeps_the_hole(tmp_path: Path):
    outer = [(0, 0), (3, 0), (3, 3), (0, 3)]
    inner = [(1, 1), (1, 2), (2, 2), (2, 1)]
    ring = [*outer, outer[0], *inner, inner[0]]
    vertices = np.array([(*p, 0.0) for p in outer + inner])
    polygon = np.array([(outer + inner).index(p) for p in ring])
    cut = triangulate(vertices, [polygon])
    areas = np.cross(vertices[cut[:, 1]] - vertices[cut[:, 0]], vertices[cut[:, 2]] - vertices[cut[:, 0]])[:, 2] / 2
    assert areas.min() > -1e-12
    assert areas.sum() == pytest.approx(8)
    centres = vertices[cut].mean(axis=1)[areas > 1e-9]
    assert not ((centres[:, :2] > 1) & (centres[:, :2] < 2)).all(axis=1).any()


@pytest.mark.parametrize("front", [True, False], ids=["fronts", "backs"])
def test_polygons_are_cut_alike_from_either_side(front: bool):
    """A face that two parts share: one has its corners the other way round, and begins elsewhere."""
    hook = np.array([(0, 0, 0), (3, 0, 0.1), (3, 1, 0), (1, 1, -0.1), (1, 3, 0), (0, 3, 0.1)])
    ring = np.roll(np.arange(6)[:: 1 if front else -1], 2)
    one, other = triangulate(hook, [np.arange(6)]), triangulate(hook, [ring])
    assert {frozenset(t) for t in one.tolist()} == {frozenset(t) for t in other.tolist()}
    normals = [np.cross(hook[t[:, 1]] - hook[t[:, 0]], hook[t[:, 2]] - hook[t[:, 0]])[:, 2] for t in (one, other)]
    assert (normals[0] > 0).all()
    assert ((normals[1] > 0) == front).all()


def test_a_polygon_of_twenty_thousand_corners_is_read_in_a_moment(tmp_path: Path):
    n = 20_000
    angle = 2 * np.pi * np.arange(n) / n
    radius = 1 + 0.2 * np.sin(40 * angle)
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    lines = [f"v {x:.9f} {y:.9f} {z}" for z in (0, 1) for x, y in flat.tolist()]
    lines += ["f " + " ".join(map(str, range(n, 0, -1))), "f " + " ".join(map(str, range(n + 1, 2 * n + 1)))]
    lines += [f"f {i + 1} {(i + 1) % n + 1} {n + (i + 1) % n + 1} {n + i + 1}" for i in range(n)]
    path = write(tmp_path / "a.obj", "\n".join(lines))
    start = time.process_time()
    (found,) = read_obj(path).parts
    assert time.process_time() - start < 10
    area = (flat * np.roll(flat, -1, axis=0)[:, ::-1] * [1, -1]).sum() / 2
    assert len(found.faces) == 2 * (n - 2) + 2 * n
    assert volume(found.vertices, found.faces) == pytest.approx(area, rel=1e-6)


# -- several solids -------------------------------------------------------------------------------------------


def parted(assembly: ns.Assembly) -> dict[str, list[float]]:
    """Where each part lies: the least and the greatest x."""
    return {n: b[:, 0].round(6).tolist() for n, b in zip(assembly.names, assembly.bodies.part_bounds)}


PAIR = {"left": [-0.5, 0.5], "right": [0.5, 1.5]}


def many(*given: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """One mesh of several."""
    starts = np.cumsum([0, *(len(v) for v, _ in given)])
    return np.concatenate([v for v, _ in given]), np.concatenate([f + s for (_, f), s in zip(given, starts)])


@pytest.mark.parametrize("words", [("o {}", "g faces"), ("g {}", ""), ("g {} more", "s 1")], ids=["o", "g", "g-named"])
def test_objects_or_groups_of_an_obj_are_parts(words: tuple[str, str], tmp_path: Path):
    text, count = "", 0
    for name, at in (("left", 0), ("right", 1)):
        vertices, faces = box(at=(at, 0, 0))
        text += f"{words[0].format(name)}\n{words[1]}\n" + obj((vertices, faces + count)).split("f ", 1)[0]
        text += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in (faces + count).tolist())
        count += len(vertices)
    found = ns.Assembly.load(write(tmp_path / "a.obj", text))
    assert {name.removesuffix(" more"): span for name, span in parted(found).items()} == PAIR


def test_groups_that_are_faces_of_one_solid_are_one_part(tmp_path: Path):
    text = obj(box()).replace("f ", "g top\nf ", 1)
    where = text.rindex("f ", 0, text.rindex("f "))
    assembly = ns.Assembly.load(write(tmp_path / "a.obj", text[:where] + "g side\n" + text[where:]))
    assert (assembly.names, kinds(assembly)) == (("a",), ["units", "solids"])
    assert "2 pieces of a.obj ('top', 'side')" in str(assembly.notes[1])


def test_solids_of_a_text_stl_are_parts(tmp_path: Path):
    text = ""
    for name, at in (("left", 0), ("right", 1)):
        one = mesh(box(at=(at, 0, 0))).export(file_type="stl_ascii")
        text += f"solid {name}\n" + one.split("\n", 1)[1].rsplit("endsolid", 1)[0] + f"endsolid {name}\n"
    assert parted(ns.Assembly.load(write(tmp_path / "a.stl", text))) == PAIR
    # In a folder a file is a part: both are one, and as they touch all over a face, one solid.
    assert parted(ns.Assembly.load(tmp_path)) == {"a": [-0.5, 1.5]}


@pytest.mark.parametrize("ending", ["stl", "ply", "off", "glb"])
def test_closed_shells_of_one_mesh_are_parts_and_a_shell_inside_is_a_cavity(ending: str, tmp_path: Path):
    hollow = box((4, 4, 4))[0], np.concatenate([box()[1]])
    cave = box((3, 3, 3))[0], box()[1][:, ::-1]
    stone = box((1, 1, 1), at=(0, 0, -1))
    slab = box((4, 4, 1), at=(0, 0, -2.5))  # touches the hollow one all over a face
    apart = box((1, 1, 1), at=(7, 0, 0))
    mesh(many(hollow, cave, stone, slab, apart)).export(tmp_path / f"a.{ending}")
    found = ns.Assembly.load(tmp_path / f"a.{ending}", units="m")
    name = found.names[0].removesuffix("-1")
    assert found.names == tuple(f"{name}-{k}" for k in (1, 2, 3, 4))
    volumes = [volume(v, f) for v, f in (body_mesh(found, i) for i in range(4))]
    np.testing.assert_allclose(volumes, [64 - 27, 1, 16, 1], rtol=1e-6)
    (note,) = [n for n in found.notes if n.kind == "solids"]
    assert (note.measure, f"'{name}-1' to '{name}-4'" in note.sentence) == (4, True)


@pytest.mark.parametrize("ending", ["stl", "obj", "ply"])
def test_thousands_of_solids_far_apart_are_as_many_parts(tmp_path: Path, ending):
    mesh(many(*(box(at=(3 * i, 0, 0)) for i in range(2_000)))).export(tmp_path / f"a.{ending}")
    assembly = ns.Assembly.load(tmp_path / f"a.{ending}", units="m")
    assert [name.rpartition("-")[2] for name in assembly.names] == [str(k + 1) for k in range(2_000)]
    np.testing.assert_allclose(assembly.bodies.part_bounds[:, 0, 0], 3 * np.arange(2_000) - 0.5, atol=1e-3)


def body_mesh(assembly: ns.Assembly, part: int) -> tuple[np.ndarray, np.ndarray]:
    return many(*((assembly.bodies.vertices(int(i)), assembly.bodies[int(i)].shape.faces)
                  for i in np.flatnonzero(assembly.owners == part)))  # fmt: skip


def test_solids_side_by_side_in_one_file_of_a_folder_are_noted(tmp_path: Path):
    folder_of(tmp_path, a=many(box(), box(at=(3, 0, 0))), b=box(at=(0, 0, 1)))
    assembly = ns.Assembly.load(tmp_path, units="mm")
    (note,) = [n for n in assembly.notes if n.kind == "solids"]
    assert (assembly.names, note.part, note.measure) == (("a", "b"), "a", 2)


# -- the same from memory -------------------------------------------------------------------------------------


def test_a_mesh_with_each_face_on_both_sides_is_one_solid(tmp_path: Path):
    vertices, faces = box((1, 2, 3))
    once_more = np.stack([faces, faces[:, ::-1]], axis=1).reshape(-1, 3)
    for both in (np.concatenate([faces, faces[:, ::-1]]), once_more, once_more[1:]):
        found = examine(raw(vertices, both))
        assert ([n.kind for n in found.notes], found.faults) == (["doubled"], ())
        assert volume(found.vertices, found.faces) == pytest.approx(6)
    assembly = ns.Assembly.load(write(tmp_path / "a.obj", obj((vertices, once_more))), units="m")
    assert (assembly.names, kinds(assembly)) == (("a",), ["doubled"])
    # A sheet with two sides is none.
    assert [n.kind for n in examine(raw(vertices, once_more[:4])).faults] == ["flat"]


MESHES = {
    "sound": box(),
    "twice": (box()[0], np.concatenate([box()[1], box()[1][:1]])),
    "inside out": (box()[0], box()[1][:, ::-1]),
    "both sides": (box()[0], np.concatenate([box()[1], box()[1][:, ::-1]])),
    "open": (box()[0], box()[1][1:]),
    "flat": (box()[0] * [1, 1, 0], box()[1]),
    "nan": (box()[0] * [1, 1, np.nan], box()[1]),
}


@pytest.mark.parametrize("given", MESHES)
def test_a_mesh_in_memory_is_treated_as_one_in_a_file(given: str, tmp_path: Path):
    def outcome(make: Callable[[], ns.Assembly]) -> list[str]:
        try:
            return [note.kind for note in make().notes]
        except FaultyPartsError as error:
            return [f"fault {note.kind}" for note in error.notes]

    folder = folder_of(tmp_path, a=MESHES[given], b=box(at=(0, 0, 1)))
    meshes = {"a": MESHES[given], "b": box(at=(0, 0, 1))}
    read = outcome(lambda: ns.Assembly.load(folder, units="m"))
    assert outcome(lambda: ns.Assembly.from_meshes(meshes, units="m")) == read
    assert (read == []) == (given == "sound")


@in_tmp_path
@given(depth=st.floats(0, 0.2))
def test_what_is_accepted_in_memory_is_accepted_from_its_file(depth: float, tmp_path: Path):
    plates = {"low": box((4, 4, 1)), "high": box((4, 4, 1), at=(0, 0, 1 - depth))}
    for tolerances in (None, Tolerances(), Tolerances(touch=0.1)):
        if depth > max(0.075, 0 if tolerances is None else tolerances.touch):
            with pytest.raises(FaultyPartsError, match="overlap by"):
                ns.Assembly.from_meshes(plates, tolerances=tolerances)
            continue
        assembly = ns.Assembly.from_meshes(plates, units="mm", fixed=["low"], tolerances=tolerances)
        assert (assembly.units, assembly.fixed) == ("mm", ("low",))
        assembly.save(tmp_path / "a.json")
        assert same(ns.Assembly.load(tmp_path / "a.json"), assembly)


def test_no_advice_goes_beyond_what_the_option_takes(tmp_path: Path):
    assert FileOptions(touch=str(MAX_TOUCH)).reading().touch == MAX_TOUCH
    with pytest.raises(ns.InputError, match="a share of the smallest extent"):
        FileOptions(touch=str(1.01 * MAX_TOUCH)).reading()
    for depth, advised in ((0.2, True), (0.9, False)):
        with pytest.raises(FaultyPartsError) as caught:
            ns.Assembly.from_meshes({"a": box((2, 2, 1)), "b": box((2, 2, 1), at=(0.5, 0, 1 - depth))})
        assert ("--touch" in str(caught.value)) == advised
    for gap, advised in ((0.2, True), (0.9, False)):
        (note,) = ns.Assembly.from_meshes({"a": box(), "b": box(at=(0, 0, 1 + gap))}).notes
        assert ("--touch" in note.remedy) == advised


@in_tmp_path
@given(share=st.floats(0.08, 0.6), gap=st.booleans())
def test_what_a_message_advises_is_taken_and_is_enough(share: float, gap: bool, tmp_path: Path):
    apart = 1 + share if gap else 1 - share
    folder = folder_of(tmp_path, a=box((2, 2, 1)), b=box((2, 2, 1), at=(0.5, 0, apart)))
    runner = CliRunner()
    found = runner.invoke(app, ["inspect", str(folder), "--units", "mm"])
    advised = re.search(r"touch=([\d.e-]+)", str(found.exception) if found.exception else found.stdout)
    assert (advised is not None) == (1.1 * share <= MAX_TOUCH)
    if advised is not None:
        again = runner.invoke(app, ["inspect", str(folder), "--units", "mm", "--touch", advised[1]])
        assert (again.exit_code, again.exception) == (0, None)
        assert not any(word in again.stdout for word in ("touches nothing", "touch="))


def test_the_same_solid_twice_is_named_as_that_however_thin_its_walls_and_however_it_is_cut():
    tube, cube = trimesh.creation.annulus(4.8, 5, 10), trimesh.creation.box((10, 10, 10))
    hole = trimesh.creation.box((9.4, 9.4, 9.4))
    hole.invert()
    walls = trimesh.util.concatenate([cube, hole])
    for one, other in ((tube, tube.copy()), (walls, walls.copy()), (cube, cube.subdivide()), (tube, tube.subdivide())):
        with pytest.raises(FaultyPartsError, match="'a' and 'b' are the same solid in the same place") as caught:
            ns.Assembly.from_meshes({"a": one, "b": other})
        assert "--touch" not in str(caught.value)
    # One within the bounds of the other is another one, and a mate of thin walls is a mate.
    lower, upper = trimesh.creation.box((10, 10, 10)), trimesh.creation.box((10, 10, 10))
    upper.apply_translation((0, 0, 9.7))
    assert [n.kind for n in ns.Assembly.from_meshes({"a": lower, "b": upper}, units="m").notes] == ["mating"]
    with pytest.raises(FaultyPartsError, match="overlap by"):
        ns.Assembly.from_meshes({"a": cube, "b": trimesh.creation.icosphere(2, 5)})


def test_progress_is_told_part_by_part(tmp_path: Path):
    told: list[tuple[int, int]] = []
    folder_of(tmp_path, a=box(), b=box(at=(0, 0, 1)))
    ns.Assembly.load(tmp_path, progress=lambda done, total: told.append((done, total)))
    assert told == [(0, 3), (1, 3), (3, 3)]


# -- overlaps at rest -----------------------------------------------------------------------------------------


def assembled(*parts: tuple[np.ndarray, np.ndarray]) -> ns.Assembly:
    """Parts of which `from_meshes` would refuse those that overlap."""
    return ns.Assembly(parts_from_meshes({chr(97 + i): m for i, m in enumerate(parts)}, Tolerances()))


def prism(sides: int, radius: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    made = trimesh.creation.cylinder(radius, height, sections=sides)
    return np.array(made.vertices), np.array(made.faces)


def turned(m: tuple[np.ndarray, np.ndarray], R: np.ndarray, shift: object = (0, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
    return m[0] @ R.T + shift, m[1]


@settings(deadline=None, max_examples=40)
@given(
    sides=st.tuples(st.integers(3, 9), st.integers(3, 9)),
    depth=st.floats(1e-4, 0.2),
    shift=st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)),
    spin=st.floats(0, 6.3),
    seed=st.integers(0, 10**6),
)
def test_a_layer_that_two_prisms_both_claim_is_as_deep_as_it_is(sides, depth, shift, spin, seed):
    """Stacked with an overlap of known depth, aside and turned about the vertical, then moved together anyhow."""
    low, high = prism(sides[0], 1.0, 1.0), prism(sides[1], 0.9, 1.3)
    high = turned(high, Rotation.from_euler("z", spin).as_matrix(), (*shift, 1.15 - depth))
    R = Rotation.random(random_state=seed).as_matrix()
    (found,) = overlaps(BodySurfaces(assembled(turned(low, R), turned(high, R)).bodies))
    assert found.depth == pytest.approx(depth, rel=1e-6)


@settings(deadline=None, max_examples=60)
@given(
    sizes=st.tuples(*[st.floats(0.5, 3)] * 6),
    shift=st.tuples(*[st.floats(-1, 1)] * 3),
    seed=st.integers(0, 10**6),
)
def test_boxes_overlap_by_no_more_than_the_shortest_way_apart_and_never_by_nothing(sizes, shift, seed):
    first, second = np.array(sizes[:3]), np.array(sizes[3:])
    apart = (first + second) / 2 - np.abs(shift)
    R = Rotation.random(random_state=seed).as_matrix()
    # As they are: read as meshes, boxes that nearly fit one grid would be put on it.
    shapes = [Convex(*turned(box(first), R)), Convex(*turned(box(second, at=shift), R))]
    parts = tuple(Part(n, (Body(shape, np.eye(4)),), np.eye(4)) for n, shape in zip("ab", shapes))
    found = overlaps(BodySurfaces(ns.Assembly(parts).bodies))
    if apart.min() < 1e-3:
        assert all(o.depth <= max(apart.min(), 0) + 1e-9 for o in found)
    else:
        assert 0 < found[0].depth <= apart.min() + 1e-9
        # Where the two come past one another at a corner or a face, it is that way exactly.
        inside = np.minimum(first, second)
        if (apart < 0.99 * inside).all():
            assert found[0].depth == pytest.approx(apart.min(), rel=1e-6)


@settings(deadline=None, max_examples=25)
@given(sides=st.integers(3, 40), slack=st.floats(0, 0.2), lift=st.floats(-0.4, 0.4), seed=st.integers(0, 10**6))
def test_a_peg_in_its_hole_only_touches(sides: int, slack: float, lift: float, seed: int):
    ring = trimesh.creation.annulus(0.5, 1.0, 1.0, sections=sides)
    R = Rotation.random(random_state=seed).as_matrix()
    peg = prism(sides, 0.5 - slack, 3.0)
    hole = (np.array(ring.vertices), np.array(ring.faces))
    assert not overlaps(BodySurfaces(assembled(turned(hole, R), turned(peg, R, R @ [0, 0, lift])).bodies))


@settings(deadline=None, max_examples=15)
@given(sides=st.integers(6, 60), tight=st.floats(2e-3, 0.05))
def test_a_peg_too_wide_for_its_hole_overlaps_by_the_difference(sides: int, tight: float):
    ring = trimesh.creation.annulus(0.5, 1.0, 1.0, sections=sides)
    pair = assembled((np.array(ring.vertices), np.array(ring.faces)), prism(sides, 0.5 + tight, 3.0))
    (found,) = overlaps(BodySurfaces(pair.bodies))
    flats = tight * np.cos(np.pi / sides)
    assert flats * (1 - 1e-6) <= found.depth <= tight * 1.45


def test_two_copies_in_one_place_overlap_by_their_thickness():
    (found,) = overlaps(BodySurfaces(assembled(box((1, 2.03, 3.1)), box((1, 2.03, 3.1))).bodies))
    assert found.depth == pytest.approx(1)


@in_tmp_path
@given(depth=st.floats(2e-3, 0.049))
def test_the_touching_tolerance_follows_the_overlap_and_goes_no_farther(depth: float, tmp_path: Path):
    folder_of(tmp_path, a=box(), b=box((1, 1, 1.2), at=(0, 0, 1.1 - depth)))
    assembly = ns.Assembly.load(tmp_path, units="mm")
    assert kinds(assembly) == ["mating"]
    assert depth < assembly.tolerances.touch <= max(0.05, 1.031 * depth)
    assert assembly.notes[0].measure == pytest.approx(depth)
    # Taken for touch: the upper one lies on the lower one, and each can leave the other upwards or sideways.
    assert len([c for c in AssemblyGeometry(assembly).contacts if c.b >= 0]) == 1
    graph = AssemblyGeometry(assembly).blocking(np.vstack([np.eye(3), -np.eye(3)]))
    assert [len(graph.free_directions(i, 0b11, table=False)) for i in (0, 1)] == [5, 5]


def test_a_stated_tolerance_is_kept_and_says_how_deep_an_overlap_may_be(tmp_path: Path):
    folder_of(tmp_path, a=box(), b=box(at=(0, 0, 0.9)))
    with pytest.raises(ns.AssemblyError, match=r"'a' and 'b' overlap by 0.1.*touch=0.11"):
        ns.Assembly.load(tmp_path)
    assert ns.Assembly.load(tmp_path, tolerances=Tolerances(touch=0.11)).tolerances.touch == 0.11
    with pytest.raises(ns.AssemblyError, match="overlap"):
        ns.Assembly.load(tmp_path, tolerances=Tolerances(touch=0.05))


def test_fixed_parts_may_overlap_one_another(tmp_path: Path):
    folder_of(tmp_path, a=box(), b=box(at=(0, 0, 0.5)))
    assert ns.Assembly.load(tmp_path, fixed=["a", "b"]).fixed == ("a", "b")


def test_parts_that_touch_nothing_are_noted_with_their_distance(tmp_path: Path):
    folder_of(tmp_path, a=box(), b=box(at=(0, 0, 1.25)), c=box(at=(3, 0, 0)), d=box(at=(3, 0, 1)))
    assembly = ns.Assembly.load(tmp_path, units="mm")
    (note,) = assembly.notes
    assert (note.part, note.kind, note.measure) == ("b", "floating", pytest.approx(0.25))
    assert "from 'a'" in note.sentence
    assert not ns.Assembly.load(tmp_path, units="mm", fixed=["b"]).notes


# -- triangles in bulk ----------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10**6), count=st.sampled_from([3, 700]))
def test_near_pairs_are_those_whose_boxes_meet_with_a_tree_and_without(seed: int, count: int):
    rng = np.random.default_rng(seed)
    low = [rng.uniform(0, 10, (count, 3)) for _ in range(2)]
    high = [edge + rng.uniform(0, 0.5, (count, 3)) for edge in low]
    found = near_pairs((low[0], high[0]), (low[1], high[1]), 10**6)
    expected = (low[0][:, None] <= high[1]).all(axis=2) & (low[1] <= high[0][:, None]).all(axis=2)
    assert {tuple(p) for p in found.tolist()} == {tuple(p) for p in np.argwhere(expected).tolist()}
    assert near_pairs((low[0], high[0]), (low[0], high[0]), count - 1) is None


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10**6))
def test_inside_and_distance_of_a_ball_are_those_of_its_radius(seed: int):
    ball = trimesh.creation.icosphere(subdivisions=3)
    points = np.random.default_rng(seed).normal(size=(60, 3))
    t = np.array(ball.vertices)[ball.faces]
    radius = np.linalg.norm(points, axis=1)
    clear = np.abs(radius - 1) > 0.02
    assert (triangles.are_inside(points, t) == (radius < 1))[clear].all()
    np.testing.assert_allclose(triangles.distances(points, t), np.abs(radius - 1), atol=0.01)


def test_the_parts_that_float_are_those_that_fcl_finds_apart():
    low, high = box(), box(at=(0, 0, 1.25))
    objects = [collision.mesh_object(Convex(*m), np.eye(4)) for m in (low, high)]
    assert collision.distance(*objects) == pytest.approx(0.25)


# -- saving ---------------------------------------------------------------------------------------------------

lengths = st.floats(0.1, 10, allow_subnormal=False)
places = st.floats(-100, 100, allow_subnormal=False)


@st.composite
def bodies(draw: st.DrawFn) -> Body:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_rotvec(draw(st.tuples(*[st.floats(-3, 3)] * 3))).as_matrix()
    X[:3, 3] = draw(st.tuples(places, places, places))
    size = np.array(draw(st.tuples(lengths, lengths, lengths)))
    kind = draw(st.sampled_from(["box", "convex", "mesh"]))
    if kind == "box":
        return Body(Box(size), X)
    vertices, faces = box(size)
    return Body(Convex(vertices, faces) if kind == "convex" else MeshShape(vertices, faces), X)


@st.composite
def any_assembly(draw: st.DrawFn) -> ns.Assembly:
    printable = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=5)
    names = draw(st.lists(printable, min_size=1, max_size=4, unique=True))
    parts = [Part(n, (draw(bodies()),), draw(bodies()).X_PB, draw(lengths)) for n in names]
    tolerances = Tolerances(touch=1e3, parallel=draw(st.floats(1e-6, 1e-2)))
    units = draw(st.sampled_from([None, "mm", "m"]))
    fixed = tuple(draw(st.lists(st.sampled_from(names), unique=True)))
    return ns.Assembly(tuple(parts), draw(st.none() | places), draw(lengths), tolerances, fixed, units)


@in_tmp_path
@given(assembly=any_assembly())
def test_what_is_saved_comes_back_number_by_number(assembly: ns.Assembly, tmp_path: Path):
    path = tmp_path / "deep" / "a.json"
    assembly.save(path)
    assert same(ns.Assembly.load(path), assembly)


def test_a_loaded_folder_is_saved_and_loaded_again_the_same(tmp_path: Path):
    folder_of(tmp_path / "in", a=LOW, b=turned(HIGH, np.eye(3), (0, 0, -0.01)))
    first = ns.Assembly.load(tmp_path / "in", units="mm", fixed=["a"])
    first.save(tmp_path / "a.json")
    assert same(ns.Assembly.load(tmp_path / "a.json"), first)
    assert first.tolerances.touch > Tolerances().touch


def test_a_file_is_saved_whole_or_not_at_all(tmp_path: Path):
    path = tmp_path / "a.json"
    ns.Assembly.from_cells({"a": [(0, 0, 0)]}).save(path)
    before = path.read_bytes()
    broken = ns.Assembly.from_cells({"a": [(0, 0, 0)]}, table=float("nan"))
    with pytest.raises(ValueError, match="JSON"):
        broken.save(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_cells_and_meshes_of_one_puzzle_load_to_the_same_boxes(tmp_path: Path):
    cells = ns.Assembly.from_cells({"a": [(0, 0, 0), (1, 0, 0)], "b": [(0, 1, 0), (1, 1, 0), (1, 1, 1)]})
    for part in cells.parts:
        pieces = [mesh(turned((b.shape.vertices, b.shape.faces), np.eye(3), b.X_PB[:3, 3])) for b in part.bodies]
        trimesh.util.concatenate(pieces).export(tmp_path / f"{part.name}.stl")
    found = ns.Assembly.load(tmp_path, units="mm")
    assert found.bodies.all_boxes
    assert sorted(map(tuple, found.X_WB[:, :3, 3].round(6))) == sorted(map(tuple, cells.X_WB[:, :3, 3]))
