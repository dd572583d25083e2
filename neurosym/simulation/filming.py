"""A camera on a plan: parts at any poses, on a ground that takes their shadows, with dark outlines. No window needed.

PyBullet's software renderer draws at twice the size with a number for each pixel's part; outlines come from where
those numbers change or the surface folds (see `neurosym.simulation.drawing`), and the picture is then made smaller,
which smooths it.
"""

import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.simulation.client import Client, Closeable
from neurosym.simulation.drawing import LIGHT, Single, cast, drawn, flat_shaded, ink, set_off
from neurosym.simulation.looks import Camera, aimed
from neurosym.simulation.scene import RGB
from neurosym.simulation.solids import quaternion
from neurosym.support.arrays import Array, Pixels

#: Drawn so many times larger, along each axis, than it is handed out.
OVERSAMPLING = 2
#: From where pictures are taken unless one is told: the front right, from above.
DEFAULT_CAMERA = Camera(-58, 24, field_of_view=26.0)
#: The same where parts bear pictures on their tops, which are to be read.
TOPS_CAMERA = Camera(-78, 50, field_of_view=26.0)
#: A picture on a part's top is drawn so many times larger, smoothly: the renderer takes the nearest pixel.
_FINER = 8
#: Where hidden parts wait: beyond what the camera sees.
_AWAY = 1e3


class FilmSet(Closeable):
    """Parts, ground, light and one camera that does not move (a context manager).

    Args:
        assembly: the parts.
        colours: part name -> RGB in 0..1.
        points: float64 (n, 3), in the world: what the picture must have room for.
        size: width and height in pixels.
        camera: from which side; how far away follows from `points`.
        ground: whether there is a ground at the assembly's table.
        tops: part name -> uint8 (H, W, 3), pictures that lie on parts' tops, their upper edges towards +y.

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
        tops: Mapping[str, Pixels] | None = None,
    ) -> None:
        if min(size) < 16:
            raise InputError(f"Expected pictures of at least 16 x 16 pixels; got {size[0]} x {size[1]}.")
        self.size = size
        self._middle = (points.min(axis=0) + points.max(axis=0)) / 2
        self._scale = 2 / float(np.ptp(points, axis=0).max())
        self._view, self._projection, self._planes = aimed((points - self._middle) * self._scale, camera, size)
        self._ground = (assembly.ground - self._middle[2]) * self._scale
        self._has_ground = ground and assembly.has_table
        self._triangles: dict[str, Array] = {}
        self._client = Client()
        self._p: Any = self._client.p
        try:
            self._numbers = {part.name: self._part(assembly, i, colours) for i, part in enumerate(assembly.parts)}
            self._tops = {name: self._top(name, picture) for name, picture in (tops or {}).items()}
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the renderer; closing twice does nothing."""
        self._client.close()

    def picture(
        self, shown: Collection[str], where: Mapping[str, Array] | None = None, *, marked: Collection[str] = ()
    ) -> Pixels:
        """One picture.

        `shown`: names of the parts that are to be seen. `where`: part name -> float64 (4, 4), a motion of the world
        from where the part rests; others rest. `marked`: names of parts that are set off by a thick line around them.
        Returns uint8 (height, width, 3).
        """
        moved = {} if where is None else where
        self._place(shown, moved)
        return self._shoot(shown, moved, marked)

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
            for body in (number, *([self._tops[name]] if name in self._tops else [])):
                self._p.resetBasePositionAndOrientation(body, at, turn)

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

    def _shoot(self, shown: Collection[str], moved: Mapping[str, Array], marked: Collection[str]) -> Pixels:
        from PIL import Image

        colour, distance, owner = self._drawn()
        nobody = owner < 0
        colour[nobody] = 255
        if self._has_ground:
            bright = cast(
                (self._moved(name, moved) for name in shown), self._projection @ self._view, self._ground, self.size
            )
            # Soft as they are, shadows need no finer drawing.
            large = np.repeat(np.repeat(bright, OVERSAMPLING, axis=0), OVERSAMPLING, axis=1)
            colour[nobody] = large[nobody][:, None]
        ink(colour, owner, distance)
        set_off(colour, owner, [self._numbers[name] for name in marked])
        return np.asarray(Image.fromarray(colour).reduce(OVERSAMPLING))

    def _moved(self, name: str, moved: Mapping[str, Array]) -> Array:
        """float64 (n, 3, 3): a part's triangles in the scene."""
        if name not in moved:
            return self._triangles[name]
        X = moved[name]
        shift = (X[:3, :3] @ self._middle + X[:3, 3] - self._middle) * self._scale
        return np.asarray(self._triangles[name] @ X[:3, :3].T + shift)

    def _drawn(self) -> tuple[Pixels, Single, NDArray[np.int32]]:
        """The large picture: colours (height, width, 3), distances and numbers of parts, -1: none, (height, width)."""
        width, height = (n * OVERSAMPLING for n in self.size)
        colour, depth, parts = drawn(
            self._client,
            (width, height),
            self._view.T.ravel().tolist(),
            self._projection.T.ravel().tolist(),
            light=(10 * LIGHT).tolist(),
            distance=20,
            shades=(0.62, 0.42, 0.0),
            shadow=0,
        )
        colour = colour.copy()
        near, far = self._planes
        distance = far * near / (far - (far - near) * np.asarray(depth, dtype=np.float32).reshape(height, width))
        owner = np.array(parts, dtype=np.int32).reshape(height, width)
        for name, top in self._tops.items():
            owner[owner == top] = self._numbers[name]
        return colour, distance, owner

    def _part(self, assembly: Assembly, number: int, colours: Mapping[str, RGB]) -> int:
        p = self._p
        triangles = []
        for i in np.flatnonzero(assembly.owners == number):
            corners = (assembly.bodies.vertices(int(i)) - self._middle) * self._scale
            triangles.append(corners[assembly.bodies[int(i)].shape.faces])
        name = assembly.names[number]
        self._triangles[name] = np.concatenate(triangles)
        visual = self._visual(self._triangles[name], [*colours[name], 1.0])
        return int(p.createMultiBody(0, -1, visual))

    def _top(self, name: str, picture: Pixels) -> int:
        """A sheet that lies on a part's bounds, with a picture on it."""
        from PIL import Image

        corners = self._triangles[name].reshape(-1, 3)
        (x, y, z), (right, back, up) = corners.min(axis=0), corners.max(axis=0)
        z = up + 1e-3 * (up - z)
        sheet = np.array([(x, y, z), (right, y, z), (right, back, z), (x, back, z)])[[0, 1, 2, 0, 2, 3]]
        uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])[[0, 1, 2, 0, 2, 3]]
        visual = self._visual(sheet.reshape(-1, 3, 3), [1.0, 1.0, 1.0, 1.0], uvs=uv.tolist())
        number = int(self._p.createMultiBody(0, -1, visual))
        height, width = picture.shape[:2]
        smooth = Image.fromarray(picture).resize((_FINER * width, _FINER * height), Image.Resampling.LANCZOS)
        with tempfile.TemporaryDirectory(prefix="neurosym-") as folder:
            smooth.save(path := Path(folder) / "top.png")
            texture = self._p.loadTexture(str(path))
        self._p.changeVisualShape(number, -1, textureUniqueId=texture)
        return number

    def _visual(self, triangles: Array, rgba: list[float], **options: Any) -> int:
        options |= flat_shaded(triangles)
        return int(self._p.createVisualShape(self._p.GEOM_MESH, rgbaColor=rgba, **options))
