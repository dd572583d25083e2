"""Geometry of many parts, of parts that are fixed or held, and of meshes that only nearly fit."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.geometry.assembly import NO_TABLE
from neurosym.geometry.blocking.directions import directions_for
from neurosym.geometry.contact.contacts import TABLE
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.readers.meshes import parts_from_meshes
from neurosym.geometry.tolerances import Tolerances
from neurosym.support.bitsets import bits

DATA = Path(__file__).parents[2] / "shared" / "data"
AXES = np.concatenate([np.eye(3), -np.eye(3)])


def rigid(angles=(0.0, 0.0, 0.0), shift=(0.0, 0.0, 0.0)) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    X[:3, 3] = shift
    return X


def arch(blocks=9, *, inner=2.0, outer=2.6, X=None, names=None, friction=0.5):
    """A half circle of wedges whose first and last are fixed."""
    meshes = {}
    angles = np.linspace(0, np.pi, blocks + 1)
    for k in range(blocks):
        ring = [
            (r * np.cos(t), y, r * np.sin(t)) for t in angles[k : k + 2] for r in (inner, outer) for y in (0.0, 1.0)
        ]
        mesh = trimesh.convex.convex_hull(np.array(ring))
        meshes[f"v{k}"] = mesh if X is None else mesh.apply_transform(X)
    order = list(meshes) if names is None else names
    assembly = ns.Assembly.from_meshes({n: meshes[n] for n in order}, friction=friction)
    return assembly.with_fixed(["v0", f"v{blocks - 1}"])


def stack(draw) -> dict[str, list[tuple[int, int, int]]]:
    """Beams of one to three cells, laid on one another in a plane, some of them over a void."""
    taken, cells = set(), {}
    for k in range(draw(st.integers(2, 9))):
        width, x = draw(st.integers(1, 3)), draw(st.integers(0, 4))
        z = 0
        while any((x + i, 0, z) in taken for i in range(width)):
            z += 1
        own = [(x + i, 0, z) for i in range(width)]
        taken.update(own)
        cells[f"p{k}"] = own
    return cells


stacks = st.composite(stack)()


@settings(max_examples=12, deadline=None)
@given(stacks, st.data())
@pytest.mark.parametrize("local", [False, True])
def test_answers_are_those_of_the_linear_program(local, cells, data):
    """Also when each is asked after another one, and answered from what is near the change."""
    from neurosym.geometry.stability import standing as module

    with pytest.MonkeyPatch.context() as patch:
        if local:
            patch.setattr(module, "SMALL", 0)
        assembly = ns.Assembly.from_cells(cells)
        quick, slow = AssemblyGeometry(assembly).limit, AssemblyGeometry(assembly, tabulate=False).limit
        subset = (1 << len(cells)) - 1
        for part in data.draw(st.permutations(range(len(cells)))):
            held = data.draw(st.sampled_from([0, 0, 1 << data.draw(st.integers(0, len(cells) - 1))]))
            answer = quick.standing(subset, held)
            assert answer.stands is slow.by_program(subset, held).stands
            if not answer.stands:
                assert answer.moving
                assert not answer.moving & (held | ~subset)
                # They fall even where all others are immovable: that is what the evidence promises.
                assert not slow.by_program(subset, subset & ~answer.moving).stands
            subset &= ~(1 << part)


@settings(max_examples=15, deadline=None)
@given(stacks, st.integers(0, 2))
@example(
    cells={
        "p0": [(3, 0, 0)], "p1": [(4, 0, 0)], "p2": [(0, 0, 0)], "p3": [(3, 0, 1), (4, 0, 1)], "p4": [(3, 0, 2)],
        "p5": [(3, 0, 3), (4, 0, 3), (5, 0, 3)], "p6": [(3, 0, 4)],
    },
    most=1,
)  # fmt: skip
def test_hands_are_found_exactly_where_some_set_helps(cells, most):
    geometry = AssemblyGeometry(ns.Assembly.from_cells(cells))
    subset = (1 << len(cells)) - 1 & ~1
    sets = [sum(c) for k in range(most + 1) for c in itertools.combinations([1 << i for i in bits(subset)], k)]
    for stability in (geometry.limit, geometry.springs):
        answer = stability.standing_when_held(subset, most)
        assert answer.stands is any(stability.standing(subset, held).stands for held in sets)
        if answer.stands:
            assert answer.held.bit_count() <= most
            assert stability.standing(subset, answer.held).stands
        elif answer.promises:
            # Nothing less stands either, while all that moved one way or another are there.
            assert not stability.standing_when_held(answer.moving, most).stands


@pytest.mark.parametrize("friction", [0.5, 0.8])
def test_an_arch_stands_between_its_springers_until_one_block_goes(friction):
    assembly = arch(friction=friction)
    stability, full = AssemblyGeometry(assembly).stability, (1 << 9) - 1
    assert stability.standing(full).stands
    assert not stability.standing(full & ~assembly.fixed_mask).stands
    for block in range(1, 8):
        fallen = stability.standing(full & ~(1 << block))
        assert not fallen.stands
        assert not fallen.moving & assembly.fixed_mask
    held = stability.standing_when_held(full & ~0b10, 1)
    assert held.stands
    assert held.held.bit_count() == 1


@settings(max_examples=6, deadline=None)
@given(
    st.integers(0, 3),
    st.tuples(*[st.floats(-300, 300)] * 3),
    st.sampled_from([1e-3, 1.0, 1e3]),
    st.permutations([f"v{k}" for k in range(7)]),
)
def test_verdicts_do_not_depend_on_pose_scale_or_names(turns, shift, scale, names):
    still = arch(7)
    X = rigid((0, 0, 90 * turns), shift)
    moved = arch(7, X=np.diag([scale, scale, scale, 1]) @ X, names=names)
    place = [still.index[n] for n in names]

    def renamed(mask: int) -> int:
        return sum(1 << k for k, old in enumerate(place) if mask >> old & 1)

    directions = np.concatenate([AXES, [[0.6, 0, 0.8], [0.0, 0.6, 0.8]]])
    first, second = AssemblyGeometry(still), AssemblyGeometry(moved)
    before, after = first.blocking(directions), second.blocking(directions @ X[:3, :3].T)
    full = (1 << 7) - 1
    for d in range(len(directions)):
        assert [after.by_part[d][k] for k in range(7)] == [renamed(before.by_part[d][old]) for old in place]
    for block in range(7):
        a = first.limit.standing(full & ~(1 << block))
        b = second.limit.standing(full & ~(1 << place.index(block)))
        assert (b.stands, b.moving) == (a.stands, renamed(a.moving))
        by_springs = [g.springs.standing(full & ~(1 << k)) for g, k in ((first, block), (second, place.index(block)))]
        assert by_springs[0].stands is by_springs[1].stands


def test_light_parts_count_and_heavy_ones_may_rest_on_them():
    cells = {"heavy": [(0, 0, 1)], "shim": [(0, 0, 0)], "floating": [(3, 0, 1)], "far": [(5, 0, 0)]}
    parts = ns.Assembly.from_cells(cells).parts
    density = {"heavy": 1e4, "shim": 1e-2, "floating": 1e-2, "far": 1e4}
    assembly = ns.Assembly(tuple(ns.geometry.shapes.Part(p.name, p.bodies, p.X_WP, density[p.name]) for p in parts))
    stability = AssemblyGeometry(assembly).stability
    answer = stability.standing(0b1111)
    assert assembly.in_mask(answer.moving) == ("floating",)
    assert stability.standing(assembly.mask(["heavy", "shim", "far"])).stands


def test_without_a_table_only_what_is_fixed_carries():
    cells = {"base": [(0, 0, 0), (1, 0, 0)], "top": [(0, 0, 1)]}
    floating = ns.Assembly.from_cells(cells, table=NO_TABLE)
    geometry = AssemblyGeometry(floating)
    assert not geometry.stability.standing(0b11).stands
    assert geometry.stability.standing(0b11, held=0b01).stands
    assert AssemblyGeometry(floating.with_fixed(["base"])).stability.standing(0b11).stands
    graph = geometry.blocking()
    assert not graph.into_table.any()
    assert [graph.describe(d) for d in graph.free_directions(0, 0b11)] == ["+y", "+x", "-x", "-y", "-z"]
    assert floating.transformed(rigid((90, 0, 0))).ground == NO_TABLE
    assert AssemblyGeometry(floating.with_table(0.0)).stability.standing(0b11).stands


# -- directions ---------------------------------------------------------------------------------------------------


def test_directions_come_from_words_numbers_and_vectors():
    assembly = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(1, 0, 0)]})
    np.testing.assert_allclose(directions_for(assembly, "+z,-x"), [[0, 0, 1], [-1, 0, 0]])
    np.testing.assert_allclose(directions_for(assembly, "axes"), assembly.axes)
    np.testing.assert_allclose(directions_for(assembly, [0, 3, 4]), [[0, 0.6, 0.8]])
    assert len(directions_for(assembly, "axes,+z")) == 6
    for sampled in (directions_for(assembly, 100), directions_for(assembly, "100")):
        np.testing.assert_allclose(np.linalg.norm(sampled, axis=1), 1)
        apart = np.linalg.norm(sampled[:, None] - sampled[None], axis=2) + 9 * np.eye(100)
        assert apart.min() > 0.2  # an even spread of 100 over the sphere is about 0.3 apart


@pytest.mark.parametrize(
    "spec", ["up", "", "+w", 0, -3, 10**6, [], [[0, 0, 0]], [[1, 2]], [[np.inf, 0, 0]], object(), True]
)
def test_other_directions_are_refused(spec):
    with pytest.raises(ns.InputError, match="directions"):
        directions_for(ns.Assembly.from_cells({"a": [(0, 0, 0)]}), spec)


def test_a_slanted_key_leaves_only_as_its_contacts_let_it():
    """A bar in a slanted tube: no axis of the world is free, the tube's own is."""
    bar = trimesh.creation.box((1, 1, 4))
    walls = [((3, 1, 3), (0, 1, 0)), ((3, 1, 3), (0, -1, 0)), ((1, 1, 3), (1, 0, 0)), ((1, 1, 3), (-1, 0, 0))]
    X = rigid((25, 40, 10))
    meshes = {"bar": bar.apply_transform(X)}
    for k, (size, at) in enumerate(walls):
        side = trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))
        meshes[f"wall{k}"] = side.apply_transform(X)
    assembly = ns.Assembly.from_meshes(meshes, table=NO_TABLE)
    full = (1 << len(assembly)) - 1
    geometry = AssemblyGeometry(assembly)
    world = geometry.blocking(AXES)
    assert world.free_directions(0, full) == []
    own = geometry.blocking("contacts")
    free = own.directions[own.free_directions(0, full)]
    assert len(free) == 2
    np.testing.assert_allclose(np.abs(free @ X[:3, 2]), 1, atol=1e-9)


