"""What a study leaves behind: results.csv, figures, and a page of Markdown with ours beside the paper's."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from neurosym import __version__, plotting
from neurosym.experiments.conclusions import conclusions
from neurosym.experiments.reporting import Drawn, markdown_table, provenance, spread, write_experiment
from neurosym.experiments.studies import Results

#: Classes above which each method's confusion matrix is a figure of its own.
LARGE = 10
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
    write_experiment(results.records, figures(results), partial(report, results), out)


def report(results: Results, drawn: Sequence[Drawn] = ()) -> str:
    """A page of Markdown: what comes out, means over seeds with their deviation, the paper's figures beside them.

    `results`: of all trials. `drawn`: figures that lie beside the page.
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


def figures(results: Results) -> Iterator[Drawn]:
    """All figures of a study, drawn one at a time; of several styles of pictures the last is shown."""
    for style in results.study.pictures:
        own = _Figures(results, style)
        for kind in results.study.figures:
            for drawn in getattr(own, kind)():
                yield replace(drawn, shown=drawn.shown and style == results.study.pictures[-1])


class _Figures:
    """Those of one style of pictures; its methods are named as a study's `figures` names them."""

    def __init__(self, results: Results, style: str) -> None:
        self.results, self.study, self.style = results, results.study, style
        self.n = max(self.study.sizes)
        self.title = _title(results, style, self.n)
        self.counts = {m: results.counts[style, m, self.n] for m in self.study.methods}

    def shares(self) -> Iterator[Drawn]:
        metrics = {
            "whole_sequence": "whole\nsequence",
            "whole_sequence_unseen": "the same,\nunseen ones",
            "per_step": "steps\nright",
            "re_use": "sequences\nwith re-use",
        }
        published = self.study.published.items()
        panels = []
        for metric, title in metrics.items():
            paper = {m: (own[metric], own.get(f"{metric}_std", 0.0)) for m, own in published if metric in own}
            panels.append(plotting.Panel(title, {row: self._values(row, metric) for row in self.study.rows}, paper))
        figure = plotting.points_figure(self.title, self.study.rows, panels)
        yield Drawn(f"shares-{self.style}", "Shares of test sequences, and of their steps, a row a method", figure)

    def density(self) -> Iterator[Drawn]:
        seeds = {m: self._values(m, "whole_sequence") for m in self.study.methods}
        paper = {m: own["whole_sequence"] for m, own in self.study.published.items() if "whole_sequence" in own}
        figure = plotting.density_figure(self.title, seeds, self._arrays("right"), paper)
        yield Drawn(f"density-{self.style}", "How precision is distributed over seeds and over sequences", figure)

    def curves(self) -> Iterator[Drawn]:
        study, what = self.study, self.study.what
        metrics = {"per_step": "steps right", "whole_sequence": "whole sequence"}
        if self.results.lengths_vary:
            metrics["stop_accuracy"] = "length right"
        panels = [
            plotting.Curves(title, {row: {n: self._values(row, metric, n) for n in study.sizes} for row in study.rows})
            for metric, title in metrics.items()
        ]
        spread = None
        if study.ours in study.methods:
            right = {n: self.results.counts[self.style, study.ours, n].right for n in study.sizes}
            spread = plotting.Spread(study.ours, right)
        # Sizes that double want a logarithmic axis.
        log = len(study.sizes) > 2 and what == "demonstrations"
        figure = plotting.curves_figure(_title(self.results, self.style), what, panels, spread=spread, log=log)
        caption = f"Growing numbers of {what}; a band reaches from the worst seed to the best"
        yield Drawn(f"curves-{self.style}", caption, figure)

    def confusion(self) -> Iterator[Drawn]:
        labels = next(iter(self.counts.values())).labels
        name, title = f"confusion-{self.style}", f"{self.title}\n% of what was demonstrated"
        counts = self._arrays("confusion")
        if len(labels) <= LARGE:
            yield Drawn(name, "What was read for what", plotting.confusion_figure(title, labels, counts))
            return
        for method, own in counts.items():
            figure = plotting.confusion_figure(title, labels, {method: own})
            yield Drawn(f"{name}-{method}", f"What {method} read for what", figure, method == self.study.ours)

    def classes(self) -> Iterator[Drawn]:
        first = next(iter(self.counts.values()))
        labels = [f"{label} ({n})" for label, n in zip(first.labels, first.members)]
        figure = plotting.classes_figure(self.title, labels, self._arrays("confusion"))
        caption = "Errors by what was demonstrated; in brackets how many there are of it"
        yield Drawn(f"classes-{self.style}", caption, figure)

    def repeats(self) -> Iterator[Drawn]:
        figure = plotting.repeats_figure(self.title, self._arrays("repeats"))
        yield Drawn(f"repeats-{self.style}", "Errors by the number of repetitions in a sequence", figure)

    def _values(self, row: str, metric: str, n: int | None = None) -> list[float]:
        return self.results.values(self.style, row, self.n if n is None else n, metric)

    def _arrays(self, what: str) -> dict[str, Any]:
        return {method: getattr(own, what) for method, own in self.counts.items()}


def _title(results: Results, style: str, n: int | None = None) -> str:
    study = results.study
    own = [c for (pictures, _, size), c in results.counts.items() if pictures == style and n in (None, size)]
    tested = max((int(c.right.sum()) // study.seeds for c in own), default=0)
    given = "" if n is None else f"{n} {study.what}, "
    test = f"{tested:,} test pictures, " if own else ""
    return f"{study.name}, {style} pictures\n{given}{test}{study.seeds} seed{'s' if study.seeds > 1 else ''}"
