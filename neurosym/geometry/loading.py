"""From a folder or a file to an assembly that has been looked over.

Each format's reader, under `neurosym.geometry.formats`, gives what stands in the file. Here units are settled, meshes
are examined (`health`), overlaps at rest are measured (`mating`), and all that is wrong is raised together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import AssemblyError, InputError
from neurosym.geometry import collision, triangles
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.formats.assembly_json import read_json
from neurosym.geometry.formats.burrtools import read_xmpuzzle
from neurosym.geometry.formats.contents import Y_UP, Contents, RawMesh
from neurosym.geometry.formats.folder import MESHES, read_folder, read_mesh
from neurosym.geometry.formats.gltf import read_gltf
from neurosym.geometry.formats.names import distinct
from neurosym.geometry.formats.obj import read_obj
from neurosym.geometry.formats.step import read_step
from neurosym.geometry.formats.threemf import read_3mf
from neurosym.geometry.health import examine
from neurosym.geometry.mating import overlaps
from neurosym.geometry.meshes import parts_from_meshes
from neurosym.geometry.notes import FaultyPartsError, Note
from neurosym.geometry.shapes import Body, Box, Convex, Part, Shape
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances
from neurosym.geometry.units import factor, unit

#: Mating faces may overlap by this share of the smallest extent: measured on timber joints, answers held so far.
MAX_MATING = 5e-2

#: The touching tolerance is raised to the measured overlap times this.
_ABOVE = 1.2

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
    contents, notes = _in_units(contents, None if units is None else unit(units), source)
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
        tolerances, mating, deep = _mating(assembly, stated is not None)
        assembly = replace(assembly, tolerances=tolerances, _cache={})
        faults += deep
        notes += mating
    if faults:
        raise FaultyPartsError(str(source), faults)
    return replace(assembly, notes=(*notes, *_floating(assembly)), _cache={})


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
        return _upright(contents) if options.up == "y" else contents
    if source.suffix.lower() not in _READERS:
        known = ", ".join(_READERS)
        raise AssemblyError(f"Expected a folder of meshes, or a file that ends in {known}; got {source.name!r}.")
    if options.up == "y" and source.suffix.lower() == ".json":
        raise InputError(f'Expected no up="y" with {source.name}: in an assembly\'s JSON z is up.')
    contents = _READERS[source.suffix.lower()](source, options)
    if options.up == "y" and source.suffix.lower() not in _TURNED_BY_READER:
        contents = _upright(contents)
    if not contents.parts:
        raise AssemblyError(f"Expected at least one part in {source}; it has none. Export solids or meshes.")
    return contents


def _upright(contents: Contents) -> Contents:
    """The contents of a file in which y is up, turned so that z is."""
    parts: list[RawMesh | Part] = []
    for part in contents.parts:
        if isinstance(part, RawMesh) and part.X_WP is None:
            parts.append(replace(part, vertices=part.vertices @ Y_UP[:3, :3].T))
        else:
            assert part.X_WP is not None
            parts.append(replace(part, X_WP=Y_UP @ part.X_WP))
    note = Note("", "axes", 0.0, "y is up in the file, as was said: turned so that z is.")
    return replace(contents, parts=tuple(parts), notes=(note, *contents.notes))


# -- units ----------------------------------------------------------------------------------------------------


def _in_units(contents: Contents, wanted: str | None, source: Path) -> tuple[Contents, list[Note]]:
    """The contents with lengths in the unit that the caller wants, or that the format states."""
    known = None if contents.units is None else unit(contents.units)
    if known is None:
        if wanted is None:
            said = f"{source.name} does not say what its lengths are in, and nothing was assumed."
            return contents, [Note("", "units", 0.0, said, "State the unit (units=, --units) if it matters.")]
        return replace(contents, units=wanted), []
    times = factor(known, wanted or known)
    if times == 1.0:
        return replace(contents, units=known), []
    parts = tuple(_scaled(part, times) for part in contents.parts)
    table = None if contents.table is None else contents.table * times
    said = f"{source.name} is in {known}: its lengths were multiplied by {times:g}, to be in {wanted}."
    return replace(contents, parts=parts, table=table, units=wanted), [Note("", "units", times, said)]


def _scaled(part: RawMesh | Part, times: float) -> RawMesh | Part:
    """The part with all lengths multiplied; a mass stays what it is."""
    density = part.density / times**3
    if isinstance(part, RawMesh):
        X = None if part.X_WP is None else _farther(part.X_WP, times)
        return replace(part, vertices=part.vertices * times, X_WP=X, density=density)
    bodies = tuple(Body(_larger(b.shape, times), _farther(b.X_PB, times)) for b in part.bodies)
    return Part(part.name, bodies, _farther(part.X_WP, times), density)


def _farther(X: NDArray[np.float64], times: float) -> NDArray[np.float64]:
    moved = np.array(X, dtype=np.float64)
    moved[:3, 3] *= times
    return moved


def _larger(shape: Shape, times: float) -> Shape:
    if isinstance(shape, Box):
        return Box(shape.size * times)
    return replace(shape, vertices=shape.vertices * times)


# -- parts ----------------------------------------------------------------------------------------------------


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


# -- at rest --------------------------------------------------------------------------------------------------


def _mating(assembly: Assembly, stated: bool) -> tuple[Tolerances, list[Note], list[Note]]:
    """Tolerances that take the overlap of mating faces for touch, a note on it, and the overlaps that are too deep.

    Args:
        stated: whether the tolerances were given; then they are kept, and say how deep an overlap may be.
    """
    tolerances, smallest = assembly.tolerances, assembly.smallest_extent
    limit = tolerances.touch if stated else max(MAX_MATING, tolerances.touch)
    deepest: dict[tuple[str, str], float] = {}
    for overlap in overlaps(assembly):
        pair = (assembly.names[assembly.owners[overlap.a]], assembly.names[assembly.owners[overlap.b]])
        deepest[pair] = max(deepest.get(pair, 0.0), overlap.depth)
    faults = [
        Note(
            a,
            "overlap",
            depth,
            f"Parts {a!r} and {b!r} overlap by {depth:.4g}, {depth / smallest:.2g} of the smallest extent of any part; "
            f"mating faces may by {limit:g} of it.",
            f"Move them apart; if they are meant to mate so, state Tolerances(touch={1.1 * depth / smallest:.2g}), --touch "
            "on the command line.",
            b,
        )
        for (a, b), depth in deepest.items()
        if depth > limit * smallest
    ]
    slight = {pair: depth for pair, depth in deepest.items() if depth <= limit * smallest}
    share = max(slight.values(), default=0.0) / smallest
    if share <= tolerances.touch:
        return tolerances, [], faults
    (a, b), depth = max(slight.items(), key=lambda item: item[1])
    touch = max(min(_ABOVE * share, MAX_MATING), 1.01 * share)
    said = f"Mating faces of {len(slight)} pairs of parts overlap, by up to {depth:.4g} between {a!r} and {b!r}; "
    said += f"overlaps up to {touch * smallest:.4g} ({touch:.2g} of the smallest extent) are taken for touch."
    return replace(tolerances, touch=touch), [Note(a, "mating", depth, said, other=b)], faults


def _floating(assembly: Assembly) -> list[Note]:
    """A note for each part that touches neither another one nor the ground, and is not fixed."""
    touch, bounds, owners = assembly.touch, assembly.body_bounds, assembly.owners
    held = np.array([bool(assembly.fixed_mask >> i & 1) for i in range(len(assembly))])
    held[owners[bounds[:, 0, 2] <= assembly.ground + touch]] = True
    grown = (bounds[:, 0] - touch / 2, bounds[:, 1] + touch / 2)
    pairs = triangles.near_pairs(grown, grown, 50 * triangles.CHUNK)
    pairs = np.zeros((0, 2), dtype=np.int64) if pairs is None else pairs
    pairs = pairs[(pairs[:, 0] < pairs[:, 1]) & (owners[pairs[:, 0]] != owners[pairs[:, 1]])]
    objects: dict[int, object] = {}

    def gap(a: int, b: int) -> float:
        for i in (a, b):
            if i not in objects:
                objects[i] = collision.shape_object(assembly.bodies[i].shape, assembly.X_WB[i])
        return max(collision.distance(objects[a], objects[b]), 0.0)

    for a, b in pairs:
        if not held[owners[[a, b]]].all() and gap(int(a), int(b)) <= touch:
            held[owners[[a, b]]] = True
    notes = []
    for part in np.flatnonzero(~held):
        name = assembly.names[part]
        own, others = np.flatnonzero(owners == part), np.flatnonzero(owners != part)
        away = np.maximum(bounds[own[0], 0] - bounds[others, 1], bounds[others, 0] - bounds[own[0], 1]).max(axis=1)
        near = others[np.argsort(away)[:8]]
        least, nearest = min(
            [(gap(int(i), int(j)), assembly.names[owners[j]]) for i in own[:64] for j in near], default=(np.inf, "")
        )
        above = float(bounds[own, 0, 2].min() - assembly.ground)
        said = f"Part {name!r} touches nothing: it is {above:.4g} above the ground"
        said += f", and {least:.4g} from {nearest!r}, the nearest part." if nearest else "."
        remedy = "Move it, fix it, or state a larger Tolerances(touch=), --touch on the command line."
        notes.append(Note(name, "floating", min(above, least), said, remedy))
    return notes
