"""What was found about a part while it was loaded: harmless findings are kept, faults are raised together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from neurosym.errors import AssemblyError

#: Characters of faults in one message; the error's `notes` has them all.
SHOWN = 700


@dataclass(frozen=True)
class Note:
    """One finding.

    Attributes:
        part: its name; empty when it is about the file as a whole.
        kind: one word: "open", "inverted", "winding", "self-intersecting", "degenerate", "nan", "empty", "flat",
            "far", "overlap", "floating", "name", "units", "axes", "t-junction", "skipped".
        measure: how much of it: edges, faces, a length, a volume; 0 where nothing is measured.
        sentence, remedy: what was seen, and done about it if anything was; what to do, if anything need be done.
        other: name of the second part, for findings about a pair.
    """

    part: str
    kind: str
    measure: float
    sentence: str
    remedy: str = ""
    other: str = ""

    def __str__(self) -> str:
        return f"{self.sentence} {self.remedy}".rstrip()


class FaultyPartsError(AssemblyError):
    """Parts that cannot be used. ``notes``: every fault found, part by part."""

    def __init__(self, source: str, faults: Iterable[Note], hint: str = "") -> None:
        self.notes = tuple(faults)
        lines: list[str] = []
        for fault in self.notes:
            if lines and sum(map(len, lines)) + len(str(fault)) > SHOWN:
                lines.append(f"  and {len(self.notes) - len(lines)} more.")
                break
            lines.append(f"  {fault}")
        lines += [hint] if hint else []
        parts = len({name for fault in self.notes for name in (fault.part, fault.other) if name})
        head = f"Expected sound parts in {source}; got {len(self.notes)} fault{'s' if len(self.notes) != 1 else ''}"
        super().__init__(f"{head} in {parts} part{'s' if parts != 1 else ''}:\n" + "\n".join(lines))
