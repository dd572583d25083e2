"""A camera on a plan: parts at any poses, on a ground that takes their shadows, with dark outlines. No window needed.

PyBullet's software renderer draws at twice the size with a number for each pixel's part; outlines come from where
those numbers change or the surface folds, and the picture is then made smaller, which smooths it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.simulation.client import Client
from neurosym.simulation.looks import Camera
from neurosym.simulation.scene import RGB
from neurosym.simulation.solids import quaternion

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

#: Drawn so many times larger, along each axis, than it is handed out.
OVERSAMPLING = 2
#: From where pictures are taken unless one is told: the front right, from above.
DEFAULT_CAMERA = Camera(-58, 24, field_of_view=26.0)
#: Free space around what is shown, as a share of the picture.
MARGIN = 0.06
#: Colour of outlines, and how much of it shows (0..1).
_INK, _INK_SHARE = np.array([38.0, 38.0, 46.0]), 0.75
#: Towards the light, a unit vector; how dark its shadow on the ground is (grey levels); how soft (a share of the size).
_LIGHT = np.array([-0.46, -0.50, 0.734])
_SHADE, _SOFT = 56.0, 0.008
#: Where hidden parts wait: behind the camera.
_AWAY = 1e3


class FilmSet:
    """Parts, ground, light and one camera that does not move (a context manager).

    Args:
        assembly: the parts.
        colours: part name -> RGB in 0..1.
        points: float64 (n, 3), in the world: what the picture must have room for.
        size: width and height in pixels.
        camera: from which side; how far away follows from `points`.
        ground: whether there is a ground at the assembly's table.

    Raises:
        InputError: a size below 16 pixels.
    """

    def __init__(
        self,
        assembly: Assembly,
        colours: Mapping[str, RGB],
        points: Array,
        *,
        size: tuple[int, int] = (640, 480),
        camera: Camera = DEFAULT_CAMERA,
        ground: bool = True,
    ) -> None:
        if min(size) < 16:
            raise InputError(f"Expected pictures of at least 16 x 16 pixels; got {size[0]} x {size[1]}.")
        self.size = size
        self._middle = (points.min(axis=0) + points.max(axis=0)) / 2
        self._scale = 2 / float(np.ptp(points, axis=0).max())
        self._view, self._projection, self._planes = _aimed((points - self._middle) * self._scale, camera, size)
        self._ground = (assembly.ground - self._middle[2]) * self._scale
        self._has_ground = ground and assembly.has_table
        self._triangles: dict[str, Array] = {}
        self._client = Client()
        self._p: Any = self._client.p
        try:
            self._numbers = {part.name: self._part(assembly, i, colours) for i, part in enumerate(assembly.parts)}
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the renderer; closing twice does nothing."""
        self._client.close()

    def __enter__(self) -> FilmSet:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def picture(self, shown: Collection[str], where: Mapping[str, Array] | None = None) -> Picture:
        """One picture.

        Args:
            shown: names of the parts that are to be seen.
            where: part name -> float64 (4, 4), a motion of the world from where the part rests; others rest.

        Returns:
            uint8 (height, width, 3).
        """
        moved = {} if where is None else where
        self._place(shown, moved)
        return self._shoot(shown, moved)

    def _place(self, shown: Collection[str], moved: Mapping[str, Array]) -> None:
        for name, number in self._numbers.items():
            X = moved.get(name)
            position, turn = np.zeros(3), (0.0, 0.0, 0.0, 1.0)
            if X is not None:
                # The scene's origin is the middle of the picture, not that of the world.
                position = (X[:3, :3] @ self._middle + X[:3, 3] - self._middle) * self._scale
                turn = tuple(quaternion(X[:3, :3]).tolist())
            if name not in shown:
                position = np.full(3, -_AWAY)
            at = position.tolist()
            self._p.resetBasePositionAndOrientation(number, at, turn, physicsClientId=self._client.id)

    def seen_at(
        self, shown: Collection[str], where: Mapping[str, Array] | None = None
    ) -> dict[str, tuple[float, float, float]]:
        """Where in the picture the parts that can be seen are seen, in pixels (x, y, radius) from the top left.

        It is the largest circle in what can be seen of the part.
        """
        from scipy.ndimage import distance_transform_edt

        self._place(shown, {} if where is None else where)
        owner = self._drawn()[2]
        found = {}
        for name in shown:
            mine = np.pad(owner == self._numbers[name], 1)
            if mine.any():
                depth = distance_transform_edt(mine)[1:-1, 1:-1]
                y, x = np.unravel_index(int(np.argmax(depth)), depth.shape)
                radius = float(depth[y, x] / OVERSAMPLING)
                found[name] = (float(x / OVERSAMPLING), float(y / OVERSAMPLING), radius)
        return found

    def _shoot(self, shown: Collection[str], moved: Mapping[str, Array]) -> Picture:
        from PIL import Image

        colour, distance, owner = self._drawn()
        colour[owner < 0] = 255.0
        if self._has_ground:
            dark = self._shadow(shown, moved)
            colour[owner < 0] -= (_SHADE * dark[owner < 0])[:, None]
        lines = _outlines(owner, distance)
        inked = colour + lines[:, :, None] * _INK_SHARE * (_INK - colour)
        image = Image.fromarray(np.clip(np.rint(inked), 0, 255).astype(np.uint8))
        return np.asarray(image.resize(self.size, Image.Resampling.LANCZOS))

    def _drawn(self) -> tuple[Array, Array, NDArray[np.int64]]:
        """The large picture: colours (height, width, 3), distances and numbers of parts, -1: none, (height, width)."""
        width, height = (n * OVERSAMPLING for n in self.size)
        _, _, rgba, depth, parts = self._p.getCameraImage(
            width,
            height,
            self._view.T.ravel().tolist(),
            self._projection.T.ravel().tolist(),
            lightDirection=(10 * _LIGHT).tolist(),
            lightColor=(1, 1, 1),
            lightDistance=20,
            shadow=0,
            lightAmbientCoeff=0.62,
            lightDiffuseCoeff=0.42,
            lightSpecularCoeff=0.0,
            renderer=self._p.ER_TINY_RENDERER,
            physicsClientId=self._client.id,
        )
        colour = np.array(rgba, dtype=np.float64).reshape(height, width, 4)[:, :, :3]
        distance = self._distance(np.asarray(depth, dtype=np.float64).reshape(height, width))
        return colour, distance, np.asarray(parts, dtype=np.int64).reshape(height, width)

    def _distance(self, depth: Array) -> Array:
        near, far = self._planes
        return far * near / (far - (far - near) * depth)

    def _part(self, assembly: Assembly, number: int, colours: Mapping[str, RGB]) -> int:
        p, c = self._p, self._client.id
        triangles = []
        for i in np.flatnonzero(assembly.owners == number):
            corners = (assembly.body_vertices(int(i)) - self._middle) * self._scale
            triangles.append(corners[assembly.bodies[int(i)].shape.faces])
        name = assembly.names[number]
        self._triangles[name] = np.concatenate(triangles)
        visual = self._visual(self._triangles[name], [*colours[name], 1.0])
        return int(p.createMultiBody(0, -1, visual, physicsClientId=c))

    def _visual(self, triangles: Array, rgba: list[float]) -> int:
        # Corners are not shared between triangles: each face keeps its own normal, and edges stay sharp.
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        return int(
            self._p.createVisualShape(
                self._p.GEOM_MESH,
                vertices=triangles.reshape(-1, 3).tolist(),
                indices=list(range(3 * len(triangles))),
                normals=np.repeat(normals, 3, axis=0).tolist(),
                rgbaColor=rgba,
                physicsClientId=self._client.id,
            )
        )

    def _shadow(self, shown: Collection[str], moved: Mapping[str, Array]) -> Array:
        """float64 (height, width) of the large picture, 0..1: how dark the ground is under what is shown.

        The corners of all triangles are carried along the light to the ground, drawn, and blurred a little.
        """
        from PIL import Image, ImageDraw, ImageFilter

        width, height = (n * OVERSAMPLING for n in self.size)
        canvas = Image.new("L", (width, height), 0)
        draw = ImageDraw.Draw(canvas)
        M = self._projection @ self._view
        for name in shown:
            corners = self._triangles[name].reshape(-1, 3)
            if name in moved:
                X = moved[name]
                shift = (X[:3, :3] @ self._middle + X[:3, 3] - self._middle) * self._scale
                corners = corners @ X[:3, :3].T + shift
            fallen = corners - np.outer(np.maximum(corners[:, 2] - self._ground, 0.0) / _LIGHT[2], _LIGHT)
            clip = np.c_[fallen, np.ones(len(fallen))] @ M.T
            flat = clip[:, :2] / clip[:, 3:]
            x, y = (flat[:, 0] + 1) / 2 * width, (1 - flat[:, 1]) / 2 * height
            for triangle in np.stack([x, y], axis=1).reshape(-1, 3, 2):
                draw.polygon([tuple(corner) for corner in triangle.tolist()], fill=255)
        blurred = canvas.filter(ImageFilter.GaussianBlur(_SOFT * min(width, height)))
        return np.asarray(blurred, dtype=np.float64) / 255


