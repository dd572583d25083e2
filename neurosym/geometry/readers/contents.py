"""What a reader gives, and the limits that every reader keeps."""

from __future__ import annotations

import contextlib
import gzip
import io
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import AssemblyError, NeurosymError
from neurosym.geometry.notes import Note
from neurosym.geometry.shapes import Part
from neurosym.geometry.tolerances import Tolerances

Array = NDArray[np.float64]

#: A file, or what a compressed one unpacks to, may be this large. 10 million triangles of STL are half of it.
MAX_BYTES = 1 << 30

#: An XML or JSON text may be this large: parsed, it takes some twenty times as much memory.
MAX_TEXT_BYTES = 1 << 28

#: Triangles of one part. The geometry of pairs grows faster than linearly with them.
MAX_FACES = 2_000_000

#: Triangles of all parts together, copies counted.
MAX_TOTAL_FACES = 10_000_000

#: Parts of one assembly, fixed ones included.
MAX_PARTS = 10_000

#: From y up to z up, float64 (4, 4): x stays, y becomes z.
Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])

#: Rounding of coordinates stored in 32 and in 64 bits, as a share of their size.
FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53


@dataclass(frozen=True, eq=False)
class RawMesh:
    """A part's mesh as it stands in a file, unchecked.

    Attributes:
        name: of the part, as the file has it; perhaps empty, perhaps not unique.
        vertices: float64 (n, 3), in the part's frame, in the file's unit.
        faces: int64 (m, 3), numbers of vertices.
        rounding: of the coordinates, as a share of their size.
        X_WP: float64 (4, 4), the part's pose; None: the part's frame is the world.
        density: mass per unit of volume.
    """

    name: str
    vertices: Array
    faces: NDArray[np.int64]
    rounding: float = FLOAT64
    X_WP: Array | None = None
    density: float = 1.0


@dataclass(frozen=True, eq=False)
class Contents:
    """What was read.

    Attributes:
        parts: meshes still to be looked at, and parts that are ready.
        units: the unit that the format states, or None.
        fixed: names of parts that never move.
        table, friction, tolerances: as in `Assembly`; None where the file says nothing.
        notes: what was odd but harmless.
    """

    parts: tuple[RawMesh | Part, ...]
    units: str | None = None
    fixed: tuple[str, ...] = ()
    table: float | None = None
    friction: float | None = None
    tolerances: Tolerances | None = None
    notes: tuple[Note, ...] = ()


@contextlib.contextmanager
def reading(what: str, path: Path) -> Iterator[None]:
    """Whatever goes wrong inside is the file's fault: `what` was expected in it.

    A parser may meet any exception on a file that is broken or made to break it, lack of memory among them.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except NeurosymError:
        raise
    except Exception as error:
        said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise AssemblyError(f"Expected {what} in {path}; reading it ended in {said}. Export it again.") from error


def within_limits(path: Path, faces: int, total: int = 0, parts: int = 0) -> None:
    """Refuse a part of too many faces, too many of all parts, and too many parts.

    Raises:
        AssemblyError: the message says which, and the limit.
    """
    for count, limit, what in (
        (faces, MAX_FACES, "triangles a part"),
        (total, MAX_TOTAL_FACES, "triangles"),
        (parts, MAX_PARTS, "parts"),
    ):
        if count > limit:
            raise AssemblyError(f"Expected at most {limit:,} {what} in {path}; got {count:,}. Give fewer.")


def united(name: str, pieces: Sequence[tuple[Array, NDArray[np.int64]]], rounding: float = FLOAT64) -> RawMesh:
    """One mesh of several pieces, each vertices (n, 3) and faces (m, 3)."""
    starts = np.cumsum([0, *(len(v) for v, _ in pieces)])
    vertices = np.concatenate([np.zeros((0, 3)), *(v for v, _ in pieces)])
    faces = np.concatenate([np.zeros((0, 3), dtype=np.int64), *(f + s for (_, f), s in zip(pieces, starts))])
    return RawMesh(name, vertices, faces, rounding)


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """A file, if it is a regular file no larger than `limit`.

    Raises:
        AssemblyError: it is absent, too large, a device or a pipe, or cannot be read.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise AssemblyError(f"Expected a regular file; {path} is none.")
        if status.st_size <= limit:
            with open(path, "rb") as file:
                data = file.read(limit + 1)
            if len(data) <= limit:
                return data
    except (OSError, ValueError) as error:
        raise AssemblyError(f"Expected a file that can be read; got {path}: {error}.") from None
    raise too_large(path, limit)


def too_large(path: Path, limit: int) -> AssemblyError:
    """The error for a file beyond a limit of bytes."""
    return AssemblyError(f"Expected at most {limit:,} bytes in {path}; it has more. Give simpler meshes, or fewer.")


def gunzip(data: bytes, path: Path, limit: int = MAX_TEXT_BYTES) -> bytes:
    """Gzip'd data unpacked, no further than `limit`; data that is not gzip'd comes back as it is."""
    if not data.startswith(b"\x1f\x8b"):
        return data
    with reading("whole gzip'd data", path), gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
        unpacked = file.read(limit + 1)
    if len(unpacked) > limit:
        raise too_large(path, limit)
    return unpacked


def inside(folder: Path, name: str) -> Path:
    """The file that a relative name means, if it lies in the folder.

    Raises:
        AssemblyError: it lies elsewhere, directly, through ``..`` or through a link.
    """
    try:
        root = folder.resolve()
        found = (root / name).resolve()
        if not Path(name).is_absolute() and found.is_relative_to(root):
            return found
    except (OSError, ValueError, RuntimeError):
        pass
    raise AssemblyError(f"Expected files inside {folder}; {name!r} lies outside, or is no path. Put it beside.")
