"""What comes out of a study, in sentences that are computed from its results: none is written by hand."""

from collections.abc import Callable, Mapping
from itertools import combinations
from typing import Any

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


#: Shares that differ by less are called alike.
ALIKE = 0.05
#: Whether it holds, and the numbers that decide; None where the results do not bear on it.
Answer = tuple[bool, str] | None
#: Called with the results and a style of pictures.
Test = Callable[[Results, str], Answer]
#: A statement, and its test.
Hypothesis = tuple[str, Test]


def ahead(first: str, second: str, metric: str) -> Test:
    """`first` is ahead of `second` at every n."""
    return _at_every_n(first, second, metric, lambda a, b: a > b)


def alike(first: str, second: str, metric: str) -> Test:
    """The two differ by less than `ALIKE` at every n."""
    return _at_every_n(first, second, metric, lambda a, b: abs(a - b) < ALIKE)


def _at_every_n(first: str, second: str, metric: str, holds: Callable[[float, float], bool]) -> Test:
    def test(results: Results, style: str) -> Answer:
        one, other = (results.means(style, method, metric) for method in (first, second))
        pairs = {n: (one[n], other[n]) for n in one if n in other}
        numbers = "; ".join(f"{a:.3f} against {b:.3f} at n = {n}" for n, (a, b) in pairs.items())
        return (all(holds(*pair) for pair in pairs.values()), numbers) if pairs else None

    return test


def reaches(
    method: str, metric: str, bound: float, *, above: bool = True, from_n: int = 0, style: str | None = None
) -> Test:
    """At every n from `from_n` on, a method's mean is at least (or, not `above`, at most) the bound."""

    def test(results: Results, given: str) -> Answer:
        means = {n: mean for n, mean in results.means(given, method, metric).items() if n >= from_n}
        if not means or style not in (None, given):
            return None
        holds = all(mean >= bound if above else mean <= bound for mean in means.values())
        return holds, "; ".join(f"{mean:.3f} at n = {n}" for n, mean in means.items())

    return test


def _loses_less(results: Results, style: str) -> Answer:
    """From the least n to the greatest, fewer of the steps than the TCN."""
    least, most = min(results.study.sizes), max(results.study.sizes)
    means = {m: results.means(style, m, "per_step") for m in ("sinkhorn-paper", "tcn-paper+hungarian")}
    if least == most or not all({least, most} <= set(own) for own in means.values()):
        return None
    lost = {method: own[least] - own[most] for method, own in means.items()}
    numbers = ", ".join(f"{method} loses {value:.3f}" for method, value in lost.items())
    return lost["sinkhorn-paper"] < lost["tcn-paper+hungarian"], f"from n = {least} to {most} {numbers}"


def _tcn_errs_more_with_repeats(results: Results, style: str) -> Answer:
    """At the greatest n, a larger share of steps is wrong in sequences with two repetitions or more than with none."""
    counts = results.counts.get((style, "tcn-paper+hungarian", max(results.study.sizes)))
    if counts is None or not counts.repeats[0, 0] or not counts.repeats[2:, 0].sum():
        return None
    none = counts.repeats[0, 1] / counts.repeats[0, 0]
    some = counts.repeats[2:, 1].sum() / counts.repeats[2:, 0].sum()
    return bool(some > none), f"{none:.3f} of the steps are wrong without repetitions, {some:.3f} with two or more"


def _unassigned_re_use(results: Results, style: str) -> Answer:
    """Methods without an assignment use an action twice, the others never do."""
    unassigned = ("bc", "tcn-paper")
    methods = (*unassigned, "bc+hungarian", "tcn-paper+hungarian", "sinkhorn-paper")
    n = max(results.study.sizes)
    means = {m: mean for m in methods if (mean := results.mean(style, m, n, "re_use")) is not None}
    numbers = ", ".join(f"{m} in {mean:.2f}" for m, mean in means.items()) + " of the sequences"
    return (all((mean > 0) == (m in unassigned) for m, mean in means.items()), numbers) if means else None


#: By study: what the paper says. Its order of the five methods is checked by `neurosym.experiments.conclusions`.
OF_THE_PAPER: Mapping[str, tuple[Hypothesis, ...]] = {
    "tower": (("BC and BC+TCN use blocks twice, the others never do.", _unassigned_re_use),),
    "unseen": (
        (
            "With unique actions BC+Sinkhorn and BC+TCN perform similarly (steps right).",
            alike("sinkhorn-paper", "tcn-paper", "per_step"),
        ),
        ("BC+Sinkhorn is above the memoriser's line.", ahead("sinkhorn-paper", "memoriser", "per_step")),
        ("BC+TCN is above the memoriser's line.", ahead("tcn-paper", "memoriser", "per_step")),
    ),
    "variable": (
        (
            "BC+Sinkhorn is ahead of BC+TCN+Hungarian (steps right).",
            ahead("sinkhorn-paper", "tcn-paper+hungarian", "per_step"),
        ),
        (
            "The stopping network knows the length from about 200 demonstrations on (at least .99).",
            reaches("sinkhorn-paper", "stop_accuracy", 0.99, from_n=200),
        ),
    ),
    "scrabble": (
        ("With more actions BC+Sinkhorn loses little, BC+TCN+Hungarian much (letters right).", _loses_less),
        ("The TCN errs more where letters repeat.", _tcn_errs_more_with_repeats),
    ),
}


def _ours(statement: str, metric: str, bound: float, **more: Any) -> Hypothesis:
    return statement, reaches("sinkhorn", metric, bound, **more)


#: By study: what is asked of `sinkhorn`.
OF_OURS: Mapping[str, tuple[Hypothesis, ...]] = {
    "tower": (
        _ours("At least .85 whole on hard pictures.", "whole_sequence", 0.85, style="hard"),
        _ours("No block twice.", "re_use", 0.0, above=False),
        _ours("Trained in at most 30 s.", "training_seconds", 30, above=False),
    ),
    "unseen": (
        ("Above the memoriser's line (steps right).", ahead("sinkhorn", "memoriser", "per_step")),
        _ours("At least .9 of the steps from 200 towers on.", "per_step", 0.9, from_n=200),
    ),
    "variable": (
        _ours("At least .95 whole sequences from 400 demonstrations on.", "whole_sequence", 0.95, from_n=400),
        _ours("Stops at the right length in at least .99.", "stop_accuracy", 0.99, from_n=400),
    ),
    "scrabble": (
        _ours("At least .97 of the letters, 98 tiles.", "per_step", 0.97, from_n=98),
        _ours("At least .93 of the words, 98 tiles.", "whole_sequence", 0.93, from_n=98),
        _ours("Trained in at most 3 minutes, 98 tiles.", "training_seconds", 180, above=False, from_n=98),
    ),
}
