"""Arrays kept on disk under a digest of all that decides them: nothing stale can be met.

Work that was killed goes on where it stopped, what is damaged is made again, and a folder that cannot be written to
costs speed, no more.
"""

import contextlib
import os
import zlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.support.files import replacing


def cache_folder() -> Path:
    """Where files are kept: the environment's ``NEUROSYM_CACHE``, else the user's cache folder."""
    chosen = os.environ.get("NEUROSYM_CACHE")
    if chosen:
        return Path(chosen)
    import platformdirs

    return Path(platformdirs.user_cache_dir("neurosym"))


def load(path: Path, place: NDArray[Any]) -> bool:
    """Fill `place` from a file; False if there is none, or it is damaged (zlib carries a checksum)."""
    try:
        content = zlib.decompress(path.read_bytes())
    except (OSError, zlib.error):
        return False
    if len(content) != place.nbytes:
        return False
    place[...] = np.frombuffer(content, dtype=place.dtype).reshape(place.shape)
    return True


def store(path: Path, array: NDArray[Any], level: int = 1) -> None:
    """Write an array, whole or not at all; `level` as zlib's, 0 only adds the checksum."""
    with contextlib.suppress(OSError), replacing(path) as temporary:
        temporary.write_bytes(zlib.compress(array.tobytes(), level))


def fill(
    places: Sequence[NDArray[Any]],
    paths: Sequence[Path],
    make: Callable[[list[int]], Iterable[NDArray[Any]]],
    *,
    level: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Fill arrays from their files, and those that have none from `make`, whose answers are then kept.

    `places`: arrays whose rows are counted in `progress`. `make`: given the numbers of the missing ones, gives their
    contents in that order.
    """
    missing = [i for i, (path, place) in enumerate(zip(paths, places, strict=True)) if not load(path, place)]
    total = sum(map(len, places))
    done = total - sum(len(places[i]) for i in missing)
    if progress is not None:
        progress(done, total)
    for i, made in zip(missing, make(missing)):
        places[i][...] = made
        store(paths[i], made, level)
        done += len(made)
        if progress is not None:
            progress(done, total)
