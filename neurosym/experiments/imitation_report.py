"""What a study leaves behind: results.csv, figures, and a page of Markdown with ours beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from neurosym import __version__
from neurosym.experiments.conclusions import findings
from neurosym.experiments.csv_lines import write_records
from neurosym.experiments.reporting import provenance
from neurosym.experiments.study_figures import Drawn, write_figures
from neurosym.experiments.study_results import Results
from neurosym.support.files import write_text

_METRICS = {
    "whole_sequence": "whole sequence",
    "whole_sequence_seen": "whole, seen",
    "whole_sequence_unseen": "whole, unseen",
    "per_step": "per step",
    "per_step_unseen": "per step, unseen",
    "stop_accuracy": "stop accuracy",
    "re_use": "re-use",
    "training_seconds": "training s",
}
_BASELINES = {
    "memoriser": "The memoriser is perfect on sequences that were demonstrated and guesses a random order of the right "
    "length in others; these are expectations.",
    "blind": "Blind is the best fixed answer, for each column the one that does best on the training demonstrations; "
    "it looks at no picture.",
}


def write_results(results: Results, out: Path) -> None:
    """Write results.csv, report.md, and the figures, each as PNG and SVG, into `out`."""
    write_records(results.records, out / "results.csv")
    write_text(out / "report.md", report(results, write_figures(results, out)))


def report(results: Results, drawn: Sequence[Drawn] = ()) -> str:
    """A page of Markdown: what comes out, means over seeds with their deviation, the paper's figures beside them.

    Args:
        results: of all trials.
        drawn: figures that lie beside the page; what is said of them.
    """
    study = results.study
    seeds = f"Mean over {study.seeds} seeds ± deviation" if study.seeds > 1 else "One seed"
    said = [
        study.about,
        f"{seeds}. A sequence of colours or letters is seen when it was trained on.",
        *(_BASELINES[b] for b in study.baselines if b in _BASELINES),
    ]
    lines = [f"# {study.name}", "", " ".join(filter(None, said))]
    for style in study.pictures:
        lines += ["", f"## {study.name}: {style} pictures", "", *(f"* {s}" for s in findings(results, style)), ""]
        lines += _table(results, style)
    for figure in drawn:
        if figure.shown:
            lines += ["", f"![{figure.caption}]({figure.name}.png)"]
    others = [f"[{figure.name}]({figure.name}.png)" for figure in drawn if not figure.shown]
    if others:
        lines += ["", f"Further figures: {', '.join(others)}."]
    trained = f"seeds 0 to {study.seeds - 1}" if study.seeds > 1 else "seed 0"
    return "\n".join([*lines, "", f"neurosym {__version__}, {trained}; {provenance()}", ""])


def _table(results: Results, style: str) -> list[str]:
    study = results.study
    rows = [*study.methods, *study.baselines]
    asked = [m for m in _METRICS if m != "stop_accuracy" or results.lengths_vary]
    metrics = [m for m in asked if any(results.values(style, r, n, m) for r in rows for n in study.sizes)]
    head = [study.what, "method", *(_METRICS[m] for m in metrics)]
    published = study.published or {}
    head += ["paper: whole sequence", "paper: re-use"] if published else []
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for n in study.sizes:
        for method in rows:
            row = [str(n), method]
            row += [_spread(results.values(style, method, n, m), 1 if "seconds" in m else 3) for m in metrics]
            if published:
                row += _published(published.get(method, {}))
            lines.append(f"| {' | '.join(row)} |")
    return lines


def _published(own: Mapping[str, float]) -> list[str]:
    if not own:
        return ["", ""]
    return [f"{own['whole_sequence']:.2f} ± {own['whole_sequence_std']:.2f}", f"{own['re_use']:.2f}"]


def _spread(values: Sequence[float], digits: int) -> str:
    if not values:
        return ""
    return f"{np.mean(values):.{digits}f}" + (f" ± {np.std(values):.{digits}f}" if len(values) > 1 else "")
