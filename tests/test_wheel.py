"""The wheel holds all it needs: built, unpacked elsewhere, and used from an empty folder."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]

USE = """
import domains, neurosym as ns
assert domains.__file__.startswith({site!r}), domains.__file__
problem = ns.load_domain("soma").problem(17)
print(ns.solve(problem, prior="sinkhorn").status.name)
"""


def test_the_wheel_works_from_an_empty_folder(tmp_path):
    built = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stderr
    (wheel,) = tmp_path.glob("*.whl")
    site, empty = tmp_path / "site", tmp_path / "empty"
    empty.mkdir()
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        archive.extractall(site)
    assert not [n for n in names if n.startswith(("tests", "examples", "benchmarks", "docs", "out"))]
    used = subprocess.run(
        [sys.executable, "-c", USE.format(site=str(site))],
        cwd=empty,
        env={**os.environ, "PYTHONPATH": str(site), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    assert used.returncode == 0, used.stderr
    assert used.stdout.strip() == "SOLVED"
