"""From a folder or a file to an assembly that has been looked over.

Each format's reader, under `neurosym.geometry.readers`, gives what stands in the file. Here units are settled
(`conversion`), meshes are examined (`health`), parts are looked at where they lie (`at_rest`), and all that is wrong is
raised together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from neurosym.errors import AssemblyError, InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.mesh import triangles
from neurosym.geometry.notes import FaultyPartsError, Note
from neurosym.geometry.readers.assembly_json import read_json
from neurosym.geometry.readers.at_rest import floating, tolerances_at_rest
from neurosym.geometry.readers.burrtools import read_xmpuzzle
from neurosym.geometry.readers.contents import Contents, RawMesh
from neurosym.geometry.readers.conversion import in_units, upright
from neurosym.geometry.readers.folder import MESHES, read_folder, read_mesh
from neurosym.geometry.readers.gltf import read_gltf
from neurosym.geometry.readers.health import examine
from neurosym.geometry.readers.meshes import parts_from_meshes
from neurosym.geometry.readers.names import distinct
from neurosym.geometry.readers.obj import read_obj
from neurosym.geometry.readers.step import read_step
from neurosym.geometry.readers.threemf import read_3mf
from neurosym.geometry.shapes import Body, Box, Convex, Part
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances
from neurosym.geometry.units import unit

_FRICTION = 0.5


@dataclass(frozen=True, kw_only=True)
class Options:
    """How to read what a file leaves open; see `Assembly.load`."""

    up: str | None = None
    problem: int = 1
    solution: int = 1


#: Formats that have a word on what is up themselves; their reader heeds `up`.
_TURNED_BY_READER = (".glb", ".gltf")

_READERS: dict[str, Callable[[Path, Options], Contents]] = {
    ".glb": lambda path, options: read_gltf(path, up=options.up),
    ".gltf": lambda path, options: read_gltf(path, up=options.up),
    ".3mf": lambda path, options: read_3mf(path),
    ".step": lambda path, options: read_step(path),
    ".stp": lambda path, options: read_step(path),
    ".xmpuzzle": lambda path, options: read_xmpuzzle(path, problem=options.problem, solution=options.solution),
    ".json": lambda path, options: read_json(path, read_mesh),
    ".obj": lambda path, options: read_obj(path, split=True),
    **{ending: (lambda path, options: MESHES[path.suffix.lower()](path)) for ending in MESHES if ending != ".obj"},
}


def load(
    path: str | Path,
    *,
    units: str | None = None,
    fixed: Iterable[str] = (),
    tolerances: Tolerances | None = None,
    friction: float | None = None,
    options: Options | None = None,
) -> Assembly:
    """What `Assembly.load` does, and says."""
    source, options = Path(path), options or Options()
    if options.up not in (None, "y", "z"):
        raise InputError(f'Expected up as "y", "z" or None; got {options.up!r}.')
    contents = _read(source, options)
    contents, notes = in_units(contents, None if units is None else unit(units), source)
    names, renamed = distinct([part.name for part in contents.parts])
    parts, found, faults = _examined([replace(p, name=n) for p, n in zip(contents.parts, names)])
    notes += [*contents.notes, *renamed, *found]
    stated = tolerances or contents.tolerances
    assembly = Assembly(
        parts if parts else (_PLACEHOLDER,),
        contents.table,
        friction if friction is not None else _FRICTION if contents.friction is None else contents.friction,
        stated or DEFAULT_TOLERANCES,
        units=contents.units,
    )
    if parts:
        wanted = dict.fromkeys((*contents.fixed, *fixed))
        lost = {fault.part for fault in faults}
        assembly = assembly.with_fixed(name for name in wanted if name not in lost)
        tolerances, mating, deep = tolerances_at_rest(assembly, stated is not None)
        assembly = replace(assembly, tolerances=tolerances, _cache={})
        faults += deep
        notes += mating
    if faults:
        raise FaultyPartsError(str(source), faults)
    return replace(assembly, notes=(*notes, *floating(assembly)), _cache={})


#: Stands in where no part is sound, and all that is left to do is to say so.
_PLACEHOLDER = Part("", (Body(Box(np.ones(3)), np.eye(4)),), np.eye(4))


def _read(source: Path, options: Options) -> Contents:
    try:
        is_folder, exists = source.is_dir(), source.exists()
    except (OSError, ValueError) as error:
        raise AssemblyError(f"Expected a folder or a file; got {str(source)!r}: {error}.") from None
    if not exists:
        raise AssemblyError(f"Expected a folder of meshes or a file; there is none at {source}.")
    if is_folder:
        contents = read_folder(source)
        return upright(contents) if options.up == "y" else contents
    if source.suffix.lower() not in _READERS:
        known = ", ".join(_READERS)
        raise AssemblyError(f"Expected a folder of meshes, or a file that ends in {known}; got {source.name!r}.")
    if options.up == "y" and source.suffix.lower() == ".json":
        raise InputError(f'Expected no up="y" with {source.name}: in an assembly\'s JSON z is up.')
    contents = _READERS[source.suffix.lower()](source, options)
    if options.up == "y" and source.suffix.lower() not in _TURNED_BY_READER:
        contents = upright(contents)
    if not contents.parts:
        raise AssemblyError(f"Expected at least one part in {source}; it has none. Export solids or meshes.")
    return contents


def _examined(given: list[RawMesh | Part]) -> tuple[tuple[Part, ...], list[Note], list[Note]]:
    """Sound parts in order, what was found, and what is wrong with the others."""
    notes: list[Note] = []
    faults: list[Note] = []
    sound: list[RawMesh | Part] = []
    for part in given:
        if isinstance(part, Part):
            wrong = _wrong(part)
        else:
            seen = examine(part)
            notes += seen.notes
            wrong = list(seen.faults)
            part = replace(part, vertices=seen.vertices, faces=seen.faces)
        faults += wrong
        if not wrong:
            sound.append(part)
    # Meshes in the world's frame are looked at together: puzzles are on one grid.
    together = {m.name: m for m in sound if isinstance(m, RawMesh) and m.X_WP is None}
    made = {p.name: p for p in parts_from_meshes(together, DEFAULT_TOLERANCES)} if together else {}
    parts = []
    for part in sound:
        if isinstance(part, Part):
            parts.append(part)
            continue
        own = made.get(part.name) or parts_from_meshes({part.name: part}, DEFAULT_TOLERANCES)[0]
        parts.append(replace(own, X_WP=own.X_WP if part.X_WP is None else part.X_WP, density=part.density))
    return tuple(parts), notes, faults


def _wrong(part: Part) -> list[Note]:
    """Faults of the bodies of a part that is given ready: they are used as they stand, or not at all."""
    faults: list[Note] = []
    for body in part.bodies:
        if isinstance(body.shape, Box):
            continue
        seen = examine(RawMesh(part.name, body.shape.vertices, body.shape.faces))
        faults += seen.faults
        faults += [
            Note(n.part, n.kind, n.measure, n.sentence, "Wind its faces outward: here a mesh is used as it stands.")
            for n in seen.notes
            if n.kind in ("inverted", "winding")
        ]
        extent = float(np.ptp(body.shape.vertices, axis=0).max()) if not seen.faults else 0.0
        corners = body.shape.vertices[body.shape.faces]
        if isinstance(body.shape, Convex) and not triangles.are_convex(body.shape.vertices, corners, 1e-6 * extent):
            said = f"Part {part.name!r} has a body that is said to be convex and is not."
            faults.append(Note(part.name, "convex", 0.0, said, "Give it as a mesh."))
    return faults
