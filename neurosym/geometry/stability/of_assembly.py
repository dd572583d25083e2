"""The springs at the contacts of an assembly."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.contacts import Contact
from neurosym.geometry.stability.patches import masses, merged_patches
from neurosym.geometry.stability.spring_stability import SpringStability
from neurosym.geometry.stability.springs import DEFAULT_NUMBERS, DOWN, SpringNumbers
from neurosym.geometry.stability.standing import Stability
from neurosym.support.arrays import Array


def spring_stability(
    assembly: Assembly,
    contacts: tuple[Contact, ...],
    *,
    gravity: Array = DOWN,
    tilt: float = 0.0,
    numbers: SpringNumbers = DEFAULT_NUMBERS,
    remember: bool = True,
) -> SpringStability:
    """The stability of an assembly with these contacts, by springs.

    Faces that touch, but are further apart than `Tolerances.play`, close that gap first: what drops by its play and
    then rests, stands.
    """
    # No patch is shrunk: limit analysis is to refute only what no forces can hold.
    exact = replace(assembly, tolerances=replace(assembly.tolerances, patch_shrink=0.0))
    patches = merged_patches(exact, contacts)
    gaps = np.array([p.gap for p in patches])
    gaps[gaps <= assembly.tolerances.play * assembly.smallest_extent] = 0.0
    mass, centres = masses(assembly)
    return SpringStability(
        patches,
        mass,
        centres,
        friction=assembly.friction,
        limit=functools.partial(Stability, exact, contacts, remember=remember),
        fixed=assembly.fixed_mask,
        gaps=gaps,
        gravity=gravity,
        tilt=tilt,
        numbers=numbers,
        remember=remember,
    )
