"""Files that are broken, or made to break their reader, end in an error that says what is wrong."""

from __future__ import annotations

import contextlib
import gzip
import importlib.util
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from broken_inputs import CASES, PUZZLE, Case, box, glb, gltf, model_3mf, obj, object_3mf, robot
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import neurosym as ns

needs_cascadio = pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="cascadio is not installed")


def test_the_corpus_is_large():
    assert len(CASES) >= 130


@pytest.mark.parametrize(
    "made",
    [pytest.param(c, id=name, marks=needs_cascadio if name.startswith("step") else ()) for name, c in CASES.items()],
)
def test_each_broken_input_ends_in_an_error_that_says_what_is_wrong(made: Case, tmp_path: Path):
    path = made.make(tmp_path)
    with pytest.raises(ns.InputError) as caught:
        ns.Assembly.load(path)
    message = str(caught.value)
    assert made.says in message
    assert len(message) < 4_000


def test_all_faulty_parts_are_named_at_once(tmp_path: Path):
    with pytest.raises(ns.AssemblyError) as caught:
        ns.Assembly.load(CASES["several-faults"].make(tmp_path))
    found = {(note.kind, note.part, note.other) for note in caught.value.notes}  # type: ignore[attr-defined]
    assert found == {("open", "c", ""), ("flat", "d", ""), ("overlap", "a", "b")}


# -- fuzzing --------------------------------------------------------------------------------------------------


def _whole_files() -> dict[str, list[bytes]]:
    """Small sound files of each format, to be damaged."""
    mesh = trimesh.Trimesh(*box(), process=False)
    scene = trimesh.Scene([mesh])
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("3D/3dmodel.model", model_3mf(object_3mf(), '<item objectid="1"/>'))
    puzzle = PUZZLE.format(grid="0", cells="##", solution="<solution><assembly>0 0 0 0 0 1 0 0</assembly></solution>")
    own = {
        "format": "neurosym-assembly",
        "schema": 1,
        "fixed": ["a"],
        "parts": [
            {"name": "a", "cells": [[0, 0, 0]], "pose": np.eye(4).tolist()},
            {"name": "b", "boxes": [{"size": [1, 1, 1], "centre": [0.5, 0.5, 1.5]}]},
            {"name": "c", "bodies": [{"mesh": {"vertices": (box()[0] + 5).tolist(), "faces": box()[1].tolist()}}]},
        ],
    }
    return {
        ".obj": [obj(box()).encode()],
        ".off": [mesh.export(file_type="off").encode()],
        ".stl": [mesh.export(file_type="stl"), mesh.export(file_type="stl_ascii").encode()],
        ".ply": [mesh.export(file_type="ply"), mesh.export(file_type="ply", encoding="ascii")],
        ".gltf": [json.dumps(gltf()).encode()],
        ".glb": [scene.export(file_type="glb"), glb(gltf())],
        ".3mf": [packed.getvalue()],
        ".urdf": [robot().encode()],
        ".xmpuzzle": [puzzle.encode(), gzip.compress(puzzle.encode())],
        ".json": [json.dumps(own).encode()],
    }


WHOLE = _whole_files()

#: What readers stumble over.
_NUMBERS = [b"-1", b"0", b"999999999999", b"1e308", b"nan", b"-0.0", b"\x00", b"\xff" * 4]
_MARKS = [b"null", b"[]", b"{}", b'"', b"\n", b"<", b" ", b"/"]
_damage = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 12), st.sampled_from(_NUMBERS + _MARKS) | st.binary(max_size=8)),
    min_size=1,
    max_size=6,
)


@pytest.mark.parametrize("ending", WHOLE)
def test_the_undamaged_files_load(ending: str, tmp_path: Path):
    for data in WHOLE[ending]:
        path = tmp_path / f"a{ending}"
        path.write_bytes(data)
        assert len(ns.Assembly.load(path)) >= 1


@pytest.mark.parametrize("ending", WHOLE)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_loads_or_is_refused(ending: str, data: st.DataObject, tmp_path: Path):
    """Nothing else is raised, whatever bytes are cut out, put in or changed."""
    found = data.draw(st.sampled_from(WHOLE[ending]))
    for where, cut, put in data.draw(_damage):
        at = int(where * len(found))
        found = found[:at] + put + found[at + cut :]
    _load_or_refuse(tmp_path / f"a{ending}", found)


@pytest.mark.parametrize("ending", WHOLE)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400))
def test_noise_is_refused(ending: str, data: bytes, tmp_path: Path):
    _load_or_refuse(tmp_path / f"a{ending}", data)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    value=st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=4),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
        max_leaves=8,
    ),
    data=st.data(),
)
def test_any_value_anywhere_in_the_own_json_loads_or_is_refused(value: object, data: st.DataObject, tmp_path: Path):
    document = json.loads(WHOLE[".json"][0])
    place = document
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = data.draw(st.sampled_from(keys))
        if not isinstance(place[key], dict | list) or not place[key] or data.draw(st.booleans()):
            break
        place = place[key]
    place[key] = value
    _load_or_refuse(tmp_path / "a.json", json.dumps(document).encode())


def _load_or_refuse(path: Path, data: bytes) -> None:
    path.write_bytes(data)
    with contextlib.suppress(ns.InputError):
        assembly = ns.Assembly.load(path)
        assert assembly.names
        assert np.isfinite(assembly.bounds).all()