def _aimed(points: Array, camera: Camera, size: tuple[int, int]) -> tuple[Array, Array, tuple[float, float]]:
    """View and projection matrices, float64 (4, 4), and the near and far planes, so that all points show."""
    turn = np.array(camera.view_matrix()).reshape(4, 4).T[:3, :3]
    seen = points @ turn.T
    tall = np.tan(np.radians(camera.field_of_view) / 2) * (1 - 2 * MARGIN)
    wide = tall * size[0] / size[1]
    # Along each axis both sides are to fit: |x - shift| <= wide * (distance - depth), so the nearest pair decides.
    shift, distance = np.zeros(2), 0.0
    for axis, slope in ((0, wide), (1, tall)):
        right, left = (seen[:, axis] + slope * seen[:, 2]).max(), (-seen[:, axis] + slope * seen[:, 2]).max()
        shift[axis], distance = (right - left) / 2, max(distance, float(right + left) / (2 * slope))
    V = np.eye(4)
    V[:3, :3] = turn
    V[:3, 3] = -shift[0], -shift[1], -distance
    near, far = 0.05 * distance, 60.0
    f = 1 / np.tan(np.radians(camera.field_of_view) / 2)
    a, b = (far + near) / (near - far), 2 * far * near / (near - far)
    P = np.array([[f * size[1] / size[0], 0, 0, 0], [0, f, 0, 0], [0, 0, a, b], [0, 0, -1, 0]])
    return V, P, (near, far)


def _outlines(owner: NDArray[np.int64], distance: Array) -> Array:
    """float64 (height, width), 0..1: where one part ends and another begins, and where a surface folds."""
    lines = np.zeros(owner.shape)
    for axis in (0, 1):
        ahead, behind = np.roll(owner, -1, axis), np.roll(owner, 1, axis)
        lines[(owner != ahead) | (owner != behind)] = 1.0
        # On a plane seen in perspective 1 / distance is linear in the picture: its second difference shows folds.
        flat = 1 / distance
        fold = np.abs(np.roll(flat, -1, axis) - 2 * flat + np.roll(flat, 1, axis)) / flat
        lines = np.maximum(lines, 0.6 * np.clip((fold - 4e-4) / 8e-4, 0, 1))
    lines[[0, -1], :] = lines[:, [0, -1]] = 0.0
    return lines
