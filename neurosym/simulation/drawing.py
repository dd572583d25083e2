"""What all pictures share: flat surfaces for PyBullet's renderers, and one picture by its software renderer."""

from collections.abc import Sequence
from typing import Any

import numpy as np

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
