"""The figures of a study, from its results: one function a kind, each for one style of pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from neurosym import plotting
from neurosym.experiments.study_results import Results
from neurosym.plotting import Curves, Panel, Spread

if TYPE_CHECKING:
    from neurosym.plotting.style import Figure

#: Classes above which each method's confusion matrix is a figure of its own.
LARGE = 10


@dataclass(frozen=True)
class Drawn:
    """A figure: the name of its files without ending, what it shows, and whether the report shows it or only links."""

    name: str
    caption: str
    figure: Figure
    shown: bool = True


def figures(results: Results) -> Iterator[Drawn]:
    """All figures of a study, drawn one at a time; of several styles of pictures the last is shown."""
    for style in results.study.pictures:
        for kind in results.study.figures:
            for drawn in KINDS[kind](results, style):
                yield replace(drawn, shown=drawn.shown and style == results.study.pictures[-1])


def _shares(results: Results, style: str) -> Iterator[Drawn]:
    study, n = results.study, max(results.study.sizes)

    def panel(title: str, metric: str) -> Panel:
        papers = study.published.items()
        paper = {m: (own[metric], own.get(f"{metric}_std", 0.0)) for m, own in papers if metric in own}
        return Panel(title, {row: results.values(style, row, n, metric) for row in study.rows}, paper)

    metrics = {
        "whole_sequence": "whole\nsequence",
        "whole_sequence_unseen": "the same,\nunseen ones",
        "per_step": "steps\nright",
        "re_use": "sequences\nwith re-use",
    }
    panels = [panel(title, metric) for metric, title in metrics.items()]
    figure = plotting.points_figure(_title(results, style, n), study.rows, panels)
    yield Drawn(f"shares-{style}", "Shares of test sequences, and of their steps, a row a method", figure)


def _density(results: Results, style: str) -> Iterator[Drawn]:
    study, n = results.study, max(results.study.sizes)
    seeds = {m: results.values(style, m, n, "whole_sequence") for m in study.methods}
    paper = {m: own["whole_sequence"] for m, own in study.published.items() if "whole_sequence" in own}
    figure = plotting.density_figure(_title(results, style, n), seeds, _counts(results, style, "right"), paper)
    yield Drawn(f"density-{style}", "How precision is distributed over seeds and over sequences", figure)


def _curves(results: Results, style: str) -> Iterator[Drawn]:
    study = results.study
    metrics = {"per_step": "steps right", "whole_sequence": "whole sequence"}
    if results.lengths_vary:
        metrics["stop_accuracy"] = "length right"
    panels = [
        Curves(title, {m: {n: results.values(style, m, n, metric) for n in study.sizes} for m in study.rows})
        for metric, title in metrics.items()
    ]
    spread = None
    if study.ours in study.methods:
        spread = Spread(study.ours, {n: results.counts[style, study.ours, n].right for n in study.sizes})
    # Sizes that double want a logarithmic axis.
    log = len(study.sizes) > 2 and study.what == "demonstrations"
    figure = plotting.curves_figure(_title(results, style), study.what, panels, spread=spread, log=log)
    caption = f"Growing numbers of {study.what}; a band reaches from the worst seed to the best"
    yield Drawn(f"curves-{style}", caption, figure)


def _confusion(results: Results, style: str) -> Iterator[Drawn]:
    counts, labels = _counts(results, style, "confusion"), _labels(results, style)
    title = f"{_title(results, style, max(results.study.sizes))}\n% of what was demonstrated"
    if len(labels) <= LARGE:
        yield Drawn(f"confusion-{style}", "What was read for what", plotting.confusion_figure(title, labels, counts))
        return
    for method, own in counts.items():
        figure = plotting.confusion_figure(title, labels, {method: own})
        shown = method == results.study.ours
        yield Drawn(f"confusion-{style}-{method}", f"What {method} read for what", figure, shown)


def _classes(results: Results, style: str) -> Iterator[Drawn]:
    title, labels = _title(results, style, max(results.study.sizes)), _labels(results, style, with_members=True)
    figure = plotting.classes_figure(title, labels, _counts(results, style, "confusion"))
    yield Drawn(f"classes-{style}", "Errors by what was demonstrated; in brackets how many there are of it", figure)


def _repeats(results: Results, style: str) -> Iterator[Drawn]:
    title = _title(results, style, max(results.study.sizes))
    figure = plotting.repeats_figure(title, _counts(results, style, "repeats"))
    yield Drawn(f"repeats-{style}", "Errors by the number of repetitions in a sequence", figure)


def _counts(results: Results, style: str, what: str) -> dict[str, Any]:
    """Method -> one array of its `Counts` at the greatest n."""
    n = max(results.study.sizes)
    return {m: getattr(results.counts[style, m, n], what) for m in results.study.methods}


def _labels(results: Results, style: str, *, with_members: bool = False) -> list[str]:
    first = results.counts[style, results.study.methods[0], max(results.study.sizes)]
    return [f"{k} ({n})" if with_members else k for k, n in zip(first.labels, first.members)]


def _title(results: Results, style: str, n: int | None = None) -> str:
    study = results.study
    tested = {
        int(own.right.sum()) // study.seeds
        for (pictures, _, size), own in results.counts.items()
        if pictures == style and n in (None, size)
    }
    given = "" if n is None else f"{n} {study.what}, "
    test = f"{max(tested):,} test pictures, " if tested else ""
    return f"{study.name}, {style} pictures\n{given}{test}{study.seeds} seed{'s' if study.seeds > 1 else ''}"


#: By the names that a study gives.
KINDS: Mapping[str, Callable[[Results, str], Iterator[Drawn]]] = MappingProxyType(
    {
        "shares": _shares,
        "density": _density,
        "curves": _curves,
        "classes": _classes,
        "repeats": _repeats,
        "confusion": _confusion,
    }
)
