"""Replays in PyBullet: what stands still, what falls, what is in the way, and files that are no plans."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import ImageGrab
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.cli import main
from neurosym.errors import InputError, NeurosymError, UnknownNameError
from neurosym.geometry.shapes import Body, Box, Mesh, Part
from neurosym.geometry.staging import Staging, building, staged
from neurosym.geometry.step_motion import StepMotion, Track
from neurosym.plan_files.reading import read_plan
from neurosym.planning.staging import stage
from neurosym.simulation import Physics, World, open_clients, replay_plan, replay_staging
from neurosym.simulation.decomposition import convex_pieces, cut_into_convex
from neurosym.simulation.looks import Camera
from neurosym.simulation.solids import rigid_bodies
from neurosym.simulation.window import Window, WorldWindow
from neurosym.testing.burrs import burr

BEAM = {"post": [(0, 0, 0)], "beam": [(0, 0, 1), (1, 0, 1)], "weight": [(0, 0, 2)]}
BOX_WITH_LID = {
    "box": [(x, y, z) for x in range(3) for y in range(3) for z in range(2) if (x, y, z) != (1, 1, 1)],
    "core": [(1, 1, 1)],
    "lid": [(x, y, 2) for x in range(3) for y in range(3)],
}
SOMA = ns.load_domain("soma")


def removal(cells, plan, motions=(), *, size=1.0, **options):
    """A replay of parts that leave one by one; a motion is one, or its direction, or nothing."""
    assembly = cells if isinstance(cells, ns.Assembly) else ns.Assembly.from_cells(cells, size)
    given = [
        m if isinstance(m, StepMotion) else StepMotion.along([name], m) if m else StepMotion((name,))
        for name, m in zip(plan, motions or [None] * len(plan))
    ]
    return replay_staging(staged(assembly, assembly.names, plan, given), **options)


def call(*arguments) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    return int(left.value.code or 0)


# -- motions ----------------------------------------------------------------------------------------------------


@given(
    st.lists(st.tuples(*[st.floats(-3, 3)] * 6), min_size=1, max_size=4),
    st.tuples(*[st.floats(-2, 2)] * 3),
    st.floats(0, 1),
)
@settings(max_examples=60, deadline=None)
def test_a_motion_begins_at_rest_ends_at_its_end_and_carries_its_centre_straight(poses, centre, share):
    path = np.tile(np.eye(4), (len(poses) + 1, 1, 1))
    for X, (x, y, z, *turn) in zip(path[1:], poses):
        X[:3, :3], X[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), (x, y, z)
    motion = StepMotion(("a",), tracks=(Track(("a",), path, np.array(centre)),))
    assert np.allclose(motion.at(0)["a"], np.eye(4))
    assert np.allclose(motion.at(1)["a"], path[-1], atol=1e-9)
    assert np.allclose(motion.reversed().at(share)["a"], motion.at(1 - share)["a"])
    assert motion.reversed().reversed() == motion
    X = motion.at(share)["a"]
    at = X[:3, :3] @ centre + X[:3, 3]
    ends = path[:, :3, :3] @ centre + path[:, :3, 3]
    off = [
        np.linalg.norm(at - (a + np.clip((at - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0, 1) * (b - a)))
        for a, b in pairwise(ends)
    ]
    assert min(off) < 1e-6


def test_a_plan_in_space_says_who_is_there_before_each_step():
    problem = SOMA.problem(17, collapse="rigid", removed=["V"])
    result = ns.solve(problem)
    staging = stage(problem, result.plan, result.motions)
    left = [n for n in problem.world.names if n != "V"]
    for i, name in enumerate(result.plan):
        assert staging.there(i) == tuple(left)
        assert np.allclose(staging.motions[i].tracks[0].poses[1, :3, :3], np.eye(3))
        left.remove(name)
    assert staging.there(len(result.plan)) == ()
    assert not staging.guessed


def test_a_plan_backwards_arrives_along_the_same_lines():
    problem = ns.load_domain("assembly").problem(0)
    result = ns.solve(problem)
    out = stage(problem, result.plan, result.motions)
    back = stage(problem, result.reversed(), result.reversed().motions)
    assert set(back.present) == set(out.there(len(out.motions)))
    for one, other in zip(out.motions, back.motions[::-1]):
        assert other.arrives
        assert one.parts == other.parts
        assert np.allclose(one.at(0.3)[one.parts[0]], other.at(0.7)[one.parts[0]])


def test_problems_without_parts_in_space_are_refused_with_a_remedy():
    letter = ns.Type("letter")
    sent = ns.Fluent("sent", letter)
    x = letter("x")
    post = ns.Domain("post", fluents=[sent], actions=[ns.Action("send", x, pre=[~sent(x)], eff=[sent(x)])])
    problem = post.problem(objects={letter: ["one"]}, init=[], goal=[sent("one")])
    with pytest.raises(InputError, match="simulation=Simulation"):
        replay_plan(problem, problem.actions)
    with pytest.raises(UnknownNameError, match="'Q'"):
        replay_plan(SOMA.problem(17), ["Q"])
    with pytest.raises(InputError, match="one motion a step"):
        replay_plan(SOMA.problem(17), ["V"], [None, None])
    with pytest.raises(InputError, match="one motion a step"):
        replay_plan(SOMA.problem(17, collapse="rigid"), ["B"], [[0, 0]])
    with pytest.raises(InputError, match="direction of three numbers"):
        StepMotion.along(["B"], [0, 0])


# -- replays ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [17, 200])
def test_a_plan_that_geometry_accepts_leaves_the_rest_standing(number):
    problem = SOMA.problem(number, collapse="rigid")
    result = ns.solve(problem)
    report = replay_plan(problem, result.plan, result.motions)
    assert report.ok
    assert [step.action for step in report.steps] == list(result.plan)
    # Well under what counts as moved (0.2 of a cube): processors differ in how far Bullet lets a part settle.
    assert all(step.displacement < 0.1 and not step.moved for step in report.steps)
    assert all(step.share == pytest.approx(step.displacement) for step in report.steps), "the smallest part is one cube"
    assert report.steps[-1].farthest is None


def test_a_part_that_is_taken_from_below_brings_down_what_stood_on_it():
    for size in (0.05, 1.0, 40.0):
        report = removal({"post": [(0, 0, 0)], "top": [(0, 0, 1)]}, ["post", "top"], size=size)
        assert report.start.stood_still
        assert report.failed_at == 0
        assert report.steps[0].moved == {"top": pytest.approx(size, rel=0.05)}
        assert report.steps[0].share == pytest.approx(1.0, rel=0.05)
        assert "top by" in report.steps[0].reason
        assert report.steps[1].stood_still, "nothing is left"


def test_a_beam_tips_when_its_counterweight_goes():
    cells = {"post": [(0, 0, 0)], "beam": [(x, 0, 1) for x in range(3)], "weight": [(0, 0, z) for z in range(2, 7)]}
    report = removal(cells, ["weight"], stop_at_failure=True)
    assert report.start.stood_still
    assert set(report.steps[0].moved) == {"beam"}


def test_what_is_in_the_way_is_named_though_nothing_falls():
    report = removal(BOX_WITH_LID, ["core", "lid"], [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    assert report.failed_at == 0
    assert report.steps[0].in_the_way == ("box",)
    assert "box is in the way of core" in report.steps[0].reason
    assert report.steps[1].stood_still


def test_a_path_leads_round_what_a_straight_line_would_hit():
    roof = [(3, 0, 1), (3, 0, 2), *((x, 0, 3) for x in range(4))]
    assembly = ns.Assembly.from_cells({"floor": [(x, 0, 0) for x in range(4)], "hook": [(0, 0, 1)], "roof": roof})
    assembly = assembly.with_fixed(["roof"])
    round_it = np.tile(np.eye(4), (3, 1, 1))
    round_it[1, :3, 3], round_it[2, :3, 3] = (1.0, 0, 0), (1.0, -3.0, 0)
    path = StepMotion(("hook",), tracks=(Track(("hook",), round_it, np.full(3, 0.5)),))
    assert removal(assembly, ["hook"], [(0.0, 0.0, 1.0)]).steps[0].in_the_way == ("roof",)
    assert removal(assembly, ["hook"], [path]).steps[0].stood_still


def test_pulled_sideways_a_part_drags_what_lies_on_it_lifted_it_does_not():
    cells = {"plank": [(x, 0, 0) for x in range(3)], "load": [(1, 0, 1)]}
    by_hand = removal(cells, ["plank"], [(1.0, 0.0, 0.0)])
    pulled = removal(cells, ["plank"], [(1.0, 0.0, 0.0)], pulled=True)
    assert by_hand.steps[0].moved["load"] == pytest.approx(1.0, rel=0.05), "it falls straight down"
    assert pulled.steps[0].moved["load"] > 1.3, "it comes along, and falls"
    assert removal(cells, ["load", "plank"], pulled=True).ok


def test_a_part_that_cannot_move_is_jammed_when_pulled():
    assembly = ns.Assembly.from_cells(BOX_WITH_LID).with_fixed(["box"])
    report = removal(assembly, ["core"], [(1.0, 0.0, 0.0)], pulled=True)
    assert report.steps[0].in_the_way == ("core",)
    assert "jammed" in report.steps[0].reason


def test_fixed_parts_stay_and_held_parts_are_held():
    cells = {"foot": [(0, 0, 0)], "arm": [(0, 0, 1), (1, 0, 1), (2, 0, 1)], "load": [(0, 0, z) for z in range(2, 8)]}
    assembly = ns.Assembly.from_cells(cells)
    assert set(removal(assembly, ["load"], [(0, 0, 1)]).steps[0].moved) == {"arm"}
    held = StepMotion(("load",), (0.0, 0.0, 1.0), held=("arm",))
    assert removal(assembly, ["load"], [held]).ok
    fixed = removal(assembly.with_fixed(["arm"]), ["load", "foot"])
    assert fixed.ok
    assert fixed.steps[1].displacement == pytest.approx(0.0, abs=1e-9), "only the arm is left, in the air"


def test_without_gravity_nothing_falls():
    problem = ns.load_domain("assembly").problem(ns.Assembly.from_cells(BEAM), gravity=False)
    plan = ["post", "beam", "weight"]
    assert replay_plan(problem, plan).ok
    assert not replay_plan(ns.load_domain("assembly").problem(ns.Assembly.from_cells(BEAM)), plan).ok


def test_a_tower_is_built_and_one_that_leans_too_far_comes_down():
    problem = ns.load_domain("tower").problem(100, variant="heights")
    result = ns.solve(problem)
    report = replay_plan(problem, result.plan)
    assert report.ok
    assert all(step.arrives for step in report.steps)
    stack = {f"{z}": [(0, 0, z)] for z in range(2)}
    leaning = ns.Assembly.from_cells({**stack, "out": [(1, 0, 2), (2, 0, 2), (0, 0, 2)]})
    report = replay_staging(building(leaning, (), ["0", "1", "out"]))
    assert report.failed_at == 2
    assert "out" in report.steps[2].moved, "what arrives is to stand, too"


def test_a_group_is_taken_apart_and_put_together_in_the_hand():
    pairs = ns.Assembly.from_cells(burr("pairs").cells)
    problem = ns.load_domain("assembly").problem(pairs, groups=True, gravity=False)
    result = ns.solve(problem)
    there = replay_plan(problem, result.plan, result.motions)
    back = replay_staging(stage(problem, result.reversed(), result.reversed().motions), physics=Physics(gravity=0.0))
    for report in (there, back):
        assert report.ok, [step.reason for step in report.steps]
        assert not report.gravity
        assert [step.in_hand for step in report.steps].count(True) == 1
    assert "taken from them" in next(step.reason for step in there.steps if step.in_hand)
    assert "put together" in next(step.reason for step in back.steps if step.in_hand)


def test_the_report_says_units_groups_and_what_is_held(tmp_path, capfd):
    cells = {"foot": [(0, 0, 0)], "arm": [(0, 0, 1), (1, 0, 1), (2, 0, 1)], "load": [(0, 0, z) for z in range(2, 8)]}
    assembly = replace(ns.Assembly.from_cells(cells), units="mm")
    assembly.save(tmp_path / "crane.json")
    path = tmp_path / "plan.json"
    assert call("plan", tmp_path / "crane.json", "--held", "1", "--directions", "+z", "--out", path) == 0
    capfd.readouterr()
    assert call("replay", path) == 0
    said = capfd.readouterr().out
    assert "largest shift (mm)" in said
    assert "load (arm held)" in said
    assert "nothing is left" in said
    assert " mm, which counts as moved" in said


def test_cubes_are_judged_by_the_rule_of_the_paper():
    problem = SOMA.problem(17)
    result = ns.solve(problem)
    report = replay_plan(problem, result.plan)
    assert report.ok
    assert report.bodies == "cubes"
    bad = next(o for o in (list("VLTZABP"), list("ATLZBPV")) if not ns.validate(problem, o))
    failed = replay_plan(problem, bad, stop_at_failure=True)
    assert failed.failed_at == ns.validate(problem, bad).failed_at


@pytest.mark.parametrize("friction", [-0.1, float("nan"), float("inf")])
def test_friction_is_a_number_of_0_or_more(friction, plan_file, capfd):
    with pytest.raises(InputError, match="friction of 0 or more"):
        Physics(friction=friction)
    assert call("replay", plan_file, f"--friction={friction}") != 0
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("bodies", ["rigid", "cubes"])
def test_a_window_is_told_of_every_time_step(bodies, monkeypatch):
    ticks, steps, world_step = [], [], World.step

    class Watched:
        def __init__(self, world, staging):
            pass

        def tick(self):
            ticks.append(len(steps))

        def __enter__(self):
            return self

        def __exit__(self, *error):
            pass

    monkeypatch.setattr("neurosym.simulation.replay.WorldWindow", Watched)
    monkeypatch.setattr(World, "step", lambda self: steps.append(world_step(self)))
    assembly = ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)]})
    staging = staged(assembly, assembly.names, ["high"], [StepMotion(("high",), (0.0, 0.0, 1.0))])
    assert replay_staging(staging, bodies=bodies, window=True).ok
    assert ticks == list(range(1, len(steps) + 1))


def u_shape():
    """A channel along y, 3 wide, 2 high, its hollow 1 wide and 1 deep, as a mesh: volume 5."""
    outline = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]
    front = [(1, 2, 3), (1, 3, 4), (0, 1, 4), (0, 4, 5), (0, 5, 6), (0, 6, 7)]
    corners = [(x, y, z) for y in (0, 1) for x, z in outline]
    sides = [t for i in range(8) for j in [(i + 1) % 8] for t in ((i, i + 8, j + 8), (i, j + 8, j))]
    mesh = trimesh.Trimesh(corners, [*front, *((c + 8, b + 8, a + 8) for a, b, c in front), *sides])
    mesh.fix_normals()
    assert mesh.is_watertight
    return mesh


def test_a_part_of_many_boxes_stands_on_each_of_them():
    # PyBullet joins 16 shapes at most; a slab of 25 on four posts would tip over the posts under the others.
    legs = {f"leg {x}{y}": [(x, y, z) for z in range(3)] for x in (0, 4) for y in (0, 4)}
    slab = [(x, y, 3) for x in range(5) for y in range(5)]
    report = removal({**legs, "slab": slab}, ["slab", *legs])
    assert report.start.stood_still
    assert report.ok
    ball = {"floor": [(x, y, 0) for x in range(6) for y in range(6)], "stone": [(5, 5, 1)]}
    assert removal(ball, ["stone"]).start.displacement < 0.01


def volume_of(pieces):
    return sum(ConvexHull(piece).volume for piece in pieces)


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.sampled_from(["u", "ring", "box"]), st.floats(0.01, 100))
@settings(max_examples=25, deadline=None)
def test_meshes_are_cut_into_convex_pieces_that_make_up_their_volume(turn, shape, scale):
    ring = trimesh.creation.annulus(0.5, 1, 1, sections=8)
    mesh, count = {"u": (u_shape(), 3), "ring": (ring, 8), "box": (trimesh.creation.box((1, 2, 3)), 1)}[shape]
    vertices = scale * mesh.vertices @ Rotation.from_rotvec(turn).as_matrix().T
    pieces = cut_into_convex(np.asarray(vertices), np.asarray(mesh.faces))
    assert pieces is not None
    assert volume_of(pieces) == pytest.approx(mesh.volume * scale**3, rel=1e-4)
    assert len(pieces) <= 2 * count


def test_a_bowl_is_left_to_vhacd():
    outer, inner = trimesh.creation.icosphere(3, 1.0), trimesh.creation.icosphere(3, 0.8)
    faces = np.concatenate([outer.faces, inner.faces[:, ::-1] + len(outer.vertices)])
    shell = np.concatenate([outer.vertices, inner.vertices]), faces
    assert cut_into_convex(*shell) is None
    assert convex_pieces("shell", *shell)


def test_a_mesh_with_a_hollow_is_taken_apart_so_that_its_hollow_is_one():
    mesh, X = u_shape(), np.eye(4)
    X[:3, 3] = 1.5, 0.5, 1.9  # half a unit above the bottom of the hollow
    channel = Body(Mesh(np.array(mesh.vertices), np.array(mesh.faces)), np.eye(4))
    assembly = ns.Assembly((Part("u", (channel,), np.eye(4)), Part("in", (Body(Box(np.full(3, 0.8)), np.eye(4)),), X)))
    with pytest.raises(InputError, match="of its convex hull"):
        World(assembly)
    made = {b.part: b for b in rigid_bodies(assembly, "parts", 1.0, meshes="decompose")}
    assert len(made["u"].solids) > 1
    assert made["u"].mass == pytest.approx(5.0, rel=1e-6), "mass is that of the mesh, not of its pieces"
    with World(assembly, meshes="decompose") as world:
        world.settle()
        assert world.bounds("in")[0, 2] == pytest.approx(1.0, abs=0.02), "it falls into the hollow"
    with World(assembly.with_fixed(["u"])) as world:
        world.settle()
        assert world.bounds("in")[0, 2] == pytest.approx(1.0, abs=0.02), "exactly as it is, where it is fixed"
        assert world.displacement()["u", 0] < 1e-6


# -- the command ------------------------------------------------------------------------------------------------


@pytest.fixture
def plan_file(tmp_path):
    path = tmp_path / "plan.json"
    assert call("plan", "soma", "--problem", "17", "--collapse", "rigid", "--out", path) == 0
    return path


def test_the_command_reports_each_step(plan_file, tmp_path, capfd):
    before = open_clients()
    capfd.readouterr()
    assert call("replay", plan_file, "--json", "--out", tmp_path / "report.json") == 0
    said = json.loads(capfd.readouterr().out)
    assert said == json.loads((tmp_path / "report.json").read_text())
    assert said["ok"]
    assert said["failed_at"] is None
    assert len(said["steps"]) == 7
    keys = {"action", "parts", "displacement", "share", "stood_still", "moved", "in_the_way", "reason", "held"}
    assert keys <= said["steps"][0].keys()
    assert said["gravity"]
    assert said["friction"] == 0.5
    assert said["unit"] is None, "cells have no unit"
    assert call("replay", plan_file) == 0
    assert "stood still" in capfd.readouterr().out
    assert open_clients() == before


def test_names_in_brackets_are_names(tmp_path, capfd):
    cells, out = tmp_path / "cells.json", tmp_path / "plan.json"
    cells.write_text(json.dumps({"[bold]q[/bold]": [[0, 0, 0]], "[/x]": [[0, 0, 1]]}))
    assert call("plan", "soma", "--cells", cells, "--out", out) == 0
    assert call("replay", out) == 0
    said = capfd.readouterr().out
    assert "[/x]" in said
    assert "[bold]q[/bold]" in said


def test_the_command_says_when_something_moved(tmp_path, capfd):
    cells = tmp_path / "cells.json"
    cells.write_text(json.dumps({"post": [[0, 0, 0]], "top": [[0, 0, 1]]}))
    path = tmp_path / "plan.json"
    assert call("plan", "soma", "--cells", cells, "--collapse", "rigid", "--out", path) == 0
    cells.unlink()  # the pieces travel with their plan
    document = json.loads(path.read_text())
    document["steps"].reverse()
    document["plan"].reverse()
    path.write_text(json.dumps(document))
    capfd.readouterr()
    assert call("replay", path) == 1
    assert "Step 1, post: " in capfd.readouterr().out


def test_files_that_say_no_parts_or_no_motion_are_read(plan_file, capfd):
    """As version 0.1 wrote them for predicates that gave a direction, a list of poses, or nothing."""
    document = json.loads(plan_file.read_text())
    directions = [step["how"] for step in document["steps"]]
    up = np.tile(np.eye(4), (2, 1, 1))
    up[1, :3, 3] = 5 * np.array(directions[1])
    ways = [directions[0], up.tolist(), None, *directions[3:]]
    document["steps"] = [{"action": step["action"], "how": how} for step, how in zip(document["steps"], ways)]
    plan_file.write_text(json.dumps(document))
    saved = read_plan(plan_file)
    assert saved.motions[2] is None
    staging = stage(saved.problem, saved.plan, saved.motions)
    assert [m.parts for m in staging.motions] == [(name,) for name in saved.plan]
    assert np.allclose(staging.motions[1].tracks[0].poses, up)
    assert staging.guessed == {2}
    assert all(np.allclose(m.direction, d) for m, d in zip(staging.motions[3:], directions[3:]))
    assert call("replay", plan_file) == 0


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda d: d.update(schema=99), "schema"),
        (lambda d: d.update(plan=None), "Expected a plan"),
        (lambda d: d.update(steps="VLT"), '"steps"'),
        (lambda d: d.update(number=999), "0 to 239"),
        (lambda d: d.update(number=None), "which problem"),
        (lambda d: d.update(domain="somma"), "soma"),
        (lambda d: d.update(domain=["soma"]), '"domain"'),
        (lambda d: d.update(options={"collaps": "rigid"}), "options"),
        (lambda d: d["steps"][0].update(action="Q"), "'Q'"),
        (lambda d: d["steps"][0].update(how=[0, 0, 0]), "direction"),
        (lambda d: d["steps"][0].update(how="up"), "direction"),
        (lambda d: d["steps"][0].update(how=[[1, 0], [0, 1]]), "direction"),
    ],
)
def test_files_that_are_no_plans_are_refused(plan_file, change, expected, capfd):
    document = json.loads(plan_file.read_text())
    change(document)
    plan_file.write_text(json.dumps(document))
    capfd.readouterr()
    assert call("replay", plan_file) == 33
    said = capfd.readouterr()
    assert expected in said.err
    assert "Traceback" not in said.err
    assert said.out == ""


@pytest.mark.parametrize("text", ["", "[]", "{", "\0\0", "[" * 10_000])
def test_files_that_are_no_json_are_refused(tmp_path, text, capfd):
    path = Path(tmp_path / "plan.json")
    path.write_text(text)
    with pytest.raises(InputError):
        read_plan(path)
    assert call("replay", path) == 33
    assert call("replay", tmp_path / "missing.json") == 33
    assert "Expected" in capfd.readouterr().err


# -- the window -------------------------------------------------------------------------------------------------


def test_a_window_without_a_screen_is_refused_and_ends_nothing(plan_file, monkeypatch, capfd):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    before = open_clients()
    assert call("replay", plan_file, "--gui") == 33
    assert "Expected a screen" in capfd.readouterr().err
    assert open_clients() == before


def test_a_window_that_has_nothing_to_show_starts_no_process(monkeypatch):
    started = []
    monkeypatch.setenv("DISPLAY", ":40931")
    monkeypatch.setattr(subprocess, "Popen", lambda *command, **options: started.append(command))
    with pytest.raises(ValueError, match="zero-size"):
        Window([], np.zeros((0, 3)), Camera(0, 0), None)
    assert started == []


def test_a_screen_that_does_not_answer_is_refused_in_our_words(plan_file, monkeypatch, capfd):
    monkeypatch.setenv("DISPLAY", ":40931")
    before = open_clients()
    assert call("replay", plan_file, "--gui", "--json") == 33
    said = capfd.readouterr()
    assert "Expected PyBullet's window to open" in said.err
    assert said.out == ""
    assert open_clients() == before


@pytest.fixture
def screen(monkeypatch):
    """A virtual screen; DISPLAY names it."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    mine, its = os.pipe()
    command = ["Xvfb", "-displayfd", str(its), "-screen", "0", "1024x768x24"]
    server = subprocess.Popen(command, pass_fds=[its], stderr=subprocess.DEVNULL)
    os.close(its)
    try:
        with os.fdopen(mine) as answer:
            monkeypatch.setenv("DISPLAY", f":{answer.readline().strip()}")
        yield os.environ["DISPLAY"]
    finally:
        server.terminate()
        server.wait()


