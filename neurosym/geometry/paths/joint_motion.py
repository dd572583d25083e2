"""Motions of a robot's joints from one configuration to another, by OMPL. Knows no robot: a function says what is free.

Counted in checks of configurations, not in seconds, so that the same seed gives the same motion on any machine.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from neurosym.errors import InputError
from neurosym.geometry.paths.trees import Growth, connected
from neurosym.support.arrays import Array

#: How far apart configurations on a motion are checked (largest change of any joint, radians).
RESOLUTION = 0.04
#: How far OMPL's trees grow in one step (radians, Euclidean).
RANGE = 0.8
#: Shortcuts tried on a motion that was found.
SHORTCUTS = 40


def plan_joint_motion(
    lower: ArrayLike,
    upper: ArrayLike,
    start: ArrayLike,
    goal: ArrayLike,
    free: Callable[[Array], bool],
    *,
    rng: np.random.Generator,
    resolution: float = RESOLUTION,
    max_checks: int = 20_000,
) -> Array | None:
    """Configurations from `start` to `goal`, with straight lines between them along which all is free.

    RRTConnect finds a motion, which is then shortened; whatever is returned was checked every `resolution`.

    Args:
        lower, upper: float64 (n,): limits of the joints (radians).
        start, goal: float64 (n,): within the limits.
        free: whether a configuration, float64 (n,), is allowed.
        rng: what OMPL's seed and the shortcuts are drawn from.
        resolution: largest change of any joint between two checks (radians).
        max_checks: configurations asked before giving up.

    Returns:
        float64 (k, n), k >= 2; None when none was found, start or goal not being free included.

    Raises:
        InputError: arrays of other shapes, or a start or goal outside the limits.
    """
    low, high, first, last = (np.asarray(v, dtype=np.float64) for v in (lower, upper, start, goal))
    if low.ndim != 1 or not low.shape == high.shape == first.shape == last.shape:
        raise InputError(f"Expected limits, start and goal of one shape (n,); got {[v.shape for v in (low, first)]}.")
    for what, q in (("start", first), ("goal", last)):
        if not ((low <= q) & (q <= high)).all():
            raise InputError(f"Expected the {what} within the joints' limits; got {np.round(q, 3).tolist()}.")
    checks = 0

    def asked(q: Array) -> bool:
        nonlocal checks
        checks += 1
        return bool(free(q))

    if not asked(first) or not asked(last):
        return None
    growth = Growth(RANGE, resolution, int(rng.integers(1, 2**31)), lambda: checks >= max_checks)
    path = connected(low, high, first, [last], asked, growth)
    if path is None:
        return None
    for _ in range(SHORTCUTS):
        if len(path) < 3:
            break
        i, j = sorted(int(k) for k in rng.choice(len(path), 2, replace=False))
        if j - i > 1 and is_free_between(path[i], path[j], asked, resolution):
            path = [*path[: i + 1], *path[j:]]
    # OMPL's own spacing is not ours: nothing leaves that was not checked here.
    pairs = pairwise(path)
    return np.array(path) if all(is_free_between(a, b, asked, resolution) for a, b in pairs) else None


def is_free_between(a: Array, b: Array, free: Callable[[Array], bool], resolution: float = RESOLUTION) -> bool:
    """Whether all of the straight line from `a` to `b`, float64 (n,), is free, as far as `resolution` sees."""
    steps = max(1, int(np.ceil(np.abs(b - a).max() / resolution)))
    return all(free(a + (b - a) * i / steps) for i in range(steps + 1))