# -- groups -------------------------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(stacks, st.data())
def test_groups_are_the_smallest_that_leave(cells, data):
    assembly = ns.Assembly.from_cells(cells, table=NO_TABLE)
    fixed = data.draw(st.sampled_from([(), (next(iter(cells)),)]))
    assembly = assembly.with_fixed(fixed)
    graph = AssemblyGeometry(assembly).blocking(AXES)
    among = data.draw(st.integers(1, (1 << len(cells)) - 1))
    for d in range(6):
        leaving = [
            g for g in range(1, 1 << len(cells)) if not g & ~among and not graph.group_blockers(g, d, among)
        ] if len(cells) <= 6 else None
        for part in bits(among):
            group = graph.leaving_group(part, d, among)
            if group:
                assert group >> part & 1
                assert not graph.group_blockers(group, d, among)
                assert not group & assembly.fixed_mask
            if leaving is not None:
                holding = [g for g in leaving if g >> part & 1]
                assert graph.carried(1 << part, d, among) == min(holding, key=int.bit_count)
        left = among
        for component in graph.components(d, among):
            assert not graph.group_blockers(component, d, left)
            left &= ~component
        assert left == sum(1 << p for p in bits(among) if not graph.leaving_group(p, d, among))


def test_nothing_moves_into_the_table():
    assembly = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(0, 0, 1)]})
    graph = AssemblyGeometry(assembly).blocking("-z,+z")
    assert graph.leaving_group(0, 0, 0b11) == 0
    assert graph.components(0, 0b11) == []
    assert graph.leaving_group(0, 0, 0b11, table=False) == 0b01
    assert graph.leaving_group(0, 1, 0b11) == 0b11


