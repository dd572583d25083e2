"""Parts drawn with play: loading tells of it, and what drops by its play and rests stands."""

import numpy as np
import pytest
import trimesh

import neurosym as ns
from neurosym.cli import main


def box(size, at):
    return trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))


def table(gap: float) -> dict[str, trimesh.Trimesh]:
    """Four legs of 2 mm, a plate that lies `gap` above them, and a weight that lies as much above the plate."""
    legs = {f"leg {i}": box((2, 2, 10), (x, y, 5)) for i, (x, y) in enumerate([(0, 0), (20, 0), (0, 20), (20, 20)])}
    return {**legs, "plate": box((24, 24, 2), (10, 10, 11 + gap)), "weight": box((4, 4, 4), (10, 10, 14 + 2 * gap))}


def folder(tmp_path, parts):
    for name, mesh in parts.items():
        mesh.export(tmp_path / f"{name}.stl")
    return tmp_path


def printed(capsys, *arguments) -> str:
    with pytest.raises(SystemExit):
        main([*map(str, arguments)])
    return capsys.readouterr().out


def test_loading_says_what_lies_apart_and_auto_takes_it_as_touching(tmp_path, capsys):
    where = folder(tmp_path, table(0.1))
    note = "5 pairs of parts lie 0.1 mm apart, face to face, and do not touch."
    remedy = "Taken as touching with Tolerances(touch=0.055), --touch 0.055 or --touch auto."
    told = printed(capsys, "plan", where, "--units", "mm")
    assert "It does not stand as it is: " in told
    assert "Loading:\n" in told
    assert f"  {note} {remedy}\n" in told
    assert note in printed(capsys, "inspect", where, "--units", "mm")
    told = printed(capsys, "plan", where, "--units", "mm", "--touch", "auto", "--out", tmp_path / "plan.json")
    assert "A plan was found." in told
    assert "they are taken as touching: touch is 0.055 of the smallest extent" in told
    assert "Expected --touch as auto" not in told
    # The plan's file reads it the same way again.
    from neurosym.plan_files.reading import read_plan

    saved = read_plan(tmp_path / "plan.json")
    assert saved.problem.world.tolerances.touch == pytest.approx(0.055)
    assert ns.validate(saved.problem, saved.plan, saved.motions)


@pytest.mark.parametrize("gap", [0.05, 0.1, 0.29])
def test_what_drops_by_its_play_and_rests_stands(tmp_path, gap):
    where = folder(tmp_path, table(gap))
    loose = ns.Assembly.load(where, units="mm")
    assert not ns.AssemblyGeometry(loose).stability.standing((1 << 6) - 1).stands
    near = ns.Assembly.load(where, units="mm", touching_gaps=True)
    geometry = ns.AssemblyGeometry(near)
    assert geometry.stability.standing((1 << 6) - 1).stands
    # Two legs carry the plate as little as ever.
    assert not geometry.stability.standing(geometry.mask(["leg 0", "leg 1", "plate"])).stands
    result = ns.solve(ns.load_domain("assembly").problem(near), prior="outermost-first")
    assert result.plan[:2] == ("weight", "plate")


def test_what_touches_or_lies_far_is_no_clearance(tmp_path):
    for gap in (0.0, 0.5):
        assert not [n for n in ns.Assembly.from_meshes(table(gap)).notes if n.kind == "clearance"]


def test_a_touch_that_is_none_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit) as end:
        main(["inspect", str(folder(tmp_path, table(0.1))), "--touch", "near"])
    assert end.value.code == 33
    assert "Expected --touch as auto, or a share" in capsys.readouterr().err


def test_round_play_is_seen(tmp_path):
    ring, pin = trimesh.creation.annulus(5.1, 10, 4, sections=40), trimesh.creation.cylinder(5, 4, sections=32)
    notes = ns.Assembly.from_meshes({"ring": ring, "pin": pin}, units="mm").notes
    (near,) = [n for n in notes if n.kind == "clearance"]
    assert 0 < near.measure <= 0.1 + 5.1 * (1 - np.cos(np.pi / 32))
