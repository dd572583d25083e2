"""Pictures of many words: drawn on many processes, kept on disk, and found again by what they show."""

import hashlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import PIL

from domains.scrabble_drawing import HEIGHT, WIDTH, Style, draw_word, style_named
from neurosym.language.problem_family import Progress
from neurosym.support.arrays import Pixels
from neurosym.support.disk_cache import cache_folder, fill

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
) -> Pixels:
    """Pictures of many words, uint8 (M, 1, 32, 192, 3), from disk where they were made before.

    The same for any number of workers, and as `draw_word` makes them with each job's seed. A file holds 256 jobs that
    follow one another and is found again only if they do.

    `jobs`: words with seeds. `workers`: processes that draw what is missing; None takes one a core. `progress`: called
    with (done, total). `folder`: where the files are; None means the library's cache folder.
    """
    look = style_named(style)
    where = (cache_folder() if folder is None else Path(folder)) / "scrabble-pictures"
    chunks = [jobs[i : i + CHUNK] for i in range(0, len(jobs), CHUNK)]
    pictures = np.empty((len(jobs), 1, HEIGHT, WIDTH, 3), dtype=np.uint8)
    # Not compressed: noise hardly shrinks, and it takes as long as drawing.
    fill(
        [pictures[i : i + CHUNK] for i in range(0, len(jobs), CHUNK)],
        [where / f"{_key(chunk, look)}.z" for chunk in chunks],
        lambda missing: _drawn([chunks[i] for i in missing], look, workers),
        level=0,
        progress=progress,
    )
    return pictures


def _drawn(chunks: Sequence[Sequence[Job]], style: Style, workers: int | None) -> Iterable[Pixels]:
    """The pictures of each chunk, in order."""
    processes = min(workers or os.cpu_count() or 1, len(chunks))
    if processes < 2:
        return (_draw_chunk(chunk, style) for chunk in chunks)
    from joblib import Parallel, delayed

    made: Iterable[Pixels] = Parallel(n_jobs=processes, return_as="generator")(
        delayed(_draw_chunk)(chunk, style) for chunk in chunks
    )
    return made


def _draw_chunk(chunk: Sequence[Job], style: Style) -> Pixels:
    return np.stack([draw_word(word, style, np.random.default_rng(seed)) for word, seed in chunk])


def _key(chunk: Sequence[Job], style: Style) -> str:
    """A digest of all that decides the pixels; the letters' shapes come with Pillow."""
    return hashlib.sha256(repr((PICTURE_VERSION, PIL.__version__, style, list(chunk))).encode()).hexdigest()
