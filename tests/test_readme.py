"""The README's Python runs, and its table is a table."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import pytest

import neurosym as ns

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def readme() -> str:
    return (ROOT / "README.md").read_text(encoding="utf-8")


def test_every_block_of_python_runs_by_itself(readme, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    assert len(blocks) >= 4
    for block in blocks:  # each as it stands, from nothing
        names = {}
        exec(compile(block, "README.md", "exec"), names)
    taken_apart = ns.solve(names["problem"])
    assert taken_apart.solved
    assert taken_apart.plan[0] == "remove(seat)"  # one leg alone does not carry it


def test_the_table_was_made_by_its_command(readme):
    table = re.search(r"<!-- table:begin.*?-->\n(.*?)<!-- table:end -->", readme, re.DOTALL).group(1)
    rows = [line for line in table.splitlines() if line.startswith("|")]
    assert len(rows) == 2 + 3 * 6  # a head and a rule; three planners, six priors
    assert not re.search(r"[A-Z]+_[A-Z]+", readme.replace("OMP_NUM_THREADS", ""))  # no place left to fill in


def test_links_of_the_readme_lead_somewhere(readme):
    for target in re.findall(r"\]\(([^)#]+)\)", readme):
        if not target.startswith("http"):
            assert (ROOT / target).exists(), target


def cells(report, section, row):
    """The cells of the first row of a report's section that begins as said."""
    text = (ROOT / "docs" / report).read_text(encoding="utf-8").split(f"## {section}\n", 1)[1]
    found = next(line for line in text.splitlines() if line.startswith(f"| {row} |"))
    return [cell.strip() for cell in found.split("|")[1:-1]]


def test_the_numbers_on_the_first_screen_are_those_of_the_reports(readme):
    clean = [
        cells("soma.md", "clean pictures", name)[1].split()[0] for name in ("sinkhorn", "sinkhorn-paper", "random")
    ]
    assert clean == ["1.0", "29.0", "94.3"]
    assert "over five splits 1.0, 29.0 and 94.3%" in readme
    for row, share in (("sinkhorn", "0.8"), ("sinkhorn-paper", "22.5"), ("none", "90.8")):
        assert re.search(rf"^\| swap-repair \| {row} \| 120/120 \| {share} \|", readme, re.MULTILINE), row


@pytest.mark.parametrize("page", ["README.md", "docs/limits.md", "docs/results-overview.md"])
def test_how_many_plans_stood_still_in_physics_is_what_the_report_says(page):
    row = "planned, accepted by `validate`"
    report = (ROOT / "docs" / "replay.md").read_text(encoding="utf-8")
    _, n, same, _ = (c.strip() for c in next(x for x in report.splitlines() if row in x).split("|")[1:-1])
    said = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    stood = same.split()[0]
    assert f"{n} plans for Soma cubes, {stood} stood still" in said or f"{stood} of {n} plans for Soma cubes" in said


def test_the_small_table_is_that_of_the_results(readme):
    """Whole sequences: in the tables of the towers that were seen, and that were not; of heights; and of words."""
    where = (
        ("tower: hard pictures", 200, 3),
        ("tower: hard pictures", 200, 4),
        ("variable: hard pictures", 400, 2),
        ("scrabble: easy pictures", 98, 2),
    )
    for label, method in (
        ("the best of the paper's methods, here", "tcn-paper+hungarian"),
        ("`sinkhorn`, ours", "sinkhorn"),
    ):
        shown = re.search(rf"^\| {re.escape(label)} \|(.*)\|$", readme, re.MULTILINE).group(1).split("|")
        for cell, (section, n, column) in zip(shown, where, strict=True):
            value = float(cells("results.md", section, f"{n} | {method}")[column].split()[0])
            cell = cell.strip()
            decimals = len(cell.partition(".")[2])
            assert f"{value:.{decimals}f}".lstrip("0") == cell, (label, section)


def test_where_both_were_trained_the_papers_network_is_behind(readme):
    """As the README says: Gumbel-Sinkhorn against the temporal network with the Hungarian algorithm."""
    assert "`sinkhorn-paper` is behind `tcn-paper+hungarian` wherever both were trained" in readme
    rows = re.findall(
        r"^\| (\d+) \| (sinkhorn-paper|tcn-paper\+hungarian) \| ([\d.]+)",
        (ROOT / "docs" / "results.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    compared = 0
    for (n, first, ahead), (m, second, behind) in pairwise(rows):
        if n == m and (first, second) == ("tcn-paper+hungarian", "sinkhorn-paper"):
            assert float(behind) < float(ahead), (n, ahead, behind)
            compared += 1
    assert compared >= 10