def test_a_window_shows_parts_in_their_colours_in_real_time_until_it_is_closed(screen):
    assembly = ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)]})
    staging = Staging(assembly, ("low",), colours={"low": (0.9, 0.0, 0.0), "high": (0.0, 0.0, 0.9)})
    with World(assembly, present=["low"]) as world:
        try:
            window = WorldWindow(world, staging)
        except NeurosymError:
            pytest.skip("no OpenGL on the virtual screen")
        with window:
            start = time.monotonic()
            for _ in range(240):
                world.step()
                window.tick()
            assert time.monotonic() - start > 0.9, "a second takes a second"
            for _ in range(100):  # a busy machine draws late
                seen = np.asarray(ImageGrab.grab(xdisplay=screen)).astype(int)
                red, blue = (seen[:, :, c] > 90 + seen.max(axis=2, where=np.arange(3) != c, initial=0) for c in (0, 2))
                if red.sum() > 2000:
                    break
                window.tick()
                time.sleep(0.1)
            assert red.sum() > 2000
            assert not blue.any(), "what is not there is not seen"
            middle = np.argwhere(red).mean(axis=0) / (768, 1024)
            assert ((middle > 0.3) & (middle < 0.8)).all(), middle
            window.close()
            assert not window.is_open
            start = time.monotonic()
            for _ in range(240):
                window.tick()
            assert time.monotonic() - start < 0.5, "nobody looks any more"
