"""The command line on a user's own assembly: inspect, plan, count, export; exit codes, JSON, and files read back."""

from __future__ import annotations

import inspect
import json
from dataclasses import dataclass
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
import trimesh
from broken_inputs import robot

import neurosym as ns
from neurosym.cli import main
from neurosym.commands.common import FileOptions, problem_at
from neurosym.commands.spread import spread
from neurosym.geometry.step_motion import StepMotion
from neurosym.plan_files.reading import read_plan

SHARED = Path(__file__).parents[1] / ".." / "shared" / "data"


def call(capsys, *arguments):
    """Exit code, stdout, stderr."""
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    said = capsys.readouterr()
    return int(left.value.code or 0), said.out, said.err


def answer(capsys, *arguments):
    """Exit code, and what --json printed."""
    code, out, err = call(capsys, *arguments, "--json")
    return code, json.loads(out), err


@pytest.fixture
def gate(tmp_path):
    """Two posts and a beam on them, one OBJ a part."""
    folder = tmp_path / "gate"
    folder.mkdir()
    for name, size, centre in [
        ("post-a", (1, 1, 2), (0.5, 0.5, 1)),
        ("post-b", (1, 1, 2), (4.5, 0.5, 1)),
        ("beam", (5, 1, 1), (2.5, 0.5, 2.5)),
    ]:
        mesh = trimesh.creation.box(size, trimesh.transformations.translation_matrix(centre))
        mesh.export(folder / f"{name}.obj")
    return folder


@pytest.fixture
def chain(tmp_path):
    """Two links of a chain, as cells."""
    ring = [(x, y, 2) for x in range(5) for y in range(5) if x in (0, 4) or y in (0, 4)]
    link = [(2, y, z) for y in range(2, 7) for z in range(5) if y in (2, 6) or z in (0, 4)]
    path = tmp_path / "chain.json"
    ns.Assembly.from_cells({"ring": ring, "link": link}).save(path)
    return path


def test_inspect_says_what_there_is(capsys, gate):
    code, found, _ = answer(capsys, "inspect", gate, "--units", "m")
    assert code == 0
    assert found["stands"] is True
    assert found["units"] == "m"
    assert set(found["free"]) == {"post-a", "post-b", "beam"}
    assert found["free_along"]["beam"][0] == "+z"
    assert found["interlocked"] == []
    assert found["why"] is None
    assert {p["name"]: round(p["volume"], 6) for p in found["parts"]} == {"post-a": 2, "post-b": 2, "beam": 5}
    areas = {frozenset((c["a"], c["b"])): round(c["area"], 6) for c in found["contacts"]}
    assert areas[frozenset(("beam", "post-a"))] == 1
    assert areas[frozenset(("the ground", "post-b"))] == 1
    code, out, _ = call(capsys, "inspect", gate)
    assert "It stands." in out
    assert "Nothing is interlocked" in out


def test_inspect_names_what_is_interlocked_and_why(capsys, chain):
    code, found, _ = answer(capsys, "inspect", chain, "--no-gravity")
    assert code == 0
    assert (found["free"], found["interlocked"]) == ([], ["ring", "link"])
    assert set(found["why"]["cycle"]["parts"]) == {"ring", "link"}
    assert found["stands"] is True
    assert answer(capsys, "inspect", chain, "--no-gravity", "--paths", "any")[1]["level"] is None
    code, out, _ = call(capsys, "inspect", chain)
    assert "smallest interlocked cycle" in out
    assert "No part is free" in out


def test_a_plan_is_written_with_all_it_takes_to_replay_it(capsys, gate, tmp_path):
    code, out, _ = call(capsys, "plan", gate, "--out", tmp_path / "plan.json")
    assert (code, "A plan was found." in out) == (0, True)
    document = json.loads((tmp_path / "plan.json").read_text())
    assert (document["schema"], document["prior"], document["domain"]) == (1, "outermost-first", "assembly")
    assert document["steps"][0] == {"action": "beam", "how": [0.0, 0.0, 1.0], "parts": ["beam"]}
    saved = read_plan(tmp_path / "plan.json")
    assert saved.problem.name == "gate"
    assert all(isinstance(motion, StepMotion) for motion in saved.motions)
    assert ns.validate(saved.problem, saved.plan, saved.motions)
    # Moved together, it is found beside the plan; changed, it is refused.
    there = tmp_path / "elsewhere"
    there.mkdir()
    gate.rename(there / "gate")
    (tmp_path / "plan.json").rename(there / "plan.json")
    assert ns.validate(read_plan(there / "plan.json").problem, saved.plan)
    trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix((2.5, 0.5, 3.5))).export(
        there / "gate" / "lid.obj"
    )
    with pytest.raises(ns.InputError, match="has changed"):
        read_plan(there / "plan.json")
    (there / "gate").rename(there / "away")
    with pytest.raises(ns.InputError, match="in neither place"):
        read_plan(there / "plan.json")


