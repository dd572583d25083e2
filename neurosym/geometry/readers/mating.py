"""How the parts of a loaded assembly lie at rest: what mates, what overlaps too deeply, what touches nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from neurosym.geometry.bodies import Bodies
from neurosym.geometry.contact.overlaps import overlaps
from neurosym.geometry.contact.surfaces import BodySurfaces
from neurosym.geometry.mesh.broad_phase import overlapping_pairs
from neurosym.geometry.mesh.triangles import distances
from neurosym.geometry.notes import Note
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances

#: The touching tolerance is at least the measured overlap times `ABOVE`, or `WIDEST` where that is enough: measured on
#: timber joints, answers hold so far. It is never less than the overlap times `MARGIN`, for what is within touch in one
#: measure may be beyond it in another.
ABOVE, WIDEST, MARGIN = 1.2, 5e-2, 1.03

#: A touching tolerance beyond this share of the smallest extent is not to be had on the command line.
MAX_TOUCH = 0.5


def mating_tolerances(
    surfaces: BodySurfaces, fixed: int, stated: Tolerances | None
) -> tuple[Tolerances, list[Note], list[Note]]:
    """Tolerances that take the overlap of mating faces for touch, a note on it, and the overlaps that are too deep.

    Args:
        fixed: a bitset of parts that may overlap one another.
        stated: tolerances that were given: they are kept.
    """
    bodies = surfaces.bodies
    tolerances, smallest = stated or DEFAULT_TOLERANCES, bodies.smallest_extent
    limit = max(tolerances.touch, tolerances.mate)
    deepest: dict[tuple[int, int], float] = {}
    for overlap in overlaps(surfaces, fixed):
        pair = int(bodies.owners[overlap.a]), int(bodies.owners[overlap.b])
        deepest[pair] = max(deepest.get(pair, 0.0), overlap.depth)
    # Thin walls overlap by no more than they are thick, so the same one twice may look like a mate.
    same = {pair for pair in deepest if _are_same(surfaces, *pair)}
    slight = {pair: depth for pair, depth in deepest.items() if depth <= limit * smallest and pair not in same}
    deep = {pair: depth for pair, depth in deepest.items() if pair not in slight}
    faults = [_too_deep(bodies, *pair, depth, limit, same=pair in same) for pair, depth in deep.items()]
    share = max(slight.values(), default=0.0) / smallest
    touch = max(min(ABOVE * share, WIDEST), MARGIN * share)
    if touch <= tolerances.touch or (stated and MARGIN * share <= tolerances.touch):
        return tolerances, [], faults
    pair, depth = max(slight.items(), key=lambda item: item[1])
    a, b = (bodies.parts[i].name for i in pair)
    if stated:
        sentence = f"Parts {a!r} and {b!r} overlap by {depth:.4g}, more than the stated touch of "
        sentence += f"{tolerances.touch * smallest:.4g}: such parts may seem to block one another where they mate."
        return tolerances, [Note(a, "mating", depth, sentence, f"State no touch, or one of {touch:.2g}.", b)], faults
    pairs = "one pair of parts" if len(slight) == 1 else f"{len(slight)} pairs of parts"
    sentence = f"Mating faces of {pairs} overlap, by up to {depth:.4g} between {a!r} and {b!r}; "
    sentence += f"overlaps up to {touch * smallest:.4g} ({touch:.2g} of the smallest extent) are taken for touch."
    # Meshes so inexact are no closer to the parts than that: gaps of this size are no play.
    return replace(tolerances, touch=touch, play=touch), [Note(a, "mating", depth, sentence, other=b)], faults


def _are_same(surfaces: BodySurfaces, i: int, j: int) -> bool:
    """Whether two parts are one solid in one place, cut into whichever facets: each has its corners on the other."""
    bodies = surfaces.bodies
    touch = DEFAULT_TOLERANCES.touch * bodies.smallest_extent
    if np.abs(bodies.part_bounds[i] - bodies.part_bounds[j]).max() > touch:
        return False
    points, triangles = [], []
    for part in (i, j):
        points.append(bodies.points(1 << part))
        exact = surfaces.exact
        triangles.append(exact.triangles[bodies.owners[exact.body] == part])
    return all(distances(points[k], triangles[1 - k]).max() <= touch for k in (0, 1))


def _too_deep(bodies: Bodies, i: int, j: int, depth: float, limit: float, *, same: bool) -> Note:
    a, b = (bodies.parts[k].name for k in (i, j))
    share = depth / bodies.smallest_extent
    if same:
        sentence = f"Parts {a!r} and {b!r} are the same solid in the same place."
        return Note(a, "overlap", depth, sentence, "Take one of them away.", b)
    sentence = f"Parts {a!r} and {b!r} overlap by {depth:.4g}, {share:.2g} of the smallest extent of any part; "
    remedy = "Move them apart."
    if 1.1 * share <= MAX_TOUCH:
        remedy = f"Move them apart; if they are meant to mate so, state Tolerances(touch={1.1 * share:.2g}), "
        remedy += "--touch on the command line."
    return Note(a, "overlap", depth, sentence + f"mating faces may by {limit:g} of it.", remedy, b)


def floating(surfaces: BodySurfaces, fixed: int, ground: float, touch: float) -> list[Note]:
    """A note for each part that touches neither another one nor the ground, and is not fixed.

    Args:
        fixed: a bitset of parts.
        ground: height (z, world).
        touch: how far apart two parts may be (length) that touch.
    """
    bodies, exact = surfaces.bodies, surfaces.exact
    bounds, owners = bodies.bounds, bodies.owners
    held = np.array([bool(fixed >> i & 1) for i in range(len(bodies.parts))])
    held[owners[bounds[:, 0, 2] <= ground + touch]] = True
    pairs = overlapping_pairs(bounds[:, 0] - touch / 2, bounds[:, 1] + touch / 2, owners)
    pairs = pairs[~held[owners[pairs]].all(axis=1)]
    held[owners[pairs[exact.gaps(pairs, enough=touch, far=2 * touch) <= touch]]] = True
    notes = []
    for part in np.flatnonzero(~held):
        name = bodies.parts[part].name
        own, others = np.flatnonzero(owners == part), np.flatnonzero(owners != part)
        least, nearest = np.inf, ""
        for i in own[:64]:
            away = np.maximum(bounds[i, 0] - bounds[others, 1], bounds[others, 0] - bounds[i, 1]).max(axis=1)
            for j in others[np.argsort(away)[:8]]:
                gap = float(exact.gaps(np.array([[i, j]]), far=least)[0])
                if gap < least:
                    least, nearest = gap, bodies.parts[owners[j]].name
        above = float(bodies.part_bounds[part, 0, 2] - ground)
        near = [f"{above:.4g} above the ground"] if np.isfinite(above) else []
        near += [f"{least:.4g} from {nearest!r}, the nearest part"] if nearest else []
        sentence = f"Part {name!r} touches nothing{': it is ' if near else ''}{', and '.join(near)}."
        share = 1.1 * min(above, least) / bodies.smallest_extent
        remedy = "Move it, or fix it."
        if share <= MAX_TOUCH:
            remedy = f"Move it, fix it, or state Tolerances(touch={share:.2g}), --touch on the command line."
        notes.append(Note(name, "floating", min(above, least), sentence, remedy))
    return notes
