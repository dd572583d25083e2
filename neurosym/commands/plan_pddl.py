"""`neurosym plan --pddl`: a problem in PDDL files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from neurosym.commands.common import SearchOptions, print_json, progress_bar, write_json

#: The planner, unless another is named: a plan soon.
PLANNER = "greedy"


def plan_pddl(
    domain: Path,
    problem: Path,
    planner: str | None,
    heuristic: str | None,
    search: SearchOptions,
    out: Path | None,
    as_json: bool,
) -> int:
    """Plan, show the plan with what it costs, and give the exit code."""
    from neurosym.errors import InputError
    from neurosym.pddl.reading import from_pddl
    from neurosym.pipeline import solve
    from neurosym.plan_files.writing import result_part
    from neurosym.planning.budget import Budget
    from neurosym.registry import load_planner

    if search.prior is not None or search.oracle != "geometry":
        raise InputError("Expected no --prior and no --oracle beside --pddl: there are no pictures and no geometry.")
    name = planner or PLANNER
    options: dict[str, Any] = {} if heuristic is None else {"heuristic": heuristic}
    chosen = load_planner(name, **options)
    budget = Budget(seconds=search.seconds, attempts=search.attempts)
    with progress_bar(f"planning {problem.name}", after=1.0):
        task = from_pddl(domain, problem)
        result = solve(task, planner=chosen, budget=budget, rng=np.random.default_rng(search.seed))
    answer = {"pddl": [str(domain), str(problem)], "planner": name, **options, **result_part(result)}
    answer |= {"total_cost": result.total_cost, "cheapest": result.cheapest}
    if out is not None:
        write_json(answer, out)
    if as_json:
        print_json(answer)
        return result.status.exit_code
    for number, step in enumerate(result.plan or (), 1):
        print(f"{number:3}. {step}")
    print(result.status.sentence)
    if result.plan is not None:
        cost = "" if result.total_cost is None else f", cost {result.total_cost:g}"
        proved = {True: "; proved that none is cheaper", False: "; not proved cheapest"}
        least = result.fewest if result.cheapest is None else result.cheapest
        print(f"{len(result.plan)} steps{cost}{proved.get(least, '') if least is not None else ''}.")
    print(f"{result.expansions} expansions, {1000 * result.seconds:.1f} ms")
    return result.status.exit_code
