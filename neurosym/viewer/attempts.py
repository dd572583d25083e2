"""The attempts of a search as HTML: in order, and which were refused most often. Every name is escaped."""

from __future__ import annotations

from collections import Counter
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from neurosym.language.search_problem import Rejection
    from neurosym.viewer.shown import Search

#: Refusals written out at a time; a hard search has thousands.
MOST_REFUSALS = 300

#: With more refusals than this, those that were refused most often are counted first, so many of them.
FEW, MOST_COUNTED = 30, 8

#: Colours (0..255) of what was refused, and of what the refusal is due to.
REFUSED, BECAUSE = (213, 94, 0), (0, 114, 178)


def attempts(search: Search, around: int = 0) -> str:
    """Attempts in the order in which they were made: refused ones with their reasons, and the steps of the plan.

    Where there are too many, refusal number `around` (from 1) is among those written out; 0: the first.
    """
    first = max(around - 1, 0) // MOST_REFUSALS * MOST_REFUSALS
    end = min(first + MOST_REFUSALS, len(search.refusals))
    rows: list[str] = []
    on_path, done = search.steps, 0
    for number, refusal in enumerate(search.refusals[:end], 1):
        depth = len(refusal.after)
        if on_path[:depth] == refusal.after:
            kept = [_kept(i, on_path[i]) for i in range(done, depth)]
            rows.extend(kept if number > first else ())
            done = max(done, depth)
        if number > first:
            rows.append(refused(number, refusal))
    left = len(search.refusals) - end
    if first or left:
        more = f"Refusals {first + 1:,} to {end:,} of {len(search.refusals):,}; the slider reaches the others."
        rows.insert(0, f"<p class='note'>{more}</p>")
    if left > 0:
        rows.append(f"<p class='note'>… and {left:,} more refusals.</p>")
    rows.extend(_kept(i, on_path[i]) for i in range(done, len(on_path)))
    return "".join(rows) or "<p>Nothing was attempted.</p>"


def most_refused(search: Search) -> str:
    """Which actions were refused most often, and the reason that each was most often given; nothing of a few."""
    if len(search.refusals) <= FEW:
        return ""
    count = Counter(r.action for r in search.refusals)
    rows = []
    for action, times in count.most_common(MOST_COUNTED):
        ((reason, often),) = Counter(r.reason for r in search.refusals if r.action == action).most_common(1)
        others = f" <span class='quiet'>({often:,}×)</span>" if often < times else ""
        rows.append(f"<li><b>{escape(action)}</b> {times:,}×: {escape(reason)}{others}</li>")
    left = f"<p class='quiet'>and {len(count) - MOST_COUNTED} more actions</p>" if len(count) > MOST_COUNTED else ""
    return f"<p><b>Refused most often</b>, and mostly why</p><ul>{''.join(rows)}</ul>{left}<p><b>In order</b></p>"


def _kept(step: int, action: str) -> str:
    return f"<p style='margin:2px 0;color:#00724f'><b>✔ {step + 1}. {escape(action)}</b></p>"


def refused(number: int, refusal: Rejection) -> str:
    """One refused attempt, with its reason."""
    after = escape(", ".join(refusal.after)) or "nothing"
    return (
        f"<p style='margin:2px 0 2px 14px'><span style='color:#b04a00'>✘ {number}. not <b>{escape(refusal.action)}</b>"
        f"</span> <span class='quiet'>after {after}</span><br>{escape(refusal.reason)}</p>"
    )


def looked_at(number: int, refusal: Rejection) -> str:
    """The refusal that the 3D view shows, and what its colours mean."""
    legend = "in the view: <b style='color:#d55e00'>what was refused</b>"
    if refusal.because:
        legend += ", <b style='color:#0072b2'>what it is due to</b>"
    return (
        "<div style='border-left:4px solid #0072B2;background:#eef5fa;color:#222;padding:4px 8px'>"
        f"{refused(number, refusal)}<span class='quiet'>{legend}</span></div>"
    )
