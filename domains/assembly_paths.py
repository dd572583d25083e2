"""Paths where no straight line is free: exact moves for puzzles of cells, else searches; and a check of any motion."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.paths.grid import GridCells
from neurosym.geometry.paths.path_check import check_path
from neurosym.geometry.paths.voxel_search import first_separation
from neurosym.geometry.paths.voxel_separation import Separation, Stuck, separation_path
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.step_motion import GROUND, StepMotion
from neurosym.language.search_problem import Verdict
from neurosym.support.bitsets import bits
from neurosym.support.words import listed

if TYPE_CHECKING:
    from domains.assembly import Setting

#: Poses and ways that each kind of search may ask for one way out (`geometry.paths.path_search`): seconds, mostly.
MAX_CHECKS = 100_000

#: States that the exact search over moves of groups may visit for one separation.
MAX_STATES = 200_000


@dataclass(frozen=True)
class NoWay:
    """That no way was found: why, whom the parts met, and whether that is proved (for cells: by translations)."""

    reason: str
    because: tuple[str, ...]
    proved: bool


def ground_of(assembly: Assembly) -> float | None:
    """Height of the plane that nothing goes through, or None."""
    return assembly.ground if assembly.has_table else None


def way_out(geometry: AssemblyGeometry, moving: int, among: int, *, shifting: bool) -> StepMotion | NoWay:
    """A path on which parts (a bitset), moving as one, leave the others in `among`.

    Args:
        shifting: whether the others may be shifted meanwhile, and go back to their places (for parts of cells). Else
            they rest.

    Asked twice, the answer is the same.
    """
    exact = shifting and geometry.cells is not None
    return geometry.ask_once(_by_moves if exact else _by_search, moving, among)


def _by_moves(geometry: AssemblyGeometry, moving: int, among: int) -> StepMotion | NoWay:
    assembly, cells = geometry.assembly, geometry.cells
    assert cells is not None
    found = first_separation(
        cells,
        among,
        fixed=assembly.fixed_mask & among,
        ground=ground_of(assembly),
        accept=lambda group: group == moving,
        max_states=MAX_STATES,
    )
    return _way(cells, found)


def _by_search(geometry: AssemblyGeometry, moving: int, among: int) -> StepMotion | NoWay:
    from neurosym.geometry.paths.path_search import KINDS, Failure, extract

    assembly = geometry.assembly
    rng = np.random.default_rng([zlib.crc32(f"{moving:x} {among:x}".encode())])
    kinds = KINDS if geometry.cells is None else KINDS[:1]  # on cells the lattice is all there is by translations
    found = extract(assembly, moving, among, rng=rng, ground=ground_of(assembly), kinds=kinds, max_checks=MAX_CHECKS)
    if isinstance(found, Failure):
        return NoWay(found.reason, found.because, found.proved and geometry.cells is not None)
    return found


def separation(geometry: AssemblyGeometry, block: int, *, standing: bool) -> StepMotion | NoWay:
    """The first separation of a block of parts of cells into two, by shifts of groups, with the fewest moves.

    Args:
        block: a bitset of parts.
        standing: whether it is what stands on the ground and holds the fixed parts; otherwise it is in the hand.
    """
    return geometry.ask_once(_separation, block, standing)


def _separation(geometry: AssemblyGeometry, block: int, standing: bool) -> StepMotion | NoWay:
    assembly, cells = geometry.assembly, geometry.cells
    assert cells is not None
    fixed = assembly.fixed_mask if standing else 0
    ground = ground_of(assembly) if standing else None
    return _way(cells, first_separation(cells, block, fixed=fixed, ground=ground, max_states=MAX_STATES))


def _way(cells: GridCells, found: Separation | Stuck) -> StepMotion | NoWay:
    if isinstance(found, Separation):
        return separation_path(cells, found)
    names = tuple(cells.names[p] for p in bits(found.block))
    sentence = f"No moves of groups separate what is wanted of {listed(names)}, in {found.explored:,} states."
    return NoWay(sentence, names, found.proved)


def check_motion(
    geometry: AssemblyGeometry, setting: Setting, motion: StepMotion, among: int, *, standing: bool
) -> Verdict:
    """Whether parts may leave the others in `among` by a motion that a plan says, asked of the pairs concerned alone.

    Args:
        standing: whether all that stands on the ground; otherwise it is in the hand.
    """
    assembly, sentence = geometry.assembly, ", ".join(motion.parts)
    if motion.direction is None:
        if setting.paths == "straight" or not motion.tracks:
            return Verdict(False, motion.parts, f"{sentence} cannot go {motion}: that is no straight line.")
        clear = check_path(motion, assembly, among, ground=ground_of(assembly) if standing else None)
        return Verdict(clear.holds, clear.parts, clear.reason, motion=motion)
    direction, leaving = np.array(motion.direction), assembly.mask(motion.parts)
    if min(np.abs(direction - d).max() for d in geometry.blocking(setting.directions).vectors) > 1e-9:
        return Verdict(False, motion.parts, f"{sentence} cannot go {motion}: that is none of the problem's directions.")
    hit = 0
    for part in bits(leaving):
        hit |= geometry.hits_along(part, direction, among & ~leaving)
    into_table = standing and assembly.has_table and direction[2] < -assembly.tolerances.parallel
    names = (*assembly.in_mask(hit), *([GROUND] if into_table else []))
    if names:
        return Verdict(False, assembly.in_mask(hit), f"{sentence} cannot go {motion}: {listed(names)} would be hit.")
    return Verdict(True, motion=motion)
