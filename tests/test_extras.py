"""Without torch, pybullet or OMPL what does not need them works, and what does says which extra to install."""

import subprocess
import sys

import pytest

BLOCK = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"torch", "safetensors", "pybullet", "pybullet_data", "ompl", "coacd"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Absent())
import neurosym as ns
def said(work):
    try:
        work()
    except ns.MissingDependencyError as error:
        print(error)
slot = {"box": [(x, y, z) for x in range(3) for y in range(3) for z in range(2) if (x, y, z) != (1, 1, 1)],
        "peg": [(1, 1, 1), (1, 1, 2)]}
assembly = ns.load_domain("assembly")
"""


def run(code):
    done = subprocess.run([sys.executable, "-c", BLOCK + code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_planning_validation_and_figures_need_none_of_them():
    code = """
print(ns.solve(ns.load_domain("soma").problem(17), planner="best-first", prior="outermost-first").status.name)
print(ns.solve(assembly.problem(ns.Assembly.from_cells(slot), paths="any", groups=True)).status.name)
print(ns.solve(ns.load_domain("tower").problem(1)).status.name, ns.solve(ns.load_domain("scrabble").problem(1)).solved)
from neurosym.plotting import blocking_figure
blocking_figure(ns.Assembly.from_cells(slot))
import neurosym.cli, learned_priors
"""
    assert run(code).split() == ["SOLVED", "SOLVED", "SOLVED", "True"]


@pytest.mark.parametrize(
    ("code", "extra", "package"),
    [
        ('ns.load_prior("sinkhorn")', "learned", "torch"),
        ('ns.solve(ns.load_domain("soma").problem(17), prior="sinkhorn")', "learned", "torch"),
        ('ns.load_domain("soma").problem(17).observation', "physics", "PyBullet"),
        ('ns.solve(ns.load_domain("soma").problem(17), oracle="physics")', "physics", "PyBullet"),
        ("from neurosym.geometry.paths.trees import ompl_works; ompl_works()", "paths", "OMPL"),
    ],
    ids=["prior", "solve", "pictures", "oracle", "paths"],
)
def test_what_needs_one_names_its_extra(code, extra, package):
    printed = run(f"def work():\n    {code}\nsaid(work)")
    assert printed.startswith(f"Expected {package}, which ")
    assert f"pip install 'neurosym-assembly[{extra}]'" in printed


def test_the_doctor_says_what_is_not_there_and_is_well():
    code = "from neurosym.commands.doctor import examine\nfor f in examine(): print(f.ok, f.name, f.said)"
    lines = run(code).splitlines()
    assert all(line.startswith("True ") for line in lines)
    assert sum("Install the extra" in line for line in lines) == 3
