"""Files that are written whole or not at all: what reads them, or a kill, never meets half a file."""

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import IO


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A path to write to; renamed to `path` when the block ends well, removed when it does not. Makes the folder."""
    path = Path(path)
    if not path.name:
        raise IsADirectoryError(errno.EISDIR, "Expected the name of a file to write; got a folder", str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    # Beside the target, so that the rename stays on one file system; the ending stays, for writers that go by it.
    temporary = path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def written_whole(path: str | Path) -> Iterator[IO[bytes]]:
    """The same, opened for bytes."""
    with replacing(path) as temporary, open(temporary, "wb") as file:
        yield file


def write_text(path: str | Path, text: str) -> None:
    """Write text, in UTF-8."""
    with written_whole(path) as file:
        file.write(text.encode())
