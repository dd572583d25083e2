"""One page of the results of many experiments, made from the reports and figures that their runs left behind."""

import re
from collections.abc import Sequence
from pathlib import Path

from neurosym.errors import InputError
from neurosym.support.files import replacing, write_text

#: The page lives in a repository: no figure of it is larger than this (bytes).
LARGEST = 60_000
#: Colours that a figure is reduced to, the first number with which it is small enough.
PALETTES = (256, 128, 64, 32)
#: The paper's experiments as the paper has them; others come after, by name.
ORDER = ("tower", "tower-easy", "tower-by-sequence", "unseen", "variable", "soma", "soma-published", "scrabble")

_IMAGE = re.compile(r"!\[(?P<caption>[^\]]*)\]\((?P<file>[^)/:]+\.png)\)")
_LINK = re.compile(r"(?<!!)\[(?P<text>[^\]]*)\]\((?P<file>[^)/:]+\.(?:png|svg|csv))\)")
_INTRODUCTION = (
    "Each section is the `report.md` of one run of `neurosym reproduce NAME`, with its seeds, versions and machine at "
    "the end; `neurosym results` put them together. Every sentence and number is computed from the run."
)


def write_results_page(folders: Sequence[Path], to: Path) -> Path:
    """Write the page `to`, a section a folder in the order given, and copy its figures to ``figures/`` beside it.

    `folders`: of `neurosym reproduce`; each has a report.md. `to`: the page, Markdown. Raises InputError: no folder,
    one without a report or without a figure that its report shows, or two of one name.
    """
    if not folders:
        raise InputError("Expected at least one folder of `neurosym reproduce`; got none. Run one, or name it.")
    names = [_name(folder) for folder in folders]
    if len(set(names)) < len(names):
        raise InputError(f"Expected folders of different names, as figures are named after them; got {names}.")
    sections = [_section(folder, name, to.parent / "figures") for folder, name in zip(folders, names)]
    titles = [title[1] for section in sections if (title := re.search(r"^## (.*)$", section, re.MULTILINE))]
    contents = [f"* [{title}](#{_anchor(title)})" for title in titles]
    write_text(to, "\n\n".join(["# Results", _INTRODUCTION, "\n".join(contents), *sections]) + "\n")
    return to


def finished_runs(parent: Path) -> list[Path]:
    """The folders ``reproduce-*`` in `parent` that have a report, in the paper's order."""
    ranks = {name: rank for rank, name in enumerate(ORDER)}
    folders = sorted(page.parent for page in parent.glob("reproduce-*/report.md"))
    return sorted(folders, key=lambda folder: ranks.get(_name(folder), len(ORDER)))


def _name(folder: Path) -> str:
    return folder.resolve().name.removeprefix("reproduce-")


def _section(folder: Path, name: str, figures: Path) -> str:
    """A report with its headings one level down; its figures are copied, links to what stays in the folder undone."""
    page = folder / "report.md"
    if not page.exists():
        raise InputError(f"Expected report.md in {folder}; there is none. Run `neurosym reproduce` to its end first.")
    text = page.read_text(encoding="utf-8").strip()

    def shown(image: re.Match[str]) -> str:
        copied = figures / f"{name}-{image['file']}"
        _copy_small(folder / image["file"], copied)
        return f"![{image['caption']}]({figures.name}/{copied.name})"

    text = _IMAGE.sub(shown, re.sub(r"^#", "##", text, flags=re.MULTILINE))
    return _LINK.sub(lambda link: link["text"], text)


def _copy_small(figure: Path, to: Path) -> None:
    """Copy a PNG with as many colours of `PALETTES` as keep it below `LARGEST`."""
    from PIL import Image

    if not figure.exists():
        raise InputError(f"Expected the figure {figure}, which the report beside it shows; there is none. Run again.")
    with Image.open(figure) as opened:
        picture = opened.convert("RGB")
    for colours in PALETTES:
        with replacing(to) as temporary:
            picture.quantize(colours, dither=Image.Dither.NONE).save(temporary, optimize=True)
        if to.stat().st_size <= LARGEST:
            return
    raise InputError(f"Expected a figure that fits into {LARGEST:,} bytes; {figure} does not. Draw less in it.")


def _anchor(title: str) -> str:
    """As GitHub makes it from a heading."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
