"""What an experiment with planners leaves behind: results.csv, figures, and a page with ours beside the paper's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from neurosym import __version__, plotting
from neurosym.experiments.benchmark import Outcome
from neurosym.experiments.reporting import (
    Drawn,
    figure_of,
    markdown_table,
    provenance,
    spread,
    values_by,
    write_experiment,
)
from neurosym.registry import load_domain

if TYPE_CHECKING:
    from neurosym.experiments.reproduce import Experiment
    from neurosym.plotting.style import Figure

#: The planner that the paper has: its figures stand beside this one's.
PAPERS_PLANNER = "swap-repair"
#: Named like this in results.csv: the order that fails least on the training half.
BLIND = "blind"
#: What must be known of the paper's figures.
_NOTES = {
    "soma": " The paper prints 51.55 and 54.95 as per cent; its authors' published evaluation suggests that these are "
    "counts of 120 cubes, which would make them 43.0% and 45.8%."
}


def write_results(
    experiment: Experiment, records: pd.DataFrame, outcomes: Mapping[tuple[str, int], Outcome], out: Path
) -> None:
    """Write results.csv, report.md, and the figures, each as PNG and SVG, into `out`.

    `outcomes`: (style, split) -> its comparison.
    """
    write_experiment(records, _figures(experiment, records, outcomes), partial(report, experiment, records), out)


def _figures(
    experiment: Experiment, records: pd.DataFrame, outcomes: Mapping[tuple[str, int], Outcome]
) -> Iterator[Drawn]:
    for style in experiment.styles:
        own = [outcomes[style, split] for split in range(experiment.splits)]
        numbers = tuple(n for each in own for n in each.comparison.numbers)
        pooled = Outcome(replace(own[0].comparison, numbers=numbers), tuple(run for each in own for run in each.runs))
        of = f"{style} pictures"
        figure = methods_figure(experiment, records, style)
        yield Drawn(f"methods-{style}", f"Each split, their means, and the paper's, {of}", figure)
        yield Drawn(f"iterations-{style}", f"Distribution of iterations, all splits, {of}", figure_of(pooled))


def methods_figure(experiment: Experiment, records: pd.DataFrame, style: str) -> Figure:
    """Initial failures, and iterations with every planner: a row a method, a dot a split."""
    rows, paper = [*experiment.methods, "random", BLIND], _published(experiment)
    known = values_by(records, "pictures", "method", "metric")

    def values(metric: str, scale: float = 1) -> dict[str, list[float]]:
        return {row: [scale * v for v in known.get((style, row, metric), ())] for row in rows}

    failures = {m: own["initial_failures"] for m, own in paper.items() if own.get("initial_failures")}
    panels = [plotting.Panel("initial\nfailures (%)", values("initial_failures", 100), failures, (0, 100))]
    for planner in experiment.planners:
        # The paper's deviation is over problems, ours over splits: beside each other they would mislead.
        means = {m: (own["iterations"][0], 0.0) for m, own in paper.items()} if planner == PAPERS_PLANNER else {}
        panels.append(plotting.Panel(f"iterations:\n{planner}", values(f"iterations {planner}"), means, None))
    tested = records.loc[records["pictures"] == style, "n"].max()
    title = f"{experiment.domain}, {style} pictures\n{tested} test problems a split, {_splits(experiment)}"
    return plotting.points_figure(title, rows, panels, each="one split")


def report(experiment: Experiment, records: pd.DataFrame, drawn: Sequence[Drawn] = ()) -> str:
    """A page of Markdown: ours beside the paper's, means over splits with the deviation between splits.

    `drawn`: figures that lie beside the page, named after their style of pictures.
    """
    lines = [
        f"# {experiment.domain}",
        "",
        f"The paper's Sec. IV-D, Table II. {_splits(experiment)} at random: trained on one half, tested on the "
        "other. Mean over splits ± deviation between splits; iterations are refusals before the plan. The paper's "
        "deviation is over problems and splits, its iterations those of swap repair. Blind is the fixed order that "
        "fails least on the training half: it looks at no picture." + _NOTES.get(experiment.domain, ""),
    ]
    for style in experiment.styles:
        lines += ["", f"## {experiment.domain}: {style} pictures", ""]
        lines += [*(f"* {sentence}" for sentence in conclusions(experiment, records, style)), ""]
        lines += _table(experiment, records, style)
        for figure in drawn:
            lines += ["", f"![{figure.caption}]({figure.name}.png)"] if figure.name.endswith(f"-{style}") else []
    splits = f"splits 0 to {experiment.splits - 1}" if experiment.splits > 1 else "split 0"
    runs = f"{splits}, seed {experiment.seed}, each test problem planned {experiment.repeats} times"
    return "\n".join([*lines, "", f"neurosym {__version__}, {runs}; {provenance()}", ""])


def _table(experiment: Experiment, records: pd.DataFrame, style: str) -> list[str]:
    published, known = _published(experiment), values_by(records, "pictures", "method", "metric")
    columns = ["initial failures %", *(f"iterations, {p}" for p in experiment.planners), "training s"]
    lines = [["method", *columns, "paper: failures %", "paper: iterations"]]
    for method in (BLIND, "random", *experiment.methods):
        papers = [published.get(method, {}).get(key) for key in ("initial_failures", "iterations")]
        row = [
            spread(known.get((style, method, "initial_failures"), ()), 1, scale=100),
            *(spread(known.get((style, method, f"iterations {p}"), ())) for p in experiment.planners),
            spread(known.get((style, method, "training_seconds"), ()), 0),
            *("" if pair is None else f"{pair[0]} ± {pair[1]}" for pair in papers),
        ]
        lines.append([method, *row])
    return markdown_table(lines)


def conclusions(experiment: Experiment, records: pd.DataFrame, style: str) -> list[str]:
    """What comes out, in sentences computed from the records; less is better in all of them."""
    measured = (
        ("initial_failures", "initial_failures", "initial failures (%)", 100),
        (f"iterations {PAPERS_PLANNER}", "iterations", f"iterations with {PAPERS_PLANNER}", 1),
    )
    known = values_by(records, "pictures", "method", "metric")
    sentences = []
    for metric, key, name, scale in measured:
        rows = (BLIND, "random", *experiment.methods)
        own = {m: scale * float(np.mean(values)) for m in rows if (values := known.get((style, m, metric)))}
        sentences += _against_the_paper(experiment, own, key, name)
        if BLIND in own:
            less = ", ".join(f"`{m}`" for m in experiment.methods if m in own and own[m] < own[BLIND])
            rest = ", ".join(f"`{m}`" for m in experiment.methods if m in own and own[m] >= own[BLIND])
            parts = [f"less do {less}" if less else "", f"not less do {rest}" if rest else ""]
            sentences.append(f"The best fixed order fails on {own[BLIND]:.1f}%; {', '.join(filter(None, parts))}.")
    return sentences


def _against_the_paper(experiment: Experiment, own: Mapping[str, float], key: str, name: str) -> list[str]:
    """Whether the paper's methods come out in its order, and which of the others are ahead of all of them."""
    paper = {m: row[key][0] for m, row in _published(experiment).items() if row.get(key) and m in own}
    sentences = []
    ranked = sorted(paper, key=lambda m: -paper[m])
    if len(ranked) > 1:
        verb = "come out" if all(own[a] > own[b] for a, b in pairwise(ranked)) else "do **not** come out"
        here = " > ".join(f"{m} {own[m]:.2f}" for m in sorted(ranked, key=lambda m: -own[m]))
        there = " > ".join(f"{m} {paper[m]:.2f}" for m in ranked)
        sentences.append(f"The {name} {verb} in the paper's order: {here} (the paper: {there}).")
    theirs = {m: own[m] for m in paper if m in experiment.methods}
    if theirs:
        best = min(theirs, key=lambda m: theirs[m])
        for ours in (m for m in experiment.methods if m in own and m not in paper):
            verb = "is ahead of" if own[ours] < theirs[best] else "is **not** ahead of"
            sentences.append(
                f"`{ours}` {verb} each of the paper's in {name}: {own[ours]:.2f}; the best of those is `{best}`, "
                f"{theirs[best]:.2f}."
            )
    return sentences


def _splits(experiment: Experiment) -> str:
    return f"{experiment.splits} split{'s' if experiment.splits > 1 else ''}"


def _published(experiment: Experiment) -> dict[str, Mapping[str, Any]]:
    """prior -> the family's published figures with the paper's planner."""
    rows = load_domain(experiment.domain).published
    return {str(row["prior"]): row for row in rows if row["planner"] == PAPERS_PLANNER}
