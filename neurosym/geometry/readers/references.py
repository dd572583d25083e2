"""Which assembly a plan's file speaks of: where and how it was read, and a digest that tells whether it has changed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.tolerances import Tolerances
from neurosym.support.progress import Progress, silent


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How an assembly is read, where its files leave it open; None: as `load` does by itself.

    `touch` is `Tolerances.touch`, or "auto": faces of parts drawn with play touch; `puzzle` the number of a puzzle's
    problem; `joint` the values of a robot's joints.
    """

    units: str | None = None
    up: str | None = None
    touch: float | str | None = None
    friction: float | None = None
    puzzle: int | None = None
    solution: int | None = None
    meshes: str | None = None
    joint: Mapping[str, float] | None = None

    def load(self, path: str | Path, progress: Progress = silent) -> Assembly:
        """The assembly at a path; raises what `neurosym.geometry.readers.loading.load` does."""
        asked: dict[str, Any] = {"units": self.units, "up": self.up, "friction": self.friction, "joints": self.joint}
        asked |= {"problem": self.puzzle, "solution": self.solution, "meshes": self.meshes}
        if self.touch == "auto":
            asked |= {"touching_gaps": True}
        elif self.touch is not None:
            asked |= {"tolerances": Tolerances(touch=float(self.touch))}
        return Assembly.load(path, progress=progress, **{k: v for k, v in asked.items() if v is not None})

    def as_json(self) -> dict[str, Any]:
        """What was asked for, and nothing else."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    def refuse(self, because: str) -> None:
        """Refuse (`InputError`) what the command line was asked for where there are no files to ask it of."""
        given = [f"--{name}" for name in self.as_json()]
        if given:
            raise InputError(f"Expected {', '.join(given)} with the files of an assembly; {because}.")

    @classmethod
    def from_json(cls, given: Mapping[str, Any]) -> Reading:
        """The inverse of `as_json`; other entries are not looked at."""
        return cls(**{field.name: given.get(field.name) for field in fields(cls)})


def reference(path: Path, reading: Reading, assembly: Assembly) -> dict[str, Any]:
    """What is written of an assembly that was loaded from `path`."""
    return {"path": str(path.resolve()), **reading.as_json(), "digest": digest(assembly)}


def referenced(given: Any, beside: Path) -> Assembly:
    """The assembly that `reference` spoke of: at its path, or by its name beside the file that mentions it.

    `InputError` where it is in neither place, or is another one now.
    """
    path = given.get("path") if isinstance(given, Mapping) else None
    if not isinstance(path, str):
        raise InputError(f'Expected "assembly" in {beside} with the "path" of an assembly; got {given!r}.')
    places = [Path(path), beside.parent / Path(path).name]
    place = next(filter(os.path.exists, places), None)
    if place is None:
        raise InputError(f"Expected the assembly of {beside} at {places[0]} or at {places[1]}; it is in neither place.")
    assembly = Reading.from_json(given).load(place)
    if given.get("digest") not in (None, digest(assembly)):
        raise InputError(f"Expected the assembly that {beside} was planned for; {place} has changed since. Plan again.")
    return assembly


def digest(assembly: Assembly) -> str:
    """A fingerprint of names, shapes, poses and fixed parts."""
    hashed = hashlib.sha256(repr((assembly.names, sorted(assembly.fixed), assembly.friction)).encode())
    if assembly.keep or assembly.piece_groups:
        hashed.update(repr((assembly.keep, assembly.piece_groups)).encode())
    for body, X, owner in zip(assembly.bodies, assembly.X_WB, assembly.owners):
        hashed.update(int(owner).to_bytes(4, "little"))
        for array in (X, body.shape.vertices, body.shape.faces):
            # Rounded, so that the last bit of another machine's arithmetic does not count.
            hashed.update(np.ascontiguousarray(np.round(array, 9) + 0.0).tobytes())
    return hashed.hexdigest()
