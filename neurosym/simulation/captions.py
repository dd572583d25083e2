"""Words under pictures."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from neurosym.simulation.scene import RGB

Picture = NDArray[np.uint8]

_PAPER, _TEXT, _FAINT = (255, 255, 255), (38, 38, 46), (214, 214, 220)


def captioned(
    picture: Picture, text: str, *, note: str = "", colour: RGB | None = None, progress: float | None = None
) -> Picture:
    """The picture with a line of words below it.

    Args:
        picture: uint8 (height, width, 3).
        text: on the left; what does not fit is cut, with an ellipsis.
        note: on the right, fainter.
        colour: of a small square before the text, RGB in 0..1; None leaves it out.
        progress: 0..1, the length of a bar between picture and words; None leaves it out.

    Returns:
        uint8 (taller, width, 3); heights are even, as video wants them.
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


def label(picture: Picture, words: dict[str, tuple[float, float]]) -> Picture:
    """The picture with names written at points (x, y), in pixels, on white."""
    from PIL import Image, ImageDraw

    canvas = Image.fromarray(picture)
    draw = ImageDraw.Draw(canvas)
    font = _font(max(10, round(min(picture.shape[:2]) / 32)))
    for name, (x, y) in words.items():
        draw.text((x, y), name, font=font, fill=_TEXT, anchor="mm", stroke_width=3, stroke_fill=_PAPER)
    return np.asarray(canvas)


@lru_cache
def _font(size: int):  # type: ignore[no-untyped-def]
    from PIL import ImageFont

    return ImageFont.load_default(size)
