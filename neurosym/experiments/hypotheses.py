"""What the paper says of its experiments, and what is asked of our own recipe: each is tested on the results."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from neurosym.experiments.studies import Results

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
OF_THE_PAPER: Mapping[str, tuple[Hypothesis, ...]] = MappingProxyType(
    {
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
)


def _ours(statement: str, metric: str, bound: float, **more: Any) -> Hypothesis:
    return statement, reaches("sinkhorn", metric, bound, **more)


#: By study: what is asked of `sinkhorn`.
OF_OURS: Mapping[str, tuple[Hypothesis, ...]] = MappingProxyType(
    {
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
)
