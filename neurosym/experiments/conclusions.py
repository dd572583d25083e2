"""What comes out of a study, in sentences that are computed from its results: none is written by hand."""

from itertools import combinations

from neurosym.experiments.hypotheses import OF_OURS, OF_THE_PAPER
from neurosym.experiments.studies import Results

#: Metrics in which our recipe is set against the paper's, as sentences name them.
COMPARED = {
    "whole_sequence": "whole sequences",
    "whole_sequence_unseen": "whole sequences that were never demonstrated",
    "per_step": "steps",
}
_BASELINES = {"blind": "best fixed answer"}


def conclusions(results: Results, style: str) -> list[str]:
    """One sentence each, Markdown without bullets."""
    study = results.study
    sentences = _order(results, style)
    for metric in COMPARED:
        sentences += _ours_ahead(results, style, metric)
    for baseline in study.baselines:
        for metric in ("whole_sequence", "per_step"):
            sentences += _above(results, style, baseline, metric)
    for who, hypotheses in (("The paper: ", OF_THE_PAPER), (f"Asked of `{study.ours}`: ", OF_OURS)):
        for statement, test in hypotheses.get(study.name, ()):
            if (answer := test(results, style)) is not None:
                verdict = "holds" if answer[0] else "does not hold"
                sentences.append(f"{who}{statement} Here it **{verdict}**: {answer[1]}.")
    return sentences


def _order(results: Results, style: str) -> list[str]:
    """Whether the paper's methods come out in the paper's order, pair by pair."""
    study = results.study
    published = {m: own["whole_sequence"] for m, own in study.published.items() if m in study.methods}
    if len(published) < 2:
        return []
    ranked = sorted(published, key=lambda m: published[m])
    means = {m: results.mean(style, m, max(study.sizes), "whole_sequence") or 0.0 for m in ranked}
    pairs = list(combinations(ranked, 2))
    # Both of a pair can be level: then it did not come out as in the paper, either.
    otherwise = [
        f"`{better}` ({means[better]:.3f}) is {'level with' if means[better] == means[worse] else 'behind'} `{worse}` "
        f"({means[worse]:.3f})"
        for worse, better in pairs
        if means[better] <= means[worse]
    ]
    own = " < ".join(f"{m} {means[m]:.3f}" for m in sorted(ranked, key=lambda m: means[m]))
    orders = f"the paper's order: {own} (the paper: {' < '.join(f'{m} {published[m]:.2f}' for m in ranked)})."
    if not otherwise:
        return [f"Whole sequences come out in {orders}"]
    return [
        f"Whole sequences do **not** come out in {orders} {len(pairs) - len(otherwise)} of its {len(pairs)} pairs do; "
        f"otherwise: {'; '.join(otherwise)}."
    ]


def _ours_ahead(results: Results, style: str, metric: str) -> list[str]:
    """Whether ours is ahead of each of the paper's methods, at each n."""
    study = results.study
    others = {m: results.means(style, m, metric) for m in study.methods if m != study.ours}
    ahead: list[str] = []
    behind: list[str] = []
    for n, own in results.means(style, study.ours, metric).items():
        rivals = {m: means[n] for m, means in others.items() if n in means}
        if not rivals:
            continue
        best = max(rivals, key=lambda m: rivals[m])
        at = f"{_at(results, n)}{own:.3f}"
        if own > rivals[best]:
            seeds = list(zip(*(results.values(style, m, n, metric) for m in (study.ours, best)), strict=False))
            won = sum(a > b for a, b in seeds)
            in_seeds = f", behind in {won} of {len(seeds)} seeds" if len(seeds) > 1 else ""
            ahead.append(f"{at}; next is `{best}`, {rivals[best]:.3f}{in_seeds}")
        else:
            level = [f"`{m}`, {v:.3f}" for m, v in rivals.items() if v >= own]
            behind.append(f"{at} against {', '.join(level)}")
    verbs = {"is ahead": ahead, "is **not** ahead": behind}
    name = COMPARED[metric]
    return [f"`{study.ours}` {v} of each of the paper's in {name} ({' | '.join(at)})." for v, at in verbs.items() if at]


def _above(results: Results, style: str, baseline: str, metric: str) -> list[str]:
    """Which methods are above a baseline, at which n."""
    study = results.study
    line = results.means(style, baseline, metric)
    places: dict[str, list[str]] = {}
    for method in study.methods if line else ():
        own = {n: v for n, v in results.means(style, method, metric).items() if n in line}
        above = [n for n in own if own[n] > line[n]]
        where = "always" if len(above) == len(own) else f"at n = {', '.join(map(str, above))}" if above else "nowhere"
        if len(study.sizes) == 1:
            where = "above" if above else "not above"
        places.setdefault(where, []).append(f"`{method}`")
    if not places:
        return []
    methods = "; ".join(f"{where}: {', '.join(names)}" for where, names in places.items())
    heights = ", ".join(f"{_at(results, n)}{v:.3f}" for n, v in line.items())
    return [f"Above the {_BASELINES.get(baseline, baseline)} in {COMPARED[metric]} ({heights}): {methods}."]


def _at(results: Results, n: int) -> str:
    return f"n = {n}: " if len(results.study.sizes) > 1 else ""
