"""Films and exploded views: what they show, that files are whole or absent, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

import neurosym as ns
from neurosym.cli import main
from neurosym.errors import InputError, MissingDependencyError
from neurosym.geometry.staging import Staging
from neurosym.geometry.step_motion import StepMotion, Track
from neurosym.planning.staging import stage
from neurosym.simulation import film_files, open_clients
from neurosym.simulation.animation import LONGEST, SHORTEST_STEP, frames, pace
from neurosym.simulation.captions import captioned
from neurosym.simulation.exploded import explode, exploded_view
from neurosym.simulation.film_files import RATE, check_film, still, write_film
from neurosym.simulation.filming import DEFAULT_CAMERA, TOPS_CAMERA, FilmSet
from neurosym.simulation.scene import FIXED, part_colours
from neurosym.simulation.storyboard import best_camera, company, describe
from neurosym.testing.burrs import burr

SMALL = (96, 72)
BRICKS = {"low": [(0, 0, 0), (1, 0, 0)], "high": [(0, 0, 1)]}
RED, BLUE = (0.9, 0.1, 0.1), (0.1, 0.2, 0.9)


def call(*arguments) -> int:
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    return int(left.value.code or 0)


def corners(assembly):
    return np.concatenate([assembly.bodies.vertices(i) for i in range(len(assembly.bodies))])


def red(picture):
    """Which pixels are red, of any brightness."""
    rgb = picture.astype(int)
    return (rgb[:, :, 0] > 2 * rgb[:, :, 1]) & (rgb[:, :, 0] > 2 * rgb[:, :, 2]) & (rgb[:, :, 0] > 60)


def reddish(picture):
    return int(red(picture).sum())


def soma(number=17):
    problem = ns.load_domain("soma").problem(number, collapse="rigid")
    result = ns.solve(problem)
    return stage(problem, result.plan, result.motions)


@pytest.fixture(scope="module")
def plan_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    cells = folder / "cells.json"
    cells.write_text(json.dumps(BRICKS))
    assert call("plan", "soma", "--cells", cells, "--collapse", "rigid", "--out", folder / "plan.json") == 0
    return folder / "plan.json"


def test_a_picture_shows_what_is_to_be_seen_where_it_is():
    assembly = ns.Assembly.from_cells(BRICKS)
    colours = {"low": BLUE, "high": RED}
    points = np.concatenate([corners(assembly), np.add(corners(assembly), (0, 0, 3))])
    up = np.eye(4)
    up[2, 3] = 3.0
    with FilmSet(assembly, colours, points, size=SMALL) as film:
        both, low = film.picture(assembly.names), film.picture(["low"])
        moved = film.picture(assembly.names, {"high": up})
        assert both.shape == (72, 96, 3)
        assert both.dtype == np.uint8
        assert reddish(both) > 30
        assert reddish(low) == 0
        assert np.array_equal(film.picture(assembly.names), both), "pictures do not depend on what was drawn before"
        rows = [np.flatnonzero(red(picture).any(axis=1)) for picture in (both, moved)]
        assert rows[1].mean() < rows[0].mean() - 10, "what is lifted is higher up in the picture"
        assert (both[0] == 255).all(), "white above"
        shade = film.picture(["low"])
    with FilmSet(assembly, colours, points, size=SMALL, ground=False) as film:
        brighter = film.picture(["low"]).astype(int) - shade
        # Making the picture smaller rings a little along edges.
        assert brighter.min() > -20, "without a ground there is no shadow"
        assert (brighter > 30).sum() > 100
        seen = film.seen_at(assembly.names)
        assert seen["high"][1] < seen["low"][1]


@pytest.mark.parametrize("size", [0.001, 1.0, 500.0])
def test_everything_is_in_the_picture_in_any_unit(size):
    assembly = ns.Assembly.from_cells({"bar": [(x, 0, 0) for x in range(6)]}, size)
    with FilmSet(assembly, {"bar": RED}, corners(assembly), size=SMALL, ground=False) as film:
        picture = film.picture(["bar"])
    border = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
    assert (border > 200).all()
    assert reddish(picture) > 400


def test_exploded_parts_are_clear_of_one_another_and_went_the_way_they_leave():
    staging = soma()
    shifts = explode(staging)
    boxes = {}
    for number, name in enumerate(staging.assembly.names):
        bounds = staging.assembly.body_bounds[staging.assembly.owners == number]
        boxes[name] = np.array([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)]) + shifts[name]
    names = list(boxes)
    for i, a in enumerate(names):
        for b in names[:i]:
            overlap = np.minimum(boxes[a][1], boxes[b][1]) - np.maximum(boxes[a][0], boxes[b][0])
            assert overlap.min() <= 1e-9, (a, b)
    for motion in staging.motions:
        way, shift = motion.tracks[0].poses[-1, :3, 3], shifts[motion.parts[0]]
        assert np.allclose(np.cross(way, shift), 0)
        assert way @ shift >= 0
    assert not explode(staging, spread=0.0)["B"].any()
    with pytest.raises(InputError, match="0 or more"):
        explode(staging, spread=-1.0)


def test_without_a_plan_parts_go_away_from_the_middle():
    assembly = ns.Assembly.from_cells(BRICKS)
    shifts = explode(Staging(assembly, assembly.names))
    assert shifts["high"][2] > 0 > shifts["low"][2]
    picture = exploded_view(Staging(assembly, assembly.names), size=SMALL)
    assert picture.shape[1] == 96
    assert picture.shape[0] > 72, "a line of words below"


def test_a_film_begins_whole_ends_empty_and_moves_in_between():
    staging = soma()
    counts = []
    shots = list(frames(staging, title="cube", size=SMALL, progress=lambda done, total: counts.append((done, total))))
    assert counts[-1][0] == counts[-1][1] == len(shots)
    assert len({s.shape for s in shots}) == 1
    assert not shots[0].shape[0] % 2
    inked = [(s[:72] < 200).any(axis=2).sum() for s in (shots[0], shots[-1])]
    assert inked[0] > 300 > inked[1]
    assert (shots[-1][:72] < 250).any(), "what was there is still seen, pale"
    different = sum(not np.array_equal(a, b) for a, b in pairwise(shots))
    assert different > 7 * RATE // 2


def test_what_a_tower_gains_arrives():
    problem = ns.load_domain("tower").problem(3, variant="heights")
    result = ns.solve(problem)
    staging = stage(problem, result.plan)
    shots = list(frames(staging, size=SMALL))
    inked = [(s[:72] < 200).any(axis=2).sum() for s in (shots[0], shots[-1])]
    assert inked[0] < 50 < inked[1]
    assert describe(staging, 0) == f"place {result.plan[0]}, along -z"


def test_a_group_leaves_together_and_is_taken_apart_by_itself():
    pairs = ns.Assembly.from_cells(burr("pairs").cells)
    problem = ns.load_domain("assembly").problem(pairs, groups=True, gravity=False)
    result = ns.solve(problem)
    out = stage(problem, result.plan, result.motions)
    group = next(i for i, motion in enumerate(out.motions) if len(motion.parts) == 2)
    apart = next(i for i in range(group + 1, 3) if out.motions[i].parts[0] in out.motions[group].parts)
    assert set(out.motions[group].parts) == {"a", "b"}
    assert describe(out, group).startswith("remove ")
    assert " with " in describe(out, group)
    assert company(out, group) == out.there(group)
    assert set(company(out, apart)) == {"a", "b"}, "nothing else is in the picture"
    assert " off " in describe(out, apart)
    back = stage(problem, result.reversed(), result.reversed().motions)
    assert set(company(back, 2 - apart)) | set(back.motions[2 - apart].parts) == {"a", "b"}, "in the hand"
    assert not {"a", "b"} & set(company(back, 2 - group)), "and not in its place before it arrives"
    between = next(i for i in range(3) if i not in (2 - apart, 2 - group))
    assert not {"a", "b"} & set(company(back, between))


def test_what_made_way_goes_back_without_a_jump_and_what_is_held_is_set_off():
    assembly = ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(2, 0, 0)]})
    path, aside = np.tile(np.eye(4), (2, 1, 1)), np.tile(np.eye(4), (2, 1, 1))
    path[1, 2, 3], aside[1, 0, 3] = 2.0, 2.0
    up, right = Track(("a",), path, np.zeros(3)), Track(("b",), aside, np.zeros(3))
    steps = [StepMotion(("a",), tracks=(up, right)), StepMotion(("a",), (0.0, 0.0, 1.0), (up,), held=("b",))]
    shots = []
    for motion in steps:
        staging = Staging(assembly, assembly.names, ("a",), (motion,), {"a": BLUE, "b": RED})
        shots.append([shot[:72] for shot in frames(staging, size=SMALL)])
    moving, held, ends = pace(1)
    columns = [np.flatnonzero(red(shot).any(axis=0)).mean() for shot in shots[0][ends:-ends]]
    assert columns[moving - 1] > columns[0] + 10
    back = columns[moving:]
    assert len(back) == held
    assert back == sorted(back, reverse=True)
    assert back[-1] < back[0] - 3
    pink = [(np.abs(shot.astype(int) - (200, 0, 110)) < 40).all(axis=2).sum() for shot in shots[1]]
    assert min(pink[ends : ends + moving]) > 10
    assert max(pink[:ends]) == 0
    assert describe(Staging(assembly, assembly.names, ("a",), (steps[1],)), 0) == "remove a, along +z, b held"


def test_tiles_show_their_letters_from_a_steeper_side():
    problem = ns.load_domain("scrabble").problem(5)
    staging = stage(problem, ns.solve(problem).plan)
    assert best_camera(staging) is TOPS_CAMERA
    bare = replace(staging, tops={})
    shots = [exploded_view(s, size=(240, 180), camera=TOPS_CAMERA, names=False) for s in (staging, bare)]
    dark = [(shot[:180] < 90).all(axis=2).sum() for shot in shots]
    assert dark[0] > 2 * dark[1]


def test_the_camera_turns_to_the_broad_side():
    def camera(*cells):
        assembly = ns.Assembly.from_cells({"bar": list(cells)})
        return best_camera(Staging(assembly, assembly.names)).azimuth

    assert camera((0, 0, 0)) == DEFAULT_CAMERA.azimuth
    assert camera(*((x, 0, 0) for x in range(4))) < DEFAULT_CAMERA.azimuth < camera(*((0, y, 0) for y in range(4)))


def test_many_steps_go_faster_but_can_be_followed():
    assert pace(7) == (15, 3, 12)
    moving, held, _ = pace(40)
    assert 40 * (moving + held) / RATE == pytest.approx(LONGEST, rel=0.15)
    assert sum(pace(1000)[:2]) / RATE == pytest.approx(SHORTEST_STEP, rel=0.15)


def test_many_parts_have_colours_that_are_neither_black_nor_white_and_fixed_ones_are_grey():
    assembly = ns.Assembly.from_cells({f"{i:02}": [(i, 0, 0)] for i in range(60)}).with_fixed(["07"])
    colours = part_colours(Staging(assembly, assembly.names, colours={"05": (0.1, 0.5, 0.6)}))
    assert colours["07"] == FIXED
    assert colours["05"] == (0.1, 0.5, 0.6)
    assert len(set(colours.values())) == 60
    brightness = [sum(colour) / 3 for colour in colours.values()]
    assert 0.3 < min(brightness) < max(brightness) < 0.9


def test_words_that_do_not_fit_are_cut():
    blank = np.full((40, 60, 3), 255, dtype=np.uint8)
    short, long = captioned(blank, "go"), captioned(blank, "go " * 50, note="1/2", colour=RED, progress=0.5)
    assert short.shape == long.shape
    assert (long[40:43, :29] < 100).all(), "half of the bar"
    assert (long[44:, -1] > 200).all()


def pictures(n=4):
    return iter([np.full((20, 30, 3), 60 * i % 251, dtype=np.uint8) for i in range(n)])


def test_films_of_every_kind(tmp_path):
    gif = write_film(pictures(), tmp_path / "new" / "a.gif")
    with Image.open(gif) as image:
        assert (image.n_frames, image.size) == (4, (30, 20))
    folder = write_film(pictures(), tmp_path / "frames")
    assert sorted(p.name for p in folder.iterdir()) == [f"frame-000{i}.png" for i in range(4)]
    write_film(pictures(2), folder)
    assert len(list(folder.iterdir())) == 2, "frames of another film do not stay"
    assert {p.name for p in tmp_path.iterdir()} == {"new", "frames"}


def test_mp4(tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    film = write_film(pictures(30), tmp_path / "a.mp4")
    count, seconds = ffmpeg.count_frames_and_secs(str(film))
    assert count == 30
    assert seconds == pytest.approx(30 / RATE, abs=0.1)
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_an_mp4_of_odd_pictures_is_even_and_says_nothing(tmp_path, capfd, caplog):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    odd = (np.full((81, 101, 3), 40 * i, dtype=np.uint8) for i in range(4))
    film = write_film(odd, tmp_path / "a.mp4")
    frames = ffmpeg.read_frames(str(film))
    assert next(frames)["size"] == (102, 82)
    frames.close()
    assert capfd.readouterr() == ("", "")
    assert caplog.records == []


def test_without_ffmpeg_an_mp4_is_refused_with_the_remedy(tmp_path, monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(film_files.importlib, "import_module", missing)
    with pytest.raises(MissingDependencyError, match=r"neurosym-assembly\[video\]"):
        check_film(tmp_path / "a.mp4")


@pytest.mark.parametrize("name", ["a.gif", "a.mp4", "frames"])
def test_a_film_that_breaks_off_leaves_nothing(tmp_path, name):
    def broken():
        yield from pictures(2)
        raise RuntimeError("the power went")

    if name.endswith("mp4"):
        pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(RuntimeError):
        write_film(broken(), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_names_that_cannot_be_written_are_refused_before_anything_is_drawn(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("precious")
    (tmp_path / "folder.gif").mkdir()
    (tmp_path / "file").write_text("")
    refused = {"mine": "frames only", "a.avi": "end in", "folder.gif": "is a folder", "file": "folder"}
    for name, expected in refused.items():
        with pytest.raises(InputError, match=expected):
            check_film(tmp_path / name)
    for name in (".", "..", "/"):
        with pytest.raises(InputError, match="name of its own"):
            check_film(name)
    with pytest.raises(InputError, match="frames only"):
        write_film(pictures(), tmp_path / "mine")
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "precious"
    with pytest.raises(InputError, match=r"\.png"):
        still(next(pictures()), tmp_path / "a.jpg")


def test_the_command_draws_a_plan(plan_file, tmp_path, capfd):
    before = open_clients()
    out, exploded = tmp_path / "plan.gif", tmp_path / "apart.png"
    assert call("render", "soma", "--plan", plan_file, "--out", out, "--exploded", exploded, "--size", "96x72") == 0
    said = capfd.readouterr()
    assert "2 steps" in said.out
    assert said.err == ""
    with Image.open(out) as film, Image.open(exploded) as picture:
        assert film.n_frames > 20
        assert film.size[0] == picture.size[0] == 96
    assert open_clients() == before


def test_the_command_draws_what_has_no_plan(tmp_path):
    for what, number in (("soma", 17), ("tower", 3), ("assembly", 0)):
        out = tmp_path / f"{what}.png"
        assert call("render", what, "--problem", number, "--exploded", out, "--size", "96x72") == 0
        assert out.stat().st_size > 500


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ([], "--out FILM"),
        (["--out", "x.gif"], "--plan"),
        (["--plan", "PLAN", "--out", "x.avi"], "end in"),
        *((["--exploded", f"x.{ending}"], "Expected --exploded with a PNG") for ending in ("jpg", "svg", "pdf")),
        (["--exploded", "x.png", "--size", "big"], "--size"),
        (["--exploded", "x.png", "--size", "0x0"], "--size"),
        (["--exploded", "x.png", "--from", "up"], "--from"),
        (["--exploded", "x.png", "--problem", "999"], "0 to 239"),
        (["--plan", "PLAN", "--exploded", "x.png", "--problem", "1"], "either --plan"),
        (["--plan", "missing.json", "--exploded", "x.png"], "missing.json"),
    ],
)
def test_the_command_refuses(arguments, expected, plan_file, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    given = [str(plan_file) if a == "PLAN" else a for a in arguments]
    assert call("render", "soma", *given) == 33
    said = capfd.readouterr()
    assert expected in said.err
    assert "Traceback" not in said.err
    assert list(tmp_path.iterdir()) == []


def test_the_command_wants_the_plan_of_what_it_is_told(plan_file, tmp_path, capfd):
    assert call("render", "tower", "--plan", plan_file, "--exploded", tmp_path / "x.png") == 33
    assert "'soma'" in capfd.readouterr().err
