"""Watching the arm at work: in a window, or as a film."""

import numpy as np

from neurosym.simulation.drawing import LIGHT, drawn
from neurosym.simulation.film_files import RATE
from neurosym.simulation.looks import Camera, aimed
from neurosym.simulation.panda.cell import TIME_STEP, Cell
from neurosym.simulation.window import Shown, Spectator, Window
from neurosym.support.arrays import Array, Pixels

#: From where the arm is watched: opposite it, a little from its left.
CAMERA = Camera(38, 24, field_of_view=30.0)
#: What is to be in view: the arm, and the table where blocks lie (metres).
_LOW, _HIGH = np.array([-0.1, -0.42, 0.0]), np.array([0.72, 0.42, 0.72])
ROOM = np.array(np.meshgrid(*zip(_LOW, _HIGH))).reshape(3, -1).T
#: Drawn so many times larger, along each axis, than it is handed out.
_OVERSAMPLING = 2


class CellWindow(Spectator):
    """Shows a cell in a window, in real time (a context manager).

    Raises NeurosymError: there is no screen, or no OpenGL.
    """

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        arm = cell.arm.looks()
        blocks = [Shown(cell.colours[name], triangles=_box(size)) for name, size in cell.sizes.items()]
        self._links = [link for link, _ in arm]
        self._window = Window([*(shown for _, shown in arm), *blocks], ROOM, CAMERA, 0.0)

    def tick(self, cell: Cell) -> None:
        """One time step has passed."""
        self._window.advance(TIME_STEP, self._poses)

    def _poses(self) -> Array:
        return np.array([*(self._cell.arm.frame(link) for link in self._links), *self._cell.frames().values()])


class CellFilm:
    """Pictures of a cell while time passes, `RATE` of them a second of film; to be called after each time step.

    `size`: width and height in pixels, even numbers. `speed`: seconds that pass in a second of film. `pictures`: uint8
    (height, width, 3) each.
    """

    def __init__(self, size: tuple[int, int] = (640, 480), speed: float = 4.0) -> None:
        self.size, self.pictures = size, list[Pixels]()
        self._every, self._steps = max(1, round(speed / RATE / TIME_STEP)), 0

    def __call__(self, cell: Cell) -> None:
        if self._steps % self._every == 0:
            self.pictures.append(picture_of(cell, self.size))
        self._steps += 1


def picture_of(cell: Cell, size: tuple[int, int]) -> Pixels:
    """uint8 (height, width, 3): the cell as it is now, from `CAMERA`, without a window."""
    from PIL import Image

    large = (_OVERSAMPLING * size[0], _OVERSAMPLING * size[1])
    view, projection, _ = aimed(ROOM, CAMERA, size)
    matrices = view.T.ravel().tolist(), projection.T.ravel().tolist()
    light = (10 * LIGHT).tolist()
    colour, _, owners = drawn(cell.client, large, *matrices, light=light, distance=3, shades=(0.6, 0.42, 0.0), shadow=0)
    colour = colour.copy()
    colour[np.array(owners).reshape(large[1], large[0]) < 0] = 255
    return np.asarray(Image.fromarray(colour).reduce(_OVERSAMPLING))


def _box(size: Array) -> Array:
    """float64 (12, 3, 3): the surface of a box around the origin."""
    import trimesh

    return np.asarray(trimesh.creation.box(size).triangles, dtype=np.float64)
