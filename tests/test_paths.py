"""Paths and their check: what meets on the way is found exactly, and parts that can come out do, by moves or turns."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.mesh.inset import inset_vertices
from neurosym.geometry.paths.clearance import Clearance
from neurosym.geometry.paths.grid import cells_of
from neurosym.geometry.paths.path_check import check_path
from neurosym.geometry.paths.path_search import Failure, extract
from neurosym.geometry.paths.trees import Growth, connected
from neurosym.geometry.paths.voxel_search import first_separation
from neurosym.geometry.paths.voxel_separation import Separation
from neurosym.geometry.rigid_motions import Interpolation, shifted
from neurosym.geometry.shapes import Body, Box, Mesh, Part
from neurosym.geometry.staging import staged
from neurosym.geometry.step_motion import StepMotion, Track
from neurosym.support.deadline import OutOfTime
from neurosym.testing.burrs import RINGS

STAY = np.eye(4)


def boxes(name, *corners) -> Part:
    """A part of boxes given by two opposite corners each."""
    bodies = []
    for low, high in corners:
        X = np.eye(4)
        X[:3, 3] = np.add(low, high) / 2
        bodies.append(Body(Box(np.subtract(high, low).astype(float)), X))
    return Part(name, tuple(bodies), np.eye(4))


def straight(assembly: ns.Assembly, part: str, direction) -> StepMotion:
    """One part leaves all others along a straight line."""
    return staged(assembly, assembly.names, [part], [StepMotion.along([part], direction)]).motions[0]


def poses(path: StepMotion) -> np.ndarray:
    return path.tracks[0].poses


def surface(corners) -> tuple[np.ndarray, np.ndarray]:
    """The closed surface of a union of boxes: vertices shared, nothing inside."""
    levels = [np.unique(np.round([c[k] for pair in corners for c in pair], 9)) for k in range(3)]
    filled = np.zeros([len(at) + 1 for at in levels], bool)
    for low, high in corners:
        spans = [np.searchsorted(levels[k], np.round([low[k], high[k]], 9)) + 1 for k in range(3)]
        filled[tuple(slice(*span) for span in spans)] = True
    numbers: dict[tuple[int, ...], int] = {}
    faces = []
    for cell, axis, side in itertools.product(map(tuple, np.argwhere(filled)), range(3), (0, 1)):
        beyond = list(cell)
        beyond[axis] += 2 * side - 1
        if filled[tuple(beyond)]:
            continue
        square = []
        for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
            corner = [c - 1 for c in cell]
            corner[axis] += side
            corner[(axis + 1) % 3] += du
            corner[(axis + 2) % 3] += dv
            square.append(numbers.setdefault(tuple(corner), len(numbers)))
        a, b, c, d = square if side else square[::-1]
        faces += [(a, b, c), (a, c, d)]
    vertices = np.array([[levels[k][corner[k]] for k in range(3)] for corner in numbers])
    return vertices, np.array(faces)


def as_meshes(assembly: ns.Assembly) -> ns.Assembly:
    """The same parts, each one closed mesh."""
    parts = []
    for part in assembly.parts:
        corners = [(b.X_PB[:3, 3] - b.shape.size / 2, b.X_PB[:3, 3] + b.shape.size / 2) for b in part.bodies]
        parts.append(Part(part.name, (Body(Mesh(*surface(corners)), np.eye(4)),), part.X_WP))
    return ns.Assembly(tuple(parts))


def keyhole(clearance: float) -> ns.Assembly:
    """A pin with a wide head in a slot with lips, closed at both ends: along the slot, then up where the lips end."""
    c = clearance
    pin = boxes("pin", ((1 + c, 1 + c, 1 + c), (2 - c, 4 - c, 2 - c)), ((1 + c, 2 + c, 2 - c), (2 - c, 3 - c, 4)))
    slot = boxes(
        "slot",
        ((0, 0, 0), (6, 5, 1)), ((0, 0, 1), (6, 1, 3)), ((0, 4, 1), (6, 5, 3)), ((0, 1, 1), (1, 4, 3)),
        ((5, 1, 1), (6, 4, 3)), ((1, 1, 2), (3.5, 2, 3)), ((1, 3, 2), (3.5, 4, 3)),
    )  # fmt: skip
    return ns.Assembly((pin, slot))


def hook() -> ns.Assembly:
    """A Z through a hole in a plate, longer at both ends than the hole is wide: it has to turn."""
    plate = boxes(
        "plate",
        ((-3, -3, 0), (3, -0.45, 0.2)), ((-3, 0.45, 0), (3, 3, 0.2)),
        ((-3, -0.45, 0), (-0.45, 0.45, 0.2)), ((0.45, -0.45, 0), (3, 0.45, 0.2)),
    )  # fmt: skip
    z = boxes(
        "hook",
        ((-0.2, -0.2, -0.6), (0.2, 0.2, 1.2)), ((0.2, -0.2, -0.6), (1.2, 0.2, -0.2)),
        ((-1.2, -0.2, 0.8), (-0.2, 0.2, 1.2)),
    )  # fmt: skip
    return ns.Assembly((z, plate))


def lock(clearance: float) -> ns.Assembly:
    """A key behind a plate, its bit a quarter turn away from the slot that it came in through."""
    w = 0.2 + clearance / 2
    plate = boxes(
        "plate",
        ((-3, -3, 0), (3, -0.5, 0.5)), ((-3, 0.5, 0), (3, 3, 0.5)), ((-3, -0.5, 0), (-0.5, 0.5, 0.5)),
        ((1.5, -0.5, 0), (3, 0.5, 0.5)), ((0.5, -0.5, 0), (1.5, -w, 0.5)), ((0.5, w, 0), (1.5, 0.5, 0.5)),
        ((-3, -3, -1.4), (3, 3, -1.1)),
    )  # fmt: skip
    key = boxes("key", ((-0.3, -0.3, -1), (0.3, 0.3, 1.5)), ((-0.2, 0.3, -1), (0.2, 1.3, -0.4)))
    return ns.Assembly((key, plate))


def moved(assembly: ns.Assembly, degrees, shift, scale: float) -> ns.Assembly:
    """All of it scaled, then turned and shifted."""
    parts = []
    for part in assembly.parts:
        bodies = []
        for body in part.bodies:
            X = body.X_PB.copy()
            X[:3, 3] *= scale
            old = body.shape
            shape = Box(old.size * scale) if isinstance(old, Box) else Mesh(old.vertices * scale, old.faces)
            bodies.append(Body(shape, X))
        parts.append(Part(part.name, tuple(bodies), part.X_WP))
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("zyx", degrees, degrees=True).as_matrix()
    X[:3, 3] = shift
    return ns.Assembly(tuple(parts)).transformed(X)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


# -- meeting on the way ---------------------------------------------------------------------------------------


def first_meeting(a, b, way):
    """The share of a way at which two axis-aligned boxes (low, high) first overlap, by intervals; None: never."""
    enter, leave = 0.0, 1.0
    for k in range(3):
        if way[k] == 0:
            if not (a[0][k] < b[1][k] and b[0][k] < a[1][k]):
                return None
            continue
        times = sorted([(b[0][k] - a[1][k]) / way[k], (b[1][k] - a[0][k]) / way[k]])
        enter, leave = max(enter, times[0]), min(leave, times[1])
    return enter if enter < leave else None


coordinates = st.integers(-3, 3)
triples = st.tuples(coordinates, coordinates, coordinates)


@given(triples, st.tuples(*[st.integers(1, 3)] * 3), triples, st.booleans(), st.sampled_from([(0, 0, 0), (25, 40, 9)]))
@example((3, 0, 0), (1, 1, 1), (3, 0, 0), True, (0, 0, 0))
@settings(max_examples=80, deadline=None)
def test_boxes_and_meshes_meet_where_intervals_say(low, size, way, meshes, turn):
    target = (np.array(low), np.add(low, size))
    start = (np.zeros(3), np.array([2.0, 1.0, 1.0]))
    if first_meeting(start, target, (1e-9, 0, 0)) is not None:
        return
    expected = first_meeting(start, target, way)
    assembly = ns.Assembly((boxes("a", start), boxes("b", target)))
    assembly = moved(as_meshes(assembly) if meshes else assembly, turn, (50.0, 20.0, 3.0), 0.01)
    X = assembly.parts[0].X_WP[:3, :3]
    found = Clearance(assembly, [0], [1]).first_hit(Interpolation(STAY, shifted(0.01 * X @ way), assembly.bounds[0]))
    assert (found is not None) == (expected is not None)
    if found is not None and expected is not None:
        assert found[0] == pytest.approx(expected, abs=0.01)
        assert found[1:] == (0, 1)


@pytest.mark.parametrize("meshes", [False, True])
def test_a_turning_bar_meets_a_wall_at_the_angle_that_trigonometry_gives(meshes):
    # A bar from 0 to 2 along x, thin, turns about the origin up to a wall above y = 1: its end is there at 30 degrees.
    bar = boxes("bar", ((-2, -0.01, 0), (2, 0.01, 1)))
    wall = boxes("wall", ((0, 1, 0), (4, 2, 1)))
    assembly = ns.Assembly((bar, wall))
    assembly = as_meshes(assembly) if meshes else assembly
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    found = Clearance(assembly, [0], [1]).first_hit(Interpolation(STAY, turned, np.array([0.0, 0.0, 0.5])))
    assert found is not None
    angle = np.degrees(np.arcsin(1 / np.hypot(2, 0.01)) - np.arctan2(0.01, 2))
    assert found[0] * 90 == pytest.approx(angle, abs=0.1)


@pytest.mark.parametrize("meshes", [False, True])
def test_nothing_jumps_over_a_sheet(meshes):
    ball = boxes("a", ((0, 0, 0), (1, 1, 1)))
    sheet = boxes("sheet", ((50, -5, -5), (50.001, 5, 5)))
    assembly = ns.Assembly((ball, sheet))
    track = Track(("a",), np.array([STAY, shifted(np.array([100.0, 0, 0]))]), np.full(3, 0.5))
    path = StepMotion(("a",), tracks=(track,))
    check = check_path(path, as_meshes(assembly) if meshes else assembly, 0b11)
    assert not check.holds
    assert set(check.parts) == {"a", "sheet"}
    assert check.key == pytest.approx(0.49, abs=1e-3)


@pytest.mark.parametrize("meshes", [False, True])
@pytest.mark.parametrize(("overlap", "holds"), [(-0.01, True), (0.0, True), (0.0008, True), (0.002, False)])
def test_touch_and_little_overlaps_are_no_hits(overlap, holds, meshes):
    # A drawer between two walls; tolerance 1e-3 of the smallest extent, which is 1.
    drawer = boxes("drawer", ((0, -overlap, 0), (3, 1 + overlap, 1)))
    walls = boxes("walls", ((0, -1, 0), (3, 0, 1)), ((0, 1, 0), (3, 2, 1)), ((-1, -1, 0), (0, 2, 1)))
    assembly = ns.Assembly((drawer, walls))
    assembly = as_meshes(assembly) if meshes else assembly
    assert check_path(straight(assembly, "drawer", (1, 0, 0)), assembly, 0b11).holds == holds


def test_meshes_put_together_from_others_touch_without_hitting():
    # They overlap the wall a little, too, as parts do that mate.
    drawer = trimesh.util.concatenate(
        [trimesh.creation.box((1, 1.0016, 1)).apply_translation((0.5 + k, 0.5, 0.5)) for k in range(3)]
    )
    wall = trimesh.creation.box((3, 1, 1)).apply_translation((1.5, 1.5, 0.5))
    parts = [
        Part(n, (Body(Mesh(np.array(m.vertices), np.array(m.faces)), np.eye(4)),), np.eye(4))
        for n, m in (("drawer", drawer), ("wall", wall))
    ]
    assembly = ns.Assembly(tuple(parts))
    assert check_path(straight(assembly, "drawer", (1, 0, 0)), assembly, 0b11).holds


STEPS = [((0, 0, 0), (2, 1, 1)), ((0, 0, 1), (1, 2, 2)), ((0, 1, 0), (1, 2, 1))]


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.box((1, 2, 3)),
        trimesh.creation.icosphere(subdivisions=2),
        trimesh.creation.torus(2, 0.5),
        trimesh.creation.cone(1, 3),
        trimesh.Trimesh(*surface(STEPS), process=False),
    ],
    ids=["box", "ball", "torus", "cone", "steps"],
)
def test_every_face_moves_inward_by_the_depth(mesh):
    depth = 0.01
    vertices = inset_vertices(np.array(mesh.vertices), np.array(mesh.faces), depth)
    inward = -np.einsum("fkd,fd->fk", (vertices - mesh.vertices)[mesh.faces], mesh.face_normals)
    assert inward.min() == pytest.approx(depth, rel=1e-6)
    assert inward.max() < 1.5 * depth


def test_two_moving_tracks_are_checked_against_each_other():
    a, b = boxes("a", ((0, 0, 0), (1, 1, 1))), boxes("b", ((4, 0, 0), (5, 1, 1)))
    assembly = ns.Assembly((a, b))

    def crossing(far_a, far_b):
        tracks = (
            Track(("a",), np.array([STAY, shifted(np.array([far_a, 0.0, 0.0]))]), np.full(3, 0.5)),
            Track(("b",), np.array([STAY, shifted(np.array([far_b, 0.0, 0.0]))]), np.array([4.5, 0.5, 0.5])),
        )
        return check_path(StepMotion(("a",), tracks=tracks, kind="moves"), assembly, 0b11)

    assert crossing(8.0, 6.0).holds is True
    met = crossing(8.0, -8.0)
    assert met.holds is False
    assert met.key == pytest.approx(3 / 16, abs=1e-3)


def test_the_check_sees_the_ground_and_whether_the_part_is_out():
    assembly = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(1, 0, 0)]})
    down = straight(assembly, "a", (0, 0, -1))
    assert check_path(down, assembly, 0b11).holds
    low = check_path(down, assembly, 0b11, ground=0.0)
    assert not low.holds
    assert "ground" in low.reason
    track = Track(("a",), np.array([STAY, shifted(np.array([0, 0, 0.5]))]), np.full(3, 0.5))
    short = StepMotion(("a",), tracks=(track,))
    said = check_path(short, assembly, 0b11)
    assert not said.holds
    assert "not out" in said.reason
    assert check_path(short, assembly, 0b01).holds


def test_paths_survive_json_and_run_backwards():
    assembly = keyhole(0.05)
    path = extract(assembly, 0b01, 0b11, rng=rng())
    assert isinstance(path, StepMotion)
    again = StepMotion.from_json(json.loads(json.dumps(path.to_json())))
    assert again.kind == path.kind
    assert again.parts == ("pin",)
    assert np.array_equal(poses(again), poses(path))
    assert again.tracks[0].length == path.tracks[0].length > 4
    back = path.reversed()
    assert np.allclose(back.at(0.0)["pin"], poses(path)[-1])
    assert np.allclose(back.at(1.0)["pin"], STAY)
    assert check_path(back, assembly, 0b11).holds
    # Files have poses in the order in which they are taken.
    document = json.loads(json.dumps(back.to_json()))
    assert document["how"] == document["path"]["tracks"][0]["poses"] == poses(path)[::-1].tolist()
    assert np.array_equal(poses(StepMotion.from_json(document)), poses(path))
    half = path.tracks[0].at(0.5)
    assert np.allclose(half[:3, 3], poses(path)[1][:3, 3] / 2)


@pytest.mark.parametrize(
    "change",
    [
        {"kind": "teleport"},
        {"tracks": []},
        {"leaving": ["nobody"]},
        {"tracks": [{"parts": ["a"], "centre": [0, 0, 0], "poses": [np.eye(4).tolist()]}]},
        {"tracks": [{"parts": ["a"], "centre": [0, 0, "x"], "poses": [np.eye(4).tolist()] * 2}]},
        {"tracks": [{"parts": ["a"], "centre": [0, 0, 0], "poses": [np.eye(4).tolist(), (2 * np.eye(4)).tolist()]}]},
        {"tracks": [{"parts": [], "centre": [0, 0, 0], "poses": [np.eye(4).tolist()] * 2}]},
        {"tracks": None},
    ],
    ids=lambda change: str(change)[:40],
)
def test_what_is_no_path_is_refused(change):
    good = {
        "kind": "lattice",
        "leaving": ["a"],
        "tracks": [{"parts": ["a"], "centre": [0, 0, 0], "poses": [np.eye(4).tolist()] * 2}],
    }
    step = {"how": [], "parts": ["a"]}
    path = StepMotion.from_json({**step, "path": good})
    assert path.parts == ("a",)
    with pytest.raises(InputError, match="Expected"):
        StepMotion.from_json({**step, "path": good | change})
    with pytest.raises(UnknownNameError):
        check_path(path, ns.Assembly.from_cells({"b": [(0, 0, 0)], "c": [(1, 0, 0)]}), 0b11)


# -- searches -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("clearance", [0.0, 0.01, 0.05])
def test_the_lattice_leads_out_of_a_keyhole_however_narrow(clearance):
    path = extract(keyhole(clearance), 0b01, 0b11, rng=rng(), kinds=("lattice",))
    assert isinstance(path, StepMotion)
    assert path.kind == "lattice"
    assert len(poses(path)) <= 6
    assert poses(path)[-1][2, 3] > 1.9


def test_the_same_keyhole_of_meshes_turned_and_in_metres():
    assembly = moved(as_meshes(keyhole(0.05)), (30, 20, 10), (5.0, -2.0, 1.0), 0.01)
    path = extract(assembly, 0b01, 0b11, rng=rng(), kinds=("lattice",))
    assert isinstance(path, StepMotion)
    assert check_path(path, assembly, 0b11).holds


def test_a_tree_of_translations_finds_the_keyhole_and_the_same_one_for_the_same_seed():
    found = [extract(keyhole(0.2), 0b01, 0b11, rng=rng(seed), kinds=("translation",)) for seed in (1, 1, 2)]
    assert all(isinstance(path, StepMotion) and path.kind == "translation" for path in found)
    first, second, other = (poses(path) for path in found)
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)
    assert np.allclose(first[:, :3, :3], np.eye(3))


def test_a_hook_has_to_turn():
    stuck = extract(hook(), 0b01, 0b11, rng=rng(), kinds=("lattice", "translation"))
    assert isinstance(stuck, Failure)
    assert stuck.proved
    assert stuck.because == ("plate",)
    assert "no translations lead out" in stuck.reason
    path = extract(hook(), 0b01, 0b11, rng=rng(), kinds=("rigid",))
    assert isinstance(path, StepMotion)
    assert path.kind == "rigid"
    assert np.abs(poses(path)[:, :3, :3] - np.eye(3)).max() > 0.1


@pytest.mark.parametrize("clearance", [0.0, 0.1])
def test_a_key_turns_by_a_quarter(clearance):
    assembly = lock(clearance)
    stuck = extract(assembly, 0b01, 0b11, rng=rng(), kinds=("lattice",))
    assert isinstance(stuck, Failure)
    assert stuck.proved
    path = extract(assembly, 0b01, 0b11, rng=rng())
    assert isinstance(path, StepMotion)
    assert path.kind == "rigid"
    assert check_path(path, assembly, 0b11).holds


def test_with_ground_below_nothing_leaves_through_it():
    # A lid that hangs in a frame: down is the only way for it.
    lid = boxes("lid", ((1, 1, 1), (4, 4, 2)), ((2, 2, 0), (3, 3, 1)))
    frame = boxes(
        "frame", ((0, 0, 0), (1, 5, 3)), ((4, 0, 0), (5, 5, 3)), ((1, 0, 0), (4, 1, 3)), ((1, 4, 0), (4, 5, 3))
    )  # fmt: skip
    roof = boxes("roof", ((0, 0, 3), (5, 5, 4)))
    assembly = ns.Assembly((lid, frame, roof))
    free = extract(assembly, 0b001, 0b111, rng=rng(), kinds=("lattice",))
    assert isinstance(free, StepMotion)
    assert poses(free)[-1][2, 3] < -1
    held = extract(assembly, 0b001, 0b111, rng=rng(), kinds=("lattice",), ground=0.0)
    assert isinstance(held, Failure)
    assert held.proved
    assert isinstance(extract(assembly, 0b001, 0b101, rng=rng(), kinds=("lattice",), ground=0.0), StepMotion)


def test_a_part_that_comes_down_to_the_ground_leaves_under_the_walls():
    part = boxes("part", ((0, 0, 2), (1, 1, 3)))
    walls = boxes(
        "walls",
        ((-1, -1, 2), (0, 2, 4)), ((1, -1, 2), (2, 2, 4)), ((0, -1, 2), (1, 0, 4)), ((0, 1, 2), (1, 2, 4)),
        ((0, 0, 3), (1, 1, 4)),
    )  # fmt: skip
    assembly = ns.Assembly((part, walls))
    path = extract(assembly, 0b01, 0b11, rng=rng(), kinds=("lattice",), ground=1.0)
    assert isinstance(path, StepMotion)
    assert poses(path)[1][2, 3] == pytest.approx(-1.0)
    high = extract(assembly, 0b01, 0b11, rng=rng(), kinds=("lattice",), ground=1.5)
    assert isinstance(high, Failure)
    assert high.proved


def test_only_boxes_and_translations_give_proofs():
    box = boxes("box", ((0, 0, 0), (1, 1, 1)))
    shell = boxes(
        "shell",
        ((-1, -1, -1), (2, 2, 0)), ((-1, -1, 1), (2, 2, 2)), ((-1, -1, 0), (0, 2, 1)), ((1, -1, 0), (2, 2, 1)),
        ((0, -1, 0), (1, 0, 1)), ((0, 1, 0), (1, 2, 1)),
    )  # fmt: skip
    closed = ns.Assembly((box, shell))
    for assembly, kinds, proved in (
        (closed, ("lattice",), True),
        (closed, ("rigid",), False),
        (as_meshes(closed), ("lattice",), False),
    ):
        failure = extract(assembly, 0b01, 0b11, rng=rng(), kinds=kinds, max_checks=3_000)
        assert isinstance(failure, Failure)
        assert failure.proved is proved
        assert failure.because == ("shell",)


def test_groups_leave_as_one():
    assembly = keyhole(0.0)
    pieces = boxes("cap", ((1, 2, 4), (2, 3, 5)))
    assembly = ns.Assembly((*assembly.parts, pieces))
    path = extract(assembly, 0b101, 0b111, rng=rng())
    assert isinstance(path, StepMotion)
    assert path.parts == ("pin", "cap")
    assert isinstance(extract(assembly, 0b001, 0b111, rng=rng(), kinds=("lattice",)), StepMotion)


def test_a_search_without_budget_proves_nothing():
    failure = extract(hook(), 0b01, 0b11, rng=rng(), max_checks=20)
    assert isinstance(failure, Failure)
    assert not failure.proved
    assert "budget" in failure.reason
    late = extract(hook(), 0b01, 0b11, rng=rng(), seconds=0.0)
    assert isinstance(late, Failure)
    assert not late.proved


def test_bad_questions_are_refused():
    with pytest.raises(InputError, match="teleport"):
        extract(hook(), 0b01, 0b11, rng=rng(), kinds=("teleport",))
    with pytest.raises(InputError, match="empty"):
        extract(hook(), 0b11, 0b11, rng=rng())


@st.composite
def pairs(draw):
    """Two parts of unit cells in a small box, or two links of a chain with some cells changed."""
    if draw(st.booleans()):
        owner = {cell: name for name, own in RINGS.cells.items() for cell in own}
        for _ in range(draw(st.integers(0, 3))):
            owner[draw(st.sampled_from(sorted(owner)))] = draw(st.sampled_from("ab."))
    else:
        shape = draw(st.sampled_from([(3, 3, 2), (3, 2, 2), (3, 3, 3)]))
        owner = {cell: draw(st.sampled_from("aabb.")) for cell in itertools.product(*map(range, shape))}
    cells = {name: sorted(c for c, own in owner.items() if own == name) for name in "ab"}
    return cells if all(cells.values()) else {"a": [(0, 0, 0)], "b": [(1, 0, 0)]}


@given(pairs())
@example(RINGS.cells)
@settings(max_examples=40, deadline=None)
def test_for_two_parts_the_lattice_and_the_exact_moves_agree(cells):
    assembly = ns.Assembly.from_cells(cells)
    grid = cells_of(assembly)
    assert grid is not None
    exact = first_separation(grid, 0b11)
    found = extract(assembly, 0b01, 0b11, rng=rng(), kinds=("lattice",))
    assert isinstance(found, StepMotion) == isinstance(exact, Separation)
    if isinstance(found, Failure):
        assert found.proved


@pytest.mark.parametrize("raised", [KeyboardInterrupt, OutOfTime, ValueError])
def test_what_is_raised_under_ompl_is_not_lost(raised):
    asked = 0

    def free(at):
        nonlocal asked
        asked += 1
        if asked > 20:
            raise raised
        return bool(np.abs(at[0]) > 0.01)

    low, high = -np.ones(3), np.ones(3)
    growth = Growth(0.1, 0.01, 0, lambda: asked > 10_000)
    with pytest.raises(raised):
        connected(low, high, low / 2, [high / 2], free, growth)
    assert asked == 21