# -- meshes that nearly fit ---------------------------------------------------------------------------------------


def test_opposite_directions_are_asked_once_and_agree_with_asking_twice():
    geometry = AssemblyGeometry(arch(7))
    directions = np.array([[0.6, 0.0, 0.8], [0, 1.0, 0], [0.0, 0.6, 0.8]])
    both = geometry.blocking(np.concatenate([directions, -directions]))
    assert both.by_part[3:] == geometry.blocking(-directions).by_part


@pytest.mark.parametrize("depth", [0.0, 0.02, 0.04, 0.2])
def test_parts_that_overlap_a_little_touch_and_do_not_block(depth):
    low, high = trimesh.creation.box((2.13, 1.71, 1)), trimesh.creation.box((2, 2, 1.003))
    high.apply_transform(rigid((0, 0, 20)))
    high.apply_translation((0, 0, 1.0015 - depth))
    meshes = {name: (np.array(m.vertices), np.array(m.faces)) for name, m in (("low", low), ("high", high))}
    # What overlaps deeply is refused by `from_meshes`, and asked of all the same.
    deep = depth > 0.1
    assembly = ns.Assembly(parts_from_meshes(meshes, Tolerances())) if deep else ns.Assembly.from_meshes(meshes)
    geometry = AssemblyGeometry(assembly)
    graph = geometry.blocking(np.array([[0, 0, 1.0], [1, 0, 0], [0.6, 0, 0.8]]))
    between = [c for c in geometry.contacts if c.b != TABLE]
    if depth < 0.1:
        assert len(between) == 1
        assert [graph.blockers(1, d, 0b11) for d in range(3)] == [0, 0, 0]
        assert graph.blockers(0, 0, 0b11) == 0b10
        assert geometry.stability.standing(0b11).stands
    else:
        assert not between
        assert [graph.blockers(1, d, 0b11) for d in range(3)] == [0b01, 0b01, 0b01]


