"""The house itself: names that exist, imports that stay light, declarations that match what is installed."""

import ast
import importlib
import re
import subprocess
import sys
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest

import neurosym

ROOT = Path(__file__).parent.parent
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
OURS = ("neurosym", "domains", "planners", "learned_priors")
HEAVY = ("fcl", "ompl", "torch", "pybullet", "matplotlib", "viser")


def loaded_by(code: str) -> set[str]:
    """The heavy modules that a fresh interpreter has loaded after running `code`."""
    code += f"\nimport sys\nprint('LOADED', *[m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.rpartition("LOADED")[2].split())


def test_the_probe_sees_what_is_loaded():
    assert "matplotlib" in loaded_by("import matplotlib")


@pytest.mark.parametrize(
    "code",
    [
        "import neurosym",
        "import neurosym as ns; ns.Budget, ns.Status, ns.load_domain, ns.planner_names(), ns.prior_names()",
        "import domains, planners, learned_priors, neurosym.simulation",
        "import neurosym.cli",
        "import neurosym.plotting, neurosym.experiments.benchmark, neurosym.commands.doctor",
        "import neurosym.cli\ntry: neurosym.cli.main(['--help'])\nexcept SystemExit: pass",
        "import neurosym.cli\ntry: neurosym.cli.main(['compare', '--help'])\nexcept SystemExit: pass",
    ],
    ids=["import", "names", "packages", "cli", "reports", "help", "compare-help"],
)
def test_nothing_heavy_is_loaded_before_it_is_needed(code):
    assert loaded_by(code) == set()


def test_planning_with_geometry_loads_no_network_library_and_no_figures():
    code = "import neurosym as ns; assert ns.solve(ns.load_domain('soma').problem(17)).solved"
    assert loaded_by(code) == {"fcl"}


#: What takes a command longer to load than to answer.
SLOW = ("numba", "xcover", "scipy.optimize", "scipy.spatial", "networkx", "pandas", "torch", "pybullet", "matplotlib")


@pytest.mark.parametrize("command", [["--help"], ["plan", "soma", "--problem", "17"]], ids=["help", "plan"])
def test_a_command_that_needs_little_starts_soon(command, tmp_path, monkeypatch):
    """The first run keeps the 240 cubes on disk and prints no dependency's warning; after it no solver is loaded."""
    monkeypatch.setenv("NEUROSYM_CACHE", str(tmp_path / "kept"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "compiled"))
    code = f"import neurosym.cli\ntry: neurosym.cli.main({command!r})\nexcept SystemExit: pass\n"
    code += f"import sys\nprint('LOADED', *[m for m in {SLOW!r} if m in sys.modules])"
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(2)]
    assert runs[0].stderr == ""
    assert runs[1].stdout.rpartition("LOADED")[2].split() == []


@pytest.mark.parametrize("package", ["neurosym", "planners", "learned_priors", "neurosym.simulation"])
def test_every_public_name_exists(package):
    module = __import__(package, fromlist=["__all__"])
    assert module.__all__
    for name in module.__all__:
        assert getattr(module, name, None) is not None, f"{package}.__all__ names {name}, which does not exist"
    assert set(module.__all__) <= set(dir(module))


def test_an_unknown_public_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="attribute slove"):
        _ = neurosym.slove


@pytest.mark.parametrize("group", sorted(PYPROJECT["project"]["entry-points"]))
def test_entry_points_are_installed_as_declared(group):
    declared = PYPROJECT["project"]["entry-points"][group]
    installed = {e.name: e.value for e in distribution("neurosym-assembly").entry_points if e.group == group}
    assert installed == declared, (
        f"The entry points of {group} in pyproject.toml are not those that are installed, so new ones cannot be found: "
        "install again (make setup, or pip install -e .)."
    )


def test_every_entry_point_leads_somewhere():
    for entry in distribution("neurosym-assembly").entry_points:
        assert callable(entry.load()), entry


def test_the_version_is_the_same_everywhere():
    assert PYPROJECT["project"]["version"] == neurosym.__version__ == distribution("neurosym-assembly").version
    assert f"version: {neurosym.__version__}" in (ROOT / "CITATION.cff").read_text()
    assert f"## {neurosym.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_no_test_or_example_hides_a_package():
    assert not list((ROOT / "tests").rglob("__init__.py")), "an __init__.py under tests/ can hide a real package"
    packages = {"neurosym", "domains", "planners", "learned_priors"}
    for folder in ("tests", "examples", "benchmarks"):
        assert not packages & {path.stem for path in (ROOT / folder).iterdir()}, f"{folder}/ hides a package"


@pytest.mark.parametrize("path", sorted((ROOT / "benchmarks").glob("*.py")), ids=lambda path: path.stem)
def test_what_a_benchmark_imports_is_there(path: Path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] in OURS:
            module = importlib.import_module(node.module or "")
            for name in node.names:
                if not hasattr(module, name.name):
                    importlib.import_module(f"{node.module}.{name.name}")


def test_every_direct_dependency_is_pinned():
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pinned = {line.partition("==")[0].lower().replace("_", "-") for line in lines}
    needed = [*PYPROJECT["project"]["dependencies"], *PYPROJECT["project"]["optional-dependencies"]["dev"]]
    names = {re.split(r"[\[<>=]", requirement)[0].lower().replace("_", "-") for requirement in needed}
    assert names <= pinned, f"constraints.txt does not pin {sorted(names - pinned)}; run make constraints"


def test_import_contracts_hold():
    command = [str(Path(sys.executable).parent / "lint-imports")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:]
    assert "0 broken" in done.stdout


def test_the_license_and_the_citation_come_along():
    assert "MIT" in (ROOT / "LICENSE").read_text()
    assert "Action sequencing using visual permutations" in (ROOT / "CITATION.cff").read_text()
