"""Lines of results.csv, the same for all experiments."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from neurosym.support.files import write_text


@dataclass(frozen=True)
class Record:
    """One number: a line of results.csv."""

    experiment: str
    pictures: str
    method: str
    n: int
    seed: int
    metric: str
    value: float


def write_records(records: Sequence[Record], path: Path) -> None:
    """Write results.csv, a line a number, whole or not at all."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(Record.__dataclass_fields__), lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(r) for r in records)
    write_text(path, text.getvalue())
