"""The site: its code runs, page by page; its links lead somewhere; it is built strictly."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer.main

from neurosym.cli import app, main
from neurosym.exit_codes import EXIT_CODES

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
#: A comment above a block says why it does not run, or with which exit codes its last command may leave.
BLOCK = re.compile(
    r"(?:<!-- (?P<what>skip|exit): (?P<said>[^\n]*?) -->\n)?```(?P<kind>python|console|bash)\n(?P<body>.*?)```",
    re.DOTALL,
)
LINK = re.compile(r"\]\(([^)\s]+)\)")


def blocks(page):
    return list(BLOCK.finditer(page.read_text(encoding="utf-8")))


def runnable(page):
    return [block for block in blocks(page) if block["what"] != "skip"]


def run_console(body, allowed):
    """Every line that begins with ``$ neurosym``; all but the last must leave with 0."""
    commands = [line[2:] for line in body.splitlines() if line.startswith("$ ")]
    assert commands, f"no command in {body!r}"
    for command in commands:
        words = shlex.split(command, comments=True)
        assert words[0] == "neurosym", f"{command!r} cannot run here: say why with <!-- skip: ... -->"
        with pytest.raises(SystemExit) as left:
            main(words[1:])
        expected = allowed if command is commands[-1] else {0}
        assert (left.value.code or 0) in expected, command


@pytest.mark.parametrize("page", [p for p in PAGES if runnable(p)], ids=lambda p: str(p.relative_to(DOCS)))
def test_code_runs(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in runnable(page):
        if block["kind"] == "python":
            line = page.read_text(encoding="utf-8")[: block.start("body")].count("\n")
            exec(compile("\n" * line + block["body"], str(page), "exec"), names)
        else:
            allowed = {int(code) for code in re.findall(r"\d+", block["said"])} if block["what"] == "exit" else {0}
            assert allowed
            run_console(block["body"], allowed)


def test_there_is_code_and_what_does_not_run_says_why():
    by_kind = dict.fromkeys(("python", "console"), 0)
    for page in PAGES:
        for block in runnable(page):
            by_kind[block["kind"]] += 1
        for block in blocks(page):
            assert block["what"] != "skip" or len(block["said"]) > 10, page
        # The expression above finds every block there is.
        assert len(re.findall(r"^```(?:python|console|bash)$", page.read_text(), re.MULTILINE)) == len(blocks(page))
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


def test_the_site_is_built_strictly_and_asks_nothing_of_the_network(tmp_path):
    if importlib.util.find_spec("material") is None or importlib.util.find_spec("mkdocstrings") is None:
        pytest.skip("mkdocs-material and mkdocstrings are not installed (extra docs)")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) >= len(PAGES)
    for page in pages:
        text = page.read_text(encoding="utf-8")
        fetched = re.findall(r'<(?:script|img|iframe|source)[^>]*?\ssrc="?(https?:[^"\s>]+)', text)
        fetched += re.findall(r'<link[^>]*rel="?(?:stylesheet|preconnect|icon)"?[^>]*href="?(https?:[^"\s>]+)', text)
        assert fetched == [], page
    planning = (tmp_path / "site" / "api" / "planning.html").read_text(encoding="utf-8")
    assert "Plan: ground the symbols, read the prior, search" in planning  # a docstring has come through
