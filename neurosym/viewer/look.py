"""How the 3D view looks: its light and its camera."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import viser

Array = NDArray[np.float64]

#: The camera's field of view (radians, top to bottom), where it looks from (the front, a little from the right, from
#: above), and how much more than all that is ever seen it takes in.
FIELD_OF_VIEW, FROM, MARGIN = 0.7, np.array([0.35, -0.75, 0.56]), 1.05

#: Light: colours (0..255) of the sky and of what the ground throws back, with their strength; strength of the sun, and
#: where it stands. The viewer's film curve makes bright colours pale, so that no face may get more than about 4 in all.
SKY, SUN, SUN_FROM = ((255, 255, 255), (165, 165, 170), 2.2), 2.0, np.array([-0.35, -0.6, 1.0])


def light(scene: viser.SceneApi) -> None:
    """Light a scene so that a part's colour is that of the pictures, and its faces are told apart."""
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    sky, ground, strength = SKY
    scene.add_light_hemisphere(
        "/lights/sky", sky_color=sky, ground_color=ground, intensity=strength, position=(0.0, 0.0, 5.0)
    )
    x, y, z = (5.0 * SUN_FROM / np.linalg.norm(SUN_FROM)).tolist()
    scene.add_light_directional("/lights/sun", intensity=SUN, cast_shadow=True, position=(x, y, z))


def camera_for(low: Array, high: Array) -> tuple[Array, Array]:
    """Where a camera stands and what it looks at, float64 (3,) each: as near as it can be and still see all of a box.

    Args:
        low, high: float64 (3,): the box, in the scene; it is all seen in a square window.
    """
    middle, back = (low + high) / 2, FROM / np.linalg.norm(FROM)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back], axis=1)
    corners = (np.array(list(itertools.product(*zip(low, high)))) - middle) @ axes
    away = corners[:, 2] + np.abs(corners[:, :2]).max(axis=1) * MARGIN / np.tan(FIELD_OF_VIEW / 2)
    return middle + float(away.max()) * back, middle
