"""The README's Python runs, and its table is a table."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import trimesh

import neurosym as ns

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def readme() -> str:
    return (ROOT / "README.md").read_text(encoding="utf-8")


def test_every_block_of_python_runs(readme, capsys):
    soma = ns.load_domain("soma")
    seat = trimesh.creation.box((4, 4, 1), trimesh.transformations.translation_matrix((0, 0, 3.5)))
    legs = {
        f"leg {k}": trimesh.creation.box((1, 1, 3), trimesh.transformations.translation_matrix((x, y, 1.5)))
        for k, (x, y) in enumerate([(-1.5, -1.5), (1.5, -1.5), (-1.5, 1.5), (1.5, 1.5)])
    }
    names = {
        "cells": soma.solutions()[3],
        "pictures": soma.problem(3).observation,
        "meshes": {"seat": seat, **legs},
    }
    blocks = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    assert len(blocks) >= 4
    for block in blocks:
        exec(compile(block, "README.md", "exec"), names)
    taken_apart = ns.solve(names["problem"])
    assert taken_apart.solved
    # Three legs carry the seat, two do not: at most one leg leaves before it.
    assert taken_apart.plan.index("remove(seat)") <= 1


def test_the_table_was_made_by_its_command(readme):
    table = re.search(r"<!-- table:begin.*?-->\n(.*?)<!-- table:end -->", readme, re.DOTALL).group(1)
    rows = [line for line in table.splitlines() if line.startswith("|")]
    assert len(rows) == 2 + 3 * 5  # a head and a rule; three planners, five priors
    assert not re.search(r"[A-Z]+_[A-Z]+", readme.replace("OMP_NUM_THREADS", ""))  # no place left to fill in


def test_links_of_the_readme_lead_somewhere(readme):
    for target in re.findall(r"\]\(([^)#]+)\)", readme):
        if not target.startswith("http"):
            assert (ROOT / target).exists(), target
