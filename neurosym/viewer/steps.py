"""The steps of a plan, in a line and as a list, and the attempts of its search, as HTML. Every name is escaped."""

from collections import Counter
from html import escape

from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import Rejection
from neurosym.viewer.exhibit import Exhibit, Search
from neurosym.viewer.panels import some

#: While a step of a longer list is under way, so many before it and after it are listed, to keep it in sight.
BEFORE, AFTER = 6, 20
#: Colour (0..255) of what is held while a step is done: its outline in the view, its name in the caption.
HELD = (170, 0, 120)
#: Refusals written out at a time; a hard search has thousands.
MOST_REFUSALS = 300
#: With more refusals than this, those that were refused most often are counted first, so many of them.
FEW, MOST_COUNTED = 30, 8
#: Colours (0..255) of what was refused, and of what the refusal is due to.
TRIED, BECAUSE = (213, 94, 0), (0, 114, 178)

_HELD = f"color:#{''.join(f'{c:02x}' for c in HELD)};font-weight:bold"


def caption(exhibit: Exhibit, t: float) -> str:
    """Where the film is at time t, in a line."""
    timeline, total = exhibit.timeline, len(exhibit.search.steps)
    now = timeline.step_at(t) if timeline else None
    name = f"<b>{escape(exhibit.problem.name)}</b>"
    if timeline is None or not total:
        text = name if exhibit.search.solved else f"{name}: no plan. The tab Plan says why, as far as it is known."
    elif now is not None:
        action, motion = timeline.staging.plan[now], timeline.staging.motions[now]
        moves = f"{_who(action, motion)} {_verb(motion)} {escape(motion.course)}" if motion.parts else escape(action)
        held = _held(motion, f"<span style='{_HELD}'>{escape(some(motion.held))}</span>")
        text = f"Step {now + 1} of {total}: {moves}{escape(_making_way(motion))}{held}"
    elif t <= 0:
        text = f"{name}: before the first of {total} steps"
    else:
        text = f"After step {int(t)} of {total}"
    return f"<div style='min-height:2.7em;padding-top:4px'>{text}</div>"


def steps(exhibit: Exhibit, now: int | None) -> str:
    """The steps, numbered from 1; number `now` (from 0) is under way and stands out; a long list is cut round it."""
    staging = exhibit.timeline.staging if exhibit.timeline else None
    total = len(exhibit.search.steps)
    first, end = (0, total) if now is None else _in_sight(now, total)
    guessed = staging.guessed if staging else frozenset()
    mixed = 0 < len(guessed) < total
    rows = []
    for i in range(first, end):
        action = exhibit.search.steps[i]
        motion = f" <span class='quiet'>{escape(in_short(action, staging.motions[i]))}</span>" if staging else ""
        star = " *" if mixed and i in guessed else ""
        style = " class='now' aria-current='step'" if i == now else ""
        rows.append(f"<li{style} data-step='{i}'>{escape(action)}{motion}{star}</li>")
    if not total:
        return _none(exhibit) or "<p>There is nothing to do.</p>"
    note = ""
    if guessed:
        which = "a step marked * moves" if mixed else "parts move"
        note = f"<p class='quiet'>The plan does not say how {which}: a free straight way was looked for here.</p>"
    above = f"<p class='quiet'>… {first} before</p>" if first else ""
    below = f"<p class='quiet'>… {total - end} more</p>" if end < total else ""
    return f"{_none(exhibit)}{note}{above}<ol start='{first + 1}'>{''.join(rows)}</ol>{below}"


def in_short(action: str, motion: StepMotion) -> str:
    """How the parts of a step move, in a few words."""
    others = [n for n in motion.parts if n != action] if action in motion.parts else []
    if not others and len(motion.parts) > 1:
        others = list(motion.parts)
    together = f", together with {some(others)}" if others else ""
    return f"{motion.course}{together}{_making_way(motion)}{_held(motion, some(motion.held))}"


def _none(exhibit: Exhibit) -> str:
    """Why there is no plan; nothing where there is one."""
    if exhibit.search.solved:
        return ""
    reasons = "".join(f"<li>{escape(sentence)}</li>" for sentence in exhibit.search.why_not)
    because = f"<p><b>Why nothing more can be done</b></p><ul>{reasons}</ul>" if reasons else ""
    if exhibit.search.refusals:
        because += "<p>The tab Search has each refused attempt; look at one to see it in the view.</p>"
    if exhibit.buildable is not None:
        because += "<p>Faint in the view is all that cannot be put in place from the empty side.</p>"
    rest = ": the longest prefix that works is shown." if exhibit.search.steps else ", and no step to show."
    return f"<p class='note'>No plan{rest}</p>{because}"


def _in_sight(now: int, total: int) -> tuple[int, int]:
    """The first step listed, and the one after the last, while step `now` is under way."""
    if total <= BEFORE + AFTER + 1:
        return 0, total
    first = min(max(now - BEFORE, 0), total - BEFORE - AFTER - 1)
    return first, first + BEFORE + AFTER + 1


def _who(action: str, motion: StepMotion) -> str:
    """The step's name; of parts that go together, all of them."""
    name = f"<b>{escape(action)}</b>"
    if len(motion.parts) == 1:
        return name
    parts = f"<b>{escape(some(motion.parts))}</b>"
    return f"{parts} together" if action in motion.parts else f"{name}: {parts} together"


def _verb(motion: StepMotion) -> str:
    return ("come" if motion.arrives else "leave") + ("s" if len(motion.parts) == 1 else "")


def _held(motion: StepMotion, names: str) -> str:
    """What is held meanwhile, by the `names` of the parts as they are to be written."""
    return f", while {names} {'is' if len(motion.held) == 1 else 'are'} held" if motion.held else ""


def _making_way(motion: StepMotion) -> str:
    return f", {some(motion.making_way)} making way" if motion.making_way else ""


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
        if refusal.side == "full" and on_path[:depth] == refusal.after:
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
    after = f"after {escape(', '.join(refusal.after)) or 'nothing'}"
    if refusal.side != "full":
        after = f"from the empty side {after} was undone"
    return (
        f"<p style='margin:2px 0 2px 14px'><span style='color:#b04a00'>✘ {number}. not <b>{escape(refusal.action)}</b>"
        f"</span> <span class='quiet'>{after}</span><br>{escape(refusal.reason)}</p>"
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
