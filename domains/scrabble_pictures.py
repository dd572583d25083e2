"""Pictures of many words: drawn on many processes, kept on disk, and found again by what they show."""

from __future__ import annotations

import contextlib
import hashlib
import os
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import PIL
from numpy.typing import NDArray

from domains.scrabble_drawing import HEIGHT, WIDTH, Style, draw_word, style_named
from neurosym.language.problem_family import Progress
from neurosym.support.files import replacing

#: Raise it whenever the same request would give other pixels.
PICTURE_VERSION = 1

#: A word's letters and the seed of its picture.
Job = tuple[str, int]

#: Pictures in one file, and drawn by one process at a time (a quarter of a second's work).
CHUNK = 256


def cached_pictures(
    jobs: Sequence[Job],
    *,
    style: str = "easy",
    workers: int | None = None,
    progress: Progress | None = None,
    folder: str | Path | None = None,
) -> NDArray[np.uint8]:
    """Pictures of many words, uint8 (M, 1, 32, 192, 3), from disk where they were made before.

    The same for any number of workers, and as `draw_word` makes them with each job's seed. A file holds 256 jobs that
    follow one another and is found again only if they do; one that is damaged is drawn again, and a folder that
    cannot be written to costs speed, no more.

    Args:
        jobs: words with seeds.
        workers: processes that draw what is missing; None takes one a core.
        progress: called with (done, total).
        folder: where the files are; None means the library's cache folder.
    """
    from neurosym.simulation.picture_cache import cache_folder

    look = style_named(style)
    where = (cache_folder() if folder is None else Path(folder)) / "scrabble-pictures"
    chunks = [jobs[i : i + CHUNK] for i in range(0, len(jobs), CHUNK)]
    paths = [where / f"{_key(chunk, look)}.raw" for chunk in chunks]
    pictures = np.empty((len(jobs), 1, HEIGHT, WIDTH, 3), dtype=np.uint8)
    places = [pictures[i : i + CHUNK] for i in range(0, len(jobs), CHUNK)]
    missing = [k for k, place in enumerate(places) if not _load(paths[k], place)]
    done = len(jobs) - sum(len(chunks[k]) for k in missing)
    if progress is not None:
        progress(done, len(jobs))
    for k, drawn in zip(missing, _drawn([chunks[k] for k in missing], look, workers)):
        places[k][...] = drawn
        with contextlib.suppress(OSError), replacing(paths[k]) as temporary:
            # Not compressed: noise hardly shrinks, and it takes as long as drawing.
            temporary.write_bytes(drawn.tobytes() + _checksum(drawn.tobytes()))
        done += len(drawn)
        if progress is not None:
            progress(done, len(jobs))
    return pictures


def _drawn(chunks: Sequence[Sequence[Job]], style: Style, workers: int | None) -> Iterable[NDArray[np.uint8]]:
    """The pictures of each chunk, in order."""
    processes = min(workers or os.cpu_count() or 1, len(chunks))
    if processes < 2:
        return (_draw_chunk(chunk, style) for chunk in chunks)
    from joblib import Parallel, delayed

    made: Iterable[NDArray[np.uint8]] = Parallel(n_jobs=processes, return_as="generator")(
        delayed(_draw_chunk)(chunk, style) for chunk in chunks
    )
    return made


def _draw_chunk(chunk: Sequence[Job], style: Style) -> NDArray[np.uint8]:
    return np.stack([draw_word(word, style, np.random.default_rng(seed)) for word, seed in chunk])


def _key(chunk: Sequence[Job], style: Style) -> str:
    """A digest of all that decides the pixels; the letters' shapes come with Pillow."""
    return hashlib.sha256(repr((PICTURE_VERSION, PIL.__version__, style, list(chunk))).encode()).hexdigest()


def _checksum(content: bytes) -> bytes:
    return zlib.crc32(content).to_bytes(4)


def _load(path: Path, place: NDArray[np.uint8]) -> bool:
    """Fill `place` from a file; False if there is none, or it is damaged."""
    try:
        found = path.read_bytes()
    except OSError:
        return False
    content = found[:-4]
    if len(content) != place.nbytes or _checksum(content) != found[-4:]:
        return False
    place[...] = np.frombuffer(content, dtype=np.uint8).reshape(place.shape)
    return True
