"""A result as text, as the command line prints it, and as notebooks show it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from neurosym.language.search_problem import Rejection
from neurosym.support.html import table
from neurosym.support.words import counted, joined

if TYPE_CHECKING:
    from neurosym.planning.result import PlanResult

#: Refusals shown at the end of a search that found nothing, or off a plan's path; `PlanResult.blame` has all.
LAST_REFUSALS = 12

#: What ended a search that did not end from its initial state.
ENDED = {"full": "", "empty": " It was decided from the empty side.", "both": " The two sides met."}


def as_text(result: PlanResult) -> str:
    """The plan step by step with the refusals on its way, or why there is none; then the counts."""
    return "\n".join([*_steps(result), *summary(result), figures(result)])


def as_html(result: PlanResult) -> str:
    """The same as a table of steps."""
    motions = result.motions or (None,) * len(result.plan or ())
    rows = [(i, action, motion or "") for i, (action, motion) in enumerate(zip(result.plan or (), motions), 1)]
    title, *rest = summary(result)
    return table(("step", "action", "motion"), rows, title=title, after="\n".join([*rest, figures(result)]))


def figures(result: PlanResult) -> str:
    """What the search took, in one line."""
    counts = {"iteration": result.iterations, "attempt": result.attempts, "expansion": result.expansions}
    return f"{', '.join(counted(n, what) for what, n in counts.items())}, {1000 * result.seconds:.1f} ms"


def summary(result: PlanResult) -> list[str]:
    """How it ended, in sentences; without a plan, how far it came, and why no further."""
    lines = [f"{result.status.sentence}{ENDED[result.side]}"]
    if result.plan is not None:
        if result.fewest is not None:
            lines.append(f"{counted(len(result.plan), 'step')}; {'' if result.fewest else 'not '}proved fewest.")
        return lines
    of = "" if result.n_actions is None else f" of {result.n_actions}"
    so_far = joined(result.best_prefix) or "nothing"
    lines.append(f"The longest prefix that works: {so_far} ({len(result.best_prefix)}{of}).")
    if result.best_suffix is not None and result.side != "empty":
        lines.append(f"From the empty side {len(result.best_suffix)}{of} can be undone.")
    if result.why_not is not None:
        return [*lines, *(f"  {sentence}" for sentence in result.why_not.sentences)]
    lines.append(f"The last of {counted(result.iterations, 'refusal')}:" if result.blame else "Nothing was refused.")
    return [*lines, *(f"  {_when(r)}, not {r.action}: {r.reason}" for r in result.blame[-LAST_REFUSALS:])]


def _when(refusal: Rejection) -> str:
    """What was done before an attempt that was refused."""
    done = joined(refusal.after) or "nothing"
    return f"after {done}" if refusal.side == "full" else f"from the empty side with {done} undone"


def _steps(result: PlanResult) -> Iterator[str]:
    """The plan and the refusals in the order in which they came; those off the plan's path say after what.

    Where few actions are wanted these are left out: most come after the plan, of the search for a shorter one.
    """
    if result.plan is None:
        return
    motions = [f"  {motion}" if motion else "" for motion in result.motions] or [""] * len(result.plan)
    lines = [f"  {i}. {action}{motion}" for i, (action, motion) in enumerate(zip(result.plan, motions), 1)]
    printed = elsewhere = 0
    for refusal in result.blame:
        depth = len(refusal.after)
        on_path = refusal.side == "full" and result.plan[:depth] == refusal.after
        if result.fewest is not None and not on_path:
            continue  # of the search for a shorter plan
        if on_path:
            yield from lines[printed:depth]
            printed = max(printed, depth)
        here = on_path and depth == printed
        elsewhere += not here
        if here or elsewhere <= LAST_REFUSALS:
            yield f"     not {refusal.action}{'' if here else f' ({_when(refusal)})'}: {refusal.reason}"
    yield from lines[printed:]
    if elsewhere > LAST_REFUSALS:
        yield f"     and {counted(elsewhere - LAST_REFUSALS, 'more refusal')} off this plan"
