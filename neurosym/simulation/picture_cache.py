"""Pictures kept on disk, found again by what they show.

Training asks for the same thousands of pictures each time. They are stored in files of `CHUNK` pictures, each under
a digest of everything that decides them (geometry, colours, style, size, seeds, `RENDER_VERSION`), so nothing stale can
be found, a run that was killed goes on where it stopped, and a damaged file is merely drawn again.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.simulation.looks import VIEWS, Camera, Style, style_named
from neurosym.simulation.render import CHUNK, Job, Progress, render_chunks, scenes_of
from neurosym.simulation.scene import RGB, Scene

#: Raise it whenever the same request would give other pixels.
RENDER_VERSION = 1


def cache_folder() -> Path:
    """Where files are kept: the environment's ``NEUROSYM_CACHE``, else the user's cache folder."""
    chosen = os.environ.get("NEUROSYM_CACHE")
    if chosen:
        return Path(chosen)
    import platformdirs

    return Path(platformdirs.user_cache_dir("neurosym"))


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
) -> NDArray[np.uint8]:
    """Pictures of many assemblies, as `render_many` makes them, from disk where they were made before.

    Put together what is asked for together: a file holds 48 jobs that follow one another (a cube in its 48
    orientations, say), and is found again only if they do. A folder that cannot be written to costs speed, no more.

    Args:
        jobs: pairs of an assembly (or a scene, whose colours are its own) and its seed.
        style: as in `PictureStudio.views`.
        colours: part name -> RGB in 0..1, for all.
        size: height and width in pixels.
        workers: processes that draw what is missing.
        progress: called with (done, total).
        folder: where the files are; None means `cache_folder`.
        cameras: where from.

    Returns:
        uint8 (len(jobs), n_cameras, size, size, 3).
    """
    look = style_named(style)
    if size < 1:
        raise InputError(f"Expected pictures of at least one pixel; got size={size}.")
    where = (cache_folder() if folder is None else Path(folder)) / "pictures"
    scenes = scenes_of(jobs, colours)
    starts = range(0, len(scenes), CHUNK)
    chunks = [scenes[i : i + CHUNK] for i in starts]
    paths = [where / f"{_key(chunk, look, size, cameras)}.z" for chunk in chunks]
    pictures = np.empty((len(scenes), len(cameras), size, size, 3), dtype=np.uint8)
    missing, done = [], 0
    for number, (start, chunk) in enumerate(zip(starts, chunks)):
        place = pictures[start : start + len(chunk)]
        if _load(paths[number], place):
            done += len(chunk)
            if progress is not None:
                progress(done, len(scenes))
        else:
            missing.append(number)
    made = render_chunks([chunks[number] for number in missing], look, size, workers, cameras)
    for number, drawn in zip(missing, made):
        pictures[starts[number] : starts[number] + len(drawn)] = drawn
        _save(paths[number], drawn)
        done += len(drawn)
        if progress is not None:
            progress(done, len(scenes))
    return pictures


def _key(chunk: Sequence[tuple[Scene, int]], style: Style, size: int, cameras: Sequence[Camera]) -> str:
    # A style that does not vary draws the same for every seed.
    seeds = [seed if style.is_random else 0 for _, seed in chunk]
    found = hashlib.sha256(repr((RENDER_VERSION, style, tuple(cameras), size, seeds)).encode())
    for scene, _ in chunk:
        found.update(scene.digest)
    return found.hexdigest()


def _load(path: Path, place: NDArray[np.uint8]) -> bool:
    """Fill `place` from a file; False if there is none, or it is damaged (zlib carries a checksum)."""
    try:
        content = zlib.decompress(path.read_bytes())
    except (OSError, zlib.error):
        return False
    if len(content) != place.nbytes:
        return False
    place[...] = np.frombuffer(content, dtype=np.uint8).reshape(place.shape)
    return True


def _save(path: Path, pictures: NDArray[np.uint8]) -> None:
    """Write aside, then rename: a reader, or a kill, never meets half a file."""
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                # Level 1: clean pictures shrink 30 times, noisy ones hardly at any level.
                file.write(zlib.compress(pictures.tobytes(), 1))
            os.replace(name, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(name)
            raise
