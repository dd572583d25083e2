"""What an answer about an assembly covers, in a sentence, and the options that would widen it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from neurosym.language import Problem
from neurosym.language.explanation import WhyNot, Wider
from neurosym.support.words import LISTED, in_words, joined

if TYPE_CHECKING:
    from domains.assembly import Setting


def covering(problem: Problem, setting: Setting, why: WhyNot | None) -> WhyNot | None:
    """The same answer, with its scope and what would widen it."""
    if why is None:
        return None
    return replace(why, scope=_scope(problem, setting, why), wider=_wider(problem, setting, why))


def _scope(problem: Problem, setting: Setting, why: WhyNot) -> str:
    exact = problem.geometry is not None and problem.geometry.cells is not None
    what = "single parts and groups of them" if setting.groups else "single parts"
    names = [in_words(d) for d in setting.directions] if not isinstance(setting.directions, str) else []
    along = joined(names) if len(names) <= LISTED else f"{len(names)} directions"
    how = f"moved in straight lines ({along}) without turning"
    if setting.paths == "any":
        how = "moved along paths without turning" if exact else f"moved in straight lines ({along}) or along paths"
    held = "nothing" if not setting.held else f"{setting.held} part{'' if setting.held == 1 else 's'}"
    gravity = f"under gravity with {held} held" if setting.gravity else "without gravity"
    if why.relaxed and why.stands:
        gravity = "with gravity or without, whatever is held"
    order = ", in the order that was asked for" if problem.before and not why.relaxed else ""
    return f"This covers {what}, each taken out once{order}, {how}, {gravity}."


def _wider(problem: Problem, setting: Setting, why: WhyNot) -> tuple[Wider, ...]:
    offered = []
    if setting.gravity and why.falls:
        more = setting.held + 1
        offered += [Wider("held", more, f"--held {more}"), Wider("gravity", False, "--no-gravity")]
    if not setting.groups and (why.blocked or (why.stands and not why.waiting)):
        offered.append(Wider("groups", True, "--groups"))
    if setting.paths == "straight" and why.blocked:
        offered.append(Wider("paths", "any", "--paths any"))
    if problem.details.get("directions") != "contacts" and why.blocked:
        offered.append(Wider("directions", "contacts", "--directions contacts"))
    return tuple(offered)
