"""What comes out of a study, in sentences that are computed from its results: none is written by hand."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from neurosym.experiments.published_claims import OF_OURS, OF_THE_PAPER, Claim
from neurosym.experiments.study_results import Results

#: Metrics in which our recipe is set against the paper's.
COMPARED = ("whole_sequence", "whole_sequence_unseen", "per_step")


def findings(results: Results, style: str) -> list[str]:
    """One sentence each, Markdown without bullets."""
    study = results.study
    found = [*_order(results, style)]
    for metric in COMPARED:
        found += _ours_ahead(results, style, metric)
    for baseline in study.baselines:
        for metric in ("whole_sequence", "per_step"):
            found += _above(results, style, baseline, metric)
    found += [s for claim in OF_THE_PAPER.get(study.name, ()) for s in _said(results, style, claim, "The paper: ")]
    asked = f"Asked of `{study.ours}`: "
    return found + [s for claim in OF_OURS.get(study.name, ()) for s in _said(results, style, claim, asked)]


def _order(results: Results, style: str) -> list[str]:
    """Whether the paper's methods come out in the paper's order, pair by pair."""
    study = results.study
    published = {m: f["whole_sequence"] for m, f in (study.published or {}).items() if m in study.methods}
    if len(published) < 2:
        return []
    ranked, n = sorted(published, key=lambda m: published[m]), max(study.sizes)
    means = {m: results.mean(style, m, n, "whole_sequence") or 0.0 for m in ranked}
    pairs = list(combinations(ranked, 2))
    # Both of a pair can be level: then it did not come out as in the paper, either.
    otherwise = [
        f"`{better}` ({means[better]:.3f}) is {'level with' if means[better] == means[worse] else 'behind'} `{worse}` "
        f"({means[worse]:.3f})"
        for worse, better in pairs
        if means[better] <= means[worse]
    ]
    own = " < ".join(f"{m} {means[m]:.3f}" for m in sorted(ranked, key=lambda m: means[m]))
    said = " < ".join(f"{m} {published[m]:.2f}" for m in ranked)
    if not otherwise:
        return [f"Whole sequences come out in the paper's order: {own} (the paper: {said})."]
    kept = len(pairs) - len(otherwise)
    return [
        f"Whole sequences do **not** come out in the paper's order: {own} (the paper: {said}). {kept} of its "
        f"{len(pairs)} pairs do; otherwise: {'; '.join(otherwise)}."
    ]


def _ours_ahead(results: Results, style: str, metric: str) -> list[str]:
    """Whether ours is ahead of each of the paper's methods, at each n."""
    study = results.study
    others = [m for m in study.methods if m != study.ours]
    ahead: list[str] = []
    behind: list[str] = []
    for n in study.sizes:
        own = results.mean(style, study.ours, n, metric)
        rivals = {m: v for m in others if (v := results.mean(style, m, n, metric)) is not None}
        if own is None or not rivals:
            continue
        best = max(rivals, key=lambda m: rivals[m])
        at = f"{_at(n, study.sizes)}{own:.3f}"
        if own > rivals[best]:
            seeds = list(
                zip(results.values(style, study.ours, n, metric), results.values(style, best, n, metric), strict=False)
            )
            won = sum(a > b for a, b in seeds)
            in_seeds = f", behind in {won} of {len(seeds)} seeds" if len(seeds) > 1 else ""
            ahead.append(f"{at}; next is `{best}`, {rivals[best]:.3f}{in_seeds}")
        else:
            level = [f"`{m}`, {v:.3f}" for m, v in rivals.items() if v >= own]
            behind.append(f"{at} against {', '.join(level)}")
    name = _name(metric)
    found = [f"`{study.ours}` is ahead of each of the paper's in {name} ({' | '.join(ahead)})."] if ahead else []
    if behind:
        found.append(f"`{study.ours}` is **not** ahead of each of the paper's in {name} ({' | '.join(behind)}).")
    return found


def _above(results: Results, style: str, baseline: str, metric: str) -> list[str]:
    """Which methods are above a baseline, at which n."""
    study = results.study
    line = {n: v for n in study.sizes if (v := results.mean(style, baseline, n, metric)) is not None}
    parts: dict[str, list[str]] = {}
    for method in study.methods if line else ():
        own = {n: v for n in line if (v := results.mean(style, method, n, metric)) is not None}
        above = [n for n in own if own[n] > line[n]]
        where = "always" if len(above) == len(own) else f"at n = {', '.join(map(str, above))}" if above else "nowhere"
        if len(study.sizes) == 1:
            where = "above" if above else "not above"
        parts.setdefault(where, []).append(f"`{method}`")
    if not parts:
        return []
    said = "; ".join(f"{where}: {', '.join(methods)}" for where, methods in parts.items())
    heights = ", ".join(f"{_at(n, study.sizes)}{v:.3f}" for n, v in line.items())
    return [f"Above the {_baseline_name(baseline)} in {_name(metric)} ({heights}): {said}."]


def _said(results: Results, style: str, claim: Claim, who: str) -> list[str]:
    answer = claim.check(results, style)
    if answer is None:
        return []
    holds, numbers = answer
    return [f"{who}{claim.says} Here it **{'holds' if holds else 'does not hold'}**: {numbers}."]


def _at(n: int, sizes: Sequence[int]) -> str:
    return f"n = {n}: " if len(sizes) > 1 else ""


def _name(metric: str) -> str:
    names = {
        "whole_sequence": "whole sequences",
        "whole_sequence_unseen": "whole sequences that were never demonstrated",
        "per_step": "steps",
    }
    return names[metric]


def _baseline_name(baseline: str) -> str:
    return {"memoriser": "memoriser", "blind": "best fixed answer"}.get(baseline, baseline)
