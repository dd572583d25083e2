"""Parts that stay together: taken as one (`keep`), or only not to be separated (piece groups of BurrTools)."""

from __future__ import annotations

import gzip
import importlib.util
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from broken_inputs import model_3mf, object_3mf, write, zipped
from hypothesis import given, settings
from hypothesis import strategies as st
from step_files import step_bolted
from typer.testing import CliRunner

import neurosym as ns
from neurosym.cli import app
from neurosym.geometry.grouping import PieceGroup, need_not_part
from neurosym.geometry.keeping import keep_together
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.stability.patches import masses
from neurosym.pipeline import count_plans
from neurosym.plan_files.reading import read_plan
from neurosym.planning.inspection import inspect_problem
from neurosym.planning.validation import validate

SHELL = [c for c in itertools.product(range(3), repeat=3) if c != (1, 1, 1)]
SLAB = [(3, y, z) for y in range(3) for z in range(3)]
BOXED = {"shell": SHELL, "ball": [(1, 1, 1)], "slab": SLAB}


def own():
    return ns.load_domain("assembly")


def run(*arguments: object):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def puzzle(path: Path, shapes: dict[str, list[tuple[int, int, int]]], entries: str, placed: str) -> Path:
    """A BurrTools file: shapes as lists of cells, entries of its problem, and one solution."""
    voxels = []
    for name, cells in shapes.items():
        size = np.max(cells, axis=0) + 1
        symbols = "".join("#" if c[::-1] in cells else "_" for c in itertools.product(*map(range, size[::-1])))
        voxels.append(f'<voxel x="{size[0]}" y="{size[1]}" z="{size[2]}" type="0" name="{name}">{symbols}</voxel>')
    text = (
        f'<puzzle version="2"><gridType type="0"/><shapes>{"".join(voxels)}</shapes><problems><problem>'
        f"<shapes>{entries}</shapes><solutions><solution><assembly>{placed}</assembly></solution></solutions></problem></problems>"
        "</puzzle>"
    )
    return write(path, gzip.compress(text.encode()))


def boxed(folder: Path, of_shell: str = "", of_ball: str = "") -> Path:
    shapes = {"shell": SHELL, "ball": [(0, 0, 0)], "slab": [(0, y, z) for y in range(3) for z in range(3)]}
    entries = f'<shape id="0" count="1"{of_shell}/><shape id="1" count="1"{of_ball}/><shape id="2" count="1"/>'
    return puzzle(folder / "boxed.xmpuzzle", shapes, entries, "0 0 0 0 1 1 1 0 3 0 0 0")


# -- one part throughout ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"gravity": False}, {"groups": True}, {"paths": "any"}, {"fixed": ["slab"]}])
def test_a_ball_in_a_shell_leaves_with_it(options: dict[str, object]):
    assembly = ns.Assembly.from_cells(BOXED)
    assert ns.solve(own().problem(assembly, **options)).plan is None
    problem = own().problem(assembly, keep=[["shell", "ball"]], **options)
    result = ns.solve(problem)
    assert result.plan is not None
    assert validate(problem, result.plan, result.motions)
    assert set(result.plan) <= {"shell+ball", "slab"}
    assert problem.details["keep"] == [["shell", "ball"]]


def test_what_is_kept_together_is_one_thing():
    problem = own().problem(ns.Assembly.from_cells(BOXED), keep=[["ball", "shell"]], before=[("ball", "slab")])
    assert ns.solve(problem).plan == ("ball+shell", "slab")  # the order speaks of the part that they became
    assert count_plans(own().problem(ns.Assembly.from_cells(BOXED), keep=[["ball", "shell"]])) == 2
    seen = inspect_problem(problem)
    assert [(p.name, p.volume) for p in seen.parts] == [("ball+shell", 27.0), ("slab", 9.0)]
    assert seen.kept == (("ball", "shell"),)
    assert seen.why is None
    fixed = own().problem(ns.Assembly.from_cells(BOXED), keep=[["ball", "shell"]], fixed=["ball"])
    assert ns.solve(fixed).plan == ("slab",)


cells = st.sets(st.tuples(*[st.integers(0, 2)] * 3), min_size=6, max_size=12)


@settings(deadline=None)
@given(cells, st.data())
def test_every_step_is_possible_for_the_parts_themselves(taken: set[tuple[int, int, int]], data: st.DataObject):
    owners = {c: data.draw(st.integers(0, 4), label=str(c)) for c in sorted(taken)}
    parts = {f"p{k}": [c for c, o in owners.items() if o == k] for k in sorted(set(owners.values()))}
    if len(parts) < 3:
        return
    assembly = ns.Assembly.from_cells(parts)
    keep = [list(parts)[:2]]
    problem = own().problem(assembly, keep=keep, gravity=False, ground=False)
    result = ns.solve(problem)
    geometry, there = AssemblyGeometry(assembly, tabulate=False), (1 << len(parts)) - 1
    members = {name: keep[0] if "+" in name else [name] for name in problem.actions}
    for name, motion in zip(result.plan or (), result.motions):
        group = assembly.mask(members[name])
        there &= ~group
        assert not any(geometry.hits_along(assembly.index[n], np.array(motion.direction), there) for n in members[name])
    if result.plan is None:  # then no order of the parts takes the two out together, either
        graph = geometry.blocking("axes")
        masks = [assembly.mask(own) for own in members.values()]
        while out := [m for m in masks if m & there and _leaves(graph, m, there)]:
            there &= ~out[0]
        assert there


