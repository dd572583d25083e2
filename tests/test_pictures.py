"""Pictures: deterministic, told apart, kept on disk."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.shapes import Body, Mesh, Part
from neurosym.simulation import PALETTE, PictureStudio, cached_pictures, open_clients, render_many, render_views
from neurosym.simulation.render import CHUNK
from neurosym.support.disk_cache import cache_folder

CELLS = {
    "corner": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "bar": [(2, y, 0) for y in range(3)],
    "top": [(0, 0, 2), (1, 0, 2), (1, 1, 2)],
}
PROGRAM = f"""
import hashlib, numpy as np
from neurosym.geometry.assembly import Assembly
from neurosym.simulation import render_views
a = Assembly.from_cells({CELLS!r})
for style in ("clean", "varied"):
    print(hashlib.sha256(render_views(a, style=style, rng=np.random.default_rng(3)).tobytes()).hexdigest())
"""


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    return Assembly.from_cells(CELLS)


def varied(assembly: Assembly, seed: int) -> np.ndarray:
    return render_views(assembly, style="varied", rng=np.random.default_rng(seed))


def test_four_different_views_and_nothing_left_open(assembly: Assembly) -> None:
    before = open_clients()
    pictures = render_views(assembly)
    assert open_clients() == before
    assert pictures.shape == (4, 64, 64, 3)
    assert pictures.dtype == np.uint8
    assert len({view.tobytes() for view in pictures}) == 4


def test_the_top_view_shows_each_part_where_it_is(assembly: Assembly) -> None:
    top = render_views(assembly, size=90)[0].astype(float)
    # Cells seen from above, 3 x 3 of them: +x to the right, +y up. The middles of the nine fields:
    spread, colours = 20, np.array(PALETTE[:3])
    for (x, y), part in {(2, 2): 1, (2, 0): 1, (1, 1): 2, (0, 1): 0}.items():
        pixel = top[45 - (y - 1) * spread, 45 + (x - 1) * spread]
        likeness = [pixel @ c / np.linalg.norm(pixel) / np.linalg.norm(c) for c in colours]
        assert int(np.argmax(likeness)) == part, (x, y)
    assert (top[45 - spread, 45] == 255).all(), "nothing stands at (1, 2)"


def test_the_same_pictures_in_another_process(assembly: Assembly) -> None:
    here = [
        hashlib.sha256(render_views(assembly, style=s, rng=np.random.default_rng(3)).tobytes()).hexdigest()
        for s in ("clean", "varied")
    ]
    there = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert there.stdout.split() == here
    assert there.stderr == ""


def test_clean_pictures_ignore_the_seed_and_varied_ones_follow_it(assembly: Assembly) -> None:
    clean = [render_views(assembly, rng=np.random.default_rng(seed)) for seed in (0, 1)]
    assert (clean[0] == clean[1]).all()
    assert (varied(assembly, 0) == varied(assembly, 0)).all()
    assert (varied(assembly, 0) != varied(assembly, 1)).any()


def test_a_studio_draws_the_same_whatever_it_drew_before(assembly: Assembly) -> None:
    tower = Assembly.from_cells({"a": [(0, 0, 0)], "b": [(0, 0, 1)]})
    with PictureStudio() as studio:
        first = studio.views(assembly)
        studio.views(tower)
        studio.views(assembly, style="varied", rng=np.random.default_rng(0))
        assert (studio.views(assembly) == first).all()
    assert (render_views(assembly) == first).all()


def test_moving_or_growing_everything_changes_no_picture(assembly: Assembly) -> None:
    X = np.eye(4)
    X[:3, 3] = 5, -3, 2
    assert (render_views(assembly.transformed(X)) == render_views(assembly)).all()
    assert (render_views(Assembly.from_cells(CELLS, 0.02)) == render_views(assembly)).all()


def test_meshes_are_drawn_as_boxes_are(assembly: Assembly) -> None:
    parts = [
        Part(p.name, tuple(Body(Mesh(b.shape.vertices, b.shape.faces), b.X_PB) for b in p.bodies), p.X_WP)
        for p in assembly.parts
    ]
    as_boxes, as_meshes = render_views(assembly).astype(int), render_views(Assembly(tuple(parts))).astype(int)
    assert (np.abs(as_boxes - as_meshes).max(axis=-1) > 8).mean() < 0.02, "but for pixels along edges"


def test_colours_can_be_given(assembly: Assembly) -> None:
    red = render_views(assembly, colours=dict.fromkeys(CELLS, (1.0, 0.0, 0.0)))[0]
    assert set(map(tuple, red.reshape(-1, 3)[:, 1:])) == {(0, 0), (255, 255)}
    with pytest.raises(UnknownNameError):
        render_views(assembly, colours={"nobody": (1.0, 0.0, 0.0)})
    with pytest.raises(InputError, match="RGB"):
        render_views(assembly, colours={"bar": (255.0, 0.0, 0.0)})


def test_what_makes_no_picture_is_refused(assembly: Assembly) -> None:
    with pytest.raises(InputError, match="rng"):
        render_views(assembly, style="varied")
    with pytest.raises(UnknownNameError, match="varied"):
        render_views(assembly, style="colourful")
    with pytest.raises(InputError, match="size"):
        render_views(assembly, size=0)


def test_any_number_of_workers_draws_the_same(assembly: Assembly) -> None:
    tower = Assembly.from_cells({"a": [(0, 0, 0)], "b": [(0, 0, 1)]})
    jobs = [(tower if i % 3 else assembly, i) for i in range(CHUNK + 10)]
    told: list[tuple[int, int]] = []
    alone = render_many(jobs, style="varied", progress=lambda done, total: told.append((done, total)))
    assert told == [(CHUNK, len(jobs)), (len(jobs), len(jobs))]
    assert (alone == render_many(jobs, style="varied", workers=2)).all()
    assert (alone[7] == varied(tower, 7)).all()
    assert render_many([]).shape == (0, 4, 64, 64, 3)


def test_pictures_are_kept_and_found_again(assembly: Assembly, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import neurosym.simulation.render as cache

    monkeypatch.setenv("NEUROSYM_CACHE", str(tmp_path))
    assert cache_folder() == tmp_path
    drawn: list[int] = []
    real = cache.render_chunks
    monkeypatch.setattr(cache, "render_chunks", lambda chunks, *a: drawn.append(len(chunks)) or real(chunks, *a))
    jobs = [(assembly, i) for i in range(CHUNK + 2)]
    first = cached_pictures(jobs, style="varied", size=16)
    assert (cached_pictures(jobs, style="varied", size=16) == first).all()
    assert drawn == [2, 0]
    files = sorted((tmp_path / "pictures").iterdir())
    assert [f.suffix for f in files] == [".z", ".z"]

    whole = files[0].read_bytes()
    for damage in (b"", whole[: len(whole) // 2], b"nonsense", whole[:-8] + bytes(8)):
        files[0].write_bytes(damage)
        assert (cached_pictures(jobs, style="varied", size=16) == first).all()
        assert files[0].read_bytes() == whole
    assert drawn == [2, 0, 1, 1, 1, 1]

    # Whatever decides the pixels decides the file.
    one = jobs[:1]
    for options in ({"style": "clean"}, {"size": 17}, {"colours": {"bar": (1.0, 0.0, 0.0)}}):
        cached_pictures(one, **{"style": "varied", "size": 16, **options})  # type: ignore[arg-type]
    cached_pictures([(assembly, 99)], style="varied", size=16)
    cached_pictures([(Assembly.from_cells({**CELLS, "bar": [(2, 0, 0)]}), 0)], style="varied", size=16)
    assert drawn[6:] == [1] * 5


def test_a_cache_that_cannot_be_written_costs_speed_only(assembly: Assembly, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert (cached_pictures([(assembly, 0)], folder=blocked)[0] == render_views(assembly)).all()
