"""From contact patches to springs at their corners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from neurosym.geometry.contact.contacts import TABLE, Contact
from neurosym.geometry.mesh.broad_phase import spans
from neurosym.geometry.stability.springs import DEFAULT_NUMBERS, SpringNumbers, Springs
from neurosym.support.arrays import Array, Numbers


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

    A patch's stiffness is its area. Its corners share it by the area of the patch about each: two that nearly coincide
    count as one.

    Args:
        patches: between parts `a` and `b`, or the table; see `merged_patches`.
        friction: Coulomb's coefficient.
        gaps: float64 (len(patches),): how far the faces of each are apart (length); None: they touch.
    """
    wide = [k for k, p in enumerate(patches) if len(p.points) > 2]  # the hull of merged slivers may be none
    patches, gaps = [patches[k] for k in wide], None if gaps is None else gaps[wide]
    counts = np.array([len(p.points) for p in patches], dtype=np.int64)
    patch, place = spans(counts)
    a = np.array([p.a for p in patches], dtype=np.int64)[patch]
    b = np.array([p.b for p in patches], dtype=np.int64)[patch]
    at = np.concatenate([np.zeros((0, 3)), *(p.points for p in patches)])
    following = np.arange(len(at)) + np.where(place + 1 == counts[patch], 1 - counts[patch], 1)
    normals = np.array([p.normal for p in patches]).reshape(-1, 3)[patch]
    areas = np.array([p.area for p in patches])
    across = areas[patch] * _shares(at, following, normals, patch) / (areas.mean() if len(areas) else 1.0)
    axes = _axes(at, following, normals, patch)
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


def _shares(at: Array, following: Numbers, normals: Array, patch: Numbers) -> Array:
    """The share of a patch about each corner, float64 (c,): half of the two triangles between it and the middle."""
    if not len(at):
        return np.zeros(0)
    starts = np.flatnonzero(np.diff(patch, prepend=-1))
    first = at[starts][patch]
    fan = np.einsum("cd,cd->c", np.cross(at - first, at[following] - first), normals)
    moments = np.add.reduceat(fan[:, None] * (first + at + at[following]) / 3, starts)
    arms = at - (moments / np.add.reduceat(fan, starts)[:, None])[patch]  # from the middle of the area
    triangles = np.abs(np.einsum("cd,cd->c", np.cross(arms, arms[following]), normals))
    shares = triangles.copy()
    shares[following] += triangles
    result: Array = shares / np.add.reduceat(shares, starts)[patch]
    return result


def _axes(at: Array, following: Numbers, normals: Array, patch: Numbers) -> Array:
    """float64 (c, 3, 3): minus the patch's normal, and tangents along and across its longest edge."""
    if not len(at):
        return np.zeros((0, 3, 3))
    edges = at[following] - at
    edges -= np.einsum("cd,cd->c", edges, normals)[:, None] * normals
    order = np.lexsort((-np.linalg.norm(edges, axis=1), patch))
    longest = order[np.flatnonzero(np.diff(patch[order], prepend=-1))]
    u = (edges[longest] / np.linalg.norm(edges[longest], axis=1, keepdims=True))[patch]
    return np.stack([-normals, u, np.cross(normals, u)], axis=1)


def _sizes(a: Numbers, b: Numbers, at: Array, centres: Array) -> Array:
    """float64 (n,): distance of each part's farthest corner; parts without one are as large as the mean."""
    sizes = np.zeros(len(centres))
    for part in (a, b):
        real = part != TABLE
        np.maximum.at(sizes, part[real], np.linalg.norm(at[real] - centres[part[real]], axis=1))
    known = sizes > 0
    sizes[~known] = sizes[known].mean() if known.any() else 1.0
    return sizes


def _pull(axes: Array, at: Array, part: Numbers, centres: Array, sizes: Array) -> Array:
    """float64 (c, 3, 6): how a part's displacement moves its corners along their axes; 0 for the table."""
    arms = (at - centres[part]) / sizes[part][:, None]
    pull = np.concatenate([axes, np.cross(arms[:, None], axes)], axis=2)
    pull[part == TABLE] = 0.0
    return pull
