"""What a comparison says: one row a planner and prior, beside the published figures, as a table or as CSV."""

from __future__ import annotations

import csv
import os
import platform
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from neurosym.experiments.benchmark import NO_PRIOR, Outcome, Run
from neurosym.registry import load_domain
from neurosym.support.files import replacing

if TYPE_CHECKING:
    from rich.table import Table

Row = dict[str, Any]


def rows(outcome: Outcome) -> list[Row]:
    """One row a planner and prior, over problems x seeds runs.

    Keys: domain, planner, prior, collapse, oracle; problems, seeds, runs; solved (problems solved under every seed),
    runs_solved; initial_failure_rate (0 to 1: the prior's own first order is refused somewhere); iterations_mean and
    iterations_std (population), expansions_mean, attempts_mean, over all runs, those that gave up too; seconds (in
    the planner, all runs together), seconds_mean; image_blind_failure_rate; published (the paper's figures, or None).
    """
    comparison = outcome.comparison
    return [
        _row(outcome, planner, prior, [r for r in outcome.runs if (r.planner, r.prior) == (planner, prior)])
        for prior in comparison.priors
        for planner in comparison.planners
    ]


def _row(outcome: Outcome, planner: str, prior: str, runs: Sequence[Run]) -> Row:
    comparison = outcome.comparison
    unsolved = {r.number for r in runs if not r.solved}
    iterations = np.array([r.iterations for r in runs])
    return {
        "domain": comparison.domain,
        "planner": planner,
        "prior": prior,
        "collapse": comparison.options.get("collapse"),
        "oracle": comparison.oracle,
        "problems": len(comparison.numbers),
        "solved": len(comparison.numbers) - len(unsolved),
        "seeds": comparison.seeds,
        "runs": len(runs),
        "runs_solved": sum(r.solved for r in runs),
        "initial_failure_rate": float(np.mean([r.first_order_failed for r in runs])),
        "iterations_mean": float(iterations.mean()),
        "iterations_std": float(iterations.std()),
        "expansions_mean": float(np.mean([r.expansions for r in runs])),
        "attempts_mean": float(np.mean([r.attempts for r in runs])),
        "seconds": float(np.sum([r.seconds for r in runs])),
        "seconds_mean": float(np.mean([r.seconds for r in runs])),
        "image_blind_failure_rate": outcome.image_blind,
        "published": published(comparison.domain, planner, prior),
    }


def published(domain: str, planner: str, prior: str) -> dict[str, Any] | None:
    """The family's published figures for a planner and prior; no prior stands beside the published random orders."""
    names = {prior, "random"} if prior == NO_PRIOR else {prior}
    for row in load_domain(domain).published:
        if row["planner"] == planner and row["prior"] in names:
            return {k: v for k, v in row.items() if k not in ("planner", "prior")}
    return None


def table(given: Sequence[Row]) -> Table:
    """The rows for a terminal."""
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    counts = ("solved", "initial\nfailures %", "iterations\nmean ± sd", "expan-\nsions", "at-\ntempts", "ms a\nproblem")
    for column in ("planner", "prior", *counts, "paper:\nfailures %", "paper:\niterations"):
        made.add_column(column, justify="left" if column in ("planner", "prior") else "right", no_wrap=True)
    for i, row in enumerate(given):
        made.add_row(*cells(row), end_section=i + 1 < len(given) and given[i + 1]["prior"] != row["prior"])
    return made


def cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    """A row as text, in the order of the table."""
    paper = row["published"] or {}
    return (
        str(row["planner"]),
        _short(row["prior"]),
        f"{row['runs_solved']}/{row['runs']}",
        f"{100 * row['initial_failure_rate']:.1f}",
        f"{row['iterations_mean']:.2f} ± {row['iterations_std']:.2f}",
        f"{row['expansions_mean']:.1f}",
        f"{row['attempts_mean']:.1f}",
        f"{1000 * row['seconds_mean']:.2f}",
        _spread(paper.get("initial_failures")),
        _spread(paper.get("iterations")),
    )


def markdown(given: Sequence[Row]) -> str:
    """The rows as a Markdown table, for the README."""
    head = ("planner", "prior", "solved", "initial failures %", "iterations", "expansions", "attempts", "ms a problem")
    lines = [(*head, "paper: failures %", "paper: iterations"), ("---",) * 10, *map(cells, given)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def report(outcome: Outcome) -> str:
    """The comparison as Markdown, with what a reader needs to repeat it: options, seeds, versions, machine."""
    comparison = outcome.comparison
    options = ", ".join(f"{key} {value}" for key, value in comparison.options.items())
    said = f"{len(comparison.numbers)} problems x {comparison.seeds} seed(s) from 0; {options}; {comparison.oracle}."
    if outcome.image_blind is not None:
        order = " ".join(outcome.image_blind_order)
        failures = 100 * outcome.image_blind
        said += f" The best fixed order ({order}), which looks at no picture, fails on {failures:.1f}%."
    return f"{markdown(rows(outcome))}\n{said} {provenance()}\n"


def provenance() -> str:
    """Versions and machine, one sentence."""
    names = ("neurosym-assembly", "numpy", "scipy", "python-fcl", "pybullet", "torch")
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in names)
    machine = f"Python {platform.python_version()} on {platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    return f"{versions}; {machine}."


def write_csv(given: Sequence[Row], path: str | Path) -> Path:
    """Write the rows as CSV, whole or not at all; the published mean and deviation are columns of their own."""
    path = Path(path)
    flat = []
    for row in given:
        paper = row["published"] or {}
        plain = {k: v for k, v in row.items() if k != "published"}
        for key in ("initial_failures", "iterations"):
            mean, deviation = paper.get(key) or ("", "")
            plain |= {f"published_{key}_mean": mean, f"published_{key}_std": deviation}
        flat.append(plain)
    with replacing(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(flat[0]))
        writer.writeheader()
        writer.writerows(flat)
    return path


def _short(prior: str) -> str:
    """A weights file goes by its name."""
    return Path(prior).name if prior.endswith(".safetensors") else prior


def _spread(figures: Sequence[float] | None) -> str:
    return "" if not figures else f"{figures[0]:.2f} ± {figures[1]:.2f}"
