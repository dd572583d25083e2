"""Geometry: pairwise facts against exact answers, and verdicts that do not depend on pose, frame or names."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.geometry.blocking.sweep import Sweeps
from neurosym.geometry.contact.contacts import TABLE
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.support.bitsets import bits

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def motion(degrees: float = 0.0, axis: str = "z", shift=(0.0, 0.0, 0.0)) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
    X[:3, 3] = shift
    return X


def exact_blockers(cells, name, direction) -> set[str]:
    """The integer answer: cells of others straight ahead of any cell of the part."""
    hit = set()
    axis = int(np.argmax(np.abs(direction)))
    sign = int(np.sign(direction[axis]))
    for cell in cells[name]:
        for other, own in cells.items():
            for o in own if other != name else ():
                same_line = all(o[k] == cell[k] for k in range(3) if k != axis)
                if same_line and sign * (o[axis] - cell[axis]) > 0:
                    hit.add(other)
    return hit


def as_meshes(cells, rotation=None, merged=True):
    found = {}
    for name, own in cells.items():
        boxes = [trimesh.creation.box((1, 1, 1)) for _ in own]
        for box, cell in zip(boxes, own):
            box.apply_translation(np.array(cell) + 0.5)
        mesh = trimesh.util.concatenate(boxes)
        if rotation is not None:
            mesh.apply_transform(rotation)
        found[name] = mesh if merged else (np.array(mesh.vertices), np.array(mesh.faces))
    return found


@st.composite
def packings(draw):
    """A few polycubes in a 3 x 3 x 2 space: neighbouring cells share a label more often than not."""
    labels = {}
    for x, y, z in itertools.product(range(3), range(3), range(2)):
        neighbours = [labels[n] for n in ((x - 1, y, z), (x, y - 1, z), (x, y, z - 1)) if n in labels]
        new = f"p{len(set(labels.values()))}"
        labels[x, y, z] = draw(st.sampled_from([*neighbours, new]))
    cells = {}
    for cell, label in labels.items():
        if draw(st.integers(0, 5)):
            cells.setdefault(label, []).append(cell)
    if not cells:
        cells["p0"] = [(0, 0, 0)]
    return cells


def test_free_on_all_240_cubes_equals_the_exact_answer():
    wrong = asked = 0
    for cells in ns.load_domain("soma").solutions():
        assembly = ns.Assembly.from_cells(cells)
        graph = AssemblyGeometry(assembly).blocking(AXES)
        everything = (1 << len(assembly)) - 1
        for (i, name), (d, direction) in itertools.product(enumerate(cells), enumerate(AXES)):
            found = set(assembly.in_mask(graph.blockers(i, d, everything)))
            wrong += found != exact_blockers(cells, name, direction)
            asked += 1
    assert asked == 240 * 7 * 6
    assert wrong == 0


@settings(max_examples=25, deadline=None)
@given(packings(), st.floats(0, 360), st.tuples(*[st.floats(-50, 50)] * 3))
def test_blocking_goes_along_with_a_rigid_motion(cells, degrees, shift):
    X = motion(degrees, "zyx"[int(degrees) % 3], shift)
    assembly = ns.Assembly.from_cells(cells)
    still, moved = AssemblyGeometry(assembly), AssemblyGeometry(assembly.transformed(X))
    assert still.blocking(AXES).by_part == moved.blocking(AXES @ X[:3, :3].T).by_part


@settings(max_examples=25, deadline=None)
@given(packings())
def test_boxes_triangles_and_steps_agree(cells):
    assembly = ns.Assembly.from_cells(cells, size=2.5)
    geometry, sweeps = AssemblyGeometry(assembly), Sweeps(assembly, BodySurfaces(assembly.bodies))
    graph, owners = geometry.blocking(AXES), assembly.owners
    for d, direction in enumerate(AXES):
        for i in range(len(assembly)):
            swept = graph.by_part[d][i]
            assert geometry.hits_along(i, direction, ((1 << len(assembly)) - 1) & ~(1 << i)) == swept
            own, others = np.meshgrid(np.flatnonzero(owners == i), np.flatnonzero(owners != i))
            pairs = np.stack([own.ravel(), others.ravel()], axis=1)
            assert set(owners[pairs[sweeps.triangles_hit(pairs, direction), 1]]) == set(bits(swept))


@settings(max_examples=25, deadline=None)
@given(packings())
def test_blocking_reverses_with_the_direction(cells):
    """If a hits b going one way, b hits a going the other."""
    graph = AssemblyGeometry(ns.Assembly.from_cells(cells)).blocking(AXES)
    for d in range(3):
        for i, j in itertools.permutations(range(len(cells)), 2):
            assert bool(graph.by_part[d][i] >> j & 1) == bool(graph.by_part[d + 3][j] >> i & 1)


@settings(max_examples=15, deadline=None)
@given(packings(), st.floats(1, 89), st.randoms(use_true_random=False))
def test_meshes_of_cubes_become_the_same_boxes(cells, degrees, random):
    X = motion(degrees, "z", (3, -2, 7))
    names = list(cells)
    random.shuffle(names)
    meshes = as_meshes({n: cells[n] for n in names}, X)
    assembly = ns.Assembly.from_meshes(meshes)
    assert assembly.bodies.all_boxes
    reference = ns.Assembly.from_cells({n: cells[n] for n in names}).transformed(X)
    assert len(assembly.bodies) == len(reference.bodies)
    directions = AXES @ X[:3, :3].T
    ours, theirs = AssemblyGeometry(assembly), AssemblyGeometry(reference)
    assert ours.blocking(directions).by_part == theirs.blocking(directions).by_part


def test_general_meshes_are_answered_by_their_triangles():
    ring = trimesh.creation.annulus(r_min=1, r_max=2, height=1)
    pin = trimesh.creation.cylinder(radius=0.9, height=4)
    ball = trimesh.creation.icosphere(radius=0.5)
    ball.apply_translation((0, 0, 5))
    assembly = ns.Assembly.from_meshes({"ring": ring, "pin": pin, "ball": ball})
    assert not assembly.bodies.all_boxes
    graph = AssemblyGeometry(assembly).blocking(np.array([[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]]))
    every = 0b111
    assert assembly.in_mask(graph.blockers(1, 0, every)) == ("ball",)
    assert assembly.in_mask(graph.blockers(1, 1, every)) == ()
    assert assembly.in_mask(graph.blockers(1, 2, every)) == ("ring",)
    assert assembly.in_mask(graph.blockers(0, 0, every)) == ()  # the ball passes through the hole
    assert graph.free_directions(1, 0b011) == [0]
    assert graph.free_directions(1, 0b011, table=False) == [0, 1]


def test_a_box_in_a_hollow_mesh_is_caught():
    shell = trimesh.creation.box((4, 4, 4))
    hole = trimesh.creation.box((2, 2, 2))
    hole.invert()
    assembly = ns.Assembly.from_meshes(
        {"shell": trimesh.util.concatenate([shell, hole]), "ball": trimesh.creation.icosphere(radius=0.9)}
    )
    graph = AssemblyGeometry(assembly).blocking(AXES)
    assert graph.free_directions(1, 0b11, table=False) == []


def test_the_filter_leaves_few_pairs_for_the_exact_test():
    assembly = ns.Assembly.from_cells(ns.load_domain("soma").solutions()[0])
    graph = AssemblyGeometry(assembly).blocking(AXES)
    # Of 27 x 26 x 6 ordered pairs of cubes only those in one column can be hit.
    assert graph.queries <= 27 * 6
    assert AssemblyGeometry(assembly.transformed(motion(30))).blocking().queries <= 27 * 6


def test_the_graph_exports_to_networkx():
    assembly = ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)], "beside": [(1, 0, 0)]})
    graph = AssemblyGeometry(assembly).blocking(AXES)
    up = graph.graph(2)
    assert set(up.edges) == {("low", "high")}
    assert up.graph["direction"] == (0.0, 0.0, 1.0)
    assert set(graph.graph(2, assembly.mask(["low", "beside"])).edges) == set()
    assert graph.group_blockers(assembly.mask(["low", "high"]), 0, 0b111) == assembly.mask(["beside"])


@pytest.mark.parametrize("degrees", [0, 30, 77.7])
def test_contacts_of_boxes_have_points_normals_and_areas(degrees):
    cells = {"a": [(0, 0, 0), (1, 0, 0)], "b": [(0, 0, 1)], "c": [(1, 1, 0)]}
    assembly = ns.Assembly.from_cells(cells, size=2.0).transformed(motion(degrees))
    by_parts = {}
    for contact in AssemblyGeometry(assembly).contacts:
        other = "table" if contact.b == TABLE else assembly.names[assembly.owners[contact.b]]
        by_parts.setdefault((assembly.names[assembly.owners[contact.a]], other), []).append(contact)
    assert set(by_parts) == {("a", "b"), ("a", "c"), ("a", "table"), ("c", "table")}
    (stacked,) = by_parts["a", "b"]
    np.testing.assert_allclose(stacked.normal, [0, 0, 1], atol=1e-9)
    assert stacked.area == pytest.approx(4.0, rel=1e-6)
    np.testing.assert_allclose(stacked.points[:, 2], 2.0, atol=1e-6)
    R = motion(degrees)[:3, :3]
    (beside,) = by_parts["a", "c"]
    np.testing.assert_allclose(beside.normal, R @ [0, 1, 0], atol=1e-9)
    np.testing.assert_allclose((beside.points @ R).min(axis=0), [2, 2, 0], atol=1e-6)
    np.testing.assert_allclose((beside.points @ R).max(axis=0), [4, 2, 2], atol=1e-6)


def test_boxes_that_meet_in_an_edge_or_a_corner_do_not_touch():
    assembly = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(1, 1, 0)], "c": [(2, 2, 1)]})
    assert all(c.b == TABLE for c in AssemblyGeometry(assembly).contacts)


def test_contacts_of_meshes_equal_those_of_boxes():
    wedge = trimesh.Trimesh(
        vertices=[[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 1], [2, 0, 1], [0, 2, 1]],
        faces=[[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]],
    )
    top = wedge.copy()
    top.apply_translation((0, 0, 1))
    assembly = ns.Assembly.from_meshes({"low": wedge, "high": top})
    contacts = AssemblyGeometry(assembly).contacts
    (contact,) = [c for c in contacts if c.b != TABLE]
    assert contact.area == pytest.approx(2.0)
    np.testing.assert_allclose(contact.normal, [0, 0, 1], atol=1e-9)
    (table,) = [c for c in contacts if c.b == TABLE]
    assert table.area == pytest.approx(2.0)


@settings(max_examples=20, deadline=None)
@given(packings(), st.floats(0, 360))
def test_standing_does_not_change_with_an_upright_motion(cells, degrees):
    # A piece on exactly its edge may go either way; patches are shrunk, so that it does not here.
    assembly = ns.Assembly.from_cells(cells)
    moved = AssemblyGeometry(assembly.transformed(motion(degrees, "z", (5, 6, -7)))).stability
    still = AssemblyGeometry(assembly).stability
    for subset in range(1, 1 << min(len(cells), 4)):
        assert still.standing(subset).stands == moved.standing(subset).stands


def test_a_tower_stands_and_an_overhang_falls():
    assembly = ns.Assembly.from_cells(
        {"base": [(0, 0, 0)], "beam": [(0, 0, 1), (1, 0, 1), (2, 0, 1)], "weight": [(0, 0, 2)], "prop": [(2, 0, 0)]}
    )
    stability = AssemblyGeometry(assembly).stability
    assert stability.standing(assembly.mask(assembly.names)).stands
    assert not stability.standing(assembly.mask(["base", "beam"])).stands
    assert assembly.in_mask(stability.standing(assembly.mask(["base", "beam"])).moving) == ("beam",)
    # Three cubes balance against one and a counterweight only if that is heavy enough: 2 x 1 against 1 x 1.
    assert not stability.standing(assembly.mask(["base", "beam", "weight"])).stands
    assert stability.standing(assembly.mask(["base", "beam", "prop"])).stands


@settings(max_examples=20, deadline=None)
@given(packings(), st.data())
def test_a_fall_stays_a_fall_while_the_moving_parts_are_there(cells, data):
    assembly = ns.Assembly.from_cells(cells)
    stability = AssemblyGeometry(assembly).stability
    subset = data.draw(st.integers(1, (1 << len(cells)) - 1))
    answer = stability.standing(subset)
    if not answer.stands:
        assert answer.moving
        assert answer.moving & ~subset == 0
        fewer = subset & (data.draw(st.integers(0, (1 << len(cells)) - 1)) | answer.moving)
        assert not stability.standing(fewer).stands


def test_friction_holds_a_wedge_only_when_there_is_enough():
    """A block on a slope of 20 degrees stays for mu above tan 20 = 0.36."""
    slope = np.tan(np.radians(20))
    ramp = trimesh.convex.convex_hull(
        np.array([[0, 0, 0], [4, 0, 0], [0, 2, 0], [4, 2, 0], [0, 0, 4 * slope], [0, 2, 4 * slope]])
    )
    block = trimesh.creation.box((1, 1, 0.5))
    block.apply_translation((0, 0, 0.25))
    block.apply_transform(motion(20, "y"))
    block.apply_translation((2, 1, 2 * slope))
    for friction, stays in ((0.3, False), (0.6, True)):
        assembly = ns.Assembly.from_meshes({"ramp": ramp, "block": block}, friction=friction)
        assert AssemblyGeometry(assembly).stability.standing(0b11).stands is stays


def test_friction_beyond_what_numbers_can_tell_apart_is_answered():
    cells = {"low": [(0, 0, 0)], "high": [(0, 0, 1)], "side": [(1, 0, 1)]}
    stability = AssemblyGeometry(ns.Assembly.from_cells(cells, friction=1e9)).stability
    assert stability.standing(0b011).stands
    assert not stability.standing(0b111).stands


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: ns.Assembly.from_cells({}), "at least one part"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0)]}, friction=float("nan")), "friction of 0 or more"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0)]}, friction=-0.1), "friction of 0 or more"),
        (lambda: ns.Assembly.from_cells({"a": []}), "empty"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0), (0, 0, 0)]}), "twice"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(0, 0, 0)]}), "same solid"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0)]}), "three integers"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0.5)]}), "three integers"),
        (lambda: ns.Assembly.from_cells({"a": ["abc"]}), "three integers"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0)]}, size=0), "above 0"),
        (lambda: ns.Assembly.from_meshes({}), "at least one mesh"),
        (lambda: ns.Assembly.from_meshes({"a": 3}), "vertices and faces"),
        (lambda: ns.Assembly.from_meshes({"a": ([[0, 0, 0]], [[0, 1, 2]])}), "index"),
        (lambda: ns.Assembly.from_meshes({"a": ([[0, 0, np.nan]] * 3, [[0, 1, 2]])}), "finite"),
        (lambda: ns.Assembly.from_meshes({"a": (np.eye(3), [[0, 1, 2]])}), "is open: 3 edges"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0)]}).transformed(np.eye(3)), "rigid motion"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0)]}).transformed(2 * np.eye(4)), "rigid motion"),
        (lambda: ns.Assembly.from_cells({"a": [(0, 0, 0)]})["b"], "name of a part"),
        (lambda: AssemblyGeometry(ns.Assembly.from_cells({"a": [(0, 0, 0)]})).blocking([[0, 0, 0]]), "non-zero"),
    ],
)
def test_bad_geometry_is_refused_with_the_reason(make, says):
    with pytest.raises(ns.InputError, match=says):
        make()


@pytest.mark.parametrize("degrees", [0, 20, 45, 70])
@pytest.mark.parametrize("side", [-0.05, 0.05])
def test_friction_is_as_stated_in_every_direction(degrees, side):
    """A block on a ramp slides at tan(slope) = friction, to 5%, wherever the ramp faces."""
    friction = 0.5
    slope = friction * (1 + side)
    ramp = trimesh.convex.convex_hull(
        np.array([[0, 0, 0], [6, 0, 0], [0, 4, 0], [6, 4, 0], [0, 0, 6 * slope], [0, 4, 6 * slope]])
    )
    block = trimesh.creation.box((2, 2, 0.1))
    block.apply_translation((0, 0, 0.05))
    block.apply_transform(motion(np.degrees(np.arctan(slope)), "y"))
    block.apply_translation((3, 2, 3 * slope))
    turn = motion(degrees)
    meshes = {"ramp": ramp.apply_transform(turn), "block": block.apply_transform(turn)}
    assembly = ns.Assembly.from_meshes(meshes, friction=friction)
    assert AssemblyGeometry(assembly).stability.standing(0b11).stands is (side < 0)


def boundary_mesh(cells, X):
    """The clean outer surface of a polycube: only outer faces, merged vertices."""
    own = set(map(tuple, cells))
    corners, faces = [], []
    for cell in own:
        for axis in range(3):
            for sign in (-1, 1):
                neighbour = list(cell)
                neighbour[axis] += sign
                if tuple(neighbour) in own:
                    continue
                u, v = (axis + 1) % 3, (axis + 2) % 3
                square = []
                for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    corner = list(cell)
                    corner[axis] += sign > 0
                    corner[u] += du
                    corner[v] += dv
                    square.append(corner)
                if sign < 0:
                    square.reverse()
                k = len(corners)
                corners += square
                faces += [[k, k + 1, k + 2], [k, k + 2, k + 3]]
    mesh = trimesh.Trimesh(np.array(corners, dtype=float), faces, process=True)
    mesh.apply_transform(X)
    return mesh


@pytest.mark.parametrize("scale", [1.0, 1e3, 1e-3])
@pytest.mark.parametrize(("degrees", "shift"), [(30, (10, -30, 2)), (17.3, (500, 700, 100)), (45, (0, 0, 0))])
def test_meshes_far_from_the_origin_touch_as_they_should(scale, degrees, shift):
    X = motion(degrees, "z", shift)
    X = np.diag([scale, scale, scale, 1]) @ X
    for number in (17, 100):
        cells = ns.load_domain("soma").solutions()[number]
        assembly = ns.Assembly.from_meshes({name: boundary_mesh(own, X) for name, own in cells.items()})
        areas = [c.area / scale**2 for c in AssemblyGeometry(assembly).contacts]
        assert len(areas) == len(AssemblyGeometry(ns.Assembly.from_cells(cells)).contacts)
        np.testing.assert_allclose(areas, 1.0, rtol=1e-6)


def test_large_boxes_stay_single_boxes():
    """A table in millimetres is six boxes, not thousands of cubes of its finest step."""
    parts = {"top": ((1200, 1200, 20), (0, 0, 710))}
    places = enumerate(itertools.product((-500, 500), repeat=2))
    parts |= {f"leg{k}": ((60, 60, 700), (x, y, 350)) for k, (x, y) in places}
    meshes = {
        name: trimesh.creation.box(size, trimesh.transformations.translation_matrix(place))
        for name, (size, place) in parts.items()
    }
    assembly = ns.Assembly.from_meshes(meshes)
    assert len(assembly.bodies) == 5
    assert AssemblyGeometry(assembly).stability.standing(0b11111).stands
