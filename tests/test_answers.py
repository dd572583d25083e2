"""What a "no" says: the decisive reason first, what it covers, and what would help."""

import json

import numpy as np
import pytest
import trimesh

import neurosym as ns
from neurosym.cli import main
from neurosym.language.search_problem import Rejection
from neurosym.planning.result_text import _when

assembly = ns.load_domain("assembly")
CHAIN = {"ring": [(x, y, 2) for x in range(5) for y in range(5) if x in (0, 4) or y in (0, 4)],
         "link": [(2, y, z) for y in range(2, 7) for z in range(5) if y in (2, 6) or z in (0, 4)]}  # fmt: skip
STACK = {"low": [(0, 0, 0)], "top": [(0, 0, 1)]}
ARM = {"foot": [(0, 0, 0)], "arm": [(0, 0, 1), (1, 0, 1), (2, 0, 1)], "weight": [(0, 0, 2), (0, 0, 3), (0, 0, 4)]}


def problem(cells, **options):
    return assembly.problem(ns.Assembly.from_cells(cells), **options)


def plan(capsys, *arguments) -> list[str]:
    with pytest.raises(SystemExit):
        main(["plan", *map(str, arguments)])
    return capsys.readouterr().out.splitlines()


def saved(tmp_path, cells):
    ns.Assembly.from_cells(cells).save(path := tmp_path / "cells.json")
    return path


@pytest.mark.parametrize("groups", [False, True])
def test_what_does_not_stand_to_begin_with_is_told_first(groups):
    hovering = problem({**CHAIN, "cloud": [(9, 9, 9)]}, groups=groups)
    why = ns.solve(hovering).why_not
    assert why.reasons[0].startswith("It does not stand as it is: ")
    assert "cloud" in why.falls[0].parts
    assert "drops along (0, 0, -1)" in why.reasons[0]
    assert why.cycle is not None  # and what interlocks comes after it
    assert not why.stands
    assert "under gravity with nothing held" in why.scope


def test_the_first_line_after_the_status_is_the_decisive_one(capsys, tmp_path):
    lines = plan(capsys, saved(tmp_path, {"base": [(0, 0, 0)], "cloud": [(0, 0, 3)]}))
    assert lines[1].startswith("Proved")
    assert lines[2] == "  It does not stand as it is: cloud would fall. cloud drops along (0, 0, -1)."
    assert "  With --held 1 there is a plan of 2 steps." in lines
    assert "  With --no-gravity there is a plan of 2 steps." in lines


def test_what_falls_anyhow_does_not_fall_for_what_leaves():
    part = ns.Type("part")
    present = ns.Fluent("present", part)
    p = part("p")
    rests = ns.predicates.stable_without(present)
    take = ns.Action("take", p, pre=[present(p), rests(p)], eff=[~present(p)], label="{p}")
    world = ns.Assembly.from_cells({"foot": [(0, 0, 0)], "arm": [(3, 0, 4)], "cap": [(0, 0, 1)]})
    names = [present(n) for n in world.names]
    own = ns.Domain("own", fluents=[present], actions=[take]).problem(
        world=world, objects={part: world.names}, init=names, goal=[~a for a in names]
    )
    search = own.ground()
    reasons = {a: search.attempt(search.initial, search.actions.index(a)).reason for a in ("foot", "cap")}
    assert reasons["cap"] == "arm would fall, with cap or without."
    assert "Without foot, arm" not in reasons["foot"]


def test_movements_do_not_say_again_who_left():
    (fall,) = [s for s in ns.solve(problem(ARM)).why_not.reasons if s.startswith("Without foot")]
    assert fall.count("foot") == 2  # "Without foot, ... (arm loses foot)."


ALL = ["--held 1", "--no-gravity", "--groups", "--paths any", "--directions contacts"]


@pytest.mark.parametrize(
    ("cells", "options", "covers", "flags"),
    [
        (ARM, {}, "single parts, each taken out once, moved in straight lines (+z,", ALL[:3]),
        (ARM, {}, "without turning, under gravity with nothing held.", ALL[:3]),
        (CHAIN, {"gravity": False}, "without turning, without gravity.", ALL[2:]),
        (CHAIN, {"fixed": ["ring"]}, "with gravity or without, whatever is held.", ALL[2:]),
        (CHAIN, {"gravity": False, "paths": "any"}, "moved along paths without turning,", [ALL[2], ALL[4]]),
        (CHAIN, {"gravity": False, "groups": True}, "single parts and groups of them,", ALL[3:]),
        (STACK, {"before": [("low", "top")], "directions": "+x"}, "in the order that was asked for, moved", ALL[:2]),
    ],
)
def test_every_proof_says_what_it_covers_and_what_would_widen_it(cells, options, covers, flags):
    result = ns.solve(problem(cells, **options))
    assert result.status is ns.Status.UNSOLVABLE
    assert covers in result.why_not.scope
    assert [w.flag for w in result.why_not.wider] == flags
    assert result.why_not.scope in result.why_not.sentences


def test_a_search_that_ended_at_its_own_limits_is_not_told_to_take_more_time(monkeypatch):
    monkeypatch.setattr("domains.assembly_paths.MAX_CHECKS", 200)
    torus = trimesh.creation.torus(2.0, 0.4, major_sections=12, minor_sections=6)
    other = torus.copy()
    other.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    other.apply_translation((2.0, 0, 0))
    links = ns.Assembly.from_meshes({"one": torus, "two": other})
    straight = ns.solve(assembly.problem(links, gravity=False, fixed=["one"]))
    assert "without turning" in straight.why_not.scope
    assert "--paths any" in [w.flag for w in straight.why_not.wider]
    result = ns.solve(assembly.problem(links, gravity=False, fixed=["one"], paths="any"))
    assert result.status is ns.Status.GAVE_UP
    told = " ".join((result.status.sentence, *result.why_not.sentences))
    assert "more time would not change that" in told
    assert "larger budget" not in told
    assert "without turning" not in result.why_not.scope  # that search turns parts, too


def test_what_would_help_is_tried_within_the_budget_and_kept(capsys, tmp_path):
    path = saved(tmp_path, ARM)
    with pytest.raises(SystemExit):
        main(["plan", str(path), "--json"])
    tried = {t["flag"]: t for t in json.loads(capsys.readouterr().out)["widened"]}
    assert (tried["--held 1"]["status"], tried["--held 1"]["steps"]) == ("SOLVED", 3)
    two = saved(tmp_path, {"one": [(0, 0, 0)], "cloud": [(0, 0, 3)]})
    lines = plan(capsys, two, "--fixed", "cloud", "--directions=-z")
    assert any("With --directions contacts" in line for line in lines)


def test_refusals_are_told_by_what_changed():
    at = [Rejection("no", action="x", after=after) for after in ((), ("a",), ("a", "b", "c"), ("a", "d"), ("a",))]
    told = [_when(now, before) for before, now in zip([None, *at], at)]
    assert told == ["after nothing, ", "then a, ", "then b and c, ", "2 steps back, then d, ", "1 step back, "]
    long = Rejection("no", action="x", after=tuple(map(str, range(26))))
    assert _when(long, None) == "after 26 steps to 25, "
    assert _when(long, long) == ""


def test_counts_have_the_right_number(capsys, tmp_path):
    path = saved(tmp_path, {"one": [(0, 0, 0)], "two": [(5, 0, 0)]})
    assert "1 step; proved fewest." in plan(capsys, path, "--target", "one")
    with pytest.raises(SystemExit):
        main(["count", str(path), "--fixed", "one"])
    assert capsys.readouterr().out.startswith("1 order (2 states, ")
