"""`neurosym count`: in how many orders an assembly comes apart, exactly."""

from __future__ import annotations

from typing import Annotated

import typer

from neurosym.commands.assemblies import AssemblyPath, FileOptions, RemovalOptions, problem_at
from neurosym.commands.common import AsJson, print_json

#: Default limits: a minute, and as many states as fit into a few hundred megabytes.
SECONDS, EXPANSIONS = 60.0, 1_000_000


def count(
    path: AssemblyPath,
    files: FileOptions,
    removal: RemovalOptions,
    seconds: Annotated[float, typer.Option("--seconds", help="Budget: wall-clock time.")] = SECONDS,
    expansions: Annotated[int, typer.Option("--expansions", help="Budget: states looked at.")] = EXPANSIONS,
    as_json: AsJson = False,
) -> None:
    """Count the orders in which everything that is not fixed can be taken out: exactly, by dynamic programming.

    Where the budget ends first there is no number, and the exit code says so.
    """
    from neurosym.pipeline import count_orders
    from neurosym.planning.budget import Budget
    from neurosym.planning.result import Status

    problem = problem_at(path, files, removal.given())
    found = count_orders(problem, budget=Budget(seconds=seconds, expansions=expansions))
    if as_json:
        print_json({"path": str(path), **found.as_json()})
    elif found.orders is None:
        looked = f"{found.states:,} states in {found.seconds:.1f} s"
        print(f"The budget ended after {looked}, so there is no number. Give more: --seconds, --expansions.")
    else:
        least = "" if found.exact else "At least "
        print(f"{least}{found.orders:,} orders ({found.states:,} states, {found.seconds:.2f} s)")
    if found.orders is None:
        raise typer.Exit(Status.OUT_OF_BUDGET.exit_code)
    if not found.exact:
        raise typer.Exit(Status.GAVE_UP.exit_code)