@pytest.mark.parametrize("times", [0, 2, 3])
def test_finer_triangles_give_the_same_answers(times):
    cells = {"l": [(0, 0, 0), (1, 0, 0), (0, 0, 1)], "s": [(1, 0, 1), (1, 1, 1)], "far": [(1, 1, 3)]}
    meshes = {}
    for name, own in cells.items():
        boxes = [trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix(c)) for c in own]
        mesh = trimesh.util.concatenate(boxes).apply_transform(rigid((12, 31, 7)))
        for _ in range(times):
            mesh = mesh.subdivide()
        meshes[name] = mesh
    meshes["tip"] = trimesh.creation.icosphere(2, radius=0.3).apply_translation((40, 0, 0))
    assembly = ns.Assembly.from_meshes(meshes)
    directions = AXES @ rigid((12, 31, 7))[:3, :3].T
    exact = AssemblyGeometry(ns.Assembly.from_cells(cells)).blocking(AXES)
    among = 0b111
    graph = AssemblyGeometry(assembly).blocking(directions)
    assert [[m & among for m in row[:3]] for row in graph.by_part] == exact.by_part


def test_round_parts_touch_though_no_facets_lie_in_one_plane():
    hole = trimesh.creation.annulus(r_min=1.0, r_max=2.0, height=1.0, sections=64)
    pin = trimesh.creation.cylinder(radius=1.0, height=3.0, sections=48)
    pair = [m.apply_transform(rigid((90, 0, 0), (0, 0, 2.0))) for m in (hole, pin)]
    assembly = ns.Assembly.from_meshes({"ring": pair[0], "pin": pair[1]}, table=NO_TABLE).with_fixed(["ring"])
    geometry = AssemblyGeometry(assembly)
    assert {(c.a, c.b) for c in geometry.contacts} == {(0, 1)}
    assert geometry.stability.standing(0b11).stands