def test_options_reach_the_problem(capsys, gate):
    code, found, _ = answer(capsys, "plan", gate, "--fixed", "post-a", "--fixed", "post-b")
    assert (code, found["plan"]) == (0, ["beam"])
    code, found, _ = answer(capsys, "plan", gate, "--directions", "-x,+x", "--no-gravity")
    assert {abs(s["how"][0]) for s in found["steps"]} == {1.0}
    code, found, _ = answer(capsys, "plan", gate, "--groups")
    assert (code, len(found["plan"])) == (0, 2)
    first = ["--before", "post-a,beam", "--before", "post-b,beam"]
    assert answer(capsys, "plan", gate, *first)[0] == 11
    code, found, _ = answer(capsys, "plan", gate, *first, "--held", "1")
    assert (code, found["steps"][0]["held"]) == (0, ["beam"])
    assert found["prior"] == "outermost-first"
    assert answer(capsys, "plan", gate, "--prior", "none")[1]["prior"] is None


def test_no_plan_is_explained_and_has_its_exit_code(capsys, chain):
    code, out, _ = call(capsys, "plan", chain, "--no-gravity")
    assert code == 11
    assert "link is blocked" in out
    assert "ring blocks link blocks ring" in out
    code, found, _ = answer(capsys, "plan", chain, "--no-gravity", "--groups")
    assert (code, found["status"], found["why_not"]["left"]) == (11, "UNSOLVABLE", ["ring", "link"])


def test_orders_are_counted_within_a_budget(capsys, gate, chain):
    code, found, _ = answer(capsys, "count", gate)
    assert (code, found["orders"], found["exact"]) == (0, 2, True)
    found = answer(capsys, "count", gate, "--no-gravity")[1]
    assert (found["orders"], found["told_apart"]) == (3, 6)  # the posts may be swapped
    assert answer(capsys, "count", chain, "--no-gravity")[1]["orders"] == 0
    code, found, _ = answer(capsys, "count", gate, "--expansions", "1")
    assert (code, found["orders"], found["exact"]) == (23, None, False)
    code, out, _ = call(capsys, "count", gate, "--seconds", "0")
    assert code == 23
    assert "no number" in out
    assert "2 orders" in call(capsys, "count", gate)[1]


