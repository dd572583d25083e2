"""BurrTools puzzles (``.xmpuzzle``): gzip'd XML; the pieces of one stored solution, on the cubic grid.

A shape's ``group`` in a problem, or its children ``<group group= count=>``, say that so many of its pieces need not be
separated from others of that group; all pieces of group 0, and those of none, are to be separated.
A placement ``x y z t`` puts cell c of a shape at (x, y, z) + R[t] (c - h), h being the shape's hotspot.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from defusedxml.ElementTree import fromstring

from neurosym.errors import AssemblyError, InputError
from neurosym.geometry.grouping import PieceGroup
from neurosym.geometry.notes import Note
from neurosym.geometry.readers.cells import parts_from_cells
from neurosym.geometry.readers.contents import Contents
from neurosym.geometry.readers.limits import MAX_TEXT_BYTES, gunzip, read_bytes, reading, within_limits
from neurosym.geometry.readers.names import distinct
from neurosym.support.arrays import Numbers

#: Cells of one shape's bounding box, and of all pieces together: each becomes a body.
MAX_CELLS = 100_000

#: The 24 orientations in the order of the program: what the new x, y and z are.
_ORIENTATIONS = (
    "+x+y+z", "+x-z+y", "+x-y-z", "+x+z-y", "-z+y+x", "-y-z+x", "+z-y+x", "+y+z+x",
    "-x+y-z", "-x-z-y", "-x-y+z", "-x+z+y", "+z+y-x", "+y-z-x", "-z-y-x", "-y+z-x",
    "-y+x+z", "+z+x+y", "+y+x-z", "-z+x-y", "+y-x+z", "-z-x+y", "-y-x-z", "+z-x-y",
)  # fmt: skip


def rotations() -> Numbers:
    """int64 (24, 3, 3): the rotation matrices by number."""
    matrices = np.zeros((24, 3, 3), dtype=np.int64)
    for number, word in enumerate(_ORIENTATIONS):
        for row in range(3):
            matrices[number, row, "xyz".index(word[2 * row + 1])] = 1 if word[2 * row] == "+" else -1
    return matrices


#: Number of a group -> numbers of pieces of one shape, and how many of them are in it.
Groups = dict[int, list[tuple[range, int]]]


@dataclass(frozen=True, eq=False)
class _Shape:
    """``name``; ``cells``: int64 (n, 3), from the hotspot."""

    name: str
    cells: Numbers
    variable: int


def read_xmpuzzle(path: Path, *, problem: int = 1, solution: int = 1) -> Contents:
    """The pieces, cells of edge 1, of a stored solution of a problem, counted from 1; `InputError` for none such."""
    data = gunzip(read_bytes(path, MAX_TEXT_BYTES), path)
    with reading("a BurrTools puzzle", path):
        root = fromstring(data, forbid_dtd=True)
        if root.tag != "puzzle":
            raise AssemblyError(f"Expected a BurrTools puzzle in {path}; its XML is of <{root.tag}>.")
        grid = root.find("gridType")
        if grid is not None and grid.get("type", "0") != "0":
            raise AssemblyError(f"Expected the cubic grid in {path}; it has grid type {grid.get('type')}.")
        problems = root.findall("problems/problem")
        chosen = _chosen(problems, problem, "problem", path)
        pieces, groups = _pieces(chosen, [*root.findall("shapes/voxel")], path)
        stored = [s for s in chosen.findall("solutions/solution") if s.find("assembly") is not None]
        if not stored:
            others = [str(n) for n, p in enumerate(problems, 1) if p.find("solutions/solution/assembly") is not None]
            hint = f"Take problem {' or '.join(others)} (problem=, --puzzle)."
            hint = hint if others else "Solve it in BurrTools, and save it again."
            raise AssemblyError(f"Expected problem {problem} of {path} to store a solution; it stores none. {hint}")
        words = (_chosen(stored, solution, "solution", path).findtext("assembly") or "").split()
        return _placed(pieces, groups, words, path)


def _chosen(among: list[Any], number: int, what: str, path: Path) -> Any:
    if not 1 <= number <= len(among):
        raise InputError(f"Expected the number of a {what} in {path}, 1 to {len(among)}; got {number}.")
    return among[number - 1]


def _pieces(problem: Any, voxels: list[Any], path: Path) -> tuple[list[tuple[str, _Shape]], Groups]:
    """The pieces in the order in which a solution places them, and for each group which of them may be in it."""
    pieces: list[tuple[str, _Shape]] = []
    groups: Groups = {}
    for entry in problem.findall("shapes/shape"):
        number = int(entry.attrib["id"])
        shape = _shape(voxels[number], number, path)
        count = int(entry.get("count", entry.get("max", "1")))
        within_limits(path, 0, parts=len(pieces) + count)
        stated = [(int(g.attrib["group"]), int(g.get("count", count))) for g in entry.findall("group")]
        for group, most in stated or [(int(entry.get("group", "0")), count)]:
            if group and most > 0:
                groups.setdefault(group, []).append((range(len(pieces), len(pieces) + count), most))
        pieces += [(shape.name if count == 1 else f"{shape.name}.{k + 1}", shape) for k in range(count)]
    return pieces, groups


def _shape(voxel: Any, number: int, path: Path) -> _Shape:
    size = [int(voxel.attrib[k]) for k in "xyz"]
    if min(size) < 1 or np.prod([float(n) for n in size]) > MAX_CELLS:
        raise AssemblyError(f"Expected shapes of at most {MAX_CELLS:,} cells in {path}; shape {number} is {size}.")
    # A digit after a symbol is its colour.
    symbols = [c for c in voxel.text or "" if c in "#+_"]
    if len(symbols) != np.prod(size):
        raise AssemblyError(f"Expected {np.prod(size)} cells of shape {number} in {path}; got {len(symbols)}.")
    filled = np.array(symbols).reshape(size[::-1]) != "_"
    cells = np.argwhere(filled)[:, ::-1] - [int(voxel.get(k, "0")) for k in ("hx", "hy", "hz")]
    name = voxel.get("name") or f"S{number + 1}"
    return _Shape(name, cells.astype(np.int64), symbols.count("+"))


def _placed(pieces: list[tuple[str, _Shape]], groups: Groups, words: list[str], path: Path) -> Contents:
    R = rotations()
    names, notes = distinct([name for name, _ in pieces])
    cells: dict[str, Numbers] = {}
    at = 0
    for name, (_, shape) in zip(names, pieces):
        if at < len(words) and words[at] == "x":
            at += 1
            continue
        x, y, z, t = (int(w) for w in words[at : at + 4])
        at += 4
        if not 0 <= t < len(R):
            raise AssemblyError(f"Expected orientations 0 to {len(R) - 1} in {path}; piece {name!r} has {t}.")
        cells[name] = np.array([x, y, z]) + shape.cells @ R[t].T
        if shape.variable:
            sentence = f"Part {name!r} has {shape.variable} variable cells, which were taken as filled."
            notes.append(Note(name, "variable", shape.variable, sentence))
    if at != len(words):
        raise AssemblyError(f"Expected placements of {len(pieces)} pieces in {path}; got {len(words)} numbers.")
    if sum(map(len, cells.values())) > MAX_CELLS:
        raise AssemblyError(f"Expected at most {MAX_CELLS:,} cells in {path}; got more.")
    parts = parts_from_cells({name: own.tolist() for name, own in cells.items()}, 1.0)
    placed = [
        [(tuple(names[n] for n in numbers if names[n] in cells), most) for numbers, most in groups[group]]
        for group in sorted(groups)
    ]
    members = (tuple((own, min(most, len(own))) for own, most in group if own) for group in placed)
    return Contents(parts, notes=tuple(notes), piece_groups=tuple(PieceGroup(own) for own in members if own))
