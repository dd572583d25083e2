"""An exploded view: the parts pulled apart so that each can be seen, along their ways out where a plan has them."""

from collections.abc import Sequence

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.rigid_motions import shifted
from neurosym.geometry.staging import Staging
from neurosym.simulation.captions import captioned, label
from neurosym.simulation.filming import FilmSet
from neurosym.simulation.looks import Camera
from neurosym.simulation.scene import part_colours
from neurosym.simulation.storyboard import best_camera
from neurosym.support.arrays import Array, Pixels

#: Gap between the bounds of exploded parts, as a share of the median part's extent.
GAP = 0.35
#: More parts than this have no numbers: they would cover what they number.
MOST_NUMBERED = 150
#: How far parts go without a plan, at a spread of one: so many times their way from the middle.
RADIAL = 0.9


def explode(staging: Staging, *, spread: float = 1.0) -> dict[str, Array]:
    """Where the parts are in an exploded view: part name -> float64 (3,), by how much it is shifted.

    With motions, backwards: the part that leaves last stays, and each other one goes along its way out until its
    bounds are clear of all that are placed by then. Parts without a straight way out, and all parts of a staging
    without motions, go away from the middle. Parts that are gone before the plan begins are left out. `spread`: how
    far apart: 1 as described, 0 not at all.
    """
    if not np.isfinite(spread) or spread < 0:
        raise InputError(f"Expected a spread of 0 or more; got {spread!r}.")
    assembly, shown = staging.assembly, staging.shown
    bounds = {name: b for name, b in zip(assembly.names, assembly.part_bounds) if name in shown}
    directions = _directions(staging)
    if not directions:
        every = np.array(list(bounds.values()))
        middle = (every[:, 0].min(axis=0) + every[:, 1].max(axis=0)) / 2
        return {name: spread * RADIAL * (b.mean(axis=0) - middle) for name, b in bounds.items()}
    gap = GAP * float(np.median([np.ptp(b, axis=0).mean() for b in bounds.values()]))
    shifts = {name: np.zeros(3) for name in bounds if name not in directions}
    placed = [bounds[name] for name in shifts]
    # A removal that comes first lies outermost; an arrival that comes last does too.
    order = [m for m in staging.motions if not m.arrives][::-1] + [m for m in staging.motions if m.arrives]
    for motion in order:
        names = [name for name in motion.parts if name not in shifts]
        if not names:
            continue
        way = directions[names[0]]
        own = np.array([bounds[name] for name in names])
        box = np.array([own[:, 0].min(axis=0), own[:, 1].max(axis=0)])
        far = spread * _clear(box, placed, way, gap)
        for name in names:
            shifts[name] = far * way
            placed.append(bounds[name] + far * way)
    return {name: shifts[name] for name in bounds}


def exploded_view(
    staging: Staging,
    *,
    spread: float = 1.0,
    size: tuple[int, int] = (960, 720),
    camera: Camera | None = None,
    title: str = "",
    names: bool = True,
) -> Pixels:
    """A picture of the parts pulled apart (see `explode`): uint8 (height and a line of words, width, 3).

    Args:
        size: width and height in pixels, without the words below.
        camera: from which side; None takes `best_camera`.
        names: whether each part's name is written on it (unless they bear pictures), or its number, with
            a list beside (up to `MOST_NUMBERED` parts).
    """
    shifts = explode(staging, spread=spread)
    bounds = dict(zip(staging.assembly.names, staging.assembly.part_bounds))
    corners = [np.array(np.meshgrid(*bounds[name].T)).reshape(3, -1).T + shift for name, shift in shifts.items()]
    where = {name: shifted(shift) for name, shift in shifts.items()}
    with FilmSet(
        staging.assembly,
        part_colours(staging),
        np.concatenate(corners),
        size=size,
        camera=camera or best_camera(staging),
        ground=False,
        tops=staging.tops,
    ) as film:
        picture = film.picture(tuple(shifts), where)
        if names and not staging.tops and len(shifts) <= MOST_NUMBERED:
            picture = label(picture, film.seen_at(tuple(shifts), where), tuple(shifts))
    count = len(shifts)
    return captioned(picture, title or "exploded view", note=f"{count} part{'s' if count != 1 else ''}")


def _directions(staging: Staging) -> dict[str, Array]:
    """Part -> unit vector of its way out, where that is straight, or at least ends somewhere else."""
    found: dict[str, Array] = {}
    for motion in (m for m in staging.motions if m.tracks):
        end, centre = motion.tracks[0].poses[-1], motion.tracks[0].centre
        way = end[:3, :3] @ centre + end[:3, 3] - centre
        length = float(np.linalg.norm(way))
        if length > 0:
            found |= dict.fromkeys(motion.parts, way / length)
    return found


def _clear(box: Array, placed: Sequence[Array], way: Array, gap: float) -> float:
    """How far a box (2, 3) must go along a unit vector until it is `gap` away from all others."""
    far = 0.0
    for other in placed:
        enter, leave = -np.inf, np.inf
        for axis in range(3):
            low, high = other[0, axis] - gap - box[1, axis], other[1, axis] + gap - box[0, axis]
            if abs(way[axis]) < 1e-9:
                # Side by side along this axis, without a gap, is apart.
                if not low + gap < 0 < high - gap:
                    enter, leave = np.inf, -np.inf
                continue
            first, last = sorted((low / way[axis], high / way[axis]))
            enter, leave = max(enter, first), min(leave, last)
        if enter < leave and leave > 0:
            far = max(far, leave)
    return float(far)
