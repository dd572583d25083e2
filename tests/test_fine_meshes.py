"""Fine meshes: right values, whatever the triangles, and work that grows with the facets, not with their square."""

from __future__ import annotations

import itertools
import subprocess
import sys

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.geometry.assembly import NO_TABLE
from neurosym.geometry.blocking.mating_overlaps import _least_overlaps
from neurosym.geometry.blocking.shadows import Shadows, _are_wide
from neurosym.geometry.contact import collision
from neurosym.geometry.contact.contacts import TABLE
from neurosym.geometry.contact.overlaps import overlaps
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.mesh import kernels, triangles
from neurosym.geometry.mesh.distances import surface_gaps
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.shapes import Body, Convex, Mesh, Part
from neurosym.support.bitsets import bits
from neurosym.support.compiled import compiled

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def rigid(seed: int, scale: float = 1.0) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3] = scale * Rotation.random(random_state=seed).as_matrix()
    X[:3, 3] = scale * np.random.default_rng(seed).uniform(-30, 30, 3)
    return X


def extruded(plan: shapely.Polygon, low: float, high: float, extra: int = 0, seed: int = 0) -> trimesh.Trimesh:
    """A plan between two heights, its lids triangulated with so many points inside besides the corners."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = plan.bounds
    inside = shapely.points(rng.uniform((x0, y0), (x1, y1), (extra, 2)))
    inside = inside[shapely.contains(plan.buffer(-1e-3), inside)]
    rings = shapely.get_coordinates(plan)
    points = np.unique(np.concatenate([rings, shapely.get_coordinates(inside)]), axis=0)
    if extra:
        every = shapely.delaunay_triangles(shapely.multipoints(points)).geoms
        lids = [t for t in every if plan.buffer(1e-9).contains(t)]
        assert sum(t.area for t in lids) == pytest.approx(plan.area)
    else:
        lids = list(shapely.constrained_delaunay_triangles(plan).geoms)
    soup = []
    for t in lids:
        corners = shapely.get_coordinates(shapely.geometry.polygon.orient(t))[:3]
        soup += [np.column_stack([corners, np.full(3, high)]), np.column_stack([corners[::-1], np.full(3, low)])]
    oriented = shapely.geometry.polygon.orient(plan)
    for ring in (oriented.exterior, *oriented.interiors):
        for a, b in itertools.pairwise(shapely.get_coordinates(ring)):
            p, q, r, s = ([*a, low], [*b, low], [*b, high], [*a, high])
            soup += [np.array([p, q, r]), np.array([p, r, s])]
    corners = np.concatenate(soup)
    mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=True)
    assert mesh.is_watertight
    return mesh


def ring(sections: int, turn: float = 0.0, at: tuple[float, float] = (0.0, 0.0)) -> shapely.Polygon:
    angles = turn + 2 * np.pi * np.arange(sections) / sections
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    return shapely.Polygon(20 * circle + at, [5 * circle + at])


def washers(sections: int) -> dict[str, trimesh.Trimesh]:
    rings = [trimesh.creation.annulus(r_min=5, r_max=20, height=4, sections=sections) for _ in range(3)]
    return {name: mesh.apply_translation((0, 0, 2 + 4 * k)) for k, (name, mesh) in enumerate(zip("abc", rings))}


def blocking(assembly: ns.Assembly, directions: np.ndarray = AXES) -> list[list[int]]:
    return AssemblyGeometry(assembly).blocking(directions).by_part


def between(assembly: ns.Assembly) -> list:
    return [c for c in AssemblyGeometry(assembly).contacts if c.b != TABLE]


# -- values -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sections", [32, 512])
def test_washers_touch_by_their_lids_and_come_apart_from_above(sections):
    assembly = ns.Assembly.from_meshes(washers(sections))
    area = sections / 2 * np.sin(2 * np.pi / sections) * (20**2 - 5**2)
    contacts = between(assembly)
    assert [(c.a, c.b) for c in contacts] == [(0, 1), (1, 2)]
    assert [c.area for c in contacts] == pytest.approx([area, area])
    np.testing.assert_allclose([c.normal for c in contacts], [[0, 0, 1]] * 2, atol=1e-12)
    up, down = [0b110, 0b100, 0], [0, 0b001, 0b011]
    assert blocking(assembly) == [[0] * 3, [0] * 3, up, [0] * 3, [0] * 3, down]
    problem = ns.load_domain("assembly").problem(assembly)
    result = ns.solve(problem, budget=ns.Budget(seconds=5))
    assert result.plan == ("c", "b", "a")


def test_a_pin_in_its_hole_touches_all_round_in_few_patches():
    """Some five hundred facets lie on as many others, each pair in a plane of its own."""
    sections, radius = 512, 5.0
    hole = trimesh.creation.annulus(r_min=radius, r_max=12, height=6, sections=sections)
    pin = trimesh.creation.cylinder(radius=radius, height=6, sections=sections)
    contacts = between(ns.Assembly.from_meshes({"hole": hole, "pin": pin}))
    assert 30 < len(contacts) < 90
    assert sum(c.area for c in contacts) == pytest.approx(2 * np.pi * radius * 6, rel=1e-3)
    normals = np.array([c.normal for c in contacts])
    assert np.linalg.norm(normals.sum(axis=0)) < 0.1 * len(contacts)


def test_bolts_with_play_are_held_sideways_and_leave_by_their_heads():
    centres = [(-10.0, 0.0), (10.0, 0.0)]
    holes = [shapely.Point(c).buffer(4, quad_segs=16) for c in centres]
    plan = shapely.box(-20, -10, 20, 10).difference(shapely.union_all(holes))
    parts = {"low": extruded(plan, 0, 8), "high": extruded(plan, 8, 16)}
    profile = np.array([[0, -2], [3.9, -2], [3.9, 16], [7, 16], [7, 21], [0, 21]], dtype=float)
    for k, centre in enumerate(centres):
        parts[f"bolt{k}"] = trimesh.creation.revolve(profile, sections=64).apply_translation((*centre, 0))
    assembly = ns.Assembly.from_meshes(parts, table=NO_TABLE)
    low, high, first, second = 1, 2, 4, 8
    both = low | high
    expected = [
        [first | second, first | second, both | second, both],
        [first | second, first | second, both, both],
        [high | first | second, first | second, 0, 0],
        [first | second, first | second, both, both | first],
        [first | second, first | second, both, both],
        [0, low, both, both],
    ]
    assert blocking(assembly) == expected
    graph = AssemblyGeometry(assembly).blocking(AXES)
    assert graph.free_directions(2, 0b1111) == [2]


# -- whatever the triangles, the place and the size ---------------------------------------------------------------


@settings(deadline=None, max_examples=12)
@given(
    sections=st.tuples(*[st.sampled_from([24, 96, 200])] * 2),
    turn=st.floats(0, 0.3),
    shift=st.tuples(st.floats(-18, 18), st.floats(-18, 18)),
    extra=st.tuples(*[st.sampled_from([0, 40])] * 2),
    seed=st.integers(0, 10**6),
    scale=st.sampled_from([1e-3, 1.0, 1e3]),
)
def test_lids_that_lie_on_one_another_aside_have_the_area_of_their_polygons(sections, turn, shift, extra, seed, scale):
    one, two = ring(sections[0]), ring(sections[1], turn, shift)
    X = rigid(seed, scale)
    parts = {
        "low": extruded(one, 0, 4, extra[0], seed).apply_transform(X),
        "high": extruded(two, 4, 9, extra[1], seed).apply_transform(X),
    }
    assembly = ns.Assembly.from_meshes(parts, table=NO_TABLE)
    (contact,) = between(assembly)
    common = one.intersection(two)
    assert contact.area / scale**2 == pytest.approx(common.area, rel=1e-5)
    hull = shapely.convex_hull(common)
    np.testing.assert_allclose(ConvexHull((contact.points @ X[:3, :2]) / scale**2).volume, hull.area, rtol=1e-3)
    up = X[:3, 2] / scale
    assert blocking(assembly, np.array([up, -up, X[:3, 0] / scale])) == [[0b10, 0], [0, 0b01], [0, 0]]


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 10**6), st.sampled_from([1e-3, 1.0, 1e3]), st.permutations(range(8)))
def test_blocking_of_round_parts_does_not_depend_on_pose_scale_or_order(seed, scale, order):
    """Balls about a shaft: each hits what is in line with it, on the way that it goes."""
    at = [14 * np.array([np.cos(a), np.sin(a), 0.0]) for a in 2 * np.pi * np.arange(6) / 6]
    meshes = [trimesh.creation.cylinder(radius=10, height=30, sections=96)]
    meshes += [trimesh.creation.icosphere(2, radius=3).apply_translation(p) for p in at]
    meshes.append(trimesh.creation.annulus(r_min=18, r_max=22, height=10, sections=80))
    still = ns.Assembly.from_meshes({str(k): m for k, m in enumerate(meshes)}, table=NO_TABLE)
    X = rigid(seed, scale)
    moved = ns.Assembly.from_meshes({str(k): meshes[k].copy().apply_transform(X) for k in order}, table=NO_TABLE)
    directions = np.concatenate([AXES, [[0.6, 0.0, 0.8], [0.48, 0.64, 0.6]]])
    before, after = blocking(still, directions), blocking(moved, directions @ X[:3, :3].T / scale)
    for d in range(len(directions)):
        for k, mask in enumerate(after[d]):
            assert {order[i] for i in bits(mask)} == set(bits(before[d][order[k]]))


@pytest.mark.parametrize("number", [0, 17, 100, 239])
def test_pieces_as_fine_meshes_are_answered_as_by_integers(number):
    """Nothing of them is a box: each is one mesh, its faces cut finely, and turned."""
    cells = ns.load_domain("soma").solutions()[number]
    exact = blocking(ns.Assembly.from_cells(cells))
    R = Rotation.from_euler("xyz", (12, 31, 7), degrees=True).as_matrix()
    parts = []
    for name, own in cells.items():
        cubes = [trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix(c)) for c in own]
        mesh = trimesh.util.concatenate(cubes).subdivide().subdivide()
        parts.append(Part(name, (Body(Mesh(mesh.vertices @ R.T, mesh.faces), np.eye(4)),), np.eye(4)))
    assert blocking(ns.Assembly(tuple(parts)), AXES @ R.T) == exact


@pytest.mark.parametrize("width", [0.2, 3.0])
def test_strips_narrower_than_the_tolerance_are_wide_together_or_not(width):
    """Two lids cut into strips along x and along y, a tenth of the tolerance wide, lie over one another by a width.

    The width is in tolerances: 0.2 is none to speak of, 3 is in the way.
    """
    touch, count = 1e-3, 60
    strip = touch / 10
    along = np.linspace(0, count * strip, count + 1)
    rim = [*((x, 0.0) for x in along), *((x, 1.0) for x in along[::-1])]
    low = extruded(shapely.Polygon(rim), 0, 1)
    aside = along[-1] - width * touch
    high = extruded(shapely.box(aside, -1, aside + 2, 2), 5, 6)
    far = trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix((90, 0, 0)))
    assembly = ns.Assembly.from_meshes({"low": low, "high": high, "far": far}, table=NO_TABLE)
    # The smallest extent is that of the narrow part: the tolerance is stated in it.
    share = touch / assembly.smallest_extent
    stated = ns.Assembly(assembly.parts, NO_TABLE, tolerances=ns.geometry.tolerances.Tolerances(touch=share))
    assert blocking(stated, np.array([[0, 0, 1.0]]))[0][0] == (0b010 if width > 1 else 0)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.floats(0.3, 3), st.sampled_from([1e-6, 1.0, 1e4]))
def test_slivers_are_wide_together_where_they_leave_nothing_out(seed, side, scale):
    """A square of so many tolerances cut into some hundred pieces, most of them slivers, holds a disc or does not."""
    rng = np.random.default_rng(seed)
    cuts = np.sort(np.concatenate([[0.0, 1.0], rng.uniform(0, 1, 40) ** 4, rng.choice([0.5, 0.5 + 1e-9], 3)]))
    a, b = cuts[:-1, None], cuts[1:, None]
    one, zero = np.ones_like(a), np.zeros_like(a)
    corners = [np.stack([np.hstack(c) for c in ((a, zero), (b, zero), (b, one))], axis=1)]
    corners.append(np.stack([np.hstack(c) for c in ((a, zero), (b, one), (a, one))], axis=1))
    triangles_of = np.concatenate(corners) * side
    turn = rng.uniform(0, 6)
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    padded = np.concatenate([triangles_of, np.repeat(triangles_of[:, 2:], 5, axis=1)], axis=1)
    pieces = padded @ R.T + rng.uniform(-9, 9, 2)
    if abs(side - 1) > 0.02:
        assert _are_wide(scale * pieces, scale) is (side > 1)


# -- overlaps -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [None, 3])
@pytest.mark.parametrize("depth", [0.0, 0.004, 0.3])
def test_fine_lids_that_overlap_do_so_by_the_depth_of_the_layer(depth, seed):
    low = extruded(ring(400), 0, 4)
    high = extruded(ring(300, 0.1, (3.0, 1.0)), 4 - depth, 9)
    X = np.eye(4) if seed is None else rigid(seed)
    meshes = [m.apply_transform(X) for m in (low, high)]
    parts = tuple(Part(n, (Body(Mesh(m.vertices, m.faces), np.eye(4)),), np.eye(4)) for n, m in zip("ab", meshes))
    deep = overlaps(BodySurfaces(ns.Assembly(parts).bodies))
    assert [o.depth for o in deep] == pytest.approx([depth] if depth else [], rel=1e-4)


def test_a_ball_within_another_part_is_found_though_no_surfaces_cross():
    block = trimesh.creation.icosphere(4, radius=3)
    ball = trimesh.creation.icosphere(4, radius=1)
    parts = tuple(
        Part(n, (Body(Convex(m.vertices, m.faces), np.eye(4)),), np.eye(4)) for n, m in (("a", block), ("b", ball))
    )
    (deep,) = overlaps(BodySurfaces(ns.Assembly(parts).bodies))
    assert deep.depth == pytest.approx(2.0, rel=0.05)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6), st.floats(0, 2.5), st.floats(0.01, 1))
def test_the_shortest_way_apart_is_that_of_all_facets_against_all_corners(seed, shift, limit):
    rng = np.random.default_rng(seed)
    clouds = [rng.normal(size=(30, 3)), np.add(rng.normal(size=(20, 3)), (shift, 0, 0))]
    hulls = [ConvexHull(c) for c in clouds]
    planes = np.concatenate([h.equations for h in hulls])
    corners = np.concatenate([c[h.vertices] for c, h in zip(clouds, hulls)])
    first = [np.cumsum([0, *sizes]) for sizes in ([len(h.equations) for h in hulls], [len(h.vertices) for h in hulls])]
    heights = [clouds[1 - k] @ hulls[k].equations[:, :3].T + hulls[k].equations[:, 3] for k in (0, 1)]
    best = max(h.min(axis=0).max() for h in heights)
    depth, way = _least_overlaps(planes, first[0], corners, first[1], np.array([[0, 1]]), limit)
    assert depth[0] == pytest.approx(-best if -best <= limit else np.inf)
    if np.isfinite(depth[0]):
        # Moved by as much, the second is off the first.
        moved = clouds[1] + way[0] * depth[0]
        outward = [hulls[0].equations[:, :3], -hulls[1].equations[:, :3]]
        clear = [((moved @ n.T).min(axis=0) - (clouds[0] @ n.T).max(axis=0)).max() for n in outward]
        assert max(clear) >= -1e-9


# -- loops against what they stand for ----------------------------------------------------------------------------


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6))
def test_what_two_triangles_have_in_common_is_what_polygons_have(seed):
    one, two = np.random.default_rng(seed).normal(size=(2, 20, 3, 2))
    areas, corners, counts = kernels.common_parts(one, two)
    common = shapely.intersection(shapely.polygons(one), shapely.polygons(two))
    np.testing.assert_allclose(areas, shapely.area(common), atol=1e-12)
    for area, own, count in zip(areas, corners, counts):
        if area > 1e-6:
            assert shapely.convex_hull(shapely.multipoints(own[:count])).area == pytest.approx(area)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6), st.floats(0, 4))
def test_gaps_between_surfaces_are_those_of_fcl(seed, shift):
    shapes = [trimesh.convex.convex_hull(np.random.default_rng(seed + k).normal(size=(12, 3))) for k in (0, 1)]
    shapes[1].apply_translation((shift, shift / 2, 0))
    t = np.concatenate([np.asarray(m.triangles) for m in shapes])
    first = np.cumsum([0, *(len(m.faces) for m in shapes)])
    low, high = kernels.tree_bounds(t, np.ones(len(t), dtype=bool), first)
    pair = np.array([[0, 1]])
    a, b = (collision.mesh_object(Convex(m.vertices, m.faces), np.eye(4)) for m in shapes)
    expected = 0.0 if collision.collide(a, b) else collision.distance(a, b)
    gap = float(surface_gaps(pair, t, low, high, first, 0.0, np.inf)[0])
    assert gap == pytest.approx(expected, abs=1e-6)
    assert bool(surface_gaps(pair, t, low, high, first, 0.5, 1.0)[0] <= 0.5) is (gap <= 0.5)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10**6), counts=st.tuples(*[st.sampled_from([1, 2, 3, 200])] * 2), gap=st.floats(0, 0.3))
def test_facing_pairs_are_those_whose_boxes_meet_and_whose_normals_are_opposite(seed, counts, gap):
    rng = np.random.default_rng(seed)
    t = rng.uniform(0, 10, (sum(counts), 1, 3)) + rng.uniform(0, 0.5, (sum(counts), 3, 3))
    normals = triangles.unit_normals(t)
    first = np.array([0, counts[0], sum(counts)])
    trees = kernels.tree_bounds(t, np.ones(len(t), dtype=bool), first)
    near = kernels.facing_pairs(*trees, *trees, normals, first, np.array([[0, 1]]), np.array([gap]), 1.0)
    low, high = t.min(axis=1), t.max(axis=1)
    meet = (low[:, None] - gap <= high).all(axis=2) & (low - gap <= high[:, None]).all(axis=2)
    meet &= normals @ normals.T < -0.1
    meet[counts[0] :] = meet[:, : counts[0]] = False
    assert {(i, j) for _, i, j in near.tolist()} == {tuple(p) for p in np.argwhere(meet).tolist()}
    assert len(near) == np.count_nonzero(meet)


@pytest.mark.parametrize("shape", ["annulus", "icosphere", "capsule", "box", "two boxes", "bent"])
@pytest.mark.parametrize("seed", [0, 1])
def test_convex_is_what_has_no_vertex_above_any_face(shape, seed):
    box = trimesh.creation.box((1, 2, 3))
    meshes = {
        "annulus": trimesh.creation.annulus(r_min=1, r_max=2, height=1, sections=700),
        "icosphere": trimesh.creation.icosphere(3),
        "capsule": trimesh.creation.capsule(count=(20, 20)),
        "box": box.subdivide().subdivide(),
        "two boxes": trimesh.util.concatenate([box, box.copy().apply_translation((3, 0, 0))]),
        "bent": box.copy().subdivide(),
    }
    if shape == "bent":
        meshes["bent"].vertices[8] *= 0.99
    mesh = meshes[shape].apply_transform(rigid(seed))
    margin = 1e-6
    above = [(mesh.vertices - t[0]) @ n for t, n in zip(mesh.triangles, mesh.face_normals)]
    assert triangles.are_convex(np.array(mesh.vertices), np.array(mesh.faces), margin) is bool(np.max(above) <= margin)


# -- how the work grows -------------------------------------------------------------------------------------------


def power(sizes, counts) -> float:
    return float(np.polyfit(np.log(sizes), np.log(counts), 1)[0])


class Nodes:
    """Labels of nodes, none of which has one: they are asked for where the bounds of two nodes meet."""

    asked = 0

    def __getitem__(self, node: int) -> int:
        self.asked += 1
        return -1


@pytest.mark.parametrize("seed", [None, 5])
def test_pairs_of_triangles_looked_at_grow_with_the_facets_not_with_their_square(seed):
    sizes, looked_at = (64, 128, 256), []
    for sections in sizes:
        meshes = [m.apply_transform(np.eye(4) if seed is None else rigid(seed)) for m in washers(sections).values()]
        surfaces = BodySurfaces(ns.Assembly.from_meshes(dict(zip("abc", meshes))).bodies)
        exact, is_flat, gap = surfaces.exact, surfaces.flats.of_triangle >= 0, 1e-2
        small, flat = (exact.facing_trees(used, gap, 1e-4) for used in (~is_flat, is_flat))
        assert np.bincount(surfaces.flats.of_triangle + 1)[1:].tolist() == [2 * sections] * 6
        nodes = Nodes()
        for one, two in ((small, small), (small, flat), (flat, small)):
            pair = np.array([0, 1])
            walk = kernels.meeting.__wrapped__(*one, *two, nodes, exact.first, pair, np.zeros(6), gap)
            assert not list(walk)
        looked_at.append(nodes.asked)
    assert power(sizes, looked_at) < 1.3


def test_crossings_are_looked_for_along_neighbours_alone():
    """Lids of a tube, of which every triangle's bounds meet those of most others, are left out as they are flat."""
    sizes, looked_at = (64, 128, 256), []
    for sections in sizes:
        mesh = washers(sections)["a"]
        seen = 0
        real = kernels.straddling_pairs

        def counting(*given, real=real):
            nonlocal seen
            low, high, low_b, high_b, labels, _, _, first, pairs, _ = given
            walk = kernels.meeting.__wrapped__(low, high, low_b, high_b, labels, first, pairs[0], np.zeros(3), 0.0)
            seen += sum(1 for _ in walk)
            return real(*given)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(kernels, "straddling_pairs", counting)
            assert not len(triangles.crossing_pairs(np.array(mesh.vertices), np.array(mesh.faces), 1e-4))
        looked_at.append(seen)
    assert power(sizes, looked_at) < 1.3


