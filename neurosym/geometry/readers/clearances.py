"""Parts drawn with play: faces that lie near one another and never touch, as CAD leaves them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from neurosym.geometry.contact.facets import facet_patches
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.mesh.broad_phase import overlapping_pairs
from neurosym.geometry.notes import Note
from neurosym.geometry.tolerances import Tolerances

#: Gaps up to this share of the smallest extent are play (0.3 mm of 2 mm); touch is raised to so many times the widest.
NEAR, ABOVE = 0.15, 1.1


@dataclass(frozen=True)
class Clearances:
    """Pairs of parts that look at one another across a gap and do not touch.

    Attributes:
        pairs: how many there are.
        least, most: the gaps (length).
        touch: the tolerance, a share of the smallest extent, by which they touch.
    """

    pairs: int
    least: float
    most: float
    touch: float


def clearances(surfaces: BodySurfaces, tolerances: Tolerances) -> Clearances | None:
    """What lies beyond touch, up to `NEAR`; None where nothing does."""
    bodies, exact = surfaces.bodies, surfaces.exact
    smallest = bodies.smallest_extent
    touch, limit = tolerances.touch * smallest, NEAR * smallest
    if touch >= limit:
        return None
    low, high = bodies.bounds[:, 0], bodies.bounds[:, 1]
    pairs = overlapping_pairs(low - limit / 2, high + limit / 2, bodies.owners)
    gaps = exact.gaps(pairs, enough=touch, far=1.01 * limit)
    owners = np.sort(bodies.owners[pairs], axis=1)
    number = owners[:, 0] * len(bodies.parts) + owners[:, 1]
    apart = (gaps > touch) & (gaps <= limit) & ~np.isin(number, number[gaps <= touch])
    sizes = {"round_sine": tolerances.mate_angle, "touch": touch, "mate": tolerances.mate * smallest}
    patches = facet_patches(surfaces, pairs[apart], sine=tolerances.mate_angle, gap=limit, **sizes)
    if not patches:
        return None
    facing = {(p[0], p[1]) for p in patches}
    kept = apart & np.array([tuple(pair) in facing for pair in pairs.tolist()])
    least = np.full(len(bodies.parts) ** 2, np.inf)
    np.minimum.at(least, number[kept], gaps[kept])
    least = least[np.isfinite(least)]
    digits = 10.0 ** (np.floor(np.log10(ABOVE * least.max() / smallest)) - 1)
    share = float(np.ceil(ABOVE * least.max() / smallest / digits - 0.01) * digits)  # two digits, rounded up
    return Clearances(len(least), float(least.min()), float(least.max()), share)


def with_clearances(
    surfaces: BodySurfaces, tolerances: Tolerances, units: str | None, *, touching: bool
) -> tuple[Tolerances, list[Note]]:
    """Tolerances, by which such faces touch if `touching`, and a note on them."""
    near = clearances(surfaces, tolerances)
    if near is None:
        return tolerances, []
    pairs = "one pair of parts lies" if near.pairs == 1 else f"{near.pairs} pairs of parts lie"
    gaps = f"{near.most:.3g}" if near.most < 1.05 * near.least else f"{near.least:.3g} to {near.most:.3g}"
    sentence = f"{pairs.capitalize()} {gaps}{f' {units}' if units else ''} apart, face to face, and do not touch"
    if touching:
        sentence += f"; they are taken as touching: touch is {near.touch:.2g} of the smallest extent."
        return replace(tolerances, touch=near.touch), [Note("", "clearance", near.most, sentence)]
    remedy = f"Taken as touching with Tolerances(touch={near.touch:.2g}), --touch {near.touch:.2g} or --touch auto."
    return tolerances, [Note("", "clearance", near.most, f"{sentence}.", remedy)]
