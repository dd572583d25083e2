"""A window on a simulation, in real time. What is simulated runs without one; the window shows where things are.

So a slow screen leaves out pictures, not time, and what comes out is the same with and without a window. PyBullet ends
the whole process when its window is closed, or when there is no OpenGL: its window has a process of its own.
"""

import json
import os
import select
import subprocess
import sys
import time
from abc import abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from neurosym.errors import NeurosymError
from neurosym.geometry.staging import Staging
from neurosym.simulation.client import Closeable
from neurosym.simulation.drawing import LIGHT
from neurosym.simulation.looks import Camera, aimed
from neurosym.simulation.scene import part_colours
from neurosym.simulation.solids import RigidBody, Solid
from neurosym.simulation.storyboard import best_camera, room_for
from neurosym.simulation.world import World
from neurosym.support.arrays import Array, Numbers

#: Pictures a second, at most.
RATE = 30
#: Where a body that is not there is put: a pose that is not a number hides it.
HIDDEN = (np.nan,) * 7
#: So long the window may take to open, and stays after the end (seconds).
_PATIENCE, LINGER = 30.0, 1.5
#: Where the time falls farther behind than this, it is not caught up (seconds).
_BEHIND = 0.25
#: Of PyBullet's window: top to bottom (degrees), and its size in pixels.
_FIELD_OF_VIEW, _SIZE = 90.0, (1024, 768)


@dataclass(frozen=True)
class Shown:
    """What one body looks like.

    `colour`: RGB in 0..1. `triangles`: float64 (n, 3, 3), in the body's frame; or `mesh`: a file, with its pose in the
    body's frame: name, position (3,), quaternion (x, y, z, w).
    """

    colour: tuple[float, float, float]
    triangles: Array | None = None
    mesh: tuple[str, tuple[float, ...], tuple[float, ...]] | None = None


class Window(Closeable):
    """A window, until it is closed from either side (a context manager).

    `bodies`: what there is to see. `room`: float64 (n, 3), points that are to be in view. `camera`: from which side;
    how far away it stands follows from `room`. `ground`: height of the table; None: there is none. Raises
    NeurosymError: there is no screen, or no OpenGL.
    """

    def __init__(self, bodies: Sequence[Shown], room: Array, camera: Camera, ground: float | None) -> None:
        # The same view as a film's, told as PyBullet wants it: it stands so far from the middle of the picture.
        seen = replace(camera, field_of_view=_FIELD_OF_VIEW)
        V = aimed(room, seen, _SIZE)[0]
        target, distance = V[:3, :3].T @ [-V[0, 3], -V[1, 3], 0.0], -float(V[2, 3])
        scene = {
            "bodies": [
                {**vars(body), "triangles": None if body.triangles is None else body.triangles.tolist()}
                for body in bodies
            ],
            # PyBullet turns from behind the scene on, and looks down at negative angles.
            "camera": [distance, camera.azimuth + 90, -camera.elevation, target.tolist()],
            "ground": ground,
            "light": (target + 10 * distance * LIGHT).tolist(),
        }
        self._ready = True
        self._process = _started()
        try:
            if not (self._send(json.dumps(scene).encode() + b"\n") and self._heard(_PATIENCE)):
                raise NeurosymError(
                    "Expected PyBullet's window to open; it did not. It wants a screen with OpenGL (X11's GLX). Leave "
                    "the window out (--gui), or draw a film instead (`neurosym render`)."
                )
        except BaseException:
            self.close()
            raise
        self._start, self._now, self._last = time.monotonic(), 0.0, -1.0

    @property
    def is_open(self) -> bool:
        """Whether it is still there: whoever looks may close it."""
        return self._process.poll() is None

    def advance(self, seconds: float, poses: Callable[[], Array]) -> None:
        """Let simulated time pass, and show where things are, if it is time for a picture. At once when it was closed.

        `seconds`: of simulated time. `poses`: called when a picture is due; float64 (n_bodies, 7), positions and
        quaternions (x, y, z, w); `HIDDEN` for a body that is not there.
        """
        if not self.is_open:
            return
        self._now += seconds
        ahead = self._now - (time.monotonic() - self._start)
        if self._now - self._last >= 1 / RATE:
            self._ready = self._ready or self._heard(0.0)
            if self._ready:
                self._last, self._ready = self._now, False
                self._send(np.ascontiguousarray(poses(), dtype=np.float64).tobytes())
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -_BEHIND:
            self._start -= ahead

    def close(self) -> None:
        """Close it; closing twice does nothing."""
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        try:
            self._process.wait(3)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _send(self, data: bytes) -> bool:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(data)
            self._process.stdin.flush()
        except OSError:
            return False
        return True

    def _heard(self, seconds: float) -> bool:
        """Whether the window says, within so long, that it has shown what it was sent last."""
        out: Any = self._process.stdout
        return bool(select.select([out], [], [], seconds)[0]) and bool(os.read(out.fileno(), 1))


