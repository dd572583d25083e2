"""A result as text, as the command line prints it, and as notebooks show it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from neurosym.language.search_problem import Rejection
from neurosym.support.html import table
from neurosym.support.words import counted, joined, listed

if TYPE_CHECKING:
    from neurosym.planning.result import PlanResult

#: Refusals shown at the end of a search that found nothing, or off a plan's path; `PlanResult.blame` has all.
LAST_REFUSALS = 12

#: What ended a search that did not end from its initial state.
ENDED = {"full": "", "empty": " It was decided from the empty side.", "both": " The two sides met."}


def as_text(result: PlanResult, tried: Sequence[str] = ()) -> str:
    """The plan step by step with the refusals on its way, or why there is none; then the counts.

    Args:
        tried: sentences that follow the reasons why there is no plan.
    """
    return "\n".join([*_steps(result), *summary(result, tried), figures(result)])


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


def summary(result: PlanResult, tried: Sequence[str] = ()) -> list[str]:
    """How it ended, in sentences; without a plan why, what that covers, and how far it came."""
    lines = [f"{result.status.sentence}{ENDED[result.side]}"]
    if result.plan is not None:
        if result.fewest is not None:
            lines.append(f"{counted(len(result.plan), 'step')}; {'' if result.fewest else 'not '}proved fewest.")
        return lines
    why, of = result.why_not, "" if result.n_actions is None else f" of {result.n_actions}"
    if why is not None:
        lines += [f"  {sentence}" for sentence in (*why.reasons, why.scope)]
    elif result.status.name == "UNSOLVABLE" and result.n_actions is not None:
        these = counted(result.n_actions, "action")
        lines.append(f"  This covers every order of these {these}, each done once at most.")
    lines += [f"  {sentence}" for sentence in tried]
    so_far = listed(result.best_prefix) or "nothing"
    lines.append(f"The longest prefix that works: {so_far} ({len(result.best_prefix)}{of}).")
    if result.best_suffix is not None and result.side != "empty":
        lines.append(f"From the empty side {len(result.best_suffix)}{of} can be undone.")
    if why is None:
        refusals = f"The last of {counted(result.iterations, 'refusal')}:"
        lines.append(refusals if result.blame else "Nothing was refused.")
        before: Rejection | None = None
        for refusal in result.blame[-LAST_REFUSALS:]:
            lines.append(f"  {_when(refusal, before)}not {refusal.action}: {refusal.reason}")
            before = refusal
    return lines


def _when(refusal: Rejection, before: Rejection | None) -> str:
    """What was done before an attempt that was refused, by what changed since another one."""
    done, full = refusal.after, refusal.side == "full"
    if before is None or before.side != refusal.side:
        start = "after" if full else "from the empty side after"
        if len(done) > 1:
            return f"{start} {counted(len(done), 'step')} to {done[-1]}, "
        return f"{start} {joined(done) or 'nothing'}, "
    pairs = zip(before.after, done, strict=False)
    same = next((i for i, (a, b) in enumerate(pairs) if a != b), min(len(done), len(before.after)))
    back = [f"{counted(len(before.after) - same, 'step')} back"] if same < len(before.after) else []
    then = [f"then {listed(done[same:])}"] if done[same:] else []
    return "".join(f"{change}, " for change in (*back, *then))


def _steps(result: PlanResult) -> Iterator[str]:
    """The plan and the refusals in the order in which they came; those off the plan's path say what is different.

    Where few actions are wanted these are left out: most come after the plan, of the search for a shorter one.
    """
    if result.plan is None:
        return
    motions = [f"  {motion}" if motion else "" for motion in result.motions] or [""] * len(result.plan)
    lines = [f"  {i}. {action}{motion}" for i, (action, motion) in enumerate(zip(result.plan, motions), 1)]
    printed = elsewhere = 0
    before: Rejection | None = None
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
            changed = "" if here else _when(refusal, before).removesuffix(", ")
            yield f"     not {refusal.action}{f' ({changed})' if changed else ''}: {refusal.reason}"
            before = refusal
    yield from lines[printed:]
    if elsewhere > LAST_REFUSALS:
        yield f"     and {counted(elsewhere - LAST_REFUSALS, 'more refusal')} off this plan"