def _leaves(graph, group: int, there: int) -> bool:
    return any(not graph.group_blockers(group, d, there) for d in range(len(graph.vectors)))


def test_masses_stay_where_they_are():
    light, heavy = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(1, 0, 0)], "c": [(5, 0, 0)]}).parts[:2]
    from dataclasses import replace

    assembly = ns.Assembly((light, replace(heavy, density=3.0)))
    joined = keep_together(assembly, [["a", "b"]]).assembly
    weights, centres = masses(joined)
    assert weights.tolist() == [4.0]
    assert joined.parts[0].density == 2.0
    np.testing.assert_allclose(centres[0], [1.25, 0.5, 0.5])


def test_what_cannot_be_kept_together_is_said():
    assembly = ns.Assembly.from_cells(BOXED)
    for keep, said in (
        ([["shell", "bal"]], "Did you mean 'ball'"),
        ([["shell"]], "two parts or more"),
        ([[]], "two parts or more"),
        (["shell"], "two parts or more"),
        ([["shell", "shell"]], "'shell' comes twice"),
        ([["shell", "ball"], ["ball", "slab"]], "'ball' comes twice"),
        ("shell,ball", "list of groups"),
        ([["shell", 3]], "list of names"),
        (3, "list of groups"),
    ):
        with pytest.raises(ns.InputError, match=said):
            own().problem(assembly, keep=keep)


def test_json_keeps_what_stays_together(tmp_path: Path):
    document = {
        "format": "neurosym-assembly",
        "schema": 1,
        "parts": [{"name": n, "cells": c} for n, c in BOXED.items()],
        "subassemblies": {"core": ["shell", "ball"]},
    }
    for more, plan in (
        ({"keep": [["shell", "ball"]]}, ("slab", "shell+ball")),
        ({"keep": [["core"]]}, ("slab", "core")),
        ({"piece_groups": [["shell", "ball"]]}, ("slab",)),
        ({"piece_groups": [[{"of": ["shell", "slab"], "most": 1}, "ball"]]}, ("slab",)),
    ):
        path = write(tmp_path / "a.json", json.dumps(document | more))
        assembly = ns.Assembly.load(path)
        assembly.save(tmp_path / "b.json")
        again = ns.Assembly.load(tmp_path / "b.json")
        assert (again.keep, again.piece_groups) == (assembly.keep, assembly.piece_groups)
        assert again.subassemblies == assembly.subassemblies == {"core": ("shell", "ball")}
        assert sorted(ns.solve(own().problem(again)).plan or ()) == sorted(plan)
        own().problem(again).world.save(tmp_path / "c.json")  # what became one part is one in a file, too
        assert len(ns.Assembly.load(tmp_path / "c.json")) == len(own().problem(again).world)


def test_the_command_line_keeps_together_and_a_plans_file_knows_it(tmp_path: Path):
    path = tmp_path / "boxed.json"
    ns.Assembly.from_cells(BOXED).save(path)
    assert run("plan", path).exit_code == 11
    planned = run("plan", path, "--keep", "shell, ball", "--out", tmp_path / "plan.json")
    assert planned.exit_code == 0
    assert "shell+ball  along +z" in planned.stdout
    saved = read_plan(tmp_path / "plan.json")
    assert sorted(saved.plan) == ["shell+ball", "slab"]
    assert validate(saved.problem, saved.plan, saved.motions)
    assert "2 orders" in run("count", path, "--keep", "shell,ball").stdout
    inspected = run("inspect", path, "--keep", "shell,ball").stdout
    assert "shell+ball: volume 27" in inspected
    assert "Kept together: shell and ball" in inspected
    assert "two parts or more" in str(run("plan", path, "--keep", "shell").exception)


@pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="cascadio is not installed")
def test_a_sub_assembly_of_step_is_kept_together_by_its_name(tmp_path: Path):
    assembly = ns.Assembly.load(write(tmp_path / "a.step", step_bolted("mm", 1.0)))
    pairs = {name: parts for name, parts in assembly.subassemblies.items() if len(parts) == 2}
    assert list(pairs.values()) == [("BOLT", "NUT"), ("BOLT (2)", "NUT (2)")]
    first, second = pairs
    problem = own().problem(assembly, keep=[first, [second]], gravity=False)
    assert problem.world.names == ("PLATE", first, second)
    assert problem.world.subassemblies == {}
    with pytest.raises(ns.InputError, match=first):
        own().problem(assembly, keep=[["PLATE"]])


