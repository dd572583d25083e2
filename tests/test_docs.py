"""The site: its code runs, page by page; its links lead somewhere; it is built strictly."""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import shlex
import subprocess
import sys
import tomllib
import zlib
from dataclasses import asdict
from functools import cache
from pathlib import Path

import pytest
import typer.main

from learned_priors import encoders
from neurosym import registry
from neurosym.cli import app, main
from neurosym.commands.exit_codes import EXIT_CODES
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
#: Its recipes run as pages do, and are short.
RECIPES = ROOT / "CONTRIBUTING.md"
#: What a page may leave out of an output, and times, which differ.
GAP, TIME = "...", re.compile(r"\b\d+(?:\.\d+)? m?s\b")
#: A comment above a block says why it does not run, with which exit codes its last command may leave, or as which file
#: the reader saves it.
BLOCK = re.compile(
    r"(?:<!-- (?P<what>skip|exit|file): (?P<said>[^\n]*?) -->\n)?"
    r"```(?P<kind>python|console|text|toml)\n(?P<body>.*?)```",
    re.DOTALL,
)
LINK = re.compile(r"\]\(([^)\s]+)\)")


def blocks(page):
    return list(BLOCK.finditer(page.read_text(encoding="utf-8")))


def runnable(page):
    return [block for block in blocks(page) if block["what"] != "skip"]


def install(project, folder):
    """Declare the entry points of a page's project, as an installation of it would."""
    info = folder / f"{project['name']}-{project['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    lines = []
    for group, points in project["entry-points"].items():
        lines += [f"[{group}]", *(f"{name} = {target}" for name, target in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines))
    registry._entry_points.cache_clear()


def same_output(shown, printed):
    """Whether a page shows what was printed: line by line, times aside, with gaps where it says so."""
    wanted, found = (
        [TIME.sub("TIME", line.rstrip()) for line in text.strip().splitlines()] for text in (shown, printed)
    )
    pattern = r"\n".join(r"(?:.*\n)*?.*" if line.strip() == GAP else re.escape(line) for line in wanted)
    return re.fullmatch(pattern, "\n".join(found)) is not None


def run_console(body, allowed, capsys):
    """Every line that begins with ``$ neurosym``; all but the last must leave with 0, and print what is shown."""
    _, *parts = re.split(r"^\$ ", body, flags=re.MULTILINE)
    assert parts, f"no command in {body!r}"
    for i, part in enumerate(parts):
        command, _, shown = part.partition("\n")
        words = shlex.split(command, comments=True)
        assert words[0] == "neurosym", f"{command!r} cannot run here: say why with <!-- skip: ... -->"
        capsys.readouterr()
        with pytest.raises(SystemExit) as left:
            main(words[1:])
        printed = capsys.readouterr().out
        expected = allowed if i == len(parts) - 1 else {0}
        assert (left.value.code or 0) in expected, command
        assert not shown.strip() or same_output(shown, printed), f"{command} printed:\n{printed}"


@pytest.mark.parametrize(
    ("shown", "same"),
    [
        ("a\nb 2.0 ms", True),
        ("a\n...", True),
        ("...", True),
        ("a", False),
        ("a\nc 1 ms", False),
        ("b 2.0 ms\na", False),
    ],
)
def test_outputs_are_told_apart(shown, same):
    assert same_output(shown, "a\nb 3.1 ms\n") is same


def test_recipes_are_short():
    recipes = runnable(RECIPES)
    assert len(recipes) == 3
    assert max(block["body"].count("\n") for block in recipes) < 25


