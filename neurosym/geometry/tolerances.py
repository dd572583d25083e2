"""Tolerances: each has a name, a unit, a default and a reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurosym.errors import InputError


@dataclass(frozen=True)
class Tolerances:
    """How exact the geometry is taken to be. Lengths are shares of the smallest extent of any body.

    Attributes:
        touch: two faces touch when their gap, or their overlap, is at most this share. Real CAD parts overlap a
            little where they mate: measured on timber joints, answers agree for every value from 1e-3 to 5e-2.
        play: of faces that touch, those further apart than this share have play: under gravity the parts drop until
            the gap has closed, and rest. Beyond the default of `touch` only what was asked for touches at such a gap.
        mate: parts that overlap at rest by at most this share are taken to touch, and are thought apart by as much
            before anything is asked of their motion; parts that touch, but with no two faces in one plane (round
            ones, cut into facets, or joints that follow chords), touch where their faces come this near. The
            staggered courses of a dome overlap by 5.2e-2, measured between hulls; answers agree from 6e-2 to 15e-2.
        mate_angle: sine of the angle up to which faces of such parts are taken to face one another (no unit): two
            neighbouring facets of a cylinder of 60 are 0.1 apart.
        parallel: faces are parallel, and a direction lies along an axis, when the sine of their angle is at
            most this (no unit). Poses read from files carry 1e-6 or so.
        patch_shrink: contact patches are shrunk by this share about their centre before forces act at their
            corners (no unit): a part that balances exactly on an edge does not stand.
    """

    touch: float = 1e-3
    play: float = 1e-3
    mate: float = 7.5e-2
    mate_angle: float = 0.1
    parallel: float = 1e-4
    patch_shrink: float = 0.02

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 <= value < np.inf:
                raise InputError(f"Expected the tolerance {name} as a number of 0 or more; got {value!r}.")


DEFAULT_TOLERANCES = Tolerances()