class Spectator(Closeable):
    """A window on something that moves by itself; where all went well it shows the end for a moment."""

    _window: Window

    @abstractmethod
    def _poses(self) -> Array:
        """float64 (n_bodies, 7), as `Window.advance` takes them."""

    @property
    def is_open(self) -> bool:
        """Whether the window is still there."""
        return self._window.is_open

    def close(self) -> None:
        self._window.close()

    def __exit__(self, *error: object) -> None:
        if not any(error):
            for _ in range(round(LINGER * RATE)):
                self._window.advance(1 / RATE, self._poses)
        self.close()


def _started() -> subprocess.Popen[bytes]:
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise NeurosymError(
            "Expected a screen for PyBullet's window; there is none (DISPLAY is not set). Leave the window out "
            "(--gui), or draw a film instead (`neurosym render`)."
        )
    path = os.pathsep.join(p for p in sys.path if p)
    return subprocess.Popen(
        [sys.executable, "-m", "neurosym.simulation.window_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path},
        # An interrupt from the keyboard is for the simulation, which then closes the window.
        start_new_session=True,
    )


class WorldWindow(Spectator):
    """Shows a world as its time passes (a context manager).

    `world`: what is simulated. `staging`: the plan that is done there, for colours and for the room that its paths
    want. Raises NeurosymError: there is no screen, or no OpenGL.
    """

    def __init__(self, world: World, staging: Staging) -> None:
        self._world, self._keys = world, tuple(world.made)
        colours = part_colours(staging)
        bodies = [Shown(colours[key[0]], triangles=_triangles(body)) for key, body in world.made.items()]
        ground = staging.assembly.ground * world.scale if staging.assembly.has_table else None
        self._window = Window(bodies, room_for(staging) * world.scale, best_camera(staging), ground)

    def tick(self) -> None:
        """One time step of the world has passed."""
        self._window.advance(self._world.physics.time_step, self._poses)

    def _poses(self) -> Array:
        frames = self._world.poses().frames
        return np.array([(*frames[key][0], *frames[key][1]) if key in frames else HIDDEN for key in self._keys])


def _triangles(body: RigidBody) -> Array:
    """float64 (n, 3, 3): the surface of a body in its own frame."""
    corners = [(_faces(solid), (solid.corners - body.X_WC[:3, 3]) @ body.X_WC[:3, :3]) for solid in body.solids]
    return np.concatenate([points[faces] for faces, points in corners])


def _faces(solid: Solid) -> Numbers:
    """int64 (n, 3), outward: of the mesh as it is, or of the hull of its corners."""
    if solid.faces is not None:
        return solid.faces
    hull, points = ConvexHull(solid.corners), solid.corners
    faces = np.array(hull.simplices, dtype=np.int64)
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = np.einsum("ni,ni->n", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces
