"""What all figures share: colours, the width of a column, and how they are saved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from neurosym.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Okabe and Ito's colours, told apart by people with any of the common colour deficiencies. One a prior, in order.
COLOURS = ("#7f7f7f", "#E69F00", "#56B4E9", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#000000")

#: Width of one column of a two-column page (inches).
COLUMN = 3.4


def save(figure: Figure, path: str | Path, *, dpi: int = 200) -> Path:
    """Write a figure to a file, whole or not at all; its folder is made. Returns the path."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=dpi)
    return Path(path)
