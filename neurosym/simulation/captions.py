"""Words under pictures."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from neurosym.simulation.scene import RGB
from neurosym.support.arrays import Pixels

#: Where something is seen: x, y, radius.
Circle = tuple[float, float, float]
_PAPER, _TEXT, _FAINT = (255, 255, 255), (38, 38, 46), (214, 214, 220)


def captioned(
    picture: Pixels, text: str, *, note: str = "", colour: RGB | None = None, progress: float | None = None
) -> Pixels:
    """The picture with a line of words below it: uint8 (taller, width, 3), of an even height, as video wants it.

    Args:
        text: on the left; what does not fit is cut, with an ellipsis.
        note: on the right, fainter.
        colour: of a small square before the text, RGB in 0..1; None leaves it out.
        progress: 0..1, the length of a bar between picture and words; None leaves it out.
    """
    from PIL import Image, ImageDraw

    height, width = picture.shape[:2]
    size = max(11, round(min(height, width) / 26))
    font = _font(size)
    band = round(2.6 * size)
    canvas = Image.new("RGB", (width, (height + band + 1) // 2 * 2), _PAPER)
    canvas.paste(Image.fromarray(picture))
    draw = ImageDraw.Draw(canvas)
    if progress is not None:
        draw.rectangle([0, height, width - 1, height + 2], fill=_FAINT)
        if progress > 0:
            draw.rectangle([0, height, round(progress * (width - 1)), height + 2], fill=_TEXT)
    middle, left, right = height + 3 + (band - 3) / 2, float(size), float(width - size)
    if note:
        right -= draw.textlength(note, font=font)
        draw.text((right, middle), note, font=font, fill=(120, 120, 130), anchor="lm")
        right -= size
    if colour is not None:
        box = [left, middle - 0.4 * size, left + 0.8 * size, middle + 0.4 * size]
        draw.rectangle(box, fill=tuple(round(255 * v) for v in colour), outline=_TEXT)
        left += 1.3 * size
    words = text
    while words and draw.textlength(words, font=font) > right - left:
        words = words.removesuffix("…")[:-1].rstrip() + "…"
        if words == "…":
            break
    draw.text((left, middle), words, font=font, fill=_TEXT, anchor="lm")
    return np.asarray(canvas)


def label(picture: Pixels, seen: Mapping[str, Circle], names: Sequence[str] = ()) -> Pixels:
    """The picture with the name of every part on it, or, where names are too many, numbers and a list beside it.

    Args:
        seen: name of a part -> the circle (x, y, radius), in pixels, in which it is seen.
        names: of all parts, those that nothing is seen of included; they are in the list. None: those of `seen`.

    A name too long for its circle stands beside it, away from the middle of all, at the end of a thin line.
    """
    names = names or tuple(seen)
    if len(names) == len(seen) and (named := _written(picture, {name: name for name in seen}, seen)) is not None:
        return named
    numbers = {name: str(number) for number, name in enumerate(names, 1)}
    numbered = _written(picture, {name: numbers[name] for name in seen}, seen, always=True)
    assert numbered is not None
    hidden = [name for name in names if name not in seen]
    return _listed(numbered, [f"{numbers[n]}  {n}{'  (hidden)' if n in hidden else ''}" for n in names])


def _written(
    picture: Pixels, words: Mapping[str, str], seen: Mapping[str, Circle], *, always: bool = False
) -> Pixels | None:
    """The picture with words on circles; None: there is no room for one of them, unless each is to be there always."""
    from PIL import Image, ImageDraw

    canvas = Image.fromarray(picture)
    draw = ImageDraw.Draw(canvas)
    size = max(10, round(min(picture.shape[:2]) / (40 if always else 32)))
    font = _font(size)
    middle = np.mean([(x, y) for x, y, _ in seen.values()], axis=0) if seen else np.zeros(2)
    taken: list[tuple[float, float, float, float]] = []
    # The largest first: they have their words where one looks for them.
    for name, (x, y, radius) in sorted(seen.items(), key=lambda item: -item[1][2]):
        wide, start = draw.textlength(words[name], font=font) / 2, np.array([x, y])
        away = start - middle
        away = away / max(float(np.hypot(*away)), 1e-9) if away.any() else np.array([0.0, -1.0])
        fits = np.hypot(wide, size / 2) <= 1.5 * radius
        first = start if fits else start + away * (radius + size + wide * abs(away[0]))
        turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
        around = [np.array([np.cos(t), np.sin(t)]) for t in turns + np.arctan2(away[1], away[0])]
        # Farther and farther round the part, until there is room.
        places = [first, *(start + (radius + k * size) * u for k in range(1, 30 if always else 4) for u in around)]
        for at in places:
            box = (at[0] - wide, at[1] - 0.6 * size, at[0] + wide, at[1] + 0.6 * size)
            inside = box[0] >= 0 and box[1] >= 0 and box[2] <= picture.shape[1] and box[3] <= picture.shape[0]
            if inside and not any(box[0] < t[2] and t[0] < box[2] and box[1] < t[3] and t[1] < box[3] for t in taken):
                break
        else:
            if not always:
                return None
            at = start
        taken.append(box)
        if (at != start).any():
            draw.line([(x, y), tuple(at.tolist())], fill=_TEXT)
        style: dict[str, Any] = {"anchor": "mm", "stroke_width": 3, "stroke_fill": _PAPER}
        draw.text(tuple(at.tolist()), words[name], font=font, fill=_TEXT, **style)
    return np.asarray(canvas)


def _listed(picture: Pixels, lines: Sequence[str]) -> Pixels:
    """The picture with lines of words on its right, in as many columns as they need."""
    from PIL import Image, ImageDraw

    height, width = picture.shape[:2]
    size = max(10, round(min(height, width) / 48))
    font, rows = _font(size), max(1, int((height - 2 * size) / (1.4 * size)))
    columns = [lines[k : k + rows] for k in range(0, len(lines), rows)]
    wide = [max(int(font.getlength(line)) for line in column) + 2 * size for column in columns]
    canvas = Image.new("RGB", ((width + sum(wide) + 1) // 2 * 2, height), _PAPER)
    canvas.paste(Image.fromarray(picture))
    draw, left = ImageDraw.Draw(canvas), float(width)
    for column, own in zip(columns, wide):
        for row, line in enumerate(column):
            draw.text((left, size + 1.4 * size * row), line, font=font, fill=_TEXT)
        left += own
    return np.asarray(canvas)


@lru_cache
def _font(size: int):  # type: ignore[no-untyped-def]
    from PIL import ImageFont

    return ImageFont.load_default(size)
