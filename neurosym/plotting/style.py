"""What all figures share: colours, the width of a column, how methods look, and how figures are saved."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
from matplotlib import figure
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.textpath import TextPath

from neurosym.support.files import replacing

#: Okabe and Ito's colours, told apart by people with any of the common colour deficiencies. One a prior, in order.
COLOURS = ("#7f7f7f", "#E69F00", "#56B4E9", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#000000")
#: Width of one column of a two-column page (inches).
COLUMN = 3.4
#: Sizes of letters (points): of titles and names of axes, and of all else.
TITLE, SMALL = 8, 7


class Figure(figure.Figure):
    """A figure that a notebook shows when it is a cell's value, whatever matplotlib was told before."""

    def _repr_png_(self) -> bytes:
        content = io.BytesIO()
        self.savefig(content, format="png", dpi=150)
        return content.getvalue()


class Look(NamedTuple):
    """How a method is drawn: never by its colour alone."""

    colour: str
    marker: str
    line: str = "-"


#: The same in all figures.
LOOKS: Mapping[str, Look] = {
    "bc": Look("#56B4E9", "v"),
    "bc+hungarian": Look("#0072B2", "^"),
    "tcn-paper": Look("#E69F00", "s"),
    "tcn-paper+hungarian": Look("#D55E00", "D"),
    "sinkhorn-paper": Look("#009E73", "P"),
    "bc-published": Look("#56B4E9", "1", ":"),
    "bc-published+hungarian": Look("#0072B2", "2", ":"),
    "tcn-published": Look("#E69F00", "<", ":"),
    "tcn-published+hungarian": Look("#D55E00", ">", ":"),
    "sinkhorn-published": Look("#009E73", "*", ":"),
    "tcn": Look("#CC79A7", "X"),
    "sinkhorn": Look("#000000", "o"),
    "memoriser": Look("0.35", "", "--"),
    "blind": Look("0.35", "", ":"),
    "random": Look("0.5", "."),
}
_OTHERS = (Look("#CC79A7", "<"), Look("#7f7f7f", ">"), Look("#0072B2", "*"), Look("#D55E00", "h"))


def look_of(method: str, position: int = 0) -> Look:
    """How a method is drawn; others than the known ones by their position."""
    return LOOKS.get(method) or _OTHERS[position % len(_OTHERS)]


def narrow(method: str) -> str:
    """A method's name, a long one in two lines."""
    return method.replace("+", "\n+") if len(method) > 16 else method


def tidy(axis: Axes, *, sides: tuple[str, ...] = ("top", "right")) -> None:
    """Small letters, and no frame where it says nothing."""
    axis.tick_params(labelsize=SMALL)
    for side in sides:
        axis.spines[side].set_visible(False)


def mark(marker: str, label: str, **look: Any) -> Line2D:
    """An entry of a legend for points."""
    return Line2D([], [], **{"ls": "", "marker": marker, "label": label, **look})


def papers_mark(label: str = "mean in the paper", *, ms: float = 4) -> Line2D:
    return mark("D", label, ms=ms, mfc="white", mec="black")


def add_legend(figure: Figure, handles: Sequence[Artist], *, columns: int = 2, **more: Any) -> None:
    """Below all panels, where it lies on no curve."""
    place = {"loc": "outside lower center", "ncols": columns, "fontsize": SMALL, "frameon": False, **more}
    figure.legend(handles=handles, **place)


def save(figure: Figure, path: str | Path, *, dpi: int = 200) -> Path:
    """Write a figure to a file, whole or not at all; its folder is made. Returns the path.

    Its ending says what it becomes, ``.png`` or ``.svg`` say; the same figure gives the same bytes.
    """
    with replacing(path) as temporary:
        if Path(path).suffix == ".svg":
            # Identifiers in an SVG are random, and its date is now, unless told otherwise.
            with matplotlib.rc_context({"svg.hashsalt": Path(path).name}):
                figure.savefig(temporary, metadata={"Date": None})
        elif Path(path).suffix == ".pdf":
            figure.savefig(temporary, metadata={"CreationDate": None})
        else:
            figure.savefig(temporary, dpi=dpi)
    return Path(path)


def save_both(figure: Figure, stem: str | Path, *, dpi: int = 200) -> tuple[Path, Path]:
    """Write ``STEM.png`` and ``STEM.svg``; returns both paths."""
    path = Path(stem)
    return save(figure, path.with_name(path.name + ".png"), dpi=dpi), save(figure, path.with_name(path.name + ".svg"))


#: Longest name; what is longer is cut.
MOST_LETTERS = 14


def shortened(name: str, most: int = MOST_LETTERS) -> str:
    """A name of at most so many letters; what is longer loses its middle, as names often differ at their ends."""
    if len(name) <= most:
        return name
    tail = (most - 1) // 2
    return name[: most - 1 - tail] + "…" + name[len(name) - tail :]


def without_common(names: Sequence[str]) -> dict[str, str]:
    """Names without what all of them share: ``remove(leg)`` among removals is ``leg``."""
    heads = {name.partition("(")[0] for name in names}
    if len(heads) == 1 and all(name.endswith(")") and "(" in name for name in names):
        return {name: name.partition("(")[2][:-1] for name in names}
    return {name: name for name in names}


def width_of(text: str, size: float) -> float:
    """How wide a text of so many points is drawn (inches)."""
    return float(TextPath((0, 0), text, size=size).get_extents().width) / 72 if text.strip() else 0.0
