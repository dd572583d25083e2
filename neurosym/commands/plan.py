"""`neurosym plan`: one problem, its plan step by step, and the reason for each refusal on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer

from neurosym.commands.common import (
    AsJson,
    FileOptions,
    PictureStyle,
    RemovalOptions,
    SearchOptions,
    family_options,
    load_assembly,
    print_json,
    problem_options,
    progress_bar,
    say,
    to_write,
    write_json,
)
from neurosym.commands.plan_pddl import plan_pddl
from neurosym.commands.plan_text import show
from neurosym.commands.spent import Spent
from neurosym.commands.widening import widened
from neurosym.errors import InputError
from neurosym.language.options import made
from neurosym.language.problem_family import ProblemFamily
from neurosym.plan_files.writing import problem_part, result_part
from neurosym.support.deadline import OutOfTime, within

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly
    from neurosym.language.problem import Problem

#: The prior for assemblies, unless another is named.
UNTRAINED = "outermost-first"


def plan(
    what: Annotated[
        str,
        typer.Argument(
            metavar="PATH|DOMAIN",
            help="An assembly of yours (a folder with one mesh a part, a scene, a puzzle, an assembly's JSON), or a "
            "problem family; `neurosym list` names them. With --pddl, a problem in PDDL.",
        ),
    ],
    *,
    number: Annotated[int | None, typer.Option("--problem", metavar="N", help="Number of the problem.")] = None,
    pddl: Annotated[Path | None, typer.Option(metavar="FILE", help="The domain, in PDDL, of the problem.")] = None,
    planner: Annotated[
        str | None,
        typer.Option(metavar="P", help="Default backtracking; --k: best-first; --target: fewest; --pddl: greedy."),
    ] = None,
    heuristic: Annotated[
        str | None, typer.Option(metavar="H", help="Of best-first and greedy: ff, add, max, goals, none.")
    ] = None,
    search: SearchOptions,
    pictures: PictureStyle = "clean",
    expansions: Annotated[int | None, typer.Option(help="Budget: states expanded.")] = None,
    side: Annotated[
        Literal["full", "empty", "both"] | None,
        typer.Option(help="From where to search: what is there, its goal, or both. Default both for assemblies."),
    ] = None,
    k: Annotated[int | None, typer.Option(metavar="K", help="The K best plans, the likeliest first.")] = None,
    sturdy: Annotated[
        bool,
        typer.Option(
            "--sturdy",
            help="Of an assembly, the plan that bears the greatest tilt at every step. The budget is of each try.",
        ),
    ] = False,
    files: FileOptions,
    removal: RemovalOptions,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", callback=to_write, help="Keep it all as JSON.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Plan one problem, and show each step with the refusals that led to it; or why there is no plan.

    For an assembly the plan takes it apart; backwards, it puts it together.
    """
    from neurosym.experiments.benchmark import NO_PRIOR
    from neurosym.geometry.readers.references import reference
    from neurosym.pipeline import plans, solve, suited_planner
    from neurosym.planning.budget import Budget
    from neurosym.planning.result import Status
    from neurosym.planning.sturdiness import SturdyPlan, sturdiest_plan
    from neurosym.registry import load_domain, load_planner

    if pddl is not None:
        raise typer.Exit(plan_pddl(pddl, Path(what), planner, heuristic, search, out, as_json))
    assembly: Assembly | None = None
    spent = Spent()
    cells = search.own_cells()
    path = _path(what, number, cells)
    family = load_domain("assembly" if path else what)
    style = None if pictures == "clean" else pictures
    options = problem_options(family, **search.of_problem(), pictures=style)
    options |= removal.given() | family_options(search.option)
    source: dict[str, Any] = {}
    if path is None:
        files.reading().refuse(f"{what!r} is a problem family")
        problem = _problem(family, number, cells, options)
        # Pieces of the user's own travel with their plan, so that it can be shown and replayed.
        source = {} if cells is None else {"cells": cells}
    else:
        try:
            with within(search.seconds):
                with spent.on("reading"):
                    assembly = load_assembly(path, files)
                named = options | {"name": path.resolve().name}
                with spent.on("contacts and blocking"):
                    problem = made(family.problem, assembly, options=named, whose=family.name)
        except OutOfTime:
            say(f"The budget of {search.seconds:g} s (--seconds) ended before there was a problem to search: {spent}.")
            raise typer.Exit(Status.OUT_OF_BUDGET.exit_code) from None
        source = {"assembly": reference(path, files.reading(), assembly), "notes": [str(n) for n in assembly.notes]}
        options = options | {"stability": problem.details["stability"]}
    prior = search.prior
    if prior is None:
        prior = NO_PRIOR if path is None else UNTRAINED
    budget = Budget(seconds=search.seconds, attempts=search.attempts, expansions=expansions)
    settings: dict[str, Any] = {
        "planner": planner or (suited_planner(problem) if k is None else "best-first"),
        "prior": None if prior == NO_PRIOR else prior,
        "budget": budget,
        "oracle": search.oracle,
        "side": side,
    }
    name = settings["planner"]
    if heuristic is not None:
        settings["planner"] = load_planner(name, heuristic=heuristic)
    settings["budget"] = budget.less(spent.seconds)
    sturdiest: SturdyPlan | None = None
    if sturdy and (path is None or k is not None or removal.tilt is not None):
        raise InputError("Expected --sturdy with the path of an assembly, and without --k and --tilt.")
    with progress_bar(f"planning {problem.name}", after=1.0), spent.on("planning"):
        if sturdy:
            sturdiest = sturdiest_plan(
                lambda tilt: made(family.problem, assembly, options=named | {"tilt": tilt}, whose=family.name),
                lambda tilted: solve(tilted, rng=np.random.default_rng(search.seed), **settings),
            )
            results, options = [sturdiest.result], options | {"tilt": sturdiest.bears}
        else:
            results = plans(problem, k=k, rng=np.random.default_rng(search.seed), **settings)
        if not results:
            # The k best of none: ask for one, to be told why there is none.
            settings["budget"] = budget.less(spent.seconds)
            results = [solve(problem, rng=np.random.default_rng(search.seed), **settings)]
    # What a user waits for, reading and geometry included.
    results = [replace(result, seconds=spent.seconds) for result in results]
    answer = {
        **problem_part(family.name, problem, number, options),
        **source,
        **settings,
        **({} if heuristic is None else {"planner": name, "heuristic": heuristic}),
        "budget": budget.limits,
        "seed": search.seed,
        **result_part(results[0]),
        **({"sturdy": sturdiest.as_json()} if sturdiest else {}),
    }
    if results[0].why_not is not None and assembly is not None:
        left = None if search.seconds is None else search.seconds - spent.seconds
        with progress_bar("looking for what would help", after=1.0), spent.on("what would help"):
            answer["widened"] = widened(family, assembly, named | options, results[0].why_not, settings, left)
    if k is not None:
        answer["plans"] = [result_part(result) for result in results]
    if out is not None:
        write_json(answer, out)
    if as_json:
        print_json(answer)
    else:
        show(problem, results, answer)
        if sturdiest:
            print(sturdiest.sentence)
        if results[0].status is Status.OUT_OF_BUDGET and search.seconds is not None:
            print(f"Spent: {spent}.")
    raise typer.Exit(results[0].status.exit_code)


def _path(what: str, number: int | None, cells: object) -> Path | None:
    """The path, if that is what was given; a family's name wins where its problem is named, too."""
    from neurosym.registry import domain_names

    if Path(what).exists() and number is None and cells is None:
        return Path(what)
    if what not in domain_names():
        raise InputError(
            f"Expected the name of a domain, one of {', '.join(sorted(domain_names()))}, or the path of an assembly; "
            f"there is nothing at {what}."
        )
    return None


def _problem(family: ProblemFamily, number: int | None, cells: object, options: dict[str, Any]) -> Problem:
    if (number is None) == (cells is None):
        raise InputError("Expected either --problem N or --cells FILE, one of them.")
    if cells is None:
        return made(family.problem, number, options=options, whose=family.name)
    make: Callable[..., Problem] | None = getattr(family, "problem_from_cells", None)
    if make is None:
        raise InputError(f"Expected a domain of polycube puzzles (soma) for --cells; {family.name!r} is none.")
    return made(make, cells, options=options, whose=family.name)
