"""`neurosym doctor`: it sees what is well, and what is not."""

import json

import pytest

from neurosym.cli import main
from neurosym.commands import doctor


@pytest.fixture(scope="module")
def findings():
    return list(doctor.examine())


def test_all_is_well_here(findings):
    assert [f for f in findings if not f.ok] == [], "run neurosym doctor: each line that says no has its remedy"


def test_every_heavy_dependency_is_called(findings):
    assert {f.name for f in findings if f.topic == "works"} >= {"FCL", "PyBullet", "OMPL", "torch"}


def test_all_four_packages_are_looked_at(findings):
    assert {f.name for f in findings if f.topic == "names"} == {"neurosym", "domains", "planners", "learned_priors"}


def test_versions_of_what_is_needed_are_said(findings):
    said = {f.name: f.said for f in findings if f.topic == "installed"}
    assert {"numpy", "python-fcl", "pybullet", "ompl", "torch", "neurosym-assembly"} <= said.keys()


def test_a_rival_distribution_is_named_with_its_remedy():
    rival = doctor.claim("planners", {"planners": ["neurosym-assembly", "planners"]})
    assert not rival.ok
    assert rival.said == "also claimed by planners"
    assert "pip uninstall planners" in rival.remedy


@pytest.mark.parametrize("spelling", ["neurosym-assembly", "neurosym_assembly", "Neurosym.Assembly"])
def test_our_own_claim_is_no_rival_however_it_is_spelt(spelling):
    assert doctor.claim("planners", {"planners": [spelling]}).ok


def test_a_package_from_elsewhere_is_seen():
    found = doctor.claim("json", {})
    assert not found.ok
    assert "imported from" in found.said


def test_a_check_that_raises_is_a_finding():
    def broken() -> str:
        raise ImportError("libfcl.so: cannot open shared object file")

    found = doctor.works("FCL", broken)
    assert not found.ok
    assert "cannot open" in found.said
    assert "python-fcl" in found.remedy


def test_a_wrong_answer_of_fcl_is_noticed(monkeypatch):
    monkeypatch.setattr("neurosym.geometry.contact.collision.collide", lambda a, b: True)
    assert not doctor.works("FCL", doctor.fcl_works).ok


def test_json_is_nothing_but_json(capsys):
    with pytest.raises(SystemExit) as left:
        main(["doctor", "--json"])
    assert left.value.code == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["ok"] is True
    assert all(f["ok"] for f in answer["findings"])
