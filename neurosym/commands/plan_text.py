"""What `neurosym plan` prints: the plan with the refusals that led to it, or why there is none and what would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from neurosym.support.words import LISTED, counted, joined, listed

if TYPE_CHECKING:
    from neurosym.language.problem import Problem
    from neurosym.language.search_problem import Rejection
    from neurosym.planning.result import PlanResult

#: Refusals shown at the end of a search that found nothing; --out keeps all.
LAST_REFUSALS = 12

#: What ended a search that did not end from its initial state.
ENDED = {"full": "", "empty": " It was decided from the empty side.", "both": " The two sides met."}


def show(problem: Problem, results: Sequence[PlanResult], answer: Mapping[str, Any]) -> None:
    """Print the results of a problem; `answer` is what --json would give."""
    best = results[0]
    advice = f"with the prior {answer['prior']}" if answer["prior"] else "without a prior"
    print(f"{problem.name}: {answer['planner']} {advice}, oracle {answer['oracle']}")
    if best.plan is not None:
        _show_steps(best.plan, best)
    print(f"{best.status.sentence}{ENDED[best.side]}")
    if best.plan is not None and best.fewest is not None:
        print(f"{counted(len(best.plan), 'step')}; {'' if best.fewest else 'not '}proved fewest.")
    if best.plan is None:
        _show_failure(problem, best, answer)
    counts = {"iteration": best.iterations, "attempt": best.attempts, "expansion": best.expansions}
    print(f"{', '.join(counted(n, what) for what, n in counts.items())}, {1000 * best.seconds:.1f} ms")
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


def _show_failure(problem: Problem, result: PlanResult, answer: Mapping[str, Any]) -> None:
    why = result.why_not
    for sentence in (*why.reasons, why.scope) if why else ():
        print(f"  {sentence}")
    if why is None and result.status.name == "UNSOLVABLE":
        print(f"  This covers every order of these {counted(len(problem.actions), 'action')}, each done once at most.")
    for tried in answer.get("widened", ()):
        print(f"  {_outcome(**tried)}")
    reached = listed(result.best_prefix) or "nothing"
    print(f"The longest prefix that works: {reached} ({len(result.best_prefix)} of {len(problem.actions)}).")
    if result.best_suffix is not None and result.side != "empty":
        print(f"From the empty side {len(result.best_suffix)} of {len(problem.actions)} can be undone.")
    if why is None:
        print(f"The last of {counted(result.iterations, 'refusal')}:" if result.blame else "Nothing was refused.")
        before: Rejection | None = None
        for refusal in result.blame[-LAST_REFUSALS:]:
            print(f"  {_when(refusal, before)}not {refusal.action}: {refusal.reason}")
            before = refusal


def _outcome(flag: str, status: str | None, steps: int | None) -> str:
    if steps is not None:
        return f"With {flag} there is a plan of {counted(steps, 'step')}."
    if status == "UNSOLVABLE":
        return f"With {flag} there is none either."
    return f"{flag} would widen this; {'it was not tried' if status is None else 'a short try did not decide it'}."


def _when(refusal: Rejection, before: Rejection | None) -> str:
    """What was done before an attempt that was refused, by what changed since another one."""
    done, full = refusal.after, refusal.side == "full"
    if before is None or before.side != refusal.side:
        if len(done) > 1:
            return f"{'after' if full else 'from the empty side after'} {counted(len(done), 'step')} to {done[-1]}, "
        return f"{'after' if full else 'from the empty side after'} {joined(done) or 'nothing'}, "
    pairs = zip(before.after, done, strict=False)
    same = next((i for i, (a, b) in enumerate(pairs) if a != b), min(len(done), len(before.after)))
    back = [f"{counted(len(before.after) - same, 'step')} back"] if same < len(before.after) else []
    then = [f"then {listed(done[same:])}"] if done[same:] else []
    return "".join(f"{change}, " for change in (*back, *then))


def _show_steps(steps: Sequence[str], result: PlanResult) -> None:
    """The plan and the refusals in the order in which they came; those off the plan's path say what is different.

    Where few actions are wanted these are left out: most come after the plan, of the search for a shorter one.
    """
    motions = [f"  {motion}" if motion else "" for motion in result.motions] or [""] * len(steps)
    printed = 0
    before: Rejection | None = None

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
        elsewhere = "" if on_path and depth == printed else _when(refusal, before).removesuffix(", ")
        print(f"     not {refusal.action}{f' ({elsewhere})' if elsewhere else ''}: {refusal.reason}")
        before = refusal
    advance(len(steps))
