"""What stands beside the 3D view, as HTML: the search, pictures, facts about a part. Every name is escaped."""

import base64
import io
import json
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from PIL import Image

from neurosym.support.arrays import Pixels
from neurosym.viewer.exhibit import Exhibit
from neurosym.viewer.facts import PartFacts
from neurosym.viewer.planning import Progress

#: Width of pictures (CSS pixels), as wide as the panel beside the view.
WIDTH = 360


def overview(exhibit: Exhibit) -> str:
    """How the search ended, its figures, and notes on what is missing."""
    search = exhibit.search
    figures = ", ".join(
        f"{value:,} {name}" if isinstance(value, int) else f"{value:.3g} {name}"
        for name, value in search.counts.items()
    )
    notes = "".join(f"<p class='note'>{escape(note)}</p>" for note in exhibit.notes)
    mark = "✔" if search.solved else "✘"
    return (
        f"<p><b>{escape(exhibit.problem.name)}</b><br>{escape(search.settings)}</p>"
        f"<p>{mark} {escape(search.sentence)}<br><span class='quiet'>{escape(figures)}</span></p>{notes}"
    )


def progress(now: Progress, *, stopping: bool) -> str:
    """How far a search is."""
    head = "Stopping after the attempt that is under way …" if stopping else f"{now.phase.capitalize()} …"
    depth = f", longest prefix {now.depth} of {now.steps}" if now.steps else ""
    figures = f"{now.attempts:,} attempts, {now.refusals:,} refused, {now.expansions:,} expansions{depth}"
    return f"<p><b>{escape(head)}</b><br><span class='quiet'>{figures}, {now.seconds:.1f} s</span></p>"


def some(names: Sequence[str]) -> str:
    """Names with commas; the many by their first and their number."""
    return ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def pictures(views: Pixels | None) -> str:
    """The observation, one picture a view."""
    if views is None or not len(views):
        return "<p>There are no reference pictures.</p>"
    alone = len(views) == 1
    width, most = int(WIDTH / (1 if alone else 2)) - 8, 100 if alone else 48
    images = "".join(
        f"<img src='{as_data(view)}' width='{width}' alt='view {i}' "
        f"style='image-rendering:pixelated;border-radius:4px;margin:2px;max-width:{most}%'>"
        for i, view in enumerate(views, 1)
    )
    return f"<div>{images}</div>"


def facts(part: PartFacts) -> str:
    """What geometry knows of a part."""
    table = "the table" if part.on_table else ""
    rows = [
        ("touches", _names(part.touches, table)),
        ("stands on", _names(part.stands_on, table)),
        ("carries", _names(part.carries)),
    ]
    free = "<b style='color:#00724f'>free</b>"
    exits = [
        (escape(e.direction), free if e.free else _names(e.blockers, "the table" if e.into_table else ""))
        for e in part.exits
    ]
    state = "fixed" if part.fixed else "in place" if part.present else "not in place"
    return (
        f"<p><b>{escape(part.name)}</b> <span class='quiet'>{state}</span></p>{_table(rows)}"
        f"<p style='margin-bottom:0'>in the way, by direction</p>{_table(exits)}"
    )


def falls(movements: Sequence[str]) -> str:
    """How parts begin to fall, in sentences."""
    more = f"<li>and {len(movements) - 6} more</li>" if len(movements) > 6 else ""
    listed = "".join(f"<li>{escape(sentence)}</li>" for sentence in movements[:6])
    return f"<p>It does not stand by itself:</p><ul>{listed}{more}</ul>"


def _names(names: Sequence[str], also: str = "") -> str:
    return escape(", ".join(filter(None, [some(names), also]))) or "<span class='quiet'>nothing</span>"


def _table(rows: Sequence[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><td class='quiet' style='padding-right:10px;vertical-align:top;white-space:nowrap'>{a}</td>"
        f"<td>{b}</td></tr>"
        for a, b in rows
    )
    return f"<table>{cells}</table>"


def options(domain: str, known: Mapping[str, Any] | None) -> str:
    """Which options a domain takes, with what they are where nobody says; None: any."""
    if known is None:
        return f"<p class='quiet'>{escape(domain)} does not list the options that it takes.</p>"
    if not known:
        return f"<p class='quiet'>{escape(domain)} takes none.</p>"
    takes = ", ".join(f"<b>{escape(name)}</b>{_default(value)}" for name, value in known.items())
    return f"<p class='quiet'>{escape(domain)} takes {takes}.</p>"


def _default(value: object) -> str:
    """What an option is where nobody says, if that says anything."""
    if value == "" or not isinstance(value, str | bool | int | float):
        return ""
    return f" ({escape(value if isinstance(value, str) else json.dumps(value))})"


def message(text: str) -> str:
    """Something the user should read: input that was refused, a fault."""
    return (
        "<div role='alert' style='border-left:4px solid #D55E00;background:#fff1e6;color:#222;padding:6px 8px'>"
        f"{escape(text)}</div>"
    )


def styled(content: str) -> str:
    """A panel's content with the few styles that it uses."""
    return f"<div class='ns' style='font-size:13px;line-height:1.35;padding:0 10px'>{_STYLE}{content}</div>"


_STYLE = (
    "<style>.ns .quiet{color:#6b6b6b}.ns .note{color:#8a4b00}.ns ol{margin:4px 0;padding-left:34px}"
    ".ns li{padding:1px 4px;border-radius:3px}.ns p{margin:4px 0}"
    ".ns ul{margin:4px 0;padding-left:18px}.ns td{padding:1px 0}"
    ".ns .now{background:#ffe9c9;color:#222;font-weight:bold}</style>"
)


def as_data(picture: Pixels) -> str:
    """A picture, uint8 (H, W, 3), as a data URI."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
