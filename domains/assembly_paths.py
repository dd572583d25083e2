"""Ways out where no straight line is free: exact moves for puzzles of cells, searches with a budget for the rest."""

from __future__ import annotations

import zlib

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.grid import GridCells, cells_of
from neurosym.geometry.paths import Path
from neurosym.geometry.voxel_moves import Stuck, first_separation, separation_path

#: Poses and ways that each kind of search may ask for one way out (`neurosym.geometry.extraction`): seconds, mostly.
MAX_CHECKS = 20_000

#: States that the exact search over moves of groups may visit for one separation.
MAX_STATES = 200_000


def ground_of(assembly: Assembly) -> float | None:
    """Height of the plane that nothing goes through, or None."""
    return assembly.ground if assembly.has_table else None


def way_out(assembly: Assembly, moving: int, among: int) -> Path | tuple[str, tuple[str, ...], bool]:
    """A path on which parts (a bitset), moving as one, leave the others in `among`, which rest.

    Returns:
        The path; or why there is none, whom it met, and whether that is proved: for parts of cells, that no
        translations lead out. Asked twice, the answer is the same.
    """
    from neurosym.geometry.extraction import Failure, extract

    def search() -> Path | tuple[str, tuple[str, ...], bool]:
        rng = np.random.default_rng([zlib.crc32(f"{moving:x} {among:x}".encode())])
        found = extract(assembly, moving, among, rng=rng, ground=ground_of(assembly), max_checks=MAX_CHECKS)
        if isinstance(found, Failure):
            return found.reason, found.because, found.proved
        return found

    return assembly.remember(f"way out {moving:x} {among:x}", search)


def separation(assembly: Assembly, block: int, *, standing: bool) -> tuple[Path, int] | bool:
    """The first separation of a block of parts of cells into two, by shifts of groups, with the fewest moves.

    Args:
        block: a bitset of parts.
        standing: whether it is what stands on the ground and holds the fixed parts; otherwise it is in the hand.

    Returns:
        The path and the parts that leave (a bitset); or whether it is proved that there is none.
    """
    cells = grid_of(assembly)
    assert cells is not None

    def search() -> tuple[Path, int] | bool:
        fixed = assembly.fixed_mask if standing else 0
        ground = ground_of(assembly) if standing else None
        found = first_separation(cells, block, fixed=fixed, ground=ground, max_states=MAX_STATES)
        return found.proved if isinstance(found, Stuck) else (separation_path(cells, found), found.group)

    return assembly.remember(f"separation {block:x} {standing}", search)


def grid_of(assembly: Assembly) -> GridCells | None:
    """The grid that all parts are made of, if there is one."""
    return assembly.remember("grid of cells", lambda: cells_of(assembly))


