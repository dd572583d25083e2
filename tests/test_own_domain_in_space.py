"""A domain of one's own, some of whose steps move nothing, in films, replays and on the page; parts that are gone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import neurosym as ns
from neurosym.cli import main
from neurosym.planning.staging import stage
from neurosym.simulation import replay_plan
from neurosym.simulation.animation import frames
from neurosym.simulation.captions import label
from neurosym.simulation.exploded import explode, exploded_view
from neurosym.simulation.storyboard import describe
from neurosym.viewer.scene import FIELD_OF_VIEW, MARGIN, camera_for
from neurosym.viewer.timeline import Timeline

part, tool = ns.Type("part"), ns.Type("tool")
present, loose = ns.Fluent("present", part), ns.Fluent("loose", part)
in_hand = ns.Fluent("in_hand", tool)
free, stable = ns.predicates.free(present), ns.predicates.stable_without(present)
p, t = part("p"), tool("t")
DOMAIN = ns.Domain(
    "unscrew",
    fluents=[present, loose, in_hand],
    actions=[
        ns.Action("pick", t, pre=[~in_hand(t)], eff=[in_hand(t)]),
        ns.Action("loosen", p, pre=[in_hand("wrench"), present(p), ~loose(p)], eff=[loose(p)]),
        ns.Action("remove", p, pre=[loose(p), present(p), free(p), stable(p)], eff=[~present(p)]),
    ],
)
CELLS = {"low": [(0, 0, 0), (1, 0, 0)], "high": [(0, 0, 1), (1, 0, 1)]}


@pytest.fixture(scope="module")
def solved():
    problem = DOMAIN.problem(
        world=ns.Assembly.from_cells(CELLS),
        objects={part: tuple(CELLS), tool: ("wrench",)},
        init=[present(n) for n in CELLS],
        goal=[~present(n) for n in CELLS],
        name="two blocks",
    )
    result = ns.solve(problem)
    assert sorted(result.plan) == ["loosen(high)", "loosen(low)", "pick(wrench)", "remove(high)", "remove(low)"]
    return problem, result


def test_steps_that_move_nothing_are_steps_of_a_film_with_a_caption(solved):
    problem, result = solved
    staging = stage(problem, result.plan, result.motions)
    assert [bool(m.parts) for m in staging.motions] == [name.startswith("remove") for name in result.plan]
    assert not staging.guessed
    still = result.plan.index("pick(wrench)")
    assert describe(staging, still) == "pick(wrench)"
    assert describe(staging, result.plan.index("remove(high)")) == "remove remove(high): high, along +z"
    film = list(frames(staging, size=(96, 72)))
    assert len({f.shape for f in film}) == 1
    assert list(explode(staging)) == ["low", "high"]


def test_they_are_steps_of_a_replay_in_which_everything_stands(solved):
    problem, result = solved
    report = replay_plan(problem, result.plan, result.motions)
    assert report.ok
    assert [step.action for step in report.steps] == list(result.plan)
    assert report.steps[result.plan.index("pick(wrench)")].parts == ()


def test_the_page_has_them_too(solved):
    problem, result = solved
    timeline = Timeline(stage(problem, result.plan, result.motions))
    still = result.plan.index("pick(wrench)")
    assert np.array_equal(timeline.motions(still + 0.5), timeline.motions(still))
    assert timeline.path_of(still).shape == (0, 3)
    assert np.isfinite(timeline.bounds()).all()
    moving = result.plan.index("remove(high)")
    assert not np.array_equal(timeline.motions(moving + 0.5), timeline.motions(moving))


def test_a_plan_that_moves_nothing_has_no_place_in_space(solved):
    with pytest.raises(ns.InputError, match="says what its actions do to parts in space"):
        stage(solved[0], ("pick(wrench)",))


@pytest.mark.parametrize("rule", ["rigid", "cubes"])
def test_parts_that_are_gone_are_in_no_picture_and_no_replay(rule):
    problem = ns.load_domain("soma").problem(17, removed=["V", "B"], collapse=rule)
    result = ns.solve(problem)
    staging = stage(problem, result.plan, result.motions)
    assert set(staging.shown) == set("LTZAP") == set(explode(staging))
    report = replay_plan(problem, result.plan, result.motions)
    assert not {"V", "B"} & {name for step in report.steps for name in step.moved}


def test_a_replay_does_not_say_that_what_moved_stood_still(tmp_path, capfd):
    """Under the paper's rule one cube alone may fall: here one does, before the first step."""
    saved = tmp_path / "plan.json"
    gone = ["--removed", "V", "--removed", "B"]
    for command in (["plan", "soma", "--problem", "17", *gone, "--out", saved], ["replay", saved]):
        capfd.readouterr()
        with pytest.raises(SystemExit) as left:
            main([str(word) for word in command])
        assert left.value.code == 0
    said = capfd.readouterr().out
    assert "Moved: Z by 1." in said, "the case that this is about"
    assert "The rest stood still at all" not in said
    assert said.splitlines()[-1].endswith("than this rule allows: one cube alone, at the start.")


def test_a_plan_file_alone_is_rendered(tmp_path, capfd):
    saved, picture = tmp_path / "plan.json", tmp_path / "exploded.png"
    for command in (
        ["plan", "soma", "--problem", "17", "--collapse", "rigid", "--removed", "V", "--out", saved],
        ["render", saved, "--exploded", picture, "--out", tmp_path / "film.gif", "--size", "96x72"],
    ):
        capfd.readouterr()
        with pytest.raises(SystemExit) as left:
            main([str(word) for word in command])
        assert left.value.code == 0
    assert "6 parts pulled apart" in capfd.readouterr().out
    assert picture.exists()
    assert (tmp_path / "film.gif").exists()


def test_every_part_of_an_exploded_view_is_named_or_numbered():
    crowd = {f"part number {i}": [(i % 6, i // 6, 0)] for i in range(36)}
    from neurosym.geometry.staging import Staging

    world = ns.Assembly.from_cells(crowd)
    few = exploded_view(Staging(world, world.names[:2], ()), size=(320, 240))
    many = exploded_view(Staging(world, world.names, ()), size=(320, 240))
    assert few.shape[1] == 320
    assert many.shape[1] > 400, "a list beside the picture"


def test_a_hidden_part_is_in_the_list():
    picture = np.full((200, 200, 3), 255, dtype=np.uint8)
    seen = {"front": (100.0, 100.0, 50.0)}
    assert label(picture, seen).shape == picture.shape
    assert label(picture, seen, ("front", "behind")).shape[1] > picture.shape[1]


@given(arrays(np.float64, (9, 3), elements=st.floats(-5, 5)))
@settings(max_examples=50, deadline=None)
def test_the_camera_sees_every_point_and_stands_no_farther_than_it_must(points):
    points = points + np.linspace(0, 1, 9)[:, None]  # never all in one place
    eye, target = camera_for(points)
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0, 0, 1], back) / np.linalg.norm(np.cross([0, 0, 1], back))
    axes = np.stack([right, np.cross(back, right), back], axis=1)

    def widest(at):
        seen = (points - at) @ axes
        return (np.abs(seen[:, :2]) / -seen[:, 2:]).max()

    window = np.tan(FIELD_OF_VIEW / 2)
    assert widest(eye) * MARGIN == pytest.approx(window, rel=1e-6)
