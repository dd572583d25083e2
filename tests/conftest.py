"""Tests ask geometry, not what an earlier run left on this machine's disk; those of what is kept say so."""

import pytest

from neurosym.geometry import kept_tables
from neurosym.geometry.readers import loading


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    monkeypatch.setenv("NEUROSYM_KEEP", "0")


@pytest.fixture
def everything_kept(nothing_kept, monkeypatch, tmp_path):
    """All that is read and tabulated is kept in a folder of this test; the folder."""
    monkeypatch.setenv("NEUROSYM_KEEP", "1")
    monkeypatch.setenv("NEUROSYM_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(kept_tables, "WORTH", 0)
    monkeypatch.setattr(loading, "SLOW", 0.0)
    return tmp_path / "cache"