# -- structures by others -----------------------------------------------------------------------------------------


def structure(name: str) -> ns.Assembly:
    folder = DATA / name
    if not folder.is_dir():
        pytest.skip(f"No ../shared/data/{name} here.")
    meshes = {p.stem: trimesh.load(p, force="mesh") for p in sorted((folder / "parts").glob("*.obj"))}
    return ns.Assembly.from_meshes(meshes).with_fixed(json.loads((folder / "supports.json").read_text())["fixed"])


def test_the_arch_of_thirty_stands_and_no_block_can_go():
    assembly = structure("arch")
    stability, full = AssemblyGeometry(assembly).stability, (1 << 30) - 1
    assert stability.standing(full).stands
    assert not any(stability.standing(full & ~(1 << k)).stands for k in range(1, 29))
    assert stability.standing_when_held(full & ~0b10, 1).stands


def test_the_wall_comes_apart_from_above():
    assembly = structure("wall")
    geometry = AssemblyGeometry(assembly)
    graph, stability = geometry.blocking(), geometry.stability
    there = (1 << len(assembly)) - 1
    down = np.argsort(-assembly.body_bounds[:, 1, 2])
    while left := [p for p in map(int, down) if there & ~assembly.fixed_mask & 1 << p]:
        going = (p for p in left if graph.free_directions(p, there) and stability.standing(there & ~(1 << p)).stands)
        there &= ~(1 << next(going))


def test_a_dome_of_527_stands_on_its_fixed_ring():
    assembly = structure("dome")
    geometry = AssemblyGeometry(assembly)
    stability, full = geometry.limit, (1 << 527) - 1
    assert stability.standing(full).stands
    graph = geometry.blocking("+z")
    assert sum(graph.blockers(p, 0, full) == 0 for p in range(527)) == 31
    top = next(p for p in range(527) if graph.blockers(p, 0, full) == 0)
    fallen = stability.standing(full & ~(1 << top))
    assert not fallen.stands
    assert not stability.standing(full & ~(1 << top), full & ~fallen.moving).stands
    stone = assembly.index["408"]
    fallen = stability.standing(full & ~(1 << stone))
    assert 0 < fallen.moving.bit_count() < 50
    assert stability.asked["program"] == 0


def test_newtons_method_converges_on_all_of_a_dome_at_once():
    """Asked without any forces to begin with; where steps were only halved it ended before."""
    from neurosym.geometry.stability.equilibrium import QUICK, THOROUGH

    assembly = structure("dome")
    equilibrium, stone = AssemblyGeometry(assembly).limit.equilibrium, assembly.index["408"]
    loose = np.array([not assembly.fixed_mask >> k & 1 and k != stone for k in range(527)] + [False])
    between = (loose[equilibrium.a] | loose[equilibrium.b]) & (equilibrium.a != stone) & (equilibrium.b != stone)
    parts, corners = np.flatnonzero(loose), np.flatnonzero(between)
    balance = equilibrium.balance(parts, corners, equilibrium.weights[parts], steps=QUICK + THOROUGH)
    assert balance.stands is False
