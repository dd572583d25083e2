"""From a folder or a file to an assembly that has been looked over.

Each format's reader gives what stands in the file. Here units are settled (`conversion`), meshes are examined
(`mesh_checks`), parts are looked at where they lie (`mating`), and all that is wrong is raised together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from neurosym.errors import AssemblyError, InputError
from neurosym.geometry.assembly import FRICTION, Assembly, check_fixed
from neurosym.geometry.bodies import Bodies
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.keeping import keep_together
from neurosym.geometry.mesh import triangles
from neurosym.geometry.notes import FaultyPartsError, Note
from neurosym.geometry.readers import kept
from neurosym.geometry.readers.assembly_json import read_json
from neurosym.geometry.readers.burrtools import read_xmpuzzle
from neurosym.geometry.readers.clearances import with_clearances
from neurosym.geometry.readers.contents import Contents, RawMesh, subassemblies
from neurosym.geometry.readers.conversion import in_units, upright
from neurosym.geometry.readers.folder import MESHES, read_folder, read_mesh
from neurosym.geometry.readers.gltf import read_gltf
from neurosym.geometry.readers.limits import within_limits
from neurosym.geometry.readers.mating import floating, mating_tolerances
from neurosym.geometry.readers.mesh_checks import examine
from neurosym.geometry.readers.meshes import as_triangles, parts_from_meshes
from neurosym.geometry.readers.names import distinct
from neurosym.geometry.readers.obj import read_obj
from neurosym.geometry.readers.repeats import Examiner
from neurosym.geometry.readers.solids import separate
from neurosym.geometry.readers.step import read_step
from neurosym.geometry.readers.threemf import read_3mf
from neurosym.geometry.readers.urdf import read_urdf
from neurosym.geometry.shapes import Box, Convex, Part
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances
from neurosym.geometry.units import unit
from neurosym.support.deadline import check
from neurosym.support.progress import Progress, silent

#: Seconds that reading must take for what was read to be kept.
SLOW = 0.2


@dataclass(frozen=True, kw_only=True)
class Options:
    """How to read what a file leaves open: see `load`."""

    up: str | None
    problem: int
    solution: int
    meshes: str
    joints: Mapping[str, float] | None


#: Formats that have a word on what is up themselves; their reader heeds `up`.
_TURNED_BY_READER = (".glb", ".gltf")

#: Formats of meshes alone: what is one mesh in such a file may be many solids.
_MESH_FILES = (".glb", ".gltf", ".3mf", *MESHES)

_READERS: dict[str, Callable[[Path, Options], Contents]] = {
    ".glb": lambda path, options: read_gltf(path, up=options.up),
    ".gltf": lambda path, options: read_gltf(path, up=options.up),
    ".3mf": lambda path, options: read_3mf(path),
    ".step": lambda path, options: read_step(path),
    ".stp": lambda path, options: read_step(path),
    ".xmpuzzle": lambda path, options: read_xmpuzzle(path, problem=options.problem, solution=options.solution),
    ".json": lambda path, options: read_json(path, read_mesh),
    ".obj": lambda path, options: read_obj(path, split=True),
    ".urdf": lambda path, options: read_urdf(path, read_mesh, meshes=options.meshes, joints=options.joints),
    **{ending: (lambda path, options: MESHES[path.suffix.lower()](path)) for ending in MESHES if ending != ".obj"},
}


def load(
    path: str | Path,
    *,
    units: str | None = None,
    fixed: Iterable[str] = (),
    tolerances: Tolerances | None = None,
    touching_gaps: bool = False,
    friction: float | None = None,
    up: str | None = None,
    problem: int = 1,
    solution: int = 1,
    meshes: str = "visual",
    joints: Mapping[str, float] | None = None,
    progress: Progress = silent,
) -> Assembly:
    """An assembly from a folder of meshes or from a file, looked over.

    Args:
        path: a folder with one mesh a part (OBJ, STL, PLY, OFF; see `neurosym.geometry.readers.folder`), or a file:
            GLB, glTF, 3MF, STEP (extra ``cad``), URDF, BurrTools ``.xmpuzzle``, the JSON that `Assembly.save` writes
            (see `neurosym.geometry.readers.assembly_json`), or one mesh. Parts are named after files or nodes.
        units: the unit of the assembly's lengths ("mm", "m", "in", ...). Of a format that states its own (glTF and
            URDF metres, STEP, 3MF and JSON what they say) lengths are converted to it; of others it says what they are.
        fixed: names of parts that never move, besides those that the files name.
        tolerances: kept as they are where given. Otherwise touch is raised so that mating faces that overlap at rest,
            by no more than `tolerances.mate`, count as touching; `notes` says by how much.
        touching_gaps: whether parts drawn with play, whose faces lie near one another without touching, are taken as
            touching (`neurosym.geometry.readers.clearances`); else `notes` says what touch that takes.
        friction: Coulomb's coefficient; None: the file's, else 0.5.
        up: "y" or "z", what is up in the files; None: z, but in glTF see `neurosym.geometry.readers.gltf`.
        problem, solution: which of a puzzle file's, counted from 1.
        meshes, joints: of URDF, which meshes of links, "visual" or "collision", and values of joints (radians, metres).
        progress: called with (done, total) parts that were looked over.

    Returns:
        The assembly; `notes` says what was seen and mended.

    Raises:
        FaultyPartsError: parts that cannot be used (open, crossing themselves, not numbers, overlapping deeply);
            all of them, each with the measure and what to do.
        AssemblyError: the file cannot be read, goes beyond a limit, or reaches outside its folder.
        InputError: an unknown unit, part or number of a problem.
        MissingDependencyError: STEP without cascadio.
    """
    source, options = Path(path), Options(up=up, problem=problem, solution=solution, meshes=meshes, joints=joints)
    if options.up not in (None, "y", "z"):
        raise InputError(f'Expected up as "y", "z" or None; got {options.up!r}.')
    fixed, start = tuple(fixed), perf_counter()
    place = kept.place_of(source, (units, fixed, tolerances, friction, options))
    if place is not None and (known := kept.load(place)) is not None:
        return known
    contents = _read(source, options)
    contents, notes = in_units(contents, None if units is None else unit(units), source)
    if contents.separate:
        contents = separate(contents)
        within_limits(source, 0, parts=len(contents.parts))
    nested = subassemblies(contents.parts)
    names, renamed = distinct([part.name for part in contents.parts])
    called = distinct([*names, *(name for name, _ in nested)], "sub-assembly")[0][len(names) :]
    contents = replace(
        contents,
        parts=tuple(replace(part, name=name) for part, name in zip(contents.parts, names)),
        fixed=(*contents.fixed, *fixed),
        tolerances=tolerances or contents.tolerances,
        touching_gaps=touching_gaps,
        friction=contents.friction if friction is None else friction,
        notes=(*notes, *contents.notes, *renamed),
        subassemblies={
            **contents.subassemblies,
            **{name: tuple(names[n] for n in numbers) for name, (_, numbers) in zip(called, nested)},
        },
    )
    assembly = _checked(contents, str(source), progress)
    if place is not None and perf_counter() - start > SLOW:
        kept.store(place, assembly)
    return assembly


def from_meshes(
    meshes: Mapping[str, Any],
    *,
    units: str | None = None,
    fixed: Iterable[str] = (),
    table: float | None = None,
    friction: float | None = None,
    tolerances: Tolerances | None = None,
    progress: Progress = silent,
) -> Assembly:
    """What `Assembly.from_meshes` does; the meshes are looked over as if they came from files."""
    if not isinstance(meshes, Mapping) or not meshes or not all(name and isinstance(name, str) for name in meshes):
        raise AssemblyError(f"Expected parts as {{name: mesh}}, at least one mesh; got {meshes!r:.80}.")
    raw = tuple(RawMesh(name, *as_triangles(name, mesh)) for name, mesh in meshes.items())
    stated = None if units is None else unit(units)
    return _checked(Contents(raw, stated, tuple(fixed), table, friction, tolerances), "the meshes", progress)


def _checked(contents: Contents, source: str, progress: Progress) -> Assembly:
    """The assembly, once all its parts are found to be sound, one by one and where they lie."""
    total = len(contents.parts) + 1
    parts, mended, faults = _examined(contents.parts, lambda done: progress(done, total))
    if not parts:
        raise FaultyPartsError(source, faults, contents.hint)
    lost = {fault.part for fault in faults}
    held = tuple(name for name in dict.fromkeys(contents.fixed) if name not in lost)
    check_fixed(held, [part.name for part in parts])
    bodies, mask = Bodies(parts), sum(1 << i for i, part in enumerate(parts) if part.name in held)
    surfaces = BodySurfaces(bodies)
    mated, mating, deep = mating_tolerances(surfaces, mask, contents.tolerances)
    if faults or deep:
        raise FaultyPartsError(source, [*faults, *deep], contents.hint)
    mated, near = with_clearances(surfaces, mated, contents.units, touching=contents.touching_gaps)
    ground = float(bodies.bounds[:, 0, 2].min()) if contents.table is None else contents.table
    loose = floating(surfaces, mask, ground, mated.touch * bodies.smallest_extent)
    progress(total, total)
    friction = FRICTION if contents.friction is None else contents.friction
    notes = (*contents.notes, *mended, *mating, *near, *loose)
    groups = (contents.keep, contents.piece_groups, contents.subassemblies)
    made = Assembly(parts, contents.table, friction, mated, held, contents.units, notes, *groups)
    keep_together(made)  # refuses groups that are none
    return made


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
    if len(contents.parts) == 1 and source.suffix.lower() in _MESH_FILES:
        contents = replace(contents, separate=True)
    if options.up == "y" and source.suffix.lower() not in _TURNED_BY_READER:
        contents = upright(contents)
    if not contents.parts:
        raise AssemblyError(f"Expected at least one part in {source}; it has none. Export solids or meshes.")
    return contents


def _examined(
    given: Sequence[RawMesh | Part], progress: Callable[[int], None]
) -> tuple[tuple[Part, ...], list[Note], list[Note]]:
    """Sound parts in order, what was seen, and what is wrong with the others; `progress` is told how many are done."""
    notes: list[Note] = []
    faults: list[Note] = []
    sound: list[RawMesh | Part] = []
    examiner = Examiner()
    for number, part in enumerate(given):
        check()
        progress(number)
        if isinstance(part, Part):
            wrong = _wrong(part)
        else:
            seen = examiner.examine(part)
            notes += seen.notes
            wrong = list(seen.faults)
            part = replace(part, vertices=seen.vertices, faces=seen.faces)
        faults += wrong
        if not wrong:
            sound.append(part)
    # Meshes in the world's frame are looked at together: puzzles are on one grid.
    together = {m.name: (m.vertices, m.faces) for m in sound if isinstance(m, RawMesh) and m.X_WP is None}
    made = {p.name: p for p in parts_from_meshes(together, DEFAULT_TOLERANCES)}
    parts = []
    for part in sound:
        if isinstance(part, Part):
            parts.append(part)
            continue
        own = made.get(part.name) or parts_from_meshes({part.name: (part.vertices, part.faces)}, DEFAULT_TOLERANCES)[0]
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
        if isinstance(body.shape, Convex) and not triangles.are_convex(
            body.shape.vertices, body.shape.faces, 1e-6 * extent
        ):
            sentence = f"Part {part.name!r} has a body that is said to be convex and is not."
            faults.append(Note(part.name, "convex", 0.0, sentence, "Give it as a mesh."))
    return faults
