"""Assemblies that were read and looked over, kept on disk by the bytes of their files, the options and this code.

What refers to other files (URDF, glTF, an assembly's JSON) is read anew each time: its bytes do not decide it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.grouping import PieceGroup
from neurosym.geometry.notes import Note
from neurosym.geometry.readers.folder import MESHES, PARTS, SUPPORTS
from neurosym.geometry.shapes import Body, Box, Convex, Mesh, Part, Shape
from neurosym.geometry.tolerances import Tolerances
from neurosym.support import disk_cache

#: Bytes beyond which files are read anew.
LARGEST = 1_000_000_000
#: Files whose bytes decide what is read.
ALONE = (".step", ".stp", ".glb", ".3mf", ".stl", ".ply", ".off", ".xmpuzzle")
_KINDS = {"box": Box, "convex": Convex, "mesh": Mesh}


def place_of(source: Path, options: object) -> Path | None:
    """Where the assembly of these files, read with these options, is kept; None: it is not to be."""
    if not disk_cache.keeps_geometry():
        return None
    try:
        files = sorted(_files(source))
        if not files or any(file.is_symlink() for file in files) or sum(f.stat().st_size for f in files) > LARGEST:
            return None
        content = [part for file in files for part in (str(file.relative_to(source)).encode(), file.read_bytes())]
    except (OSError, ValueError):
        return None  # whoever reads it says why
    if source.suffix.lower() == ".glb" and b'"uri"' in content[1]:
        return None
    try:
        cascadio = metadata.version("cascadio")
    except metadata.PackageNotFoundError:
        cascadio = ""
    return disk_cache.place("assemblies", repr((options, source.name, cascadio)).encode(), *content)


def _files(source: Path) -> Iterator[Path]:
    """The files that are read, and others that lie beside them."""
    if source.is_file() and source.suffix.lower() in ALONE:
        yield source
    elif source.is_dir() and source.name != PARTS:  # which looks at its parent, too
        for folder in (source, source / PARTS):
            yield from (file for file in folder.glob("*") if file.suffix.lower() in MESHES or file.name == SUPPORTS)


def load(place: Path) -> Assembly | None:
    """The assembly that is kept at a place, number by number; None: none is, or it is damaged."""
    arrays = disk_cache.load_all(place)
    if arrays is None:
        return None
    try:
        return _unpacked(arrays)
    except (KeyError, ValueError, TypeError, IndexError):
        return None


def store(place: Path, assembly: Assembly) -> None:
    """Keep an assembly at a place, whole or not at all."""
    shapes = [body.shape for part in assembly.parts for body in part.bodies]
    solid = [s for s in shapes if not isinstance(s, Box)]
    none = np.zeros((0, 3))
    rest = {name: getattr(assembly, name) for name in ("table", "friction", "fixed", "units", "keep")}
    rest |= {
        "tolerances": asdict(assembly.tolerances),
        "notes": [asdict(note) for note in assembly.notes],
        "piece_groups": [group.members for group in assembly.piece_groups],
        "subassemblies": dict(assembly.subassemblies),
        "names": assembly.names,
        "bodies": [len(part.bodies) for part in assembly.parts],
        "kinds": [type(shape).__name__.lower() for shape in shapes],
    }
    arrays = {
        "rest": np.frombuffer(json.dumps(rest).encode(), dtype=np.uint8),
        "X_WP": np.array([part.X_WP for part in assembly.parts]),
        "density": np.array([part.density for part in assembly.parts]),
        "X_PB": np.array([body.X_PB for part in assembly.parts for body in part.bodies]),
        "body_density": np.array([body.density for part in assembly.parts for body in part.bodies]),
        "sizes": np.array([s.size for s in shapes if isinstance(s, Box)]).reshape(-1, 3),
        "counts": np.array([(len(s.vertices), len(s.faces)) for s in solid], dtype=np.int64).reshape(-1, 2),
        "vertices": np.concatenate([none, *(s.vertices for s in solid)]),
        "faces": np.concatenate([none.astype(np.int64), *(s.faces for s in solid)]),
    }
    disk_cache.store_all(place, arrays)


def _unpacked(arrays: dict[str, NDArray[Any]]) -> Assembly:
    rest = json.loads(arrays["rest"].tobytes())
    ends = np.cumsum(arrays["counts"], axis=0)[:-1]
    vertices, faces = (np.split(arrays[k], ends[:, c]) for c, k in enumerate(("vertices", "faces")))
    solids, boxes = iter(zip(vertices, faces)), iter(arrays["sizes"])
    shapes: list[Shape] = [Box(next(boxes)) if k == "box" else _KINDS[k](*next(solids)) for k in rest["kinds"]]
    bodies = iter(map(Body, shapes, arrays["X_PB"], arrays["body_density"].tolist()))
    parts = tuple(
        Part(name, tuple(next(bodies) for _ in range(count)), X, density)
        for name, count, X, density in zip(rest["names"], rest["bodies"], arrays["X_WP"], arrays["density"].tolist())
    )
    groups = [PieceGroup(tuple((tuple(names), n) for names, n in members)) for members in rest["piece_groups"]]
    return Assembly(
        parts,
        rest["table"],
        rest["friction"],
        Tolerances(**rest["tolerances"]),
        tuple(rest["fixed"]),
        rest["units"],
        tuple(Note(**note) for note in rest["notes"]),
        tuple(map(tuple, rest["keep"])),
        tuple(groups),
        {name: tuple(own) for name, own in rest["subassemblies"].items()},
    )