def test_nodes_of_a_scene_are_sub_assemblies(tmp_path: Path):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    for name, above, x in (("a", "left", 0), ("b", "left", 2), ("c", "world", 4)):
        if above != "world" and above not in scene.graph.nodes:
            scene.graph.update(frame_from="world", frame_to=above)
        place = trimesh.transformations.translation_matrix((x, 0, 0))
        scene.add_geometry(trimesh.creation.box((1, 1, 1)), name, name, parent_node_name=above, transform=place)
    scene.export(tmp_path / "a.glb")
    assembly = ns.Assembly.load(tmp_path / "a.glb")
    assert assembly.subassemblies == {"left": ("a", "b")}
    assert keep_together(assembly, ["left"]).assembly.names == ("left", "c")


def test_components_of_3mf_are_sub_assemblies(tmp_path: Path):
    moved = ("1 0 0 0 1 0 0 0 1 0 0 0", "1 0 0 0 1 0 0 0 1 3 0 0")
    components = "".join(f'<component objectid="1" transform="{m}"/>' for m in moved)
    pair = f'<object id="2" name="pair"><components>{components}</components></object>'
    items = "".join(f'<item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 {y} 0"/>' for y in (0, 5))
    assembly = ns.Assembly.load(zipped(tmp_path, model_3mf(object_3mf(1) + pair, items)))
    assert [len(parts) for parts in assembly.subassemblies.values()] == [2, 2]
    assert keep_together(assembly, ["pair (2)"]).assembly.names[-1] == "pair (2)"


@pytest.mark.parametrize("ending", [".json", ".step"])
def test_a_page_and_a_simulation_show_what_is_kept_together(ending: str, tmp_path: Path):
    if ending == ".step":
        pytest.importorskip("cascadio")
        path, options = write(tmp_path / "a.step", step_bolted("mm", 1.0)), ["--keep", "BOLT,NUT", "--target", "BOLT"]
    else:
        path, options = tmp_path / "a.json", ["--keep", "shell,ball"]
        ns.Assembly.from_cells(BOXED).save(path)
    pytest.importorskip("viser")
    shown = run("view", path, *options, "--no-gravity", "--export", tmp_path / "page.html")
    assert (shown.exit_code, shown.exception) == (0, None)
    assert (tmp_path / "page.html").stat().st_size > 10_000


# -- not to be separated ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"gravity": False}, {"groups": True}, {"groups": True, "gravity": False}])
def test_pieces_of_one_group_need_not_be_separated(tmp_path: Path, options: dict[str, object]):
    group = ' group="1"'
    for of_shell, of_ball, solved in ((group, group, True), ("", "", False), (group, ' group="2"', False)):
        problem = own().problem(ns.Assembly.load(boxed(tmp_path, of_shell, of_ball)), **options)
        result = ns.solve(problem)
        assert (result.status.name, result.plan) == (("SOLVED", ("slab",)) if solved else ("UNSOLVABLE", None))
        if solved:
            assert not validate(problem, [])
            assert inspect_problem(problem).why is None


def test_groups_may_be_stated_for_so_many_pieces(tmp_path: Path):
    # Two rings that hold two bars each: the bars of one shape, of which so many are in a group with the rings.
    ring = [(x, y, z) for x in range(5) for y in range(3) for z in range(3) if (x, y, z) not in ((1, 1, 1), (3, 1, 1))]
    for count, solved in ((1, False), (2, True)):
        entries = (
            '<shape id="0" count="1"><group group="3" count="1"/><group group="4" count="1"/></shape>'
            f'<shape id="1" count="2"><group group="3" count="{count}"/></shape>'
        )
        path = puzzle(tmp_path / "a.xmpuzzle", {"ring": ring, "bar": [(0, 0, 0)]}, entries, "0 0 0 0 1 1 1 0 3 1 1 0")
        for groups in (False, True):
            result = ns.solve(own().problem(ns.Assembly.load(path), groups=groups))
            assert (result.plan == ()) is solved
            assert (result.status.name == "UNSOLVABLE") is not solved


@given(st.lists(st.integers(0, 3), min_size=2, max_size=6), st.lists(st.integers(1, 2), min_size=8, max_size=8))
def test_blocks_share_the_room_of_groups_as_if_all_ways_were_tried(of_block: list[int], room: list[int]):
    copies = [f"c{i}" for i in range(len(of_block))]
    kinds = [tuple(copies[::2]), tuple(copies[1::2])]
    groups = [PieceGroup(((kinds[0], room[2 * g]), (kinds[1], room[2 * g + 1]))) for g in range(2)]
    blocks = [[c for c, b in zip(copies, of_block) if b == k] for k in sorted(set(of_block))]

    def fits(choice: tuple[int, ...]) -> bool:
        return all(
            sum(c in kind for block, g in zip(blocks, choice) if g == number for c in block) <= most
            for number, group in enumerate(groups)
            for kind, most in group.members
        )

    tried = any(fits(choice) for choice in itertools.product(range(2), repeat=len(blocks)))
    assert need_not_part(blocks, groups) is tried
