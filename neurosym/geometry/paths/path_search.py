"""Paths for parts that no straight line takes out: a lattice of translations, then OMPL.

Searches are counted in checks of poses, not in seconds, so the same seed gives the same path on any machine. No path
leaves here that `check_path` has not confirmed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.paths.lattice import Lattice
from neurosym.geometry.paths.path_check import check_path
from neurosym.geometry.paths.removal import OutOfBudget, Removal
from neurosym.geometry.paths.trees import Growth, connected, grown_out
from neurosym.geometry.rigid_motions import Interpolation, posed, shifted
from neurosym.geometry.step_motion import Kind, StepMotion
from neurosym.support.arrays import Array
from neurosym.support.deadline import check
from neurosym.support.progress import tell

#: What `extract` tries, in this order.
KINDS: tuple[Kind, ...] = ("lattice", "translation", "rigid")

#: How far trees of translations and of rigid motions grow at once, in smallest extents (plus radians), attempt by
#: attempt: measured on narrow slots and a hook, where longer steps miss the way in and shorter ones arrive late.
RANGES: dict[Kind, tuple[float, ...]] = {"translation": (1.0, 0.5, 2.0), "rigid": (1.0, 0.3, 2.0)}

#: How far apart OMPL checks a motion, in smallest extents; each new attempt halves it.
RESOLUTION = 0.05

#: The share of the budget of a search over rigid motions that goes to quarter turns on the lattice, before the trees.
TURNS_SHARE = 0.25

#: Shortcuts tried on a path that a tree has found.
SHORTCUTS = 60


@dataclass(frozen=True)
class Failure:
    """Why there is no path, in a sentence, after so many poses and ways were asked.

    Attributes:
        because: names of the parts that were in the way, the most frequent first.
        proved: whether no translations, however many and in whatever directions, take the parts out. Motions that turn
            are never ruled out.
    """

    reason: str
    because: tuple[str, ...]
    proved: bool
    checks: int


def extract(
    assembly: Assembly,
    moving: int,
    among: int,
    *,
    rng: np.random.Generator,
    ground: float | None = None,
    kinds: Sequence[Kind] = KINDS,
    max_checks: int = 200_000,
    seconds: float | None = None,
) -> StepMotion | Failure:
    """A path that takes parts, moving as one, out from among others.

    They are out when a plane across one of the axes divides them from the others. Straight lines are not asked first:
    `BlockingGraph` knows them.

    Args:
        moving: a bitset of the parts that leave together.
        among: a bitset of the parts that are there.
        rng: for the searches with OMPL.
        ground: height (z, world) of a plane that nothing goes below; None: there is none.
        kinds: which searches to try, in this order: "lattice" and "translation" never turn the parts, "rigid" does.
        max_checks, seconds: how many poses and ways each kind of search may ask, and for how long; where time ends a
            search, another run may end elsewhere.

    Raises:
        InputError: a kind that there is not, or parts that move without others that stay.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise InputError(f"Expected kinds of search among {', '.join(KINDS)}; got {kind!r}.")
    if not moving or not among & ~moving:
        raise InputError("Expected parts that move and others that stay; one of the two is empty.")
    met: Counter[int] = Counter()
    proved, checks = False, 0
    reasons = []
    for kind in kinds:
        tell(f"a path, {kind}")
        removal = Removal(assembly, moving, among, ground, max_checks, seconds)
        try:
            if kind == "lattice":
                lattice = Lattice(removal)
                poses = lattice.search()
                if poses is None:
                    proved = lattice.complete
                    reasons.append("no translations lead out" if proved else "no way out on the lattice")
            elif proved and kind == "translation":
                continue
            else:
                poses = _turned(removal, max_checks) if kind == "rigid" else None
                poses = poses or _grown(removal, kind, rng)
        except OutOfBudget:
            poses = None
        if poses is not None:
            path = removal.path(kind, poses)
            check = check_path(path, assembly, among, ground=ground)
            if check.holds:
                return path
            reasons.append(f"the path of kind {kind!r} did not pass its check: {check.reason}")
        elif removal.spent():
            reasons.append(f"the search of kind {kind!r} ran out of its budget after {removal.checks:,} checks")
        elif kind != "lattice":
            reasons.append(f"no attempt of kind {kind!r} found a way out")
        checks += removal.checks
        met += removal.met
    names = tuple(assembly.names[p] for p, _ in sorted(met.items(), key=lambda item: (-item[1], item[0])))
    return Failure(f"{', '.join(assembly.in_mask(moving))}: {'; '.join(reasons)}.", names, proved, checks)


def _turned(removal: Removal, max_checks: int) -> list[Array] | None:
    """Poses of a way out on the lattice with quarter turns, for a part of the budget; None: none was found."""
    removal.max_checks = int(TURNS_SHARE * max_checks)
    try:
        return Lattice(removal, turns=True).search()
    except OutOfBudget:
        return None
    finally:
        removal.max_checks = max_checks


def _grown(removal: Removal, kind: Kind, rng: np.random.Generator) -> list[Array] | None:
    """Poses of a way out that a random tree found, made shorter and confirmed without gaps; None: none was."""
    ranges = RANGES[kind]
    for attempt, step in enumerate(ranges):
        until = removal.checks + (removal.max_checks - removal.checks) // (len(ranges) - attempt)
        seed = int(rng.integers(1, 2**31 - 1))
        growth = Growth(step, RESOLUTION / 2**attempt, seed, partial(removal.spent, until))
        poses = _tree(removal, kind == "rigid", growth)
        check()
        if poses is None:
            continue
        if all(removal.is_clear(Interpolation(a, b, removal.centre)) for a, b in pairwise(poses)):
            return _shortened(removal, poses, rng)
        if removal.spent():
            return None
    return None


def _tree(removal: Removal, turning: bool, growth: Growth) -> list[Array] | None:
    """One attempt with OMPL: towards places outside, or over rigid motions until it is out.

    Places are where the moving parts' centre is, from its assembled place, in smallest extents.
    """
    scale, centre = removal.assembly.smallest_extent, removal.centre
    reach = float(np.linalg.norm(removal.own_points - centre, axis=1).max()) + scale
    low = (removal.other_points.min(axis=0) - reach - centre) / scale
    high = (removal.other_points.max(axis=0) + reach - centre) / scale

    def pose(X: Array) -> Array:
        return posed(X[:3, :3], centre + scale * X[:3, 3] - X[:3, :3] @ centre)

    if turning:
        motions = grown_out(
            low, high, lambda X: not removal.hit(pose(X)), lambda X: removal.left(pose(X)) / scale, growth
        )
        return None if motions is None else list(map(pose, motions))
    outside = [np.eye(3)[axis] * edge for axis in range(3) for edge in (low, high)]
    places = connected(low, high, np.zeros(3), outside, lambda at: not removal.hit(shifted(scale * at)), growth)
    return None if places is None else [shifted(scale * at) for at in places]


def _shortened(removal: Removal, poses: list[Array], rng: np.random.Generator) -> list[Array]:
    """Fewer poses: each shortcut is confirmed without gaps, which OMPL's own do not do."""
    for _ in range(SHORTCUTS):
        if len(poses) < 3 or removal.spent():
            break
        i, j = sorted(int(k) for k in rng.choice(len(poses), 2, replace=False))
        if j - i > 1 and removal.is_clear(Interpolation(poses[i], poses[j], removal.centre)):
            poses = [*poses[: i + 1], *poses[j:]]
    return poses
