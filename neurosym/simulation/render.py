"""Pictures of assemblies, from PyBullet's software renderer: no window, no graphics card, same bits everywhere.

Four views as in Burke, Subr and Ramamoorthy (2021), section V: the top and three sides (`VIEWS`). Nothing moves and
nothing collides here: bodies are visual shapes at poses.

Training asks for the same thousands of pictures each time. They are kept on disk, `CHUNK` to a file, under a digest of
all that decides them: geometry, colours, style, size, seeds, `RENDER_VERSION`.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.simulation.client import Client, Closeable
from neurosym.simulation.clutter import draw_surroundings
from neurosym.simulation.drawing import drawn, flat_shaded
from neurosym.simulation.looks import VIEWS, Camera, Style, draw_look, style_named
from neurosym.simulation.scene import RGB, Scene, scene_of
from neurosym.support.arrays import Array, Pixels
from neurosym.support.disk_cache import cache_folder, fill

#: Called with (done, total) while many pictures are made.
Progress = Callable[[int, int], None]
#: An assembly, or the scene made of it, and the seed of its picture.
Job = tuple[Assembly | Scene, int]
#: Pictures that one process makes before it hands them back (about a quarter of a second's work).
CHUNK = 48
#: A rectangle before its half edges scale it, facing along z.
_SQUARE = (np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))


class PictureStudio(Closeable):
    """Cameras and a renderer, kept ready: pictures of assemblies with the same shapes only move bodies about.

    A context manager. The pictures do not depend on what was drawn before.
    """

    def __init__(self) -> None:
        self._client = Client()
        self._p: Any = self._client.p
        self._shapes: tuple[tuple[object, ...], ...] = ()
        self._ids: list[int] = []

    def close(self) -> None:
        """Close the renderer; closing twice does nothing."""
        self._client.close()

    def views(
        self,
        assembly: Assembly | Scene,
        *,
        style: str | Style = "clean",
        colours: Mapping[str, RGB] | None = None,
        size: int = 64,
        rng: np.random.Generator | None = None,
        cameras: Sequence[Camera] = VIEWS,
    ) -> Pixels:
        """Pictures of an assembly, one a camera.

        Args:
            assembly: the parts, or the scene made of them (then `colours` is not asked).
            style: ``"clean"``, ``"varied"``, ``"cluttered"`` or a `Style`; one that varies needs an `rng`.
            colours: part name -> RGB in 0..1; the default is `PALETTE` by the order of the parts.
            size: height and width in pixels.

        Returns:
            uint8 (n_cameras, size, size, 3).

        Raises:
            InputError: a varied style without an rng, or a size below 1.
            UnknownNameError: no such style, or a colour for a part that is not there.
        """
        look_of = style_named(style)
        if size < 1:
            raise InputError(f"Expected pictures of at least one pixel; got size={size}.")
        if rng is None and look_of.is_random:
            raise InputError("Expected rng, a numpy Generator, since this style varies; got None.")
        scene = assembly if isinstance(assembly, Scene) else scene_of(assembly, colours)
        chance = np.random.default_rng(0) if rng is None else rng
        look = draw_look(look_of, cameras, scene.colours, chance)
        seen, own, around = look.cameras, look.colours, None
        if look_of.clutter is not None:
            around = draw_surroundings(look_of.clutter, scene, seen, chance)
            scene, seen = around.scene, around.cameras
            own = np.concatenate([own, scene.colours[len(own) :]])
        self._arrange(scene, own)
        pictures = np.empty((len(cameras), size, size, 3), dtype=np.uint8)
        for i, camera in enumerate(seen):
            pictures[i], _, owners = drawn(
                self._client,
                (size, size),
                camera.view_matrix(),
                camera.projection_matrix(),
                light=look.light,
                distance=10,
                shades=(look.ambient, look.diffuse, look.specular),
                shadow=int(look.shadow),
                flags=self._p.ER_NO_SEGMENTATION_MASK if around is None else 0,
            )
            if around is not None:
                pictures[i] = around.finished(pictures[i], np.reshape(owners, (size, size)), i)
        if look.noise > 0:
            noise = chance.standard_normal(pictures.shape, dtype=np.float32) * np.float32(look.noise)
            pictures = np.clip(np.rint(pictures + noise), 0, 255).astype(np.uint8)
        return pictures

    def _arrange(self, scene: Scene, colours: Array) -> None:
        """Put bodies where the scene has them. The order in which bodies are made shows in single pixels along edges,
        so bodies are reused only by a scene of the very same shapes."""
        p = self._p
        if scene.shapes != self._shapes:
            p.resetSimulation()
            made: dict[tuple[object, ...], int] = {}
            for i, shape in enumerate(scene.shapes):
                if shape not in made:
                    made[shape] = self._visual(scene, i)
            self._ids = [p.createMultiBody(0, -1, made[shape], [0, 0, 0]) for shape in scene.shapes]
            self._shapes = scene.shapes
        rows = zip(self._ids, scene.position.tolist(), scene.turn.tolist(), colours[scene.owner].tolist())
        for number, position, turn, rgb in rows:
            p.resetBasePositionAndOrientation(number, position, turn)
            p.changeVisualShape(number, -1, rgbaColor=[*rgb, 1.0])

    def _visual(self, scene: Scene, i: int) -> int:
        p = self._p
        vertices, faces = scene.meshes.get(i, _SQUARE)
        surface = flat_shaded((vertices * scene.half[i])[faces])
        return int(p.createVisualShape(p.GEOM_MESH, **surface))


def render_views(
    assembly: Assembly,
    *,
    style: str | Style = "clean",
    colours: Mapping[str, RGB] | None = None,
    size: int = 64,
    rng: np.random.Generator | None = None,
    cameras: Sequence[Camera] = VIEWS,
) -> Pixels:
    """Pictures of one assembly, uint8 (4, size, size, 3); see `PictureStudio.views`, faster for many."""
    with PictureStudio() as studio:
        return studio.views(assembly, style=style, colours=colours, size=size, rng=rng, cameras=cameras)


def render_many(
    jobs: Sequence[Job],
    *,
    style: str | Style = "clean",
    colours: Mapping[str, RGB] | None = None,
    size: int = 64,
    workers: int = 1,
    progress: Progress | None = None,
    cameras: Sequence[Camera] = VIEWS,
) -> Pixels:
    """Pictures of many assemblies, in order, the same for any number of workers.

    `jobs`: pairs of an assembly (or a scene, whose colours are its own) and its seed. `style, colours, size, cameras`:
    as in `PictureStudio.views`, for all. `workers`: processes; 1 stays in this one. `progress`: called with (done,
    total). Returns uint8 (len(jobs), n_cameras, size, size, 3).
    """
    scenes = scenes_of(jobs, colours)
    pictures = np.empty((len(jobs), len(cameras), size, size, 3), dtype=np.uint8)
    chunks = [scenes[i : i + CHUNK] for i in range(0, len(scenes), CHUNK)]
    done = 0
    for part in render_chunks(chunks, style_named(style), size, workers, cameras):
        pictures[done : done + len(part)] = part
        done += len(part)
        if progress is not None:
            progress(done, len(jobs))
    return pictures


def scenes_of(jobs: Sequence[Job], colours: Mapping[str, RGB] | None) -> list[tuple[Scene, int]]:
    """The scenes of jobs, with their seeds."""
    return [(given if isinstance(given, Scene) else scene_of(given, colours), int(seed)) for given, seed in jobs]


def render_chunks(
    chunks: Sequence[Sequence[tuple[Scene, int]]],
    style: Style,
    size: int,
    workers: int,
    cameras: Sequence[Camera] = VIEWS,
) -> Any:
    """An iterator over the pictures of each chunk, uint8 (n, n_cameras, size, size, 3), in order."""
    draw = partial(_render_chunk, style=style, size=size, cameras=cameras)
    if workers == 1 or len(chunks) < 2:
        return map(draw, chunks)
    from joblib import Parallel, delayed

    return Parallel(n_jobs=workers, return_as="generator")(delayed(draw)(chunk) for chunk in chunks)


def _render_chunk(chunk: Sequence[tuple[Scene, int]], **options: Any) -> Pixels:
    with PictureStudio() as studio:
        return np.stack([studio.views(scene, rng=np.random.default_rng(seed), **options) for scene, seed in chunk])


#: Raise it whenever the same request would give other pixels.
RENDER_VERSION = 1


def cached_pictures(
    jobs: Sequence[Job],
    *,
    style: str | Style = "clean",
    colours: Mapping[str, RGB] | None = None,
    size: int = 64,
    workers: int = 1,
    progress: Progress | None = None,
    folder: str | Path | None = None,
    cameras: Sequence[Camera] = VIEWS,
) -> Pixels:
    """Pictures of many assemblies, as `render_many` makes them, from disk where they were made before.

    Put together what is asked for together: a file holds 48 jobs that follow one another (a cube in its 48
    orientations, say), and is found again only if they do.

    `folder`: where the files are; None means `cache_folder`. The others, and what is returned, as there.
    """
    look = style_named(style)
    if size < 1:
        raise InputError(f"Expected pictures of at least one pixel; got size={size}.")
    where = (cache_folder() if folder is None else Path(folder)) / "pictures"
    scenes = scenes_of(jobs, colours)
    chunks = [scenes[i : i + CHUNK] for i in range(0, len(scenes), CHUNK)]
    pictures = np.empty((len(scenes), len(cameras), size, size, 3), dtype=np.uint8)
    # Level 1: clean pictures shrink 30 times, noisy ones hardly at any level.
    fill(
        [pictures[i : i + CHUNK] for i in range(0, len(scenes), CHUNK)],
        [where / f"{_key(chunk, look, size, cameras)}.z" for chunk in chunks],
        lambda missing: render_chunks([chunks[i] for i in missing], look, size, workers, cameras),
        level=1,
        progress=progress,
    )
    return pictures


def _key(chunk: Sequence[tuple[Scene, int]], style: Style, size: int, cameras: Sequence[Camera]) -> str:
    # A style that does not vary draws the same for every seed.
    seeds = [seed if style.is_random else 0 for _, seed in chunk]
    digest = hashlib.sha256(repr((RENDER_VERSION, style, tuple(cameras), size, seeds)).encode())
    for scene, _ in chunk:
        digest.update(scene.digest)
    return digest.hexdigest()
