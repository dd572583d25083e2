"""Changes of pictures that leave the work as it is: what a prior is tried with beyond the pictures it learned from."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from neurosym.simulation.clutter import turned_hues
from neurosym.support.arrays import Pixels

#: Pictures uint8 (..., H, W, 3), and a generator for what is drawn by chance -> the same, changed.
Change = Callable[[Pixels, np.random.Generator], Pixels]

#: Side of the thing in front, of 64 pixels.
OCCLUDER = 8
#: Pixels whose colours are all this bright are the white behind the work, noise and all.
WHITE = 215


def _brighter(factor: float, pictures: Pixels, rng: np.random.Generator) -> Pixels:
    return _pixels(pictures * factor)


def _other_hue(share: float, pictures: Pixels, rng: np.random.Generator) -> Pixels:
    return turned_hues(pictures, share)


def _blurred(pictures: Pixels, rng: np.random.Generator) -> Pixels:
    return _pixels(ndimage.gaussian_filter(pictures.astype(np.float32), 1.0, axes=(-3, -2)))


def _noisy(pictures: Pixels, rng: np.random.Generator) -> Pixels:
    return _pixels(pictures + rng.normal(0, 10, pictures.shape))


def _moved(
    down: float, right: float, zoom: float, degrees: float, pictures: Pixels, rng: np.random.Generator
) -> Pixels:
    """Moved by pixels of 64, magnified and turned about the middle; what comes in at the edge looks as the edge did."""
    size = np.array(pictures.shape[-3:-1])
    a, middle = np.radians(degrees), (size - 1) / 2
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) / zoom
    offset = middle - turn @ (middle + np.array([down, right]) * size / 64)
    flat = pictures.reshape(-1, *pictures.shape[-3:]).astype(np.float32)
    matrix = np.pad(turn, (0, 1)) + np.diag([0, 0, 1.0])
    moved = [ndimage.affine_transform(view, matrix, [*offset, 0], order=1, mode="nearest") for view in flat]
    return _pixels(np.stack(moved)).reshape(pictures.shape)


def _before_black(pictures: Pixels, rng: np.random.Generator) -> Pixels:
    return _pixels(np.where((pictures >= WHITE).all(axis=-1, keepdims=True), 0, pictures))


def _hidden(pictures: Pixels, rng: np.random.Generator) -> Pixels:
    changed: Pixels = pictures.copy().reshape(-1, *pictures.shape[-3:])
    height, width = pictures.shape[-3:-1]
    side = max(1, OCCLUDER * min(height, width) // 64)
    for view in changed:
        row, column = rng.integers(0, height - side + 1), rng.integers(0, width - side + 1)
        view[row : row + side, column : column + side] = rng.integers(0, 256, 3)
    return np.asarray(changed.reshape(pictures.shape))


def _pixels(values: ArrayLike) -> Pixels:
    return np.asarray(np.clip(np.rint(values), 0, 255).astype(np.uint8))


_SHIFTS = {"down": (5, 0), "up": (-5, 0), "right": (0, 5), "left": (0, -5)}
PERTURBATIONS: Mapping[str, Change] = MappingProxyType(
    {f"brightness x {factor}": partial(_brighter, factor) for factor in (0.5, 1.5)}
    | {f"hue {share:+.2f}": partial(_other_hue, share) for share in (-0.10, -0.05, 0.05, 0.10)}
    | {"blur, deviation 1 pixel": _blurred, "noise, deviation 10": _noisy}
    | {f"5 pixels {way}": partial(_moved, *shift, 1.0, 0.0) for way, shift in _SHIFTS.items()}
    | {f"zoom {zoom - 1:+.0%}": partial(_moved, 0, 0, zoom, 0.0) for zoom in (0.9, 1.1)}
    | {f"rotation {degrees:+d} degrees": partial(_moved, 0, 0, 1.0, degrees) for degrees in (-5, 5)}
    | {f"occluder of {OCCLUDER} pixels": _hidden, "black background": _before_black}
)


def _one_colour(pictures: Pixels, rng: np.random.Generator) -> Pixels:
    colours = rng.integers(0, 256, (len(pictures), *(1,) * (pictures.ndim - 2), 3))
    return np.broadcast_to(colours, pictures.shape).astype(np.uint8)


def _scrambled(pictures: Pixels, rng: np.random.Generator) -> Pixels:
    """Tiles of 8 x 8 of each view, in some other order."""
    n, (height, width) = 8, pictures.shape[-3:-1]
    tiles = pictures.reshape(-1, n, height // n, n, width // n, 3).swapaxes(2, 3)
    mixed = [view.reshape(n * n, *view.shape[2:])[rng.permutation(n * n)].reshape(view.shape) for view in tiles]
    return np.stack(mixed).swapaxes(2, 3).reshape(pictures.shape)


#: Pictures of something else altogether, as many and as large.
SOMETHING_ELSE: Mapping[str, Change] = MappingProxyType(
    {
        "noise": lambda pictures, rng: rng.integers(0, 256, pictures.shape, dtype=np.uint8),
        "one colour": _one_colour,
        "scrambled": _scrambled,
    }
)
