"""What all pictures share: flat surfaces and one picture by PyBullet's software renderer; outlines and soft shadows."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.simulation.client import Client
from neurosym.support.arrays import Array, Pixels

#: The colour of light, and how much of it shines everywhere, on what faces it, and back from what is polished.
WHITE = (1, 1, 1)


def flat_shaded(triangles: Array) -> dict[str, Any]:
    """The surface of triangles (n, 3, 3) as `createVisualShape` takes it.

    Corners are not shared between triangles: each face keeps its own normal, and edges stay sharp.
    """
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return {
        "vertices": triangles.reshape(-1, 3).tolist(),
        "indices": list(range(3 * len(triangles))),
        "normals": np.repeat(normals, 3, axis=0).tolist(),
    }


def drawn(
    client: Client,
    size: tuple[int, int],
    view: list[float],
    projection: list[float],
    *,
    light: Sequence[float],
    distance: float,
    shades: tuple[float, float, float],
    **options: Any,
) -> tuple[Pixels, Any, Any]:
    """One picture: colours, uint8 (height, width, 3), and PyBullet's depths and numbers of bodies.

    Args:
        size: width and height in pixels.
        view, projection: 16 numbers each, columns first.
        light: where it comes from; `distance`: how far away it is.
        shades: how much light shines everywhere, on what faces it, and back from what is polished.
    """
    p, (ambient, diffuse, specular) = client.p, shades
    _, _, rgba, depth, owners = p.getCameraImage(
        *size,
        view,
        projection,
        lightDirection=light,
        lightColor=WHITE,
        lightDistance=distance,
        lightAmbientCoeff=ambient,
        lightDiffuseCoeff=diffuse,
        lightSpecularCoeff=specular,
        renderer=p.ER_TINY_RENDERER,
        **options,
    )
    # A PyBullet built without numpy hands out a flat tuple.
    return np.asarray(rgba, dtype=np.uint8).reshape(size[1], size[0], 4)[:, :, :3], depth, owners


Single = NDArray[np.float32]
#: Colour of outlines, and how much of it shows (0..1).
_INK, _INK_SHARE = np.array([38, 38, 46], dtype=np.float32), 0.75
#: Colour of the line around parts that are set off, and how wide it is, as a share of the picture's smaller side.
_SET_OFF, _SET_OFF_WIDTH = np.array([200, 0, 110], dtype=np.uint8), 0.006
#: Towards the light, a unit vector; how dark its shadow on the ground is (grey levels); how soft (a share of the size).
LIGHT = np.array([-0.46, -0.50, 0.734])
_SHADE, _SOFT = 56.0, 0.008


def ink(colour: Pixels, owner: NDArray[np.int32], distance: Single) -> None:
    """Draw dark lines into a picture: where one part ends and another begins, and where a surface folds.

    `colour`: uint8 (height, width, 3), changed. `owner`: int32 (height, width), the number of the part that is seen,
    -1: none. `distance`: float32 (height, width), from the camera's plane.
    """
    lines = _outlines(owner, distance)
    where = lines > 0
    share = (_INK_SHARE * lines[where])[:, None]
    below = colour[where].astype(np.float32)
    colour[where] = np.rint(below + share * (_INK - below)).astype(np.uint8)


def set_off(colour: Pixels, owner: NDArray[np.int32], parts: Iterable[int]) -> None:
    """Draw a thick line of a colour of its own around what is seen of some parts, in a picture: see `ink`."""
    from scipy.ndimage import binary_dilation, binary_erosion

    wide = max(1, round(_SET_OFF_WIDTH * min(owner.shape)))
    for part in parts:
        mine = owner == part
        if mine.any():
            rim = binary_dilation(mine, iterations=wide) & ~binary_erosion(mine, iterations=wide)
            colour[rim] = _SET_OFF


def cast(shadow_of: Iterable[Array], view: Array, ground: float, size: tuple[int, int]) -> Pixels:
    """How bright a white ground is under what stands on it: uint8 (height, width), 255 out of the shadow.

    The corners of all triangles are carried along the light to the ground, drawn, and blurred a little.

    `shadow_of`: float64 (n, 3, 3) each, triangles in the scene. `view`: float64 (4, 4), from the scene to the camera's
    clip space. `ground`: its height in the scene. `size`: width and height in pixels.
    """
    from PIL import Image, ImageDraw, ImageFilter

    width, height = size
    canvas = Image.new("L", size, 0)
    draw = ImageDraw.Draw(canvas)
    for triangles in shadow_of:
        corners = triangles.reshape(-1, 3)
        fallen = corners - np.outer(np.maximum(corners[:, 2] - ground, 0.0) / LIGHT[2], LIGHT)
        clip = np.c_[fallen, np.ones(len(fallen))] @ view.T
        flat = clip[:, :2] / clip[:, 3:]
        x, y = (flat[:, 0] + 1) / 2 * width, (1 - flat[:, 1]) / 2 * height
        for triangle in np.stack([x, y], axis=1).reshape(-1, 6).tolist():
            draw.polygon(triangle, fill=255)
    blurred = canvas.filter(ImageFilter.GaussianBlur(_SOFT * min(size)))
    bright = np.rint(255 - _SHADE * np.arange(256) / 255).astype(np.uint8)
    return np.asarray(bright[np.asarray(blurred)])


def _outlines(owner: NDArray[np.int32], distance: Single) -> Single:
    """float32 (height, width), 0..1."""
    lines = np.zeros(owner.shape, dtype=np.float32)
    # On a plane seen in perspective 1 / distance is linear in the picture: its second difference shows folds.
    flat = 1 / distance
    for whole, near, part in ((lines, flat, owner), (lines.T, flat.T, owner.T)):
        inner = whole[1:-1]
        fold = np.abs(near[2:] - 2 * near[1:-1] + near[:-2]) / near[1:-1]
        np.maximum(inner, 0.6 * np.clip((fold - 4e-4) / 8e-4, 0, 1), out=inner)
        inner[(part[1:-1] != part[2:]) | (part[1:-1] != part[:-2])] = 1.0
    lines[[0, -1], :] = lines[:, [0, -1]] = 0.0
    return lines
