"""A journal of finished work: JSON lines, each a key and a value, appended whole; a torn last line is ignored."""

import contextlib
import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from neurosym.errors import InputError
from neurosym.support.documents import MAX_BYTES, read_bytes


def key_of(configuration: Any) -> str:
    """A digest of everything that decides a result (JSON-able)."""
    text = json.dumps(configuration, sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


class Journal:
    """Finished results by key. With a path of None it remembers nothing.

    `path`: the file; made, with its folder, at the first `add`.
    """

    def __init__(self, path: str | Path | None) -> None:
        self.path = None if path is None else Path(path)
        self._entries: dict[str, dict[str, Any]] = {}
        content = read_bytes(self.path, MAX_BYTES, InputError) if self.path is not None and self.path.exists() else b""
        # A line may be whole and lack only its end.
        self._torn = bool(content) and not content.endswith(b"\n")
        for line in content.split(b"\n"):
            # What a kill left half written is done again.
            with contextlib.suppress(ValueError, KeyError, TypeError, RecursionError):
                self._keep(line)

    def __contains__(self, key: str) -> bool:
        return key in self._entries

    def __getitem__(self, key: str) -> dict[str, Any]:
        return self._entries[key]

    def __len__(self) -> int:
        return len(self._entries)

    def add(self, entries: Mapping[str, Mapping[str, Any]]) -> None:
        """Keep finished results: all lines in one write, on disk when this returns."""
        if self.path is None or not entries:
            return
        lines = [json.dumps({"key": key, "value": dict(value)}) for key, value in entries.items()]
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with open(self.path, "ab", buffering=0) as file:
            # Whatever was torn ends here, so that the next line begins on its own.
            left = memoryview((("\n" if self._torn else "") + "".join(line + "\n" for line in lines)).encode())
            while left:
                left = left[file.write(left) :]
            os.fsync(file.fileno())
        self._torn = False
        for line in lines:
            self._keep(line)

    def _keep(self, line: str | bytes) -> None:
        """Remember what a line holds; so a value is the same now and when it is read again after a kill."""
        entry = json.loads(line)
        self._entries[entry["key"]] = dict(entry["value"])
