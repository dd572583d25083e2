"""`neurosym compare`: how many iterations each planner needs with each prior, beside the published figures."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from neurosym.commands import common
from neurosym.errors import InputError, UnknownNameError
from neurosym.experiments.engines import cores
from neurosym.language.problem_family import ProblemFamily
from neurosym.support.files import write_text

if TYPE_CHECKING:
    from neurosym.experiments.benchmark import Comparison, Outcome
    from neurosym.experiments.reporting import Row

PLANNERS = ("swap-repair", "backtracking", "best-first")
PRIORS = ("none", "outermost-first", "tcn-paper", "sinkhorn-paper", "tcn", "sinkhorn")
PARTS = ("test", "train", "all")


def compare(
    domain: common.DomainName,
    problems: Annotated[
        str, typer.Option(metavar="test|train|all|N", help="Which; N means the first N of the test part.")
    ] = "test",
    split: common.Split = 0,
    pictures: common.PictureStyle = "clean",
    planner: Annotated[list[str] | None, typer.Option(metavar="P", help="Name of a planner. May be repeated.")] = None,
    prior: common.PriorNames = None,
    collapse: common.CollapseRule = None,
    option: common.FamilyOptions = None,
    oracle: common.OracleName = "geometry",
    seeds: Annotated[int, typer.Option(min=1, metavar="K", help="Solve each problem K times.")] = 1,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the table, the figure and the journal.")
    ] = None,
    as_json: common.AsJson = False,
    workers: Annotated[int | None, typer.Option(min=1, metavar="N", help="Processes; default one a core.")] = None,
) -> None:
    """Compare planners and priors on a domain's problems: one row a planner and prior, of each kind of problem.

    Writes results.csv, results.md and iterations.png. Finished runs are kept in DIR/runs.jsonl: interrupted, or asked
    again with one more prior, it does only the rest.
    `solved` counts the problems that were solved under every seed; means are over problems x seeds.
    Without --out, files go to out/compare-DOMAIN (with --json nowhere).
    """
    from neurosym.experiments.benchmark import Comparison, Outcome, image_blind, run
    from neurosym.experiments.reporting import figure_of, report, rows, write_csv
    from neurosym.plotting import save
    from neurosym.registry import load_domain

    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"Expected --out to be a folder; {out} is a file.")
    family = load_domain(domain)
    own = common.family_options(option)
    only_numbers = common.taken_by(family.numbers, own).keys() - common.taken_by(family.problem, own).keys()
    of_problems = {k: v for k, v in own.items() if k not in only_numbers}
    folder = out if out is not None or as_json else Path("out") / f"compare-{domain}"
    processes = workers or cores()
    # A family whose problems have no such option is not told the default.
    style = None if pictures == "clean" else pictures
    comparison = Comparison(
        domain=domain,
        numbers=_numbers(family, problems, split, own),
        planners=tuple(dict.fromkeys(planner or PLANNERS)),
        priors=tuple(dict.fromkeys(prior or (*PRIORS[:2], *family.priors, *PRIORS[2:]))),
        options=common.problem_options(family, collapse=collapse, pictures=style) | of_problems,
        oracle=oracle,
        seeds=seeds,
    )
    if oracle == "physics":
        comparison = _simulated(comparison, family)
    comparison, scores = _scores(comparison, asked=bool(prior), workers=processes)
    with common.progress_bar("planning") as progress:
        journal = folder / "runs.jsonl" if folder else None
        runs = run(comparison, scores, workers=processes, journal=journal, progress=progress)
    outcome = Outcome(comparison, runs, *image_blind(comparison, split=split))
    table = rows(outcome)
    if folder:
        write_csv(table, folder / "results.csv")
        write_text(folder / "results.md", report(outcome))
        save(figure_of(outcome), folder / "iterations.png")
    if as_json:
        common.print_json({"rows": table})
        return
    _show(outcome, table, family, folder)


def _numbers(family: ProblemFamily, problems: str, split: int, options: Mapping[str, Any]) -> tuple[int, ...]:
    # Which problems there are may depend on the options, too: a variant, how many tiles.
    own = common.taken_by(family.numbers, options)
    if problems.isdecimal() and int(problems) > 0:
        test = tuple(family.numbers("test", split=split, **own))
        if int(problems) > len(test):
            raise InputError(f"Expected at most {len(test)} problems, as many as the test part has; got {problems}.")
        return test[: int(problems)]
    if problems not in PARTS:
        raise UnknownNameError("part", problems, PARTS, hint="A number N above 0 takes the first N of the test part.")
    return tuple(family.numbers(problems, split=split, **own))


def _simulated(comparison: Comparison, family: ProblemFamily) -> Comparison:
    """Without the problems that a simulation does not judge, as long as it judges some."""
    numbers = comparison.numbers
    kept = tuple(n for n in numbers if family.problem(n, **comparison.options).simulation is not None)
    if 0 < len(kept) < len(numbers):
        common.say(f"Left out: {len(numbers) - len(kept)} problems that no simulation judges (fixed or held parts).")
    return dataclasses.replace(comparison, numbers=kept or numbers)


def _scores(comparison: Comparison, *, asked: bool, workers: int) -> tuple[Comparison, dict[str, Any]]:
    """The priors' scores; of the default priors, those that do not know this domain are left out."""
    from neurosym.experiments.benchmark import ask_priors

    def leave_out(name: str, error: InputError) -> None:
        common.say(f"Left out: the prior {name}. {error}")

    with common.progress_bar("taking pictures") as progress:
        scores = ask_priors(comparison, workers=workers, leave_out=None if asked else leave_out, progress=progress)
    return dataclasses.replace(comparison, priors=tuple(scores)), scores


def _show(outcome: Outcome, given: list[Row], family: ProblemFamily, folder: Path | None) -> None:
    from neurosym.experiments.reporting import table

    comparison = outcome.comparison
    rendered = table(given)
    out = common.console(rendered)
    options = "".join(f"{key} {value}, " for key, value in comparison.options.items())
    seeds = f", {comparison.seeds} seeds each" if comparison.seeds > 1 else ""
    out.print(f"{comparison.domain}: {len(comparison.numbers)} problems{seeds}; {options}oracle {comparison.oracle}")
    out.print(rendered)
    if outcome.image_blind is not None:
        out.print(
            f"Without looking at any picture: the best fixed order ({' '.join(outcome.image_blind_order)}) "
            f"fails on {100 * outcome.image_blind:.1f}% of them."
        )
    if any(row["published"] for row in given):
        out.print(f"Paper: {family.reference}. Its 'random' stands beside 'none'.")
    if folder:
        out.print(f"Written: {folder / 'results.csv'}, {folder / 'iterations.png'}", soft_wrap=True)
