"""Which assembly a plan's file speaks of: where it was read, and a digest that tells whether it is still the same."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly


def reference(path: Path, units: str | None, assembly: Assembly) -> dict[str, Any]:
    """What is written of an assembly that was loaded from `path`."""
    return {"path": str(path.resolve()), "units": units, "digest": digest(assembly)}


def referenced(said: Any, beside: Path) -> Assembly:
    """The assembly that `reference` spoke of: at its path, or by its name beside the file that mentions it.

    Raises:
        InputError: it is in neither place, or it is another one now.
    """
    path = said.get("path") if isinstance(said, Mapping) else None
    if not isinstance(path, str):
        raise InputError(f'Expected "assembly" in {beside} with the "path" of an assembly; got {said!r}.')
    places = [Path(path), beside.parent / Path(path).name]
    found = next((place for place in places if place.exists()), None)
    if found is None:
        raise InputError(f"Expected the assembly of {beside} at {places[0]} or at {places[1]}; it is in neither place.")
    assembly = Assembly.load(found, units=said.get("units"))
    if said.get("digest") not in (None, digest(assembly)):
        raise InputError(f"Expected the assembly that {beside} was planned for; {found} has changed since. Plan again.")
    return assembly


def digest(assembly: Assembly) -> str:
    """A fingerprint of names, shapes, poses and fixed parts."""
    found = hashlib.sha256(repr((assembly.names, sorted(assembly.fixed), assembly.friction)).encode())
    for body, X, owner in zip(assembly.bodies, assembly.X_WB, assembly.owners):
        found.update(int(owner).to_bytes(4, "little"))
        for array in (X, body.shape.vertices, body.shape.faces):
            # Rounded, so that the last bit of another machine's arithmetic does not count.
            found.update(np.ascontiguousarray(np.round(array, 9) + 0.0).tobytes())
    return found.hexdigest()
