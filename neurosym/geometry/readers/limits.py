"""What every reader keeps to, for files that are broken or made to break it: sizes, counts, and their folder."""

from __future__ import annotations

import contextlib
import gzip
import io
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np

from neurosym.errors import AssemblyError, NeurosymError
from neurosym.support import documents
from neurosym.support.documents import MAX_BYTES, too_large

#: An XML or JSON text may be this large: parsed, it takes some twenty times as much memory.
MAX_TEXT_BYTES = 1 << 28

#: Triangles of one part (the geometry of pairs grows faster than linearly with them), and of all together with copies.
MAX_FACES, MAX_TOTAL_FACES = 2_000_000, 10_000_000

#: Parts of one assembly, fixed ones included.
MAX_PARTS = 10_000


@contextlib.contextmanager
def reading(what: str, path: Path) -> Iterator[None]:
    """Whatever goes wrong inside, lack of memory included, is the file's fault: `what` was expected in it."""
    try:
        with np.errstate(all="ignore"):
            yield
    except NeurosymError:
        raise
    except Exception as error:
        text = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise AssemblyError(f"Expected {what} in {path}; reading it ended in {text}. Export it again.") from error


def within_limits(path: Path, faces: int, total: int = 0, parts: int = 0) -> None:
    """Refuse (`AssemblyError`) a part of too many faces, too many of all parts, and too many parts."""
    for count, limit, what in (
        (faces, MAX_FACES, "triangles a part"),
        (total, MAX_TOTAL_FACES, "triangles"),
        (parts, MAX_PARTS, "parts"),
    ):
        if count > limit:
            raise AssemblyError(f"Expected at most {limit:,} {what} in {path}; got {count:,}. Give fewer.")


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """A file no larger than `limit`; `AssemblyError` for one that is larger, no regular file, or not to be read."""
    return documents.read_bytes(path, limit, AssemblyError)


def limited(file: IO[bytes] | gzip.GzipFile, path: Path, limit: int) -> bytes:
    """All bytes of a stream, which is or comes from `path`; `AssemblyError` where there are more than `limit`."""
    data = file.read(limit + 1)
    if len(data) > limit:
        raise AssemblyError(too_large(path, limit))
    return data


def gunzip(data: bytes, path: Path, limit: int = MAX_TEXT_BYTES) -> bytes:
    """Gzip'd data unpacked, no further than `limit`; data that is not gzip'd comes back as it is."""
    if not data.startswith(b"\x1f\x8b"):
        return data
    with reading("whole gzip'd data", path), gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
        return limited(file, path, limit)


def inside(folder: Path, name: str) -> Path:
    """The file that a relative name means; `AssemblyError` if it lies outside the folder, be it by ``..`` or a link."""
    with contextlib.suppress(OSError, ValueError, RuntimeError):
        root = folder.resolve()
        path = (root / name).resolve()
        if not Path(name).is_absolute() and path.is_relative_to(root):
            return path
    raise AssemblyError(f"Expected files inside {folder}; {name!r} lies outside, or is no path. Put it beside.")
