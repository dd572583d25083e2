"""A folder with one mesh a part, and single files of one mesh.

The meshes are taken in the order of their names, each part named after its file. Where there is a folder ``parts``, the
parts are in it, and meshes beside it are surroundings, such as a table: they stay fixed. A ``supports.json``,
``{"fixed": [names]}``, in the folder or beside a folder ``parts``, names fixed parts. Links may not lead outside.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from neurosym.errors import AssemblyError, UnknownNameError
from neurosym.geometry.readers.contents import Contents, RawMesh, united
from neurosym.geometry.readers.limits import MAX_TEXT_BYTES, inside, read_bytes, reading, within_limits
from neurosym.geometry.readers.names import distinct
from neurosym.geometry.readers.obj import read_obj
from neurosym.geometry.readers.off import read_off
from neurosym.geometry.readers.ply import read_ply
from neurosym.geometry.readers.stl import read_stl
from neurosym.support.deadline import check

#: Formats of one mesh, by the file's ending.
MESHES: dict[str, Callable[[Path], Contents]] = {".obj": read_obj, ".stl": read_stl, ".ply": read_ply, ".off": read_off}

PARTS, SUPPORTS = "parts", "supports.json"


def read_mesh(path: Path) -> RawMesh:
    """The mesh in a file, named after it; `UnknownNameError` where its ending is none of `MESHES`."""
    ending = path.suffix.lower()
    if ending not in MESHES:
        raise UnknownNameError("mesh format", ending, MESHES)
    meshes = [m for m in MESHES[ending](path).parts if isinstance(m, RawMesh)]
    return meshes[0] if len(meshes) == 1 else united(path.stem, [(m.vertices, m.faces) for m in meshes])


def read_folder(folder: Path) -> Contents:
    """The parts of a folder; `AssemblyError` for no meshes, one that cannot be read, a link that leads outside."""
    with reading("a folder of meshes", folder):
        has_parts = (folder / PARTS).is_dir()
        where = inside(folder, PARTS) and folder / PARTS if has_parts else folder
        files = _mesh_files(where)
        every = [*files, *(_mesh_files(folder) if has_parts else [])]
    if not files:
        raise AssemblyError(f"Expected meshes ({', '.join(MESHES)}) in {where}; got none. Put one file a part there.")
    within_limits(folder, 0, parts=len(every))
    names, notes = distinct([file.stem for file in every])
    meshes: list[RawMesh] = []
    faces = 0
    for name, file in zip(names, every):
        check()
        meshes.append(replace(read_mesh(inside(file.parent, file.name)), name=name))
        faces += len(meshes[-1].faces)
        within_limits(folder, 0, faces)
    supports = folder if has_parts or folder.name != PARTS else folder.parent
    fixed = (*_supports(supports), *names[len(files) :])
    return Contents(tuple(meshes), fixed=tuple(dict.fromkeys(fixed)), notes=tuple(notes))


def _mesh_files(folder: Path) -> list[Path]:
    """Files whose ending is known, in the order of their names; hidden ones are nobody's part."""
    return sorted(f for f in folder.iterdir() if f.suffix.lower() in MESHES and not f.name.startswith("."))


def _supports(folder: Path) -> list[str]:
    path = folder / SUPPORTS
    if not path.is_file():
        return []
    with reading('{"fixed": [names of parts]}', path):
        given: Any = json.loads(read_bytes(inside(folder, SUPPORTS), MAX_TEXT_BYTES))
        names = given["fixed"]
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise TypeError("fixed is no list of names")
    return list(names)
