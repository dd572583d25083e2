"""What a study says: a page of Markdown, our figures beside the paper's."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from neurosym import __version__
from neurosym.files import write_text
from neurosym.reproduce import write_records
from neurosym.study_results import Results


def write_results(results: Results, out: Path) -> None:
    """Write results.csv and report.md into `out`."""
    write_records(results.records, out / "results.csv")
    write_text(out / "report.md", report(results))


def report(results: Results) -> str:
    """A page of Markdown: means over seeds with their deviation, the paper's figures beside them."""
    given = results.study
    metrics = ["whole_sequence", "whole_sequence_seen", "whole_sequence_unseen", "per_step", "per_step_unseen"]
    metrics += ["stop_accuracy", "re_use", "training_seconds"]
    said = f"Mean over {given.seeds} seeds ± deviation; a sequence is seen when it, colours or letters, was trained on."
    lines = [f"# {given.name}", "", said]
    for style in given.pictures:
        head = [given.what, "method", *(m.replace("_", " ") for m in metrics), "paper"]
        lines += ["", f"## {style} pictures", "", f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
        for n in given.sizes:
            for method in (*given.methods, *given.baselines):
                row = [_mean(results.values(style, method, n, m)) for m in metrics]
                paper = (given.published or {}).get(method, {})
                beside = ", ".join(f"{m.replace('_', ' ')} {v:.2f}" for m, v in paper.items())
                lines.append(f"| {n} | {method} | {' | '.join(row)} | {beside} |")
    machine = f"Python {platform.python_version()}, {os.cpu_count()} processors"
    return "\n".join([*lines, "", f"neurosym {__version__}, {machine}; seeds 0 to {given.seeds - 1}.", ""])


def _mean(values: Sequence[float]) -> str:
    if not values:
        return ""
    return f"{np.mean(values):.2f}" + (f" ± {np.std(values):.2f}" if len(values) > 1 else "")
