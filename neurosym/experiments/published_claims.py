"""What the paper says of its experiments, and what is asked of our own recipe: each checked on the results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from neurosym.experiments.study_results import Results

#: Shares that differ by less are called alike.
ALIKE = 0.05

#: Whether it holds, and the numbers that decide; None where the results do not bear on it.
Answer = tuple[bool, str] | None


@dataclass(frozen=True)
class Claim:
    """A statement that results can be asked about.

    Attributes:
        says: the statement.
        check: called with the results and a style of pictures.
    """

    says: str
    check: Callable[[Results, str], Answer]


def ahead(first: str, second: str, metric: str) -> Callable[[Results, str], Answer]:
    """`first` is ahead of `second` at every n."""
    return lambda results, style: _at_every_n(results, style, (first, second), metric, lambda a, b: a > b)


def alike(first: str, second: str, metric: str) -> Callable[[Results, str], Answer]:
    """The two differ by less than `ALIKE` at every n."""
    return lambda results, style: _at_every_n(results, style, (first, second), metric, lambda a, b: abs(a - b) < ALIKE)


def reaches(
    method: str, metric: str, bound: float, *, above: bool = True, from_n: int = 0, style: str | None = None
) -> Callable[[Results, str], Answer]:
    """At every n from `from_n` on, a method's mean is at least (or, not `above`, at most) the bound."""

    def check(results: Results, given: str) -> Answer:
        sizes = [n for n in results.study.sizes if n >= from_n]
        found = {n: results.mean(given, method, n, metric) for n in sizes} if style in (None, given) else {}
        known = {n: value for n, value in found.items() if value is not None}
        if not known:
            return None
        holds = all(value >= bound if above else value <= bound for value in known.values())
        return holds, "; ".join(f"{value:.3f} at n = {n}" for n, value in known.items())

    return check


def drops_less(first: str, second: str, metric: str) -> Callable[[Results, str], Answer]:
    """From the least n to the greatest, `first` loses less than `second`."""

    def check(results: Results, style: str) -> Answer:
        sizes = results.study.sizes
        lost = {}
        for method in (first, second):
            ends = [results.mean(style, method, n, metric) for n in (min(sizes), max(sizes))]
            if len(sizes) < 2 or ends[0] is None or ends[1] is None:
                return None
            lost[method] = ends[0] - ends[1]
        said = ", ".join(f"{method} loses {value:.3f}" for method, value in lost.items())
        return lost[first] < lost[second], f"from n = {min(sizes)} to {max(sizes)} {said}"

    return check


def errs_more_with_repeats(method: str) -> Callable[[Results, str], Answer]:
    """At the greatest n, a larger share of steps is wrong in sequences with two repetitions or more than with none."""

    def check(results: Results, style: str) -> Answer:
        counts = results.counts.get((style, method, max(results.study.sizes)))
        if counts is None or not counts.repeats[0, 0] or not counts.repeats[2:, 0].sum():
            return None
        none = counts.repeats[0, 1] / counts.repeats[0, 0]
        some = counts.repeats[2:, 1].sum() / counts.repeats[2:, 0].sum()
        return bool(some > none), f"{none:.3f} of the steps are wrong without repetitions, {some:.3f} with two or more"

    return check


def re_uses(those: Sequence[str], others: Sequence[str]) -> Callable[[Results, str], Answer]:
    """Some methods use an action twice, others never do."""

    def check(results: Results, style: str) -> Answer:
        n = max(results.study.sizes)
        found = {m: results.mean(style, m, n, "re_use") for m in (*those, *others)}
        known = {m: value for m, value in found.items() if value is not None}
        if not known:
            return None
        holds = all((value > 0) == (m in those) for m, value in known.items())
        return holds, ", ".join(f"{m} in {value:.2f}" for m, value in known.items()) + " of the sequences"

    return check


def _at_every_n(
    results: Results, style: str, pair: tuple[str, str], metric: str, holds: Callable[[float, float], bool]
) -> Answer:
    found = []
    for n in results.study.sizes:
        first, second = (results.mean(style, method, n, metric) for method in pair)
        if first is not None and second is not None:
            found.append((holds(first, second), f"{first:.3f} against {second:.3f} at n = {n}"))
    if not found:
        return None
    return all(held for held, _ in found), "; ".join(said for _, said in found)


_ASSIGNED = ("bc+hungarian", "tcn-paper+hungarian", "sinkhorn-paper")

#: By study: what the paper says. Its order of the five methods is checked by `neurosym.experiments.conclusions`.
OF_THE_PAPER: Mapping[str, tuple[Claim, ...]] = MappingProxyType(
    {
        "tower": (
            Claim("BC and BC+TCN use blocks twice, the others never do.", re_uses(("bc", "tcn-paper"), _ASSIGNED)),
        ),
        "unseen": (
            Claim(
                "With unique actions BC+Sinkhorn and BC+TCN perform similarly (steps right).",
                alike("sinkhorn-paper", "tcn-paper", "per_step"),
            ),
            Claim("BC+Sinkhorn is above the memoriser's line.", ahead("sinkhorn-paper", "memoriser", "per_step")),
            Claim("BC+TCN is above the memoriser's line.", ahead("tcn-paper", "memoriser", "per_step")),
        ),
        "variable": (
            Claim(
                "BC+Sinkhorn is ahead of BC+TCN+Hungarian (steps right).",
                ahead("sinkhorn-paper", "tcn-paper+hungarian", "per_step"),
            ),
            Claim(
                "The stopping network knows the length from about 200 demonstrations on (at least .99).",
                reaches("sinkhorn-paper", "stop_accuracy", 0.99, from_n=200),
            ),
        ),
        "scrabble": (
            Claim(
                "With more actions BC+Sinkhorn loses little, BC+TCN+Hungarian much (letters right).",
                drops_less("sinkhorn-paper", "tcn-paper+hungarian", "per_step"),
            ),
            Claim("The TCN errs more where letters repeat.", errs_more_with_repeats("tcn-paper+hungarian")),
        ),
    }
)

#: By study: what is asked of `sinkhorn`.
OF_OURS: Mapping[str, tuple[Claim, ...]] = MappingProxyType(
    {
        "tower": (
            Claim("At least .85 whole on hard pictures.", reaches("sinkhorn", "whole_sequence", 0.85, style="hard")),
            Claim("No block twice.", reaches("sinkhorn", "re_use", 0.0, above=False)),
            Claim("Trained in at most 30 s.", reaches("sinkhorn", "training_seconds", 30, above=False)),
        ),
        "unseen": (
            Claim("Above the memoriser's line (steps right).", ahead("sinkhorn", "memoriser", "per_step")),
            Claim("At least .9 of the steps from 200 towers on.", reaches("sinkhorn", "per_step", 0.9, from_n=200)),
        ),
        "variable": (
            Claim(
                "At least .95 whole sequences from 400 demonstrations on.",
                reaches("sinkhorn", "whole_sequence", 0.95, from_n=400),
            ),
            Claim("Stops at the right length in at least .99.", reaches("sinkhorn", "stop_accuracy", 0.99, from_n=400)),
        ),
        "scrabble": (
            Claim("At least .97 of the letters, 98 tiles.", reaches("sinkhorn", "per_step", 0.97, from_n=98)),
            Claim("At least .93 of the words, 98 tiles.", reaches("sinkhorn", "whole_sequence", 0.93, from_n=98)),
            Claim(
                "Trained in at most 3 minutes, 98 tiles.",
                reaches("sinkhorn", "training_seconds", 180, above=False, from_n=98),
            ),
        ),
    }
)
