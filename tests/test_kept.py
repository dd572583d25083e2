"""What was read and tabulated is kept on disk: met again when nothing has changed, and never when something has."""

import numpy as np
import pytest
import trimesh

import neurosym as ns
from neurosym.cli import main
from neurosym.geometry.blocking.sweep import Sweeps
from neurosym.geometry.contact import contacts
from neurosym.geometry.readers import loading
from neurosym.geometry.shapes import Box
from neurosym.geometry.tolerances import Tolerances
from neurosym.support import disk_cache

at = trimesh.transformations.translation_matrix


@pytest.fixture
def scene(tmp_path):
    """A tube on a plate with a peg in it, as a GLB."""
    path = tmp_path / "scene.glb"
    made = trimesh.Scene()
    for name, mesh in {
        "plate": trimesh.creation.box((40, 40, 10), at((0, 0, 5))),
        "tube": trimesh.creation.annulus(5, 9, 20, transform=at((0, 0, 20)), sections=24),
        "peg": trimesh.creation.cylinder(4.9, 30, transform=at((0, 0, 25)), sections=24),
    }.items():
        made.add_geometry(mesh, node_name=name, geom_name=name)
    made.export(path)
    return path


@pytest.fixture
def counted(monkeypatch):
    """How often files were examined, contacts found and directions swept."""
    counts = {"read": 0, "contacts": 0, "along": 0}

    def count(what, function):
        def call(*args, **options):
            counts[what] += 1
            return function(*args, **options)

        return call

    monkeypatch.setattr(loading, "_checked", count("read", loading._checked))
    monkeypatch.setattr(contacts, "find_contacts", count("contacts", contacts.find_contacts))
    monkeypatch.setattr(Sweeps, "along", count("along", Sweeps.along))
    return counts


def same(a, b):
    assert (a.names, a.units, a.fixed, a.friction, a.tolerances, a.notes) == (
        b.names, b.units, b.fixed, b.friction, b.tolerances, b.notes)  # fmt: skip
    assert (a.table, a.keep, a.piece_groups, a.subassemblies) == (b.table, b.keep, b.piece_groups, b.subassemblies)
    assert np.array_equal(a.X_WB, b.X_WB)
    for one, other in zip(a.bodies, b.bodies, strict=True):
        assert type(one.shape) is type(other.shape)
        assert np.array_equal(one.shape.vertices, other.shape.vertices)
        assert np.array_equal(one.shape.faces, other.shape.faces)


def asked(assembly):
    world = ns.AssemblyGeometry(assembly)
    found = [(c.a, c.b, c.points.tolist(), c.normal.tolist(), c.area, c.gap) for c in world.contacts]
    return found, world.blocking("axes").by_part, world.blocking("axes").queries


def test_what_is_kept_is_what_was_found_and_is_asked_once(scene, counted, everything_kept):
    first = ns.Assembly.load(scene, units="mm", fixed=["plate"])
    told = asked(first)
    assert counted["read"] == 1
    assert counted["along"] >= 3
    before = dict(counted)
    again = ns.Assembly.load(scene, units="mm", fixed=["plate"])
    same(first, again)
    assert asked(again) == told
    assert counted == before, "asked again"
    assert any(isinstance(b.shape, Box) for b in again.bodies)


@pytest.mark.parametrize(
    "change",
    [
        {"units": "m"},
        {"fixed": ["peg"]},
        {"tolerances": Tolerances(touch=2e-3)},
        {"friction": 0.3},
        {"up": "z"},
    ],
    ids=lambda change: next(iter(change)),
)
def test_other_options_are_read_anew(change, scene, counted, everything_kept):
    ns.Assembly.load(scene, units="mm")
    ns.Assembly.load(scene, **{"units": "mm"} | change)
    assert counted["read"] == 2


def test_other_bytes_poses_and_tolerances_are_asked_anew(scene, counted, everything_kept):
    one = ns.Assembly.load(scene)
    told = asked(one)
    moved = one.transformed(at((0, 0, 1.0)))
    assert asked(moved)[0] != told[0]
    assert counted["contacts"] == 2
    data = bytearray(scene.read_bytes())
    loaded = trimesh.load(scene)
    loaded.apply_translation((0, 0, 1))
    loaded.export(scene)
    assert scene.read_bytes() != bytes(data)
    ns.Assembly.load(scene)
    assert counted["read"] == 2


def test_other_code_is_another_version(scene, counted, everything_kept, monkeypatch):
    ns.Assembly.load(scene)
    monkeypatch.setattr(disk_cache, "_code", lambda: b"another")
    ns.Assembly.load(scene)
    assert counted["read"] == 2


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "nonsense"])
def test_a_broken_file_is_made_again(damage, scene, counted, everything_kept):
    told = asked(ns.Assembly.load(scene))
    files = sorted(everything_kept.rglob("*.npz"))
    assert len(files) == 3
    for file in files:
        content = bytearray(file.read_bytes())
        if damage == "flipped":
            content[len(content) // 2] ^= 0xFF
        file.write_bytes({"cut": content[:-40], "empty": b"", "nonsense": b"PK nonsense"}.get(damage, bytes(content)))
    counted.update(read=0, contacts=0, along=0)
    assert asked(ns.Assembly.load(scene)) == told
    assert counted["read"] == counted["contacts"] == 1
    counted.update(read=0, contacts=0, along=0)
    assert asked(ns.Assembly.load(scene)) == told
    assert counted == {"read": 0, "contacts": 0, "along": 0}, "mended"


def test_replays_share_nothing_of_it(scene, counted, everything_kept):
    world = ns.AssemblyGeometry(ns.Assembly.load(scene))
    asked(world.assembly)
    found = counted["contacts"]
    assert world.anew().contacts
    assert counted["contacts"] == found + 1


def test_a_folder_that_cannot_be_written_costs_speed_only(scene, everything_kept, monkeypatch):
    everything_kept.write_text("a file is in the way")
    same(ns.Assembly.load(scene), ns.Assembly.load(scene))


def test_commands_share_it_and_budgets_cover_them(scene, counted, everything_kept, capsys):
    def call(*words):
        with pytest.raises(SystemExit) as left:
            main([*map(str, words)])
        return left.value.code, capsys.readouterr().out

    assert call("inspect", scene)[0] == 0
    before = dict(counted)
    assert call("count", scene)[0] == 0
    assert counted == before
    assert call("plan", scene)[0] == 0  # which replays its plan, and asks that anew
    assert counted["read"] == 1
    code, said = call("count", scene, "--seconds", "1e-9")
    assert code == 23
    assert "reading and geometry" in said