@pytest.mark.parametrize("page", [*(p for p in PAGES if runnable(p)), RECIPES], ids=lambda p: str(p.relative_to(ROOT)))
def test_code_runs(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(encoders, "_ENCODERS", dict(encoders._ENCODERS))
    monkeypatch.setattr("neurosym.registry._entry_points", cache(registry._entry_points.__wrapped__))
    names = {}
    printed = ""
    for block in runnable(page):
        if block["what"] == "file":
            Path(block["said"]).write_text(block["body"], encoding="utf-8")
            monkeypatch.setitem(sys.modules, Path(block["said"]).stem, None)  # forgotten in the end
            del sys.modules[Path(block["said"]).stem]
        if block["kind"] == "toml":
            install(tomllib.loads(block["body"])["project"], tmp_path)
        elif block["kind"] == "text":  # what the block of Python before it prints
            assert same_output(block["body"], printed), f"printed:\n{printed}"
        elif block["kind"] == "python" and block["what"] != "file":  # a file runs where it is imported
            line = page.read_text(encoding="utf-8")[: block.start("body")].count("\n")
            capsys.readouterr()
            exec(compile("\n" * line + block["body"], str(page), "exec"), names)
            printed = capsys.readouterr().out
        elif block["kind"] == "console":
            allowed = {int(code) for code in re.findall(r"\d+", block["said"])} if block["what"] == "exit" else {0}
            assert allowed
            run_console(block["body"], allowed, capsys)


def test_there_is_code_and_what_does_not_run_says_why():
    by_kind = dict.fromkeys(("python", "console", "text", "toml"), 0)
    for page in PAGES:
        for block in runnable(page):
            by_kind[block["kind"]] += 1
        for block in blocks(page):
            assert block["what"] != "skip" or len(block["said"]) > 10, page
        # The expression above finds every block there is.
        assert len(re.findall(r"^```(?:python|console|text|toml)$", page.read_text(), re.MULTILINE)) == len(
            blocks(page)
        )
    assert by_kind["python"] >= 15
    assert by_kind["console"] >= 10


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(DOCS)))
def test_links_lead_to_files_in_the_docs(page):
    for target in LINK.findall(re.sub(r"```.*?```|`[^`]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)):
        if not re.match(r"[a-z]+:|#", target):
            assert (page.parent / target.partition("#")[0]).is_file(), f"{target} in {page}"


def test_the_page_on_commands_has_all_of_them_and_all_exit_codes():
    said = (DOCS / "api" / "cli.md").read_text()
    commands = set(typer.main.get_command(app).commands)
    assert set(re.findall(r"^\| `([a-z]+)` \|", said, re.MULTILINE)) == commands
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", said, re.MULTILINE)} == set(EXIT_CODES)


def test_the_limits_name_the_tolerances_as_they_are():
    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) \|", (DOCS / "limits.md").read_text(), re.MULTILINE)
    assert {name: float(value) for name, value in rows} == asdict(DEFAULT_TOLERANCES)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if importlib.util.find_spec("material") is None or importlib.util.find_spec("mkdocstrings") is None:
        pytest.skip("mkdocs-material and mkdocstrings are not installed (extra docs)")
    built = tmp_path_factory.mktemp("docs") / "site"
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(built)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return built


def test_the_site_asks_nothing_of_the_network(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) >= len(PAGES)
    for page in pages:
        text = page.read_text(encoding="utf-8")
        fetched = re.findall(r'<(?:script|img|iframe|source)[^>]*?\ssrc="?(https?:[^"\s>]+)', text)
        fetched += re.findall(r'<link[^>]*rel="?(?:stylesheet|preconnect|icon)"?[^>]*href="?(https?:[^"\s>]+)', text)
        assert fetched == [], page
    planning = (site / "api" / "planning.html").read_text(encoding="utf-8")
    assert "Plan: ground the symbols, read the prior, search" in planning  # a docstring has come through


def public_names(module):
    """What a module says is public, or, where it does not say, what it defines without an underscore."""
    if hasattr(module, "__all__"):
        return set(module.__all__) - {"__version__"}
    return {name for name, what in vars(module).items() if getattr(what, "__module__", "") == module.__name__} - {
        name for name in vars(module) if name.startswith("_")
    }


@pytest.mark.parametrize(
    "package",
    [
        "neurosym",
        "neurosym.language.predicates",
        "neurosym.plotting",
        "neurosym.simulation",
        "neurosym.testing",
        "learned_priors",
    ],
)
def test_the_reference_has_every_public_name(package, site):
    inventory = zlib.decompress((site / "objects.inv").read_bytes().split(b"\n", 4)[4]).decode()
    described = {line.split()[0].rpartition(".")[2] for line in inventory.splitlines()}
    public = public_names(importlib.import_module(package))
    assert public
    assert public - described == set()


def test_the_search_works_from_disk(site):
    """A browser that may not start workers asks for a script with the index, and for the frame that stands in."""
    assert (site / "search" / "search_index.js").read_text(encoding="utf-8").startswith("var __index = {")
    assert 'src="../theme/iframe-worker.js"' in (site / "api" / "planning.html").read_text(encoding="utf-8")
