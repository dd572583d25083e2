"""What a film of a plan shows at each step: who is in the picture, from which side, how large, and in which words."""

import numpy as np

from neurosym.geometry.staging import Staging
from neurosym.simulation.filming import DEFAULT_CAMERA, TOPS_CAMERA
from neurosym.simulation.looks import Camera
from neurosym.support.arrays import Array

#: So many degrees the camera turns towards the broad side of an assembly that is four times as long as wide.
_TURN = 20.0


def company(staging: Staging, step: int) -> tuple[str, ...]:
    """Names of the parts that are in place around what moves in step number `step` (from 0).

    A group that leaves together is taken apart later, in the hand: then only what is left of it is there. Backwards, a
    group is put together in the hand and then arrives; until then its parts are not where they will be.
    """
    motion, motions = staging.motions[step], staging.motions
    mine = set(motion.parts)
    if not motion.arrives:
        there = staging.there(step)
        if mine <= set(there):
            return there
        earlier = [m.parts for m in motions[:step] if not m.arrives]
        first = next((i for i, parts in enumerate(earlier) if mine & set(parts)), None)
        if first is None:
            return there
        left = set(earlier[first]).difference(*earlier[first + 1 :])
        return tuple(name for name in staging.assembly.names if name in left)
    later = [set(m.parts) for m in motions[step + 1 :] if m.arrives]
    group = next((parts for parts in later if mine & parts), None)
    if group is None:
        # What will arrive once more, with others, waits in the hand.
        waiting = set().union(*later) if later else set()
        return tuple(name for name in staging.there(step) if name not in waiting | mine)
    coming = {name for m in motions[step:] if m.arrives and set(m.parts) != group for name in m.parts}
    return tuple(name for name in staging.assembly.names if name in group - coming)


def first_part(staging: Staging, step: int) -> str | None:
    """The part that a step is about: the one that its action is named after, or the first that moves; None: none."""
    action, parts = staging.plan[step], staging.motions[step].parts
    if not parts:
        return None
    return action if action in parts else parts[0]


def describe(staging: Staging, step: int) -> str:
    """'remove L, along +z'; 'remove a with b, along +x'; 'take a off b, along -z'."""
    action, motion = staging.plan[step], staging.motions[step]
    if not motion.parts:
        return action
    around, part = set(company(staging, step)), first_part(staging, step)
    if part is None:
        return action
    verb = "place" if motion.arrives else "remove"
    others = [name for name in motion.parts if name != part]
    name = part if action in motion.parts else f"{action}: {part}"
    words = f"{verb} {name}{' with ' + _few(others) if others else ''}"
    if not motion.arrives and not around >= set(staging.there(step)):
        words = f"take {name} off {_few(sorted(around - {part}))}"
    held = f", {_few(motion.held)} held" if motion.held else ""
    return f"{words}, {motion.course}{held}"


def _few(names: tuple[str, ...] | list[str]) -> str:
    """Up to four names, or three and how many more."""
    return ", ".join(names) if len(names) <= 4 else f"{', '.join(names[:3])} and {len(names) - 3} more"


def best_camera(staging: Staging) -> Camera:
    """From the front right, from above; turned towards the broad side of what is long; steeper to read pictures."""
    if staging.tops:
        return TOPS_CAMERA
    x, y, _ = np.maximum(np.ptp(staging.assembly.bounds, axis=0), 1e-9)
    share = float(np.clip(np.log2(x / y) / 2, -1, 1))
    # The front is towards -y, at -90 degrees, the right side at 0.
    turn = -_TURN * share if share > 0 else -2 * _TURN * share
    return Camera(DEFAULT_CAMERA.azimuth + turn, DEFAULT_CAMERA.elevation, field_of_view=DEFAULT_CAMERA.field_of_view)


def room_for(staging: Staging) -> Array:
    """float64 (n, 3), in the world: bounds of all parts, resting and at places along their paths."""
    bounds = zip(staging.assembly.names, staging.assembly.part_bounds)
    corners = {name: np.array(np.meshgrid(*b.T)).reshape(3, -1).T for name, b in bounds}
    found = list(corners.values())
    for motion in (m for m in staging.motions if m.tracks):
        for share in np.linspace(0, 1, 2 * len(motion.tracks[0].poses) + 1):
            found += [corners[name] @ X[:3, :3].T + X[:3, 3] for name, X in motion.at(float(share)).items()]
    return np.concatenate(found)
