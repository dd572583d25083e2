"""What is wrong with a mesh, by how much, and what to do: harmless faults are mended, the others reported.

Merging vertices, dropping faces of no area and turning faces outward change no solid, so they are done and noted.
Holes, crossings and missing numbers are the user's to mend: nobody can know what was meant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurosym.geometry.mesh import topology, triangles
from neurosym.geometry.notes import Note
from neurosym.geometry.readers.contents import RawMesh
from neurosym.geometry.readers.limits import MAX_FACES
from neurosym.geometry.shapes import LARGEST, SMALLEST
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES
from neurosym.support.arrays import Array, Numbers, extents

#: Corners nearer than this share of the part are one: text has some eight digits, a 32-bit number seven.
MERGE = 1e-6

#: A part thinner than this share of its extent (2 volumes over its surface) encloses nothing.
FLAT = 1e-9

#: Faces that cross by less than this share of the part's smallest extent do no harm: touch is ten times as much.
CROSSING = 1e-4

#: Shells of one part whose order inside one another is looked at.
MAX_SHELLS = 64

#: What to do about solids that overlap within a part.
UNITE = "Unite them (trimesh.boolean.union) for the right mass."

#: Corners that do not turn (cosine) between two faces folded onto one another.
_FOLDED = -1 + 1e-6


@dataclass(frozen=True, eq=False)
class Examined:
    """A mesh as it can be used, unless there are faults.

    Attributes:
        vertices: float64 (n, 3), merged.
        faces: int64 (m, 3), outward, none of them a line or a point.
        notes: harmless findings.
        faults: findings with which the part cannot be used.
    """

    vertices: Array
    faces: Numbers
    notes: tuple[Note, ...]
    faults: tuple[Note, ...]


class _Report:
    """Notes and faults of one part, gathered while it is looked at."""

    def __init__(self, part: str) -> None:
        self.part = part
        self.notes: list[Note] = []
        self.faults: list[Note] = []

    def note(self, kind: str, measure: float, sentence: str, remedy: str = "") -> None:
        self.notes.append(Note(self.part, kind, float(measure), f"Part {self.part!r} {sentence}.", remedy))

    def fault(self, kind: str, measure: float, sentence: str, remedy: str) -> None:
        self.faults.append(Note(self.part, kind, float(measure), f"Part {self.part!r} {sentence}.", remedy))


def examine(mesh: RawMesh) -> Examined:
    """Look a mesh over, mend what can be mended without changing the solid, and say what cannot.

    Args:
        mesh: as read; its name is the part's.
    """
    report = _Report(mesh.name)
    vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    if _can_be_measured(vertices, faces, mesh.rounding, report):
        vertices, faces = _closed(vertices, faces, report)
        if not report.faults:
            faces = _outward(vertices, faces, report)
        if not report.faults:
            _look_for_crossings(vertices, faces, report)
    return Examined(vertices, faces, tuple(report.notes), tuple(report.faults))


def _can_be_measured(vertices: Array, faces: Numbers, rounding: float, report: _Report) -> bool:
    if not len(vertices) or not len(faces):
        report.fault("empty", 0, "is empty: it has no faces", "Take the file away, or export the part again.")
        return False
    if len(faces) > MAX_FACES:
        report.fault("empty", len(faces), f"has {len(faces):,} faces, more than {MAX_FACES:,}", "Simplify the mesh.")
        return False
    if faces.min() < 0 or faces.max() >= len(vertices):
        report.fault(
            "index", faces.max(), f"has faces that index more than its {len(vertices)} vertices", "Export it again."
        )
        return False
    corners = vertices[topology.in_use(vertices, faces)]
    if not np.isfinite(corners).all():
        bad = int((~np.isfinite(corners)).any(axis=1).sum())
        report.fault("nan", bad, f"has {bad} vertices that are NaN or infinite", "Export the part again.")
        return False
    with np.errstate(over="ignore"):
        reach = extents(corners)
    if not SMALLEST <= reach.max() <= LARGEST:
        sentence = f"is {reach.max():g} long, expected {SMALLEST:g} to {LARGEST:g}"
        kind = "flat" if reach.max() < SMALLEST else "far"
        report.fault(kind, reach.max(), sentence, "Use another unit of length.")
        return False
    away = float(np.abs(corners).max())
    step = 2 * away * rounding
    thin = float(reach[reach >= SMALLEST].min())
    if step > DEFAULT_TOLERANCES.touch * thin / 4:
        sentence = f"lies {away:g} from the origin, where coordinates come in steps of {step:.2g}; it is {thin:g} thin"
        report.fault("far", away, sentence, "Move the assembly to the origin before exporting it.")
        return False
    return True


def _closed(vertices: Array, faces: Numbers, report: _Report) -> tuple[Array, Numbers]:
    """The mesh with its vertices merged, its faces of no area dropped, wound one way; faults where it is open."""
    given = len(faces)
    extent = float(extents(vertices[topology.in_use(vertices, faces)]).max())
    exact, joined = topology.merged(vertices, faces)
    vertices, merged = topology.merged(exact, joined, MERGE * extent)
    faces = topology.without_repeats(merged)
    half, winding = topology.open_edges(faces) if len(faces) else (np.zeros((0, 2)), False)
    if len(half) or not len(faces):
        once = topology.without_repeats(merged, cancel=False)
        turned = topology.same_winding(once) if len(once) > len(faces) else None
        left = 0 if turned is None else len(topology.open_edges(turned)[0])
        if turned is not None and not left:
            report.note("doubled", len(once), "had faces twice, wound both ways, as if hollow; each was taken once")
            return vertices, turned if topology.signed_volume(vertices, turned) > 0 else turned[:, ::-1]
        if not len(faces):
            sentence = f"its faces cancel, and taken once leave {left} edges open" if left else "its faces are lines"
            report.fault("flat", left, f"encloses nothing: {sentence}", "Give it a thickness, or close it.")
            return vertices, faces
    elif len(vertices) < len(exact) and len(topology.open_edges(topology.without_repeats(joined))[0]):
        report.note("merged", len(exact) - len(vertices), f"has corners up to {MERGE * extent:.2g} apart made one")
    if len(faces) < given:
        dropped = given - len(faces)
        sentence = f"had {dropped} faces of no area, given twice or back to back, which were dropped"
        report.note("degenerate", dropped, sentence)
    if winding:
        turned = topology.same_winding(faces)
        if turned is None:
            report.fault("open", len(half), "is one-sided, like a Moebius strip", "Export the part as a solid.")
            return vertices, faces
        changed = int((turned != faces).any(axis=1).sum())
        report.note("winding", min(changed, len(faces) - changed), "had faces wound both ways, which were turned")
        faces = turned
        half, _ = topology.open_edges(faces)
    if len(half):
        if topology.closes_at_junctions(vertices, faces, MERGE * extent):
            sentence = f"has {len(half)} edges that meet others halfway; it is closed all the same"
            report.note("t-junction", len(half), sentence)
        else:
            sentence = f"is open: {len(half)} edges have a face on one side only"
            remedy = "Fill the holes (trimesh.repair.fill_holes), or export it as a solid."
            report.fault("open", len(half), sentence, remedy)
    return vertices, faces


def _outward(vertices: Array, faces: Numbers, report: _Report) -> Numbers:
    """The faces turned so that each shell is a solid, or a cavity in one."""
    shells = topology.shells_of(faces)
    volumes = topology.shell_volumes(vertices, faces, shells)
    area = float(np.linalg.norm(triangles.area_vectors(vertices[faces]) / 2, axis=1).sum())
    extent = float(extents(vertices).max())
    total = float(volumes.sum())
    if 2 * np.abs(volumes).sum() <= FLAT * extent * area or abs(total) <= FLAT * extent * area / 2:
        remedy = "Give it a thickness, or wind its faces one way."
        report.fault("flat", total, f"encloses no volume ({total:.2g})", remedy)
        return faces
    turned = np.full(len(volumes), total < 0)
    if 1 < len(volumes) <= MAX_SHELLS and topology.closed_shells(faces) is not None:
        for k, volume in enumerate(np.where(turned, -volumes, volumes)):
            around, point = vertices[faces[shells != k]], vertices[faces[shells == k][:1]].mean(axis=1)
            inside = bool(triangles.are_inside(point, around[:, ::-1] if total < 0 else around)[0])
            turned[k] ^= volume < 0 and not inside
    if turned.any():
        faces = faces.copy()
        which = turned[shells]
        faces[which] = faces[which][:, ::-1]
        report.note("inverted", total, f"was inside out (volume {total:.4g}); its faces were turned")
    return faces


def _look_for_crossings(vertices: Array, faces: Numbers, report: _Report) -> None:
    margin = CROSSING * float(extents(vertices).min())
    folds = _folds(vertices, faces, margin)
    if folds:
        sentence = f"crosses itself: {folds} pairs of neighbouring faces are folded onto one another"
        report.fault("self-intersecting", folds, sentence, "Cut its polygons into triangles before exporting it.")
        return
    if triangles.are_convex(vertices, faces, margin):
        return
    pairs = triangles.crossing_pairs(vertices, faces, margin)
    shells = topology.shells_of(faces)
    if not len(pairs):
        _look_for_nested(vertices, faces, report)
        return
    i, j = pairs.T
    within = shells[i] == shells[j]
    which = within if within.any() else ~within
    count = int(which.sum())
    where = vertices[faces[i[which][0]]].mean(axis=0)
    at = f"{count} pairs of faces, one near ({', '.join(f'{x:.4g}' for x in where)})"
    if within.any():
        report.fault(
            "self-intersecting", count, f"crosses itself: {at}", "Mend it (a boolean union of it with nothing does)."
        )
    else:
        sentence = f"is made of solids that overlap: {at}; its volume counts the overlap twice"
        report.note("self-intersecting", count, sentence, UNITE)


def _look_for_nested(vertices: Array, faces: Numbers, report: _Report) -> None:
    shells = topology.closed_shells(faces)
    if shells is None or shells.max() == 0:
        return
    volumes = topology.shell_volumes(vertices, faces, shells)
    solids = np.flatnonzero(volumes > 0)
    nested = False
    for k in solids if len(volumes) <= MAX_SHELLS else ():
        if triangles.are_inside(vertices[faces[shells == k][:1]].mean(axis=1), vertices[faces[shells != k]])[0]:
            sentence = f"is made of solids inside one another; its volume counts {volumes[k]:.4g} twice"
            report.note("self-intersecting", volumes[k], sentence, UNITE)
            nested = True
    if len(solids) > 1 and not nested:
        report.note("solids", len(solids), f"is made of {len(solids)} solids side by side, which move as one")


def _folds(vertices: Array, faces: Numbers, margin: float) -> int:
    """How many pairs of neighbouring faces lie on one another: what is left of a hollow polygon cut as a fan."""
    pairs, _ = topology.neighbours(faces)
    t = vertices[faces]
    vectors = triangles.area_vectors(t) / 2
    area = np.linalg.norm(vectors, axis=1)
    longest = np.linalg.norm(t - np.roll(t, 1, axis=1), axis=2).max(axis=1)
    wide = 2 * area > 10 * margin * np.maximum(longest, 1e-300)
    pairs = pairs[wide[pairs].all(axis=1)]
    cosine = np.einsum("nd,nd->n", vectors[pairs[:, 0]], vectors[pairs[:, 1]]) / area[pairs].prod(axis=1)
    return int((cosine < _FOLDED).sum())
