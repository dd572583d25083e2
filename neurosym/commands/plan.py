"""`neurosym plan`: one problem, its plan step by step, and the reason for each refusal on the way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
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
    write_json,
)
from neurosym.commands.plan_pddl import plan_pddl
from neurosym.errors import InputError
from neurosym.language.options import made
from neurosym.language.problem_family import ProblemFamily
from neurosym.plan_files.writing import problem_part, result_part
from neurosym.support.deadline import OutOfTime, within
from neurosym.support.words import joined

if TYPE_CHECKING:
    from neurosym.language.problem import Problem
    from neurosym.language.search_problem import Rejection
    from neurosym.planning.result import PlanResult

#: The prior for assemblies, unless another is named.
UNTRAINED = "outermost-first"

#: Refusals shown at the end of a search that found nothing; --out keeps all.
LAST_REFUSALS = 12

#: What ended a search that did not end from its initial state.
ENDED = {"full": "", "empty": " It was decided from the empty side.", "both": " The two sides met."}


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
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Keep it all as JSON.")] = None,
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

    start = perf_counter()
    if pddl is not None:
        raise typer.Exit(plan_pddl(pddl, Path(what), planner, heuristic, search, out, as_json))
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
                assembly = load_assembly(path, files)
                named = options | {"name": path.resolve().name}
                problem = made(family.problem, assembly, options=named, whose=family.name)
        except OutOfTime:
            say(f"The budget of {search.seconds:g} seconds ended while {path} was read. Give more: --seconds.")
            raise typer.Exit(Status.OUT_OF_BUDGET.exit_code) from None
        source = {"assembly": reference(path, files.reading(), assembly)}
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
    settings["budget"] = budget.less(perf_counter() - start)
    sturdiest: SturdyPlan | None = None
    if sturdy and (path is None or k is not None or removal.tilt is not None):
        raise InputError("Expected --sturdy with the path of an assembly, and without --k and --tilt.")
    with progress_bar(f"planning {problem.name}", after=1.0):
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
            settings["budget"] = budget.less(perf_counter() - start)
            results = [solve(problem, rng=np.random.default_rng(search.seed), **settings)]
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
    if k is not None:
        answer["plans"] = [result_part(result) for result in results]
    if out is not None:
        write_json(answer, out)
    if as_json:
        print_json(answer)
    else:
        _show(problem, results, answer)
        if sturdiest:
            print(sturdiest.sentence)
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


def _show(problem: Problem, results: Sequence[PlanResult], answer: dict[str, Any]) -> None:
    best = results[0]
    advice = f"with the prior {answer['prior']}" if answer["prior"] else "without a prior"
    print(f"{problem.name}: {answer['planner']} {advice}, oracle {answer['oracle']}")
    if best.plan is not None:
        _show_steps(best.plan, best)
    print(f"{best.status.sentence}{ENDED[best.side]}")
    if best.plan is not None and best.fewest is not None:
        steps = f"{len(best.plan)} step{'' if len(best.plan) == 1 else 's'}"
        print(f"{steps}; proved fewest." if best.fewest else f"{steps}; not proved fewest.")
    if best.plan is None:
        so_far = joined(best.best_prefix) or "nothing"
        print(f"The longest prefix that works: {so_far} ({len(best.best_prefix)} of {len(problem.actions)}).")
        if best.best_suffix is not None and best.side != "empty":
            print(f"From the empty side {len(best.best_suffix)} of {len(problem.actions)} can be undone.")
    if best.why_not is not None:
        for sentence in best.why_not.sentences:
            print(f"  {sentence}")
    elif best.plan is None:
        print(f"The last of {best.iterations} refusals:" if best.blame else "Nothing was refused.")
        for refusal in best.blame[-LAST_REFUSALS:]:
            print(f"  {_when(refusal)}, not {refusal.action}: {refusal.reason}")
    counts = {"iteration": best.iterations, "attempt": best.attempts, "expansion": best.expansions}
    figures = ", ".join(f"{n} {what}{'' if n == 1 else 's'}" for what, n in counts.items())
    print(f"{figures}, {1000 * best.seconds:.1f} ms")
    for rank, other in enumerate(results if len(results) > 1 else (), 1):
        cost = "" if other.cost is None else f"  (cost {other.cost:.3f} nats)"
        print(f"plan {rank}: {' '.join(other.plan or ())}{cost}")


def _when(refusal: Rejection) -> str:
    """What was done before an attempt that was refused."""
    done = joined(refusal.after) or "nothing"
    return f"after {done}" if refusal.side == "full" else f"from the empty side with {done} undone"


def _show_steps(steps: Sequence[str], result: PlanResult) -> None:
    """The plan and the refusals in the order in which they came; those off the plan's path say after what.

    Where few actions are wanted these are left out: most come after the plan, of the search for a shorter one.
    """
    motions = [f"  {motion}" if motion else "" for motion in result.motions] or [""] * len(steps)
    printed = 0

    def advance(to: int) -> int:
        for i in range(printed, to):
            print(f"  {i + 1}. {steps[i]}{motions[i]}")
        return max(printed, to)

    for refusal in result.blame:
        depth = len(refusal.after)
        on_path = refusal.side == "full" and tuple(steps[:depth]) == refusal.after
        if result.fewest is not None and not on_path:
            continue  # of the search for a shorter plan
        if on_path:
            printed = advance(depth)
        elsewhere = "" if on_path and depth == printed else f" ({_when(refusal)})"
        print(f"     not {refusal.action}{elsewhere}: {refusal.reason}")
    advance(len(steps))
