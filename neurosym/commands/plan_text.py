"""What `neurosym plan` prints: the plan with the refusals that led to it, or why there is none and what would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from neurosym.planning.result_text import as_text
from neurosym.support.words import LISTED, counted

if TYPE_CHECKING:
    from neurosym.language.problem import Problem
    from neurosym.planning.result import PlanResult


def show(problem: Problem, results: Sequence[PlanResult], answer: Mapping[str, Any]) -> None:
    """Print the results of a problem; `answer` is what --json would give."""
    advice = f"with the prior {answer['prior']}" if answer["prior"] else "without a prior"
    print(f"{problem.name}: {answer['planner']} {advice}, oracle {answer['oracle']}")
    print(as_text(results[0], [_outcome(**tried) for tried in answer.get("widened", ())]))
    notes = list(answer.get("notes", ()))
    if notes:
        print("Loading:")
    for note in notes[: LISTED - 1] if len(notes) > LISTED else notes:
        print(f"  {note}")
    if len(notes) > LISTED:
        print(f"  and {counted(len(notes) - LISTED + 1, 'note')} more; --json has all.")
    for rank, other in enumerate(results if len(results) > 1 else (), 1):
        cost = "" if other.cost is None else f"  (cost {other.cost:.3f} nats)"
        print(f"plan {rank}: {' '.join(other.plan or ())}{cost}")


def _outcome(flag: str, status: str | None, steps: int | None) -> str:
    if steps is not None:
        return f"With {flag} there is a plan of {counted(steps, 'step')}."
    if status == "UNSOLVABLE":
        return f"With {flag} there is none either."
    return f"{flag} would widen this; {'it was not tried' if status is None else 'a short try did not decide it'}."
