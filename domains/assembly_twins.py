"""Identical parts, of which it does not matter which is taken when: eight equal bolts that hold one cover."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from neurosym.geometry.queries import AssemblyGeometry
from neurosym.support.arrays import Array
from neurosym.support.bitsets import bits

if TYPE_CHECKING:
    from domains.assembly import Setting
    from domains.assembly_targets import Relaxation

#: Shapes are the same up to this share of their size: files round.
SAME = 1e-5


def twins(geometry: AssemblyGeometry, setting: Setting, relaxation: Relaxation) -> list[tuple[str, ...]]:
    """Groups of names of parts of one shape, any two of which may be swapped in all that is asked of the assembly.

    Along straight lines a part may leave by each of some sets of parts that must be out before. Where these sets, of
    all parts, stay as they are when two parts are swapped, so does what is free. Under gravity only parts that touch
    none but fixed ones are swapped: they carry nothing, and nothing carries them that may leave.
    """
    assembly = geometry.assembly
    if setting.paths != "straight" or assembly.piece_groups:
        return []
    able = (1 << len(geometry)) - 1 & ~assembly.fixed_mask
    shapes: list[tuple[Array, list[int]]] = []
    for part in bits(able):
        shape = np.append(_shape(geometry, part), relaxation.targets >> part & 1)
        own = next((own for known, own in shapes if np.allclose(known, shape, rtol=SAME, atol=0.0)), None)
        if own is None:
            shapes.append((shape, own := []))
        own.append(part)
    groups: list[list[int]] = []
    for own in (own for _, own in shapes if len(own) > 1):
        classes: list[list[int]] = []
        for part in own:
            if setting.gravity and geometry.stability.touching[part] & able:
                continue
            members = next((c for c in classes if relaxation.may_swap(c[0], part)), None)
            if members is None:
                classes.append([part])
            else:
                members.append(part)
        groups += [c for c in classes if len(c) > 1]
    return [tuple(geometry.names[p] for p in group) for group in groups]


def _shape(geometry: AssemblyGeometry, part: int) -> Array:
    """What does not change when a part is moved: how many bodies and vertices it has, and how these are spread."""
    bodies = geometry.assembly.bodies
    points = bodies.points(1 << part)
    arms = points - points.mean(axis=0)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(arms.T @ arms / len(arms)), 0.0))
    reach = np.linalg.norm(arms, axis=1)
    return np.array([len(bodies.of(1 << part)), len(points), *spread, reach.max(), reach.mean()])
