"""Pictures kept on disk, found again by what they show.

Training asks for the same thousands of pictures each time. They are stored in files of `CHUNK` pictures, each under
a digest of everything that decides them: geometry, colours, style, size, seeds, `RENDER_VERSION`.
"""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from neurosym.errors import InputError
from neurosym.simulation.looks import VIEWS, Camera, Style, style_named
from neurosym.simulation.render import CHUNK, Job, Progress, render_chunks, scenes_of
from neurosym.simulation.scene import RGB, Scene
from neurosym.support.arrays import Pixels
from neurosym.support.disk_cache import cache_folder, fill

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
