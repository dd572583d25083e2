"""What a study leaves behind: results.csv, figures, and a page of Markdown with ours beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from neurosym import __version__
from neurosym.experiments.conclusions import conclusions
from neurosym.experiments.reporting import markdown_table, provenance, spread, write_records
from neurosym.experiments.study_figures import Drawn, figures
from neurosym.experiments.study_results import Results
from neurosym.plotting import save_both
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
    drawn = []
    for each in figures(results):
        save_both(each.figure, out / each.name)
        drawn.append(each)
    write_text(out / "report.md", report(results, drawn))


def report(results: Results, drawn: Sequence[Drawn] = ()) -> str:
    """A page of Markdown: what comes out, means over seeds with their deviation, the paper's figures beside them.

    Args:
        results: of all trials.
        drawn: figures that lie beside the page.
    """
    study = results.study
    seeds = f"Mean over {study.seeds} seeds ± deviation" if study.seeds > 1 else "One seed"
    introduction = [
        study.about,
        f"{seeds}. A sequence of colours or letters is seen when it was trained on.",
        *(_BASELINES[name] for name in study.baselines if name in _BASELINES),
    ]
    lines = [f"# {study.name}", "", " ".join(filter(None, introduction))]
    for style in study.pictures:
        lines += ["", f"## {study.name}: {style} pictures", "", *(f"* {s}" for s in conclusions(results, style)), ""]
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
    metrics = [m for m in _METRICS if m != "stop_accuracy" or results.lengths_vary]
    metrics = [m for m in metrics if any(results.means(style, row, m) for row in study.rows)]
    papers = ["paper: whole sequence", "paper: re-use"] if study.published else []
    lines = [[study.what, "method", *(_METRICS[m] for m in metrics), *papers]]
    for n in study.sizes:
        for method in study.rows:
            means = [spread(results.values(style, method, n, m), 1 if "seconds" in m else 3) for m in metrics]
            lines.append([str(n), method, *means, *(_published(study.published.get(method)) if papers else ())])
    return markdown_table(lines)


def _published(own: Mapping[str, float] | None) -> tuple[str, str]:
    if not own:
        return "", ""
    return f"{own['whole_sequence']:.2f} ± {own['whole_sequence_std']:.2f}", f"{own['re_use']:.2f}"