def test_one_overlap_that_is_deep_and_wide_ends_the_search():
    """Of two thousand facets under a lid of as many, only the first few pairs are clipped."""
    meshes = washers(512)
    surfaces = BodySurfaces(ns.Assembly.from_meshes(meshes).bodies)
    shadows = Shadows(surfaces.exact, np.eye(3), 4e-3)
    clipped = 0
    walk = kernels.meeting.__wrapped__(
        *shadows._trees, np.full(2 * len(shadows.triangles), -1), shadows.first, np.array([0, 2]), np.zeros(3), 0.0
    )
    for i, j in walk:
        clipped += 1
        one, two = shapely.polygons(shadows.triangles[[i, j], :, :2])
        if one.intersection(two).area > 1e-3 or clipped > 200:
            break
    assert clipped < 200


# -- compiled loops ----------------------------------------------------------------------------------------------


def test_nothing_is_compiled_by_importing():
    program = (
        "import sys\n"
        "from neurosym.geometry.blocking import sweep\n"
        "from neurosym.geometry.mesh import connections, distances, kernels, trees\n"
        "assert 'numba' not in sys.modules\n"
        "assert trees.tree_labels.__doc__.startswith('int64')\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", program], check=True)


def test_what_cannot_be_kept_on_disk_is_compiled_all_the_same(recwarn):
    """Without a file of its own a function has no place there, as in a folder that cannot be written."""
    space: dict[str, object] = {}
    exec(compile("def twice(x):\n    return 2 * x\n", "<nowhere>", "exec"), space)
    assert compiled(space["twice"])(21) == 42
    assert not recwarn
