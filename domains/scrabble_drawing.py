"""Pictures of words: wooden tiles with letter and value, in a row, left to right; one view of 32 x 192 pixels.

Every letter is drawn once, large, on a few cuts of wood; a picture then only bends those tiles into their places
(turn, shift, and one camera for the whole row), at twice its size, and halves it.

``easy``  tiles on a green table, turned by up to 2 degrees and shifted by up to half a pixel, seen a little from above
          or below; the light hardly changes.
``hard``  tiles turned by up to 10 degrees, shifted by up to 2 pixels and of other sizes, the row seen from the side
          too, on tables of any colour; light from dim to bright, tinted, falling off to one side; noise and blur.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter, ImageFont

from domains.scrabble_tiles import VALUES
from neurosym.errors import UnknownNameError
from neurosym.support.arrays import Array, Pixels

HEIGHT, WIDTH = 32, 192
#: Pictures are drawn so many times larger, then halved: edges are smooth.
_FINE = 2
#: Side of a tile and of the square around it, with room for its shadow, in pixels of the large drawing.
_TILE, _SQUARE = 54, 62
#: Cuts of wood.
_CUTS = 12
#: Distance between slots, in pixels of the picture.
_PITCH = 31.0


@dataclass(frozen=True)
class Style:
    """How pictures vary. Each number bounds a draw on either side; lengths in pixels of the picture.

    Attributes:
        turn: of each tile (degrees).
        shift: of each tile, both ways; the row as a whole by as much again.
        size: of each tile (share).
        pitch: how far the camera is above or below the row (perspective, share of the height).
        yaw: how far it is to one side (share of the width).
        light: brightness (share), and half of it falling off along the row.
        tint: of each colour channel (share).
        table: how far the table's colour strays from green (0 to 1).
        noise: standard deviation, at most (levels of 255).
        blur: of every other picture, at most (pixels).
    """

    name: str
    turn: float
    shift: float
    size: float
    pitch: float
    yaw: float
    light: float
    tint: float = 0.0
    table: float = 0.0
    noise: float = 0.0
    blur: float = 0.0


EASY = Style("easy", turn=2, shift=0.5, size=0.01, pitch=0.04, yaw=0.01, light=0.04, noise=2)
HARD = Style(
    "hard", turn=10, shift=2, size=0.06, pitch=0.15, yaw=0.06, light=0.35, tint=0.12, table=1, noise=14, blur=0.6
)

#: The two styles, by their names and by those that all domains share.
STYLES = {"easy": EASY, "hard": HARD, "clean": EASY, "varied": HARD}


def style_named(style: str) -> Style:
    """A style by its name."""
    if style not in STYLES:
        raise UnknownNameError("picture style", style, STYLES)
    return STYLES[style]


def draw_word(word: str, style: Style, rng: np.random.Generator) -> Pixels:
    """One picture, uint8 (1, 32, 192, 3), of a word of at most 6 letters."""
    n = len(word)
    canvas = Image.new("RGBA", (WIDTH * _FINE, HEIGHT * _FINE), _table(style, rng))
    around = rng.uniform(-style.shift, style.shift, (n + 1, 2))
    centres = np.stack([WIDTH / 2 + _PITCH * (np.arange(n) - 2.5), np.full(n, HEIGHT / 2)], axis=1)
    # Words begin at the left, at the first slot, however many letters they have.
    bends = _bends(centres + around[:n] + around[n], style, rng)
    tiles = [_tile(letter, cut) for letter, cut in zip(word, rng.integers(_CUTS, size=n).tolist())]
    _lay(canvas, tiles, bends)
    small = canvas.convert("RGB").reduce(_FINE)
    if style.blur and rng.random() < 0.5:
        small = small.filter(ImageFilter.GaussianBlur(style.blur * rng.random()))
    return _lit(np.asarray(small, dtype=np.float32), style, rng)[None]


def _table(style: Style, rng: np.random.Generator) -> tuple[int, int, int, int]:
    green = np.array([38, 92, 66])
    r, g, b = (green + rng.random() * style.table * (rng.uniform(20, 235, 3) - green)).astype(int)
    return int(r), int(g), int(b), 255


def _bends(centres: Array, style: Style, rng: np.random.Generator) -> Array:
    """float64 (n, 3, 3): from the square around each tile to the large drawing, as homographies."""
    n = len(centres)
    angle = np.radians(rng.uniform(-style.turn, style.turn, n))
    scale = (1 + rng.uniform(-style.size, style.size, n)) / _FINE
    # From the tile's pixels about its centre to the picture's about the picture's centre.
    place = np.zeros((n, 3, 3))
    place[:, 0, 0] = place[:, 1, 1] = scale * np.cos(angle)
    place[:, 1, 0] = scale * np.sin(angle)
    place[:, 0, 1] = -place[:, 1, 0]
    place[:, :2, 2] = centres - (WIDTH / 2, HEIGHT / 2)
    place[:, 2, 2] = 1
    # Seen from above, what is higher in the picture is farther; seen from the side, what is to the other side.
    camera = np.eye(3)
    camera[2, :2] = rng.uniform(-style.yaw, style.yaw) / WIDTH * 2, rng.uniform(-style.pitch, style.pitch) / HEIGHT * 2
    outer = np.array([[_FINE, 0, WIDTH * _FINE / 2], [0, _FINE, HEIGHT * _FINE / 2], [0, 0, 1.0]])
    centred = np.array([[1, 0, -_SQUARE / 2], [0, 1, -_SQUARE / 2], [0, 0, 1.0]])
    bends: Array = outer @ camera @ place @ centred
    return bends


def _lay(canvas: Image.Image, tiles: Sequence[Image.Image], bends: Array) -> None:
    """Put tiles on the canvas, each bent by its homography."""
    corners = bends @ (np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]]) * (_SQUARE, _SQUARE, 1)).T
    seen = corners[:, :2] / corners[:, 2:]
    limits = np.array([canvas.width, canvas.height])
    starts = np.clip(np.floor(seen.min(axis=2)), 0, limits).astype(int)
    sizes = np.clip(np.ceil(seen.max(axis=2)), 0, limits).astype(int) - starts
    # Pillow asks, for each pixel of the piece that it makes, where it comes from.
    back = np.linalg.inv(bends)
    back[:, :, 2] += np.einsum("nij,nj->ni", back[:, :, :2], starts)
    back /= back[:, 2:, 2:]
    rows = back.reshape(-1, 9)[:, :8].tolist()
    for tile, (left, top), (width, height), row in zip(tiles, starts.tolist(), sizes.tolist(), rows):
        if width > 0 and height > 0:
            bent = tile.transform((width, height), Image.Transform.PERSPECTIVE, row, Image.Resampling.BILINEAR)
            canvas.alpha_composite(bent.convert("RGBA"), (left, top))


def _lit(picture: NDArray[np.float32], style: Style, rng: np.random.Generator) -> Pixels:
    """Brightness, its fall along the row, tint and noise; uint8 (32, 192, 3)."""
    bright, fall = rng.uniform(-style.light, style.light, 2) * (1, 0.5)
    along = (1 + bright + fall * np.linspace(-1, 1, WIDTH)).astype(np.float32)
    tint = (1 + rng.uniform(-style.tint, style.tint, 3)).astype(np.float32)
    picture = picture * (along[:, None] * tint)
    picture += rng.standard_normal(picture.shape, dtype=np.float32) * np.float32(style.noise * rng.random())
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


@functools.cache
def _tile(letter: str, cut: int) -> Image.Image:
    """A tile as it lies straight, with its shadow: 62 x 62, colours times alpha, as `transform` mixes them."""
    side = (_SQUARE - _TILE) // 2
    box = (side, side, side + _TILE - 1, side + _TILE - 1)
    shadow = Image.new("L", (_SQUARE, _SQUARE))
    ImageDraw.Draw(shadow).rounded_rectangle((box[0] + 2, box[1] + 2, box[2] + 3, box[3] + 3), 5, fill=150)
    tile = Image.new("RGBA", (_SQUARE, _SQUARE), (10, 8, 5, 0))
    tile.putalpha(shadow.filter(ImageFilter.GaussianBlur(1.6)))

    face = _face(letter, cut)
    shape = Image.new("L", (_TILE, _TILE))
    ImageDraw.Draw(shape).rounded_rectangle((0, 0, _TILE - 1, _TILE - 1), 5, fill=255)
    face.putalpha(shape)
    tile.alpha_composite(face, box[:2])
    return tile.convert("RGBa")


def tile_face(letter: str) -> Pixels:
    """What the top of a tile looks like, uint8 (54, 54, 3)."""
    face: Pixels = np.asarray(_face(letter, 0).convert("RGB"))
    return face


def _face(letter: str, cut: int) -> Image.Image:
    """The top of a tile, 54 x 54: wood, letter and points."""
    face = Image.fromarray(_wood(np.random.default_rng([ord(letter), cut]))).convert("RGBA")
    draw = ImageDraw.Draw(face)
    draw.rounded_rectangle((0, 0, _TILE - 1, _TILE - 1), 5, outline=(118, 84, 48), width=1)
    draw.line([(4, 1), (_TILE - 5, 1)], fill=(250, 232, 196))
    draw.line([(1, 4), (1, _TILE - 5)], fill=(250, 232, 196))
    ink = (34, 24, 18)
    middle = (_TILE / 2 - 2, _TILE / 2 - 2)
    draw.text(middle, letter.upper(), fill=ink, font=_font(38), anchor="mm", stroke_width=1, stroke_fill=ink)
    draw.text((_TILE - 5, _TILE - 4), str(VALUES[letter]), fill=ink, font=_font(14), anchor="rs")
    return face


def _wood(rng: np.random.Generator) -> Pixels:
    """uint8 (54, 54, 3): grain runs across, in waves that are stretched along it."""
    y, x = np.mgrid[0:_TILE, 0:_TILE] / _TILE
    along = y + 0.06 * np.sin(2 * np.pi * (x * rng.uniform(0.3, 0.8) + rng.random()))
    grain = np.zeros_like(x)
    for waves, strength in ((3, 8.0), (7, 6.0), (15, 4.0)):
        grain += strength * np.sin(2 * np.pi * (waves * rng.uniform(0.7, 1.3) * along + rng.random()))
    grain += np.repeat(rng.normal(0, 3, (_TILE, 1)), _TILE, axis=1)
    base = np.array([222, 184, 128]) + rng.uniform(-14, 14) * np.array([1, 1, 0.8])
    wood: Pixels = np.clip(base + grain[..., None] * np.array([1, 0.9, 0.7]), 0, 255).astype(np.uint8)
    return wood


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)
