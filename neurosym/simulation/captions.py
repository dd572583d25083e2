"""Words under pictures."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from neurosym.simulation.scene import RGB
from neurosym.support.arrays import Pixels

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


def label(picture: Pixels, seen: Mapping[str, tuple[float, float, float]]) -> Pixels:
    """The picture with names written on circles (x, y, radius), in pixels.

    A name too long for its circle stands beside it, away from the middle of all, at the end of a thin line; where it
    would cover another name, it is left out.
    """
    from PIL import Image, ImageDraw

    canvas = Image.fromarray(picture)
    draw = ImageDraw.Draw(canvas)
    size = max(10, round(min(picture.shape[:2]) / 32))
    font = _font(size)
    middle = np.mean([(x, y) for x, y, _ in seen.values()], axis=0) if seen else np.zeros(2)
    taken: list[tuple[float, float, float, float]] = []
    # The largest first: what is left out should be small.
    for name, (x, y, radius) in sorted(seen.items(), key=lambda item: -item[1][2]):
        wide = draw.textlength(name, font=font) / 2
        at = np.array([x, y])
        if np.hypot(wide, size / 2) > 1.5 * radius:
            away = at - middle
            away = away / max(float(np.hypot(*away)), 1e-9) if away.any() else np.array([0.0, -1.0])
            at = at + away * (radius + size + wide * abs(away[0]))
        box = (at[0] - wide, at[1] - 0.6 * size, at[0] + wide, at[1] + 0.6 * size)
        outside = box[0] < 0 or box[1] < 0 or box[2] > picture.shape[1] or box[3] > picture.shape[0]
        if outside or any(box[0] < t[2] and t[0] < box[2] and box[1] < t[3] and t[1] < box[3] for t in taken):
            continue
        taken.append(box)
        if (at != (x, y)).any():
            draw.line([(x, y), tuple(at.tolist())], fill=_TEXT)
        draw.text(tuple(at.tolist()), name, font=font, fill=_TEXT, anchor="mm", stroke_width=3, stroke_fill=_PAPER)
    return np.asarray(canvas)


@lru_cache
def _font(size: int):  # type: ignore[no-untyped-def]
    from PIL import ImageFont

    return ImageFont.load_default(size)