def test_a_graph_is_read_back_by_others(capsys, gate, tmp_path):
    for ending in ("graphml", "json", "dot"):
        code, written, _ = answer(capsys, "export", gate, "--graph", tmp_path / f"gate.{ending}")
        assert (code, written["written"]) == (0, [str(tmp_path / f"gate.{ending}")])
    graph = nx.read_graphml(tmp_path / "gate.graphml")
    edges = {(a, b, said.get("direction", "")) for a, b, said in graph.edges(data=True)}
    assert ("post-a", "beam", "+z") in edges
    assert ("beam", "post-a", "+z") not in edges
    assert ("beam", "the ground", "-z") in edges
    touching = {frozenset((a, b)): d["area"] for a, b, d in graph.edges(data=True) if d["kind"] == "touches"}
    assert touching[frozenset(("beam", "post-a"))] == pytest.approx(1)
    document = json.loads((tmp_path / "gate.json").read_text())
    assert nx.node_link_graph(document, edges="edges").number_of_edges() == graph.number_of_edges()
    assert '"post-a" -> "beam" [label="+z"];' in (tmp_path / "gate.dot").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["inspect", "nowhere"], "nothing at nowhere"),
        (["plan", "nowhere/at/all"], "nothing at nowhere/at/all"),
        (["plan", "nowhere"], "name of a domain"),
        (["count", "nowhere.json"], "nothing at"),
        (["inspect", "gate", "--directions", "up"], "directions"),
        (["inspect", "gate", "--fixed", "nobody"], "fixed part"),
        (["inspect", "gate", "--units", "furlong"], "unit"),
        (["inspect", "gate", "--paths", "bent"], "bent"),
        (["plan", "gate", "--held", "-1"], "held"),
        (["plan", "gate", "--before", "beam,roof"], "roof"),
        (["plan", "gate", "--prior", "sinkhorn"], "pictures"),
        (["plan", "gate", "--oracle", "physics", "--groups"], "physics"),
        (["plan", "gate", "--collapse", "cubes"], "collapse"),
        (["plan", "soma", "--problem", "1", "--units", "mm"], "--units"),
        (["plan", "soma", "--problem", "1", "--held", "1"], "held"),
        (["export", "gate"], "--pddl DIR or --graph FILE"),
        (["export", "gate", "--graph", "gate.png"], "graphml"),
        (["export", "gate", "--pddl", "gate/beam.obj"], "is a file"),
        (["count", "empty"], "empty"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_input_is_refused_in_a_sentence(capsys, gate, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    code, out, err = call(capsys, *arguments)
    assert (code, out) == (33, "")
    assert said in err
    assert "Traceback" not in err


def test_a_prior_that_reads_pictures_is_left_out_of_a_comparison(capsys):
    code, out, err = call(capsys, "compare", "assembly", "--problems", "2", "--workers", "1", "--json")
    assert code == 0
    assert {row["prior"] for row in json.loads(out)["rows"]} == {"none", "outermost-first"}
    assert "Left out: the prior sinkhorn" in err
    code, out, _ = call(
        capsys, *["compare", "assembly", "--problems", "2", "--workers", "1", "--json", "--prior", "outermost-first"]
    )
    rows = json.loads(out)["rows"]
    assert {row["solved"] for row in rows} == {2}


def test_a_folder_called_like_a_domain_is_a_path_unless_a_problem_is_named(capsys, gate, monkeypatch):
    gate.rename(gate.parent / "soma")
    monkeypatch.chdir(gate.parent)
    assert answer(capsys, "plan", "soma")[1]["domain"] == "assembly"
    assert answer(capsys, "plan", "soma", "--problem", "3")[1]["domain"] == "soma"


@pytest.fixture(scope="module")
def shared():
    if not SHARED.is_dir():
        pytest.skip("the assemblies in ../shared/data are not here")
    return SHARED


def test_the_arch_stands_and_gives_no_block_away(capsys, shared):
    code, found, _ = answer(capsys, "inspect", shared / "arch")
    assert (code, found["stands"], len(found["parts"])) == (0, True, 30)
    code, found, _ = answer(capsys, "plan", shared / "arch")
    assert (code, found["status"]) == (11, "UNSOLVABLE")
    assert len(found["why_not"]["falls"]) == 28
    code, found, _ = answer(capsys, "plan", shared / "arch", "--held", "1")
    assert (code, len(found["plan"])) == (0, 28)
    assert answer(capsys, "plan", shared / "arch", "--no-gravity")[0] == 0


def test_the_wall_is_planned_and_not_counted(capsys, shared, tmp_path):
    code, found, _ = answer(capsys, "plan", shared / "wall", "--out", tmp_path / "wall.json", "--seconds", "60")
    assert (code, len(found["plan"])) == (0, 42)
    assert np.allclose([np.linalg.norm(s["how"]) for s in found["steps"]], 1)
    code, found, _ = answer(capsys, "count", shared / "wall", "--seconds", "1")
    assert (code, found["orders"]) == (23, None)


def test_the_problem_of_a_path_is_that_of_the_domain(gate):
    problem = problem_at(gate, FileOptions(units="m"), {"gravity": False})
    assert (problem.name, problem.world.units, problem.details["gravity"]) == ("gate", "m", False)


# -- how files are read -------------------------------------------------------------------------------------------

PUZZLE = """<?xml version="1.0"?><puzzle version="2"><gridType type="0"/><colors/><shapes>
<voxel x="3" y="1" z="1" type="0">###</voxel><voxel x="3" y="2" z="1" type="0">###___</voxel>
<voxel x="3" y="2" z="1" type="0">######</voxel></shapes><problems>
<problem name="one" state="2"><shapes><shape id="0" count="1"/></shapes><result id="0"/>
<solutions><solution asmNum="0"><assembly>0 0 0 0</assembly></solution></solutions></problem>
<problem name="two" state="2"><shapes><shape id="0" count="2"/></shapes><result id="2"/><solutions>
<solution asmNum="0"><assembly>0 0 0 0 0 1 0 0</assembly></solution>
<solution asmNum="1"><assembly>0 1 0 0 0 0 0 0</assembly></solution></solutions></problem>
</problems></puzzle>"""


def test_what_is_up_in_the_files_can_be_said_and_is_kept_with_the_plan(capsys, tmp_path):
    folder = tmp_path / "tower"
    folder.mkdir()
    for i, name in enumerate(("base", "top")):
        trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix((0, i, 0))).export(
            folder / f"{name}.stl"
        )
    lying = answer(capsys, "inspect", folder)[1]
    assert "+z" in lying["free_along"]["base"]
    code, standing, _ = answer(capsys, "inspect", folder, "--up", "y")
    assert code == 0
    assert any(note.startswith("y is up in the file") for note in standing["notes"])
    assert "+z" not in standing["free_along"]["base"]
    out = tmp_path / "plan.json"
    code, found, _ = answer(capsys, "plan", folder, "--up", "y", "--directions", "+z", "--out", out)
    assert (code, found["plan"]) == (0, ["top", "base"])
    saved = read_plan(out)
    assert np.allclose(saved.problem.world.bounds, [[-0.5, -0.5, -0.5], [0.5, 0.5, 1.5]])
    assert ns.validate(saved.problem, saved.plan, saved.motions).ok


def test_faces_that_overlap_deeply_mate_where_that_is_said(capsys, tmp_path):
    folder = tmp_path / "pair"
    folder.mkdir()
    for name, z in (("low", 0.0), ("high", 0.9)):
        trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix((0, 0, z))).export(
            folder / f"{name}.obj"
        )
    code, _, err = call(capsys, "inspect", folder)
    assert (code, "--touch" in err) == (33, True)
    out = tmp_path / "plan.json"
    code, found, _ = answer(capsys, "plan", folder, "--touch", "0.11", "--out", out)
    assert (code, found["plan"]) == (0, ["high", "low"])
    assert read_plan(out).problem.world.tolerances.touch == 0.11


