"""Tables: of a comparison, one row a planner and prior, beside the published figures; and what all reports share."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from neurosym.experiments.benchmark import NO_PRIOR, OUTERMOST, Outcome
from neurosym.plotting import iterations_figure, save_both
from neurosym.registry import load_domain
from neurosym.support.files import write_text

if TYPE_CHECKING:
    from rich.table import Table

    from neurosym.plotting.style import Figure

Row = dict[str, Any]

#: Columns of results.csv of the paper's experiments: a line a number.
RECORD = ["experiment", "pictures", "method", "n", "seed", "metric", "value"]
#: What is published of a planner and prior, each with its deviation.
PUBLISHED = ("initial_failures", "iterations")


def rows(outcome: Outcome) -> list[Row]:
    """One row a planner and prior, over problems x seeds runs; where the family has kinds of problems, of each kind.

    Keys: kind, where there are any; domain, planner, prior, collapse, oracle; problems, seeds, runs; solved (problems
    solved under every seed), runs_solved; initial_failure_rate (0 to 1: the prior's own first order is refused
    somewhere); iterations_mean and iterations_std (population), expansions_mean, attempts_mean, over all runs, those
    that gave up too; seconds (in the planner, all runs together), seconds_mean; image_blind_failure_rate; published
    (the paper's figures, or None).
    """
    comparison, kind = outcome.comparison, load_domain(outcome.comparison.domain).kind
    table = pd.DataFrame(list(outcome.runs))
    groups = table.groupby([table["number"].map(kind), "planner", "prior"])
    kinds = dict.fromkeys(map(kind, comparison.numbers))
    return [
        ({"kind": own} if own else {}) | _row(outcome, planner, prior, groups.get_group((own, planner, prior)))
        for own in kinds
        for prior in comparison.priors
        for planner in comparison.planners
    ]


def _row(outcome: Outcome, planner: str, prior: str, runs: pd.DataFrame) -> Row:
    comparison, solved = outcome.comparison, runs["status"] == "SOLVED"
    problems = runs["number"].nunique()
    return {
        "domain": comparison.domain,
        "planner": planner,
        "prior": prior,
        "collapse": comparison.options.get("collapse"),
        "oracle": comparison.oracle,
        "problems": problems,
        "solved": problems - runs.loc[~solved, "number"].nunique(),
        "seeds": comparison.seeds,
        "runs": len(runs),
        "runs_solved": int(solved.sum()),
        "initial_failure_rate": float(runs["first_order_failed"].mean()),
        "iterations_mean": float(runs["iterations"].mean()),
        "iterations_std": float(runs["iterations"].std(ddof=0)),
        "expansions_mean": float(runs["expansions"].mean()),
        "attempts_mean": float(runs["attempts"].mean()),
        "seconds": float(runs["seconds"].sum()),
        "seconds_mean": float(runs["seconds"].mean()),
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


def figure_of(outcome: Outcome) -> Figure:
    """How many iterations each planner needs with each prior, beside the published means."""
    comparison = outcome.comparison
    counts: dict[str, dict[str, list[int]]] = {pl: {pr: [] for pr in comparison.priors} for pl in comparison.planners}
    for run in outcome.runs:
        counts[run.planner][run.prior].append(run.iterations)
    cells = [(planner, prior) for planner in comparison.planners for prior in comparison.priors]
    papers = {cell: (published(comparison.domain, *cell) or {}).get("iterations") for cell in cells}
    what = [comparison.domain, str(comparison.options.get("collapse") or ""), comparison.oracle]
    n = f"{len(comparison.numbers)} problems" + (f" × {comparison.seeds} seeds" if comparison.seeds > 1 else "")
    title = f"{', '.join(filter(None, what))}: n = {n}"
    return iterations_figure(title, counts, paper={cell: figures[0] for cell, figures in papers.items() if figures})


def table(given: Sequence[Row]) -> Table:
    """The rows for a terminal."""
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    counts = ("solved", "initial\nfailures %", "iterations\nmean ± sd", "expan-\nsions", "at-\ntempts", "ms a\nproblem")
    named = (*_kind_of_row(given, "kind"), "planner", "prior")
    for column in (*named, *counts, "paper:\nfailures %", "paper:\niterations"):
        made.add_column(column, justify="left" if column in named else "right", no_wrap=True)
    for i, row in enumerate(given):
        made.add_row(*cells(row), end_section=i + 1 < len(given) and given[i + 1]["prior"] != row["prior"])
    return made


def cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    """A row as text, in the order of the table."""
    prior, paper = row["prior"], row["published"] or {}
    return (
        *_kind_of_row([row], row.get("kind")),
        str(row["planner"]),
        Path(prior).name if prior.endswith(".safetensors") else prior,
        f"{row['runs_solved']}/{row['runs']}",
        f"{100 * row['initial_failure_rate']:.1f}",
        f"{row['iterations_mean']:.2f} ± {row['iterations_std']:.2f}",
        f"{row['expansions_mean']:.1f}",
        f"{row['attempts_mean']:.1f}",
        f"{1000 * row['seconds_mean']:.2f}",
        *("{:.2f} ± {:.2f}".format(*pair) if pair else "" for pair in map(paper.get, PUBLISHED)),
    )


def _kind_of_row(given: Sequence[Mapping[str, Any]], text: Any) -> tuple[str, ...]:
    """A first cell, where rows are of kinds of problems."""
    return (str(text),) if any("kind" in row for row in given) else ()


def markdown(given: Sequence[Row]) -> str:
    """The rows as a Markdown table, for the README."""
    head = (
        *_kind_of_row(given, "kind"),
        "planner",
        "prior",
        "solved",
        "initial failures %",
        "iterations",
        "expansions",
        "attempts",
        "ms a problem",
    )
    papers = ("paper: failures %", "paper: iterations")
    return "\n".join(markdown_table([(*head, *papers), *map(cells, given)], rule=" --- ")) + "\n"


def report(outcome: Outcome) -> str:
    """The comparison as Markdown, with what a reader needs to repeat it: options, seeds, versions, machine."""
    comparison = outcome.comparison
    options = ", ".join(f"{key} {value}" for key, value in comparison.options.items())
    text = f"{len(comparison.numbers)} problems x {comparison.seeds} seed(s) from 0; {options}; {comparison.oracle}."
    if outcome.image_blind is not None:
        order, failures = " ".join(outcome.image_blind_order), 100 * outcome.image_blind
        text += f" The best fixed order ({order}), which looks at no picture, fails on {failures:.1f}%."
    if OUTERMOST in comparison.priors:
        text += f" `{OUTERMOST}` knows the geometry and needs no training."
    return f"{markdown(rows(outcome))}\n{text} {provenance()}\n"


def write_csv(given: Sequence[Row], path: str | Path) -> Path:
    """Write the rows as CSV, whole or not at all; the published mean and deviation are columns of their own."""
    flat = []
    for row in given:
        plain = {key: value for key, value in row.items() if key != "published"}
        for key in PUBLISHED:
            mean, deviation = (row["published"] or {}).get(key) or (None, None)
            plain |= {f"published_{key}_mean": mean, f"published_{key}_std": deviation}
        flat.append(plain)
    write_text(path, pd.DataFrame(flat, dtype=object).to_csv(index=False, lineterminator="\r\n"))
    return Path(path)


# -- what all reports share -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Drawn:
    """A figure: the name of its files without ending, what it shows, and whether the report shows it or only links."""

    name: str
    caption: str
    figure: Figure
    shown: bool = True


def markdown_table(lines: Sequence[Sequence[str]], rule: str = "---") -> list[str]:
    """The lines of a Markdown table; the first is its head."""
    head, *body = (f"| {' | '.join(line)} |" for line in lines)
    return [head, "|" + f"{rule}|" * len(lines[0]), *body]


def values_by(records: pd.DataFrame, *columns: str) -> dict[tuple[Any, ...], list[float]]:
    """What is in some columns of the lines of results.csv -> the values, in their order."""
    return dict(records.groupby(list(columns))["value"].agg(list))


def write_experiment(
    records: pd.DataFrame, drawn: Iterable[Drawn], page: Callable[[Sequence[Drawn]], str], out: Path
) -> None:
    """Write results.csv, the figures, each as PNG and SVG, and the page that shows them, report.md, into `out`."""
    write_text(out / "results.csv", records.to_csv(index=False, lineterminator="\n"))
    figures = []
    for each in drawn:
        save_both(each.figure, out / each.name)
        figures.append(each)
    write_text(out / "report.md", page(figures))


def spread(values: Sequence[float], digits: int = 3, *, scale: float = 1) -> str:
    """Mean and, of several values, their deviation (population); empty without values."""
    own = scale * np.array(values)
    if not len(own):
        return ""
    return f"{own.mean():.{digits}f}" + (f" ± {own.std():.{digits}f}" if len(own) > 1 else "")


def provenance() -> str:
    """Versions and machine, one sentence."""
    names = ("neurosym-assembly", "numpy", "scipy", "python-fcl", "pybullet", "torch")
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in names)
    machine = f"Python {platform.python_version()} on {platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    return f"{versions}; {machine}."
