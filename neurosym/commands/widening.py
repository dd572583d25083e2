"""Where there is no plan: the options that would widen the answer, each tried for a moment."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING, Any

from neurosym.errors import NeurosymError
from neurosym.language.options import made
from neurosym.support.deadline import OutOfTime, within

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly
    from neurosym.language.explanation import WhyNot
    from neurosym.language.problem_family import ProblemFamily

#: Seconds for one option, and for all of them: less than what a user waits for without asking what goes on.
EACH, ALL = 2.0, 5.0


def widened(
    family: ProblemFamily,
    assembly: Assembly,
    options: dict[str, Any],
    why: WhyNot,
    settings: dict[str, Any],
    seconds: float | None,
) -> list[dict[str, Any]]:
    """For each option of `why.wider` its flag, and the status and number of steps that it leads to; None: not tried.

    Args:
        options: those of the problem that has no plan.
        settings: of `solve`.
        seconds: what is left of the user's own budget.
    """
    from neurosym.pipeline import solve
    from neurosym.planning.budget import Budget

    start, most = perf_counter(), ALL if seconds is None else min(ALL, seconds)
    tried = []
    for wider in why.wider:
        left = min(EACH, most - (perf_counter() - start))
        status, steps = None, None
        if left > 0:
            began = perf_counter()
            try:
                with within(left):
                    problem = made(family.problem, assembly, options=options | {wider.option: wider.value}, whose="it")
                budget = Budget(seconds=max(left - (perf_counter() - began), 0.0))
                asked = settings | {"budget": budget, "planner": None, "side": None}
                result = solve(problem, rng=0, **asked)
                status, steps = result.status.name, None if result.plan is None else len(result.plan)
            except OutOfTime:
                status = "OUT_OF_BUDGET"
            except NeurosymError:  # an option that does not go with the others
                continue
        tried.append({"flag": wider.flag, "status": status, "steps": steps})
    return tried
