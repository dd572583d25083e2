"""What becomes of the priors that come along when pictures change: `neurosym reproduce robustness`.

Each reads the test problems in pictures of each style, in `varied` ones that are changed, and in pictures of something
else altogether, from which it can only guess.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from neurosym.experiments.engines import run_tasks
from neurosym.experiments.order_accuracy import calibration_error
from neurosym.experiments.perturbations import PERTURBATIONS, SOMETHING_ELSE
from neurosym.experiments.reporting import RECORD, markdown_table, provenance, write_experiment
from neurosym.language.problem_family import Progress
from neurosym.pipeline import solve
from neurosym.planning.planner import OrderCounter
from neurosym.planning.validation import validate
from neurosym.registry import load_domain, load_planner, load_prior

if TYPE_CHECKING:
    from neurosym.language.problem import Problem

NAME = "robustness"
STYLES = ("clean", "varied", "cluttered")
#: What is changed.
BASE = "varied"
PLANNERS = ("backtracking", "best-first")


@dataclass(frozen=True)
class Subject:
    """A prior that comes along, and problems that it never saw.

    Attributes:
        label: heads its column.
        options: of the family's problems.
        chooses: options of `numbers` among them.
        counted: options under which valid orders are counted, as in its training.
    """

    label: str
    domain: str
    prior: str
    options: Mapping[str, Any] = field(default_factory=dict)
    counted: Mapping[str, Any] = field(default_factory=dict)

    def problems(self, style: str, count: int, options: Mapping[str, Any]) -> list[Problem]:
        """The first test problems, with pictures."""
        family = load_domain(self.domain)
        numbers = family.numbers("test", **({"variant": self.options["variant"]} if "variant" in self.options else {}))
        return family.observed([family.problem(n, pictures=style, **options) for n in list(numbers)[:count]])


SUBJECTS = (
    Subject("towers of 2 to 6", "tower", "sinkhorn", {"variant": "heights"}),
    Subject("towers of six colours", "tower", "sinkhorn", {"variant": "unique"}),
    Subject("Soma, sinkhorn", "soma", "sinkhorn", counted={"collapse": "strict"}),
    Subject("Soma, tcn", "soma", "tcn", counted={"collapse": "strict"}),
)


def reproduce(
    out: Path,
    *,
    subjects: Sequence[Subject] = SUBJECTS,
    count: int = 120,
    progress: Progress = lambda done, total: None,
    **where: Any,
) -> pd.DataFrame:
    """Try every subject on its first `count` test problems; write results.csv and report.md into `out`.

    `where`: workers, engine and address, see `neurosym.experiments.engines.run_tasks`.

    Returns the lines of results.csv: metrics `first_orders_right` (share), `calibration_error`, and `iterations` (means
    by planner; method `none` is without a prior).
    """
    figures: dict[str, list[Any]] = {}
    for subject, own in run_tasks(lambda subject: list(_figures(subject, count)), subjects, **where):
        figures[subject.label] = own
        progress(len(figures), len(subjects))
    lines = [
        (s.label, style, method, count, 0, metric, float(value))
        for s in subjects
        for style, method, metric, value in figures[s.label]
    ]
    records = pd.DataFrame(lines, columns=RECORD)
    write_experiment(records, (), lambda _: report(records), out)
    return records


def _figures(subject: Subject, count: int) -> Iterator[tuple[str, str, str, float]]:
    prior = load_prior(subject.prior)
    for style in STYLES:
        problems, known = subject.problems(style, count, subject.options), _Verdicts()
        yield style, subject.prior, "first_orders_right", _right(prior, problems, known)
        if style == BASE:
            for name, change in PERTURBATIONS.items():
                changed = _changed(problems, change)
                yield name, subject.prior, "first_orders_right", _right(prior, changed, known)
    counter = load_planner("exhaustive")
    assert isinstance(counter, OrderCounter)
    counted = subject.problems("cluttered", count, {**subject.options, **subject.counted})
    shares = [counter.order_marginals(problem.ground()) for problem in counted]
    yield "cluttered", subject.prior, "calibration_error", calibration_error(prior.scores(counted), shares)
    for planner in PLANNERS:
        problems = subject.problems(BASE, count, subject.options)
        plain = [solve(p, planner=planner, rng=seed).iterations for p in problems for seed in range(2)]
        yield "no prior", "none", f"iterations {planner}", float(np.mean(plain))
        for name, change in SOMETHING_ELSE.items():
            changed = _changed(problems, change)
            guided = [
                solve(p, planner=planner, prior=s, rng=0).iterations for p, s in zip(changed, prior.scores(changed))
            ]
            yield name, subject.prior, f"iterations {planner}", float(np.mean(guided))


class _Verdicts(dict[tuple[str, tuple[str, ...]], bool]):
    """Whether an order is a plan, by the problem's name: pictures that change leave the work as it is."""


def _right(prior: Any, problems: Sequence[Problem], known: _Verdicts) -> float:
    """The share of problems whose likeliest order is a plan."""
    keys = [(p.name, s.names()) for p, s in zip(problems, prior.scores(problems))]
    for p, key in zip(problems, keys):
        if key not in known:
            known[key] = validate(p, key[1]).ok
    return float(np.mean([known[key] for key in keys]))


def _changed(problems: Sequence[Problem], change: Callable[..., Any]) -> list[Problem]:
    pictures = change(np.stack([np.asarray(p.observation) for p in problems]), np.random.default_rng(0))
    return [p.with_pictures(own) for p, own in zip(problems, pictures)]


def report(records: pd.DataFrame) -> str:
    """The page: how often first orders are right, how sure the priors are, and what a wrong guess costs."""
    labels = list(dict.fromkeys(records["experiment"]))
    value = {tuple(line[:-1]): line[-1] for line in records[["experiment", "pictures", "metric", "value"]].values}

    def table(metric: str, rows: Sequence[str], scale: float, digits: int) -> list[str]:
        cells = [[f"{scale * value[label, row, metric]:.{digits}f}" for label in labels] for row in rows]
        return markdown_table([["pictures", *labels], *([row, *own] for row, own in zip(rows, cells))])

    lines = [
        "# When pictures change",
        "",
        "Made by `neurosym reproduce robustness`: the priors that come along, on test problems of split 0, which they "
        f"never saw ({', '.join(f'{n} of {label}' for label, n in _counts(records).items())}).",
        "",
        "First orders that are plans, in per cent: for towers the whole sequence is right; for Soma what is missing "
        f"are initial failures. Below the styles, pictures of the style `{BASE}` are changed.",
        "",
        *table("first_orders_right", [*STYLES, *PERTURBATIONS], 100, 1),
        "",
        "Expected calibration error of each step's likeliest action, in `cluttered` pictures (0: of the steps that a "
        "prior calls 70% sure, 70% are right):",
        "",
        *table("calibration_error", ["cluttered"], 1, 3),
        "",
        "Pictures of something else altogether: mean iterations, beside those without a prior.",
    ]
    for planner in PLANNERS:
        lines += ["", f"{planner}:", "", *table(f"iterations {planner}", ["no prior", *SOMETHING_ELSE], 1, 2)]
    return "\n".join([*lines, "", provenance(), ""])


def _counts(records: pd.DataFrame) -> dict[str, int]:
    return {str(label): int(n) for label, n in records.groupby("experiment", sort=False)["n"].first().items()}