def test_friction_decides_what_stands(capsys, tmp_path):
    path = tmp_path / "slope.json"
    turn = trimesh.transformations.rotation_matrix(np.radians(20), [0, 1, 0])
    slab = trimesh.creation.box((4, 2, 0.5))
    block = trimesh.creation.box((1, 1, 0.5), trimesh.transformations.translation_matrix((0, 0, 0.5)))
    meshes = {"slab": slab.apply_transform(turn), "block": block.apply_transform(turn)}
    ns.Assembly.from_meshes(meshes).with_fixed(["slab"]).save(path)
    assert answer(capsys, "inspect", path)[1]["stands"] is True
    assert answer(capsys, "inspect", path, "--friction", "0.2")[1]["stands"] is False


def test_which_puzzle_of_a_file_and_which_of_its_solutions(capsys, tmp_path):
    path = tmp_path / "two.xmpuzzle"
    path.write_text(PUZZLE)
    assert len(answer(capsys, "inspect", path)[1]["parts"]) == 1
    assert len(answer(capsys, "inspect", path, "--puzzle", "2")[1]["parts"]) == 2
    out = tmp_path / "plan.json"
    assert answer(capsys, "plan", path, "--puzzle", "2", "--solution", "2", "--out", out)[0] == 0
    assert json.loads(out.read_text())["assembly"]["solution"] == 2
    first, second = (ns.Assembly.load(path, problem=2, solution=n) for n in (1, 2))
    loaded = read_plan(out).problem.world
    assert np.allclose(loaded.body_bounds, second.body_bounds)
    assert not np.allclose(loaded.body_bounds, first.body_bounds)
    code, _, err = call(capsys, "inspect", path, "--puzzle", "3")
    assert (code, "3" in err) == (33, True)


def test_a_robot_is_read_at_a_configuration_that_the_plan_keeps(capsys, tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(robot(shape='<box size="1 1 1"/>').replace("0 0 1", "0 0 2").replace("revolute", "prismatic"))
    code, found, _ = answer(capsys, "inspect", path)
    assert (code, found["units"], [p["name"] for p in found["parts"]]) == (0, "m", ["base", "arm"])
    assert [p["fixed"] for p in found["parts"]] == [True, False]
    options = ["--joint", "j=2", "--meshes", "visual", "--no-gravity"]
    assert answer(capsys, "plan", path, *options, "--out", tmp_path / "plan.json")[0] == 0
    assert np.allclose(read_plan(tmp_path / "plan.json").problem.world.bounds[1], [2.5, 0.5, 2.5])
    for wrong, said in ((["--joint", "j"], "NAME=VALUE"), (["--joint", "k=1"], "joint"), (["--meshes", "x"], "meshes")):
        code, _, err = call(capsys, "inspect", path, *wrong)
        assert (code, said in err) == (33, True)


@pytest.mark.parametrize("command", ["plan", "render", "view"])
def test_a_problem_family_has_no_files_to_read(command, capsys, tmp_path):
    extra = {"render": ("--exploded", tmp_path / "x.png"), "view": ("--no-browser",)}.get(command, ())
    code, _, err = call(capsys, command, "soma", "--problem", "17", "--up", "y", *extra)
    assert code == 33
    assert "problem family" in err


def test_options_that_commands_share_stand_in_the_place_of_their_group():
    @dataclass(frozen=True)
    class Shared:
        one: int = 1
        two: str = "b"

    def command(what: str, *, shared: Shared, last: bool = False) -> None:
        got.append((what, shared, last))

    command.__annotations__["shared"] = Shared
    got: list = []
    spread_out = spread(command)
    assert list(inspect.signature(spread_out).parameters) == ["what", "one", "two", "last"]
    spread_out(what="x", one=5, two="b", last=True)
    assert got == [("x", Shared(5), True)]

    @dataclass(frozen=True)
    class Bare:
        one: int

    def other(*, shared) -> None: ...

    other.__annotations__["shared"] = Bare
    with pytest.raises(TypeError, match="default for every option"):
        spread(other)
