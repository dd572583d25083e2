"""Files of others, read within limits: a device, a bomb or half a file is refused before it fills the memory.

Each reader is told what was expected and which exception says so: its message names the file, and what to do follows
from what was expected.
"""

import json
import math
import stat
import zipfile
import zlib
from collections import Counter
from pathlib import Path
from tokenize import TokenError
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

#: A file, or what a compressed one unpacks to, may be this large.
MAX_BYTES = 1 << 30

#: JSON of plans and cells may be this large: parsed, it takes some twenty times as much memory.
MAX_JSON_BYTES = 1 << 26

Error = type[Exception]

#: What reading an archive of arrays may end in.
_SPOILT = (
    *(OSError, ValueError, RuntimeError, MemoryError, EOFError, SyntaxError, TokenError),
    *(zipfile.BadZipFile, zlib.error),
)


def read_bytes(path: Path, limit: int, error: Error) -> bytes:
    """A regular file no larger than `limit` bytes."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise error(f"Expected a regular file; {path} is none.")
        if status.st_size > limit:
            raise error(too_large(path, limit))
        with open(path, "rb") as file:
            data = file.read(limit + 1)
    except OSError as reason:
        raise error(f"Expected a file that can be read; got {path}: {reason.strerror or reason}.") from None
    if len(data) > limit:
        raise error(too_large(path, limit))
    return data


def too_large(path: Path, limit: int) -> str:
    """What to say of a file beyond a limit of bytes."""
    return f"Expected at most {limit:,} bytes in {path}; it has more. Give less."


def read_json(path: Path, what: str, error: Error, *, limit: int = MAX_JSON_BYTES) -> Any:
    """JSON in UTF-8 whose objects name each key once: of two, JSON itself would silently drop the first."""
    try:
        return json.loads(read_bytes(path, limit, error).decode(), object_pairs_hook=each_once)
    except RecursionError:
        raise error(f"Expected {what} in {path}; it is nested too deeply.") from None
    except ValueError as reason:
        if isinstance(reason, error):
            raise
        raise error(f"Expected {what} in {path}; got: {brief(reason)}.") from None


def each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object whose keys differ; ValueError: one comes twice."""
    found = dict(pairs)
    if len(found) < len(pairs):
        twice = [key for key, times in Counter(key for key, _ in pairs).items() if times > 1]
        raise ValueError(f"{brief(', '.join(twice))} comes twice")
    return found


def read_arrays(path: Path, what: str, error: Error, *, limit: int = MAX_BYTES) -> dict[str, NDArray[Any]]:
    """The plain arrays of an ``.npz`` file, which unpack to at most `limit` bytes together."""
    size = 0
    arrays: dict[str, NDArray[Any]] = {}
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise error(f"Expected a regular file; {path} is none.")
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                with archive.open(name) as file:
                    size += _size(file)
                    if size > limit:
                        raise error(too_large(path, limit))
                    file.seek(0)
                    arrays[name.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    except _SPOILT as reason:
        if isinstance(reason, error):
            raise
        raise error(f"Expected {what} in {path}; got: {brief(reason)}.") from None
    return arrays


def _size(file: IO[bytes]) -> int:
    """Bytes of the array whose header comes next."""
    version = np.lib.format.read_magic(file)
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = header(file)
    return math.prod(shape) * dtype.itemsize


def brief(text: object) -> str:
    """Its text, on one line and no longer than a message can bear."""
    line = " ".join(str(text).split())
    return line if len(line) <= 200 else f"{line[:197]}..."
