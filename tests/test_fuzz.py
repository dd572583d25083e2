"""Random assemblies and broken documents, for a bounded time; `make fuzz` goes on for an hour."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import documents
import numpy as np
import pytest
import verdicts
from polycubes import HALVES, Oracle, interlocked_halves
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.errors import LONGEST
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.step_motion import StepMotion
from neurosym.plan_files.reading import read_search


def test_no_verdict_about_random_polycubes_is_wrong():
    outcome = verdicts.run(40.0, most=12)
    assert not outcome.wrong
    assert outcome.asked["verdicts"] > 1_000


@pytest.mark.parametrize("seed", range(len(HALVES)))
def test_halves_need_groups(seed):
    cells = interlocked_halves(np.random.default_rng(seed))
    truth = Oracle(cells)
    assert not truth.count()
    assert truth.apart()
    problem = ns.load_domain("assembly").problem(ns.Assembly.from_cells(cells), gravity=False, groups=True)
    assert ns.solve(problem).plan is not None


def test_the_brute_force_can_tell_wrong_from_right():
    """A check of the checker: a lid held by a rim, a stack, a stack on air."""
    box = {"floor": [(0, 0, 0)], "lid": [(0, 0, 2)], "top": [(0, 0, 1)]}
    assert Oracle(box).count() == 6  # each leaves sideways
    assert Oracle(box, gravity=True).count() == 1
    assert Oracle({"a": [(0, 0, 0)], "b": [(1, 0, 1)]}, gravity=True).count() == 0


def test_broken_documents_are_read_or_refused():
    assert documents.run(240) == []


# -- found so, and mended -----------------------------------------------------------------------------------------


def test_a_device_is_no_file():
    for reader in (read_search, ns.Demonstrations.load):
        with pytest.raises(ns.InputError, match="regular file"):
            reader(Path("/dev/zero"))


def test_what_unpacks_to_too_much_is_refused_before_it_is_unpacked(tmp_path):
    header = (
        b"\x93NUMPY\x01\x00v\x00"
        + b"{'descr': '<f8', 'fortran_order': False, 'shape': (1099511627776,), }".ljust(117)
        + b"\n"
    )
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w") as archive:
        archive.writestr("pictures.npy", header)
    with pytest.raises(ns.DemonstrationError, match="at most"):
        ns.Demonstrations.load(tmp_path / "bomb.npz")


def test_brackets_without_end(tmp_path):
    (tmp_path / "w.safetensors").write_bytes((200_000).to_bytes(8, "little") + b"[" * 200_000)
    with pytest.raises(ns.CheckpointError):
        ns.load_prior(str(tmp_path / "w.safetensors"))
    (tmp_path / "plan.json").write_text("[" * 200_000)
    with pytest.raises(ns.InputError, match="nested too deeply"):
        read_search(tmp_path / "plan.json")


def test_directions_have_any_length():
    for length in (5e-324, 1e-300, 1e-160, 1.0, 1e160, 1e308):
        x, y, z = StepMotion.along((), (0.0, length, length)).direction or (1, 1, 1)
        assert (x, round(y, 12), round(z, 12)) == (0.0, round(0.5**0.5, 12), round(0.5**0.5, 12))


def test_messages_are_no_longer_than_one_reads():
    with pytest.raises(ns.InputError) as caught:
        ns.load_domain("x" * 5_000)
    assert len(str(caught.value)) <= LONGEST
    assert "more characters" in str(caught.value)


@pytest.mark.parametrize(("size", "away"), [(1e200, 0.0), (1e-200, 0.0), (1.0, 1e12), (1.0, 1e300), (1e-12, 0.0)])
def test_lengths_out_of_range_are_refused(tmp_path, size, away):
    pose = np.eye(4)
    pose[0, 3] = away
    part = {"name": "a", "pose": pose.tolist(), "boxes": [{"size": [size] * 3, "centre": [0, 0, 0]}]}
    (tmp_path / "a.json").write_text(json.dumps({"format": "neurosym-assembly", "schema": 1, "parts": [part]}))
    with pytest.raises(ns.AssemblyError, match="1e-09 to 1e\\+09"):
        ns.Assembly.load(tmp_path / "a.json")
    if not away:
        with pytest.raises(ns.AssemblyError, match="1e-09 to 1e\\+09"):
            ns.Assembly.from_cells({"a": [(0, 0, 0)]}, size=size)


@pytest.mark.parametrize("second", [2.0**-21, 1e-9])
def test_a_box_beside_one_a_million_times_larger(tmp_path, second):
    lines = []
    for k, (size, x) in enumerate(((1.0, 0.0), (second, 2.0))):
        corners = [(x + a * size, b * size, c * size) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
        faces = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
        lines += [f"o b{k}", *(f"v {a!r} {b!r} {c!r}" for a, b, c in corners)]
        lines += ["f " + " ".join(str(n + 8 * k) for n in face) for face in faces]
    (tmp_path / "two.obj").write_text("\n".join(lines))
    assert len(ns.Assembly.load(tmp_path / "two.obj")) == 2


def test_a_part_that_hardly_falls_falls_when_turned_too():
    """Springs leave .002 of a part's weight: friction that agrees roughly took it for balance, turned by 37 degrees."""
    rows = {0: "000001010011020", 1: "002", 2: "021", 3: "100200", 4: "101201202211212", 6: "210", 7: "220"}
    rows[5] = "012022102110111112121122221222"
    cells = {f"p{k}": [tuple(map(int, row[i : i + 3])) for i in range(0, len(row), 3)] for k, row in rows.items()}
    names, there = [f"p{k}" for k in (2, 7, 6, 4, 0, 5, 1, 3)], ("p0", "p1", "p4", "p5", "p6")
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()
    world = ns.Assembly.from_cells(dict(sorted(cells.items())))
    turned = ns.Assembly.from_cells({name: cells[name] for name in names}, size=100.0).transformed(X)
    for given in (world, turned):
        assert not AssemblyGeometry(given).springs.standing(given.mask(there)).stands


# -- at the command line ------------------------------------------------------------------------------------------


def command(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "neurosym.cli", *words]
    return subprocess.run(line, capture_output=True, text=True, timeout=60, env=os.environ | environment)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("plan", "soma", "--problem", "3", "--out", ""), "name of a file"),
        (("view", "soma", "--problem", "3", "--host", "nope.invalid"), "address of this machine"),
        (("export", "{own}", "--graph", "{own}.dot", "--seconds", "5"), "--pddl"),
        (("export", "{own}", "--pddl", "{own}.d", "--seconds", "nan"), "nan"),
        (("render", "{own}", "--problem", "3", "--exploded", "{own}.png"), "is a path"),
    ],
)
def test_what_would_be_ignored_or_lost_is_refused(words, says, tmp_path):
    own = tmp_path / "own.json"
    ns.Assembly.from_cells({"a": [(0, 0, 0)], "b": [(0, 0, 1)]}).save(own)
    done = command(*(word.format(own=own) for word in words))
    assert done.returncode == 33
    assert says in " ".join((done.stdout + done.stderr).split())
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "latin-1"])
def test_names_may_have_letters_that_the_terminal_has_not(encoding, tmp_path):
    path = tmp_path / "中\U0001f600.json"
    ns.Assembly.from_cells({"\u6728": [(0, 0, 0)], "\U0001f9f1": [(0, 0, 1)]}).save(path)
    for words in (("inspect", str(path)), ("plan", str(path)), ("plan", str(path), "--json")):
        done = command(*words, PYTHONIOENCODING=encoding)
        assert done.returncode == 0, done.stderr
