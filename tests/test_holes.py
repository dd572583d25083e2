"""Parts with holes and play in the simulator: decomposed exactly, looked at before anything moves, or refused."""

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from trimesh.creation import cylinder, extrude_polygon, icosphere, revolve

import neurosym as ns
from neurosym.simulation import replay_plan
from neurosym.simulation.layers import convex_parts, layered

AT = [(-14.0, 0.0), (14.0, 0.0)]


def plate(height, z, hole=3.1, around=4):
    """A round plate with a hole at each of `AT`, as many facets a quarter as `around`."""
    outline = shapely.Point(0, 0).buffer(22, quad_segs=around)
    for x, y in AT:
        outline = outline.difference(shapely.Point(x, y).buffer(hole, quad_segs=around))
    return extrude_polygon(outline, height).apply_translation((0, 0, z))


def bolt(x, y, z, around=16):
    profile = [(0, -14), (3, -14), (3, 0), (5, 0), (5, 4), (0, 4)]
    return revolve(profile, sections=around).apply_translation((x, y, z))


def volume_of(pieces):
    return sum(ConvexHull(piece).volume for piece in pieces)


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.sampled_from(["plate", "bolt", "tube"]), st.floats(0.01, 100))
@settings(max_examples=20, deadline=None)
def test_layers_have_the_volume_of_the_mesh_however_it_lies(turn, shape, scale):
    tube = trimesh.creation.annulus(2, 5, 7, sections=20)
    mesh = {"plate": plate(5, 0), "bolt": bolt(0, 0, 0), "tube": tube}[shape]
    vertices = np.asarray(scale * mesh.vertices @ Rotation.from_rotvec(turn).as_matrix().T)
    pieces = layered(vertices, np.asarray(mesh.faces))
    assert pieces is not None
    assert volume_of(pieces) == pytest.approx(mesh.volume * scale**3, rel=1e-4)


def test_no_piece_reaches_into_a_hole_and_a_ball_is_in_no_layers():
    mesh = plate(5, 0)
    for piece in layered(np.asarray(mesh.vertices), np.asarray(mesh.faces)):
        flat = shapely.convex_hull(shapely.MultiPoint(piece[:, :2]))
        assert all(flat.intersection(shapely.Point(at).buffer(3.0, quad_segs=4)).area < 1e-6 for at in AT)
    ball = icosphere(2)
    assert layered(np.asarray(ball.vertices), np.asarray(ball.faces)) is None


@given(st.integers(3, 12), st.integers(3, 12), st.floats(0.1, 0.8))
@settings(max_examples=25, deadline=None)
def test_polygons_with_a_hole_fall_into_convex_ones(outer, inner, share):
    def regular(n, r):
        t = 2 * np.pi * np.arange(n) / n
        return np.column_stack([r * np.cos(t), r * np.sin(t)])

    polygon = shapely.Polygon(regular(outer, 1.0)).difference(shapely.Polygon(regular(inner, 0.49 * share)))
    parts = [shapely.Polygon(p) for p in convex_parts(polygon)]
    assert sum(p.area for p in parts) == pytest.approx(polygon.area)
    assert all(p.convex_hull.area == pytest.approx(p.area) for p in parts)
    assert shapely.union_all(parts).symmetric_difference(polygon).area < 1e-9


def problem(meshes):
    return ns.load_domain("assembly").problem(ns.Assembly.from_meshes(meshes, units="mm"))


def test_a_flange_a_cover_and_bolts_with_play_stand_still():
    """Holes are 0.1 mm wider than bolts. Solid plates, as a hull has them, would throw the bolts out by 100 mm."""
    meshes = {"flange": plate(12, 0), "cover": plate(5, 12)}
    meshes |= {f"bolt {i}": bolt(x, y, 17) for i, (x, y) in enumerate(AT)}
    made = problem(meshes)
    result = ns.solve(made)
    report = replay_plan(made, result.plan, result.motions)
    assert report.ok, report.start.reason
    assert report.start.displacement < 0.3  # by their play, at the most
    assert all(step.displacement < 0.5 for step in report.steps)


def test_what_the_simulator_cannot_represent_gets_no_verdict(monkeypatch):
    """The bolt sits in a hole that a hull fills: there is nothing to say of the parts."""
    made = problem({"plate": plate(16, 0), "bolt": bolt(*AT[0], 16)})
    result = ns.solve(made)
    from neurosym.simulation import decomposition

    def filled(name, vertices, faces):
        return [np.asarray(vertices)]

    monkeypatch.setattr(decomposition, "convex_pieces", filled)
    with pytest.raises(ns.AssemblyError, match=r"(?s)plate and bolt|bolt and plate.* no verdict"):
        replay_plan(made, result.plan, result.motions)


def test_a_peg_in_a_blind_hole_is_not_pushed_out_by_a_hull():
    """The block fills 97% of its hull, and the hole is where the peg is."""
    block = revolve([(0, 0), (20, 0), (20, 16), (3.1, 16), (3.1, 8), (0, 8)], sections=16)
    peg = cylinder(3.0, 12, sections=16).apply_translation((0, 0, 14))
    made = problem({"block": block, "peg": peg})
    result = ns.solve(made)
    report = replay_plan(made, result.plan, result.motions)
    assert report.ok, report.start.reason
