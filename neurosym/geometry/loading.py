"""Assemblies from files: a folder with one mesh a part, or one file.

A folder holds one mesh a part, taken in the order of names, or a folder ``parts`` with them; then meshes beside it are
surroundings, such as a table, and stay fixed. A ``supports.json``, ``{"fixed": [names]}``, names fixed parts.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from neurosym.errors import AssemblyError, UnknownNameError
from neurosym.geometry.assembly import Assembly, Part
from neurosym.geometry.formats import assembly_json
from neurosym.geometry.formats.contents import MAX_PARTS, MAX_TEXT_BYTES, Contents, inside, read_bytes
from neurosym.geometry.formats.obj import read_obj
from neurosym.geometry.meshes import parts_from_meshes
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances

#: Formats of one mesh, by the file's ending.
MESHES: dict[str, Callable[[Path], Contents]] = {".obj": read_obj}

#: Names the fixed parts of a folder.
SUPPORTS = "supports.json"


def load(
    path: str | Path,
    *,
    units: str | None = None,
    fixed: Iterable[str] = (),
    tolerances: Tolerances | None = None,
    friction: float | None = None,
) -> Assembly:
    """What `Assembly.load` does."""
    source = Path(path)
    if source.is_dir():
        assembly = _folder(source, units, tolerances or DEFAULT_TOLERANCES, 0.5 if friction is None else friction)
    elif source.suffix.lower() == ".json":
        assembly = _own(source)
    else:
        raise AssemblyError(f"Expected a folder of meshes or a file; got {source}.")
    return assembly.with_fixed(dict.fromkeys((*assembly.fixed, *fixed)))


def _folder(folder: Path, units: str | None, tolerances: Tolerances, friction: float) -> Assembly:
    movable = folder / "parts" if (folder / "parts").is_dir() else folder
    files = _mesh_files(movable)
    around = _mesh_files(folder) if movable is not folder else []
    if not files:
        raise AssemblyError(f"Expected meshes ({', '.join(MESHES)}) in {movable}; got none.")
    meshes = {f.stem: MESHES[f.suffix.lower()](inside(f.parent, f.name)).meshes[0] for f in [*files, *around]}
    fixed = [*_supports(folder if movable is not folder or folder.name != "parts" else folder.parent)]
    fixed += [f.stem for f in around]
    parts = parts_from_meshes(meshes, tolerances)
    return Assembly(parts, None, friction, tolerances, tuple(fixed), units)


def _mesh_files(folder: Path) -> list[Path]:
    found = sorted(
        (f for f in folder.iterdir() if f.suffix.lower() in MESHES and not f.name.startswith(".")), key=lambda f: f.name
    )
    if len(found) > MAX_PARTS:
        raise AssemblyError(f"Expected at most {MAX_PARTS:,} parts; {folder} has {len(found):,}.")
    return found


def _supports(folder: Path) -> list[str]:
    path = folder / SUPPORTS
    if not path.exists():
        return []
    said = f'Expected {{"fixed": [names of parts]}} in {path}'
    try:
        given: Any = json.loads(read_bytes(inside(folder, SUPPORTS), MAX_TEXT_BYTES))
    except (ValueError, RecursionError) as error:
        raise AssemblyError(f"{said}; got: {error}.") from None
    names = given.get("fixed") if isinstance(given, dict) else None
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise AssemblyError(f"{said}; got something else.")
    return names


def _own(path: Path) -> Assembly:
    document = assembly_json.read(path)
    parts: list[Part] = []
    for part in document.parts:
        if isinstance(part, Part):
            parts.append(part)
            continue
        file = inside(path.parent, part.mesh)
        if file.suffix.lower() not in MESHES:
            raise UnknownNameError("format of meshes", file.suffix, MESHES)
        mesh = MESHES[file.suffix.lower()](file).meshes[0]
        made = parts_from_meshes({part.name: mesh}, document.tolerances or DEFAULT_TOLERANCES)[0]
        parts.append(Part(part.name, made.bodies, part.X_WP, part.density))
    return Assembly(
        tuple(parts),
        document.table,
        document.friction,
        document.tolerances or DEFAULT_TOLERANCES,
        document.fixed,
        document.units,
    )
