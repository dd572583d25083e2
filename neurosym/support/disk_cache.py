"""Arrays kept on disk under a digest of all that decides them: nothing stale can be met.

Work that was killed goes on where it stopped, what is damaged is made again, and a folder that cannot be written to
costs speed, no more.
"""

import contextlib
import hashlib
import os
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
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


@cache
def _code() -> bytes:
    """A digest of all that makes what is kept of geometry: a version that nobody has to remember to raise."""
    home = Path(__file__).parent.parent
    digest = hashlib.sha256(f"{np.__version__}".encode())
    for file in sorted((*home.glob("geometry/**/*.py"), *home.glob("support/*.py"))):
        digest.update(file.read_bytes())
    return digest.digest()


def keeps_geometry() -> bool:
    """Whether what is read and tabulated is kept: unless the environment's ``NEUROSYM_KEEP`` is 0, as in benchmarks."""
    return os.environ.get("NEUROSYM_KEEP") != "0"


def place(what: str, *content: bytes) -> Path:
    """Where arrays that geometry makes of this content are kept, with this code."""
    digest = hashlib.sha256(_code())
    for part in content:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return cache_folder() / what / f"{digest.hexdigest()}.npz"


def load_all(path: Path) -> dict[str, NDArray[Any]] | None:
    """The arrays that `store_all` wrote, by name; None: there are none, or the file is damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error):
        return None


def store_all(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays, whole or not at all."""
    with contextlib.suppress(OSError), replacing(path) as temporary:
        np.savez(temporary, **arrays)  # type: ignore[arg-type]


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
