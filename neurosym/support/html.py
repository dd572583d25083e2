"""Tables as notebooks show them: all text escaped, long tables cut short."""

from collections.abc import Iterable, Sequence
from html import escape

#: Rows, or columns, of a table that a notebook shows; the data has them all.
SHOWN = 40


def table(head: Sequence[str], rows: Iterable[Sequence[object]], *, title: str = "", after: str = "") -> str:
    """A table under a title, with a sentence below it; a cell that is a pair is a text and its style."""
    rows = list(rows)
    lines = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows[:SHOWN])
    names = "".join(f"<th>{escape(name)}</th>" for name in head)
    more = f" {len(rows) - SHOWN} more rows are not shown." if len(rows) > SHOWN else ""
    parts = [f"<b>{escape(title)}</b>" if title else "", f"<table><tr>{names}</tr>{lines}</table>" if rows else ""]
    below = escape(f"{after}{more}".strip()).replace("\n", "<br>")
    return f"<div>{''.join(parts)}{f'<div>{below}</div>' if below else ''}</div>"


def _cell(content: object) -> str:
    if isinstance(content, tuple):
        text, style = content
        return f'<td style="{escape(str(style))}">{escape(str(text))}</td>'
    return f"<td>{escape(str(content))}</td>"
