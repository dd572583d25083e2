"""From contact patches to springs at their corners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from neurosym.geometry.contact.contacts import TABLE, Contact
from neurosym.geometry.stability.patches import patch_axes
from neurosym.geometry.stability.springs import DEFAULT_NUMBERS, Array, SpringNumbers, Springs


def contact_springs(
    patches: Sequence[Contact],
    masses: Array,
    centres: Array,
    *,
    friction: float,
    gaps: Array | None = None,
    numbers: SpringNumbers = DEFAULT_NUMBERS,
) -> Springs:
    """The springs of parts with these masses (n,) and centres (n, 3) that touch in these patches.

    A patch's stiffness is its area. Its corners share it by the area of the patch about each, so that a corner that
    is told twice, or a needless one on an edge, changes nothing.

    Args:
        patches: between parts `a` and `b`, or the table; see `merged_patches`.
        friction: Coulomb's coefficient.
        gaps: float64 (len(patches),): how far the faces of each are apart (length); None: they touch.
    """
    counts = [len(p.points) for p in patches]
    patch = np.repeat(np.arange(len(patches)), counts)
    a = np.array([p.a for p in patches], dtype=np.int64)[patch]
    b = np.array([p.b for p in patches], dtype=np.int64)[patch]
    at = np.concatenate([np.zeros((0, 3)), *(p.points for p in patches)])
    frames = np.array([[-p.normal, *patch_axes(p)] for p in patches]).reshape(-1, 3, 3)
    axes = frames[patch]
    areas = np.array([p.area for p in patches])
    across = np.concatenate([np.zeros(0), *(p.area * _shares(p) for p in patches)]) / (areas.mean() if counts else 1.0)
    sizes = _sizes(a, b, at, centres)
    weights = masses / masses.mean()
    gap = (np.zeros(len(patches)) if gaps is None else gaps)[patch] / (numbers.softness * sizes.mean())
    return Springs(
        a,
        b,
        at,
        axes,
        _pull(axes, at, a, centres, sizes),
        -_pull(axes, at, b, centres, sizes),
        across,
        numbers.tangential * across,
        gap,
        weights,
        centres,
        sizes,
        float(masses.mean()),
        friction,
        numbers,
    )


def _shares(patch: Contact) -> Array:
    """The share of a patch about each corner, float64 (k,): half of the two triangles between it and the middle."""
    arms = patch.points - patch.points.mean(axis=0)
    triangles = np.abs(np.cross(arms, np.roll(arms, -1, axis=0)) @ patch.normal)
    shares = triangles + np.roll(triangles, 1)
    total = shares.sum()
    return np.asarray(shares / total if total > 0 else np.full(len(arms), 1 / len(arms)))


def _sizes(a: NDArray[np.int64], b: NDArray[np.int64], at: Array, centres: Array) -> Array:
    """float64 (n,): distance of each part's farthest corner; parts without one are as large as the mean."""
    sizes = np.zeros(len(centres))
    for part in (a, b):
        real = part != TABLE
        np.maximum.at(sizes, part[real], np.linalg.norm(at[real] - centres[part[real]], axis=1))
    known = sizes > 0
    sizes[~known] = sizes[known].mean() if known.any() else 1.0
    return sizes


def _pull(axes: Array, at: Array, part: NDArray[np.int64], centres: Array, sizes: Array) -> Array:
    """float64 (c, 3, 6): how a part's displacement moves its corners along their axes; 0 for the table."""
    arms = (at - centres[part]) / sizes[part][:, None]
    pull = np.concatenate([axes, np.cross(arms[:, None], axes)], axis=2)
    pull[part == TABLE] = 0.0
    return pull
