"""How the parts of a loaded assembly lie at rest: what mates, what overlaps too deeply, what touches nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact import collision
from neurosym.geometry.contact.overlaps import overlaps
from neurosym.geometry.mesh import triangles
from neurosym.geometry.notes import Note
from neurosym.geometry.tolerances import Tolerances

#: Mating faces may overlap by this share of the smallest extent: measured on timber joints, answers held so far.
MAX_MATING = 5e-2

#: The touching tolerance is raised to the measured overlap times this.
_ABOVE = 1.2


def tolerances_at_rest(assembly: Assembly, stated: bool) -> tuple[Tolerances, list[Note], list[Note]]:
    """Tolerances that take the overlap of mating faces for touch, a note on it, and the overlaps that are too deep.

    Args:
        stated: whether the tolerances were given; then they are kept, and say how deep an overlap may be.
    """
    tolerances, smallest = assembly.tolerances, assembly.smallest_extent
    limit = tolerances.touch if stated else max(MAX_MATING, tolerances.touch)
    deepest: dict[tuple[str, str], float] = {}
    for overlap in overlaps(assembly):
        pair = (assembly.names[assembly.owners[overlap.a]], assembly.names[assembly.owners[overlap.b]])
        deepest[pair] = max(deepest.get(pair, 0.0), overlap.depth)
    faults = [
        Note(
            a,
            "overlap",
            depth,
            f"Parts {a!r} and {b!r} overlap by {depth:.4g}, {depth / smallest:.2g} of the smallest extent of any part; "
            f"mating faces may by {limit:g} of it.",
            f"Move them apart; if they are meant to mate so, state Tolerances(touch={1.1 * depth / smallest:.2g}), "
            "--touch on the command line.",
            b,
        )
        for (a, b), depth in deepest.items()
        if depth > limit * smallest
    ]
    slight = {pair: depth for pair, depth in deepest.items() if depth <= limit * smallest}
    share = max(slight.values(), default=0.0) / smallest
    if share <= tolerances.touch:
        return tolerances, [], faults
    (a, b), depth = max(slight.items(), key=lambda item: item[1])
    touch = max(min(_ABOVE * share, MAX_MATING), 1.01 * share)
    pairs = "one pair of parts" if len(slight) == 1 else f"{len(slight)} pairs of parts"
    said = f"Mating faces of {pairs} overlap, by up to {depth:.4g} between {a!r} and {b!r}; "
    said += f"overlaps up to {touch * smallest:.4g} ({touch:.2g} of the smallest extent) are taken for touch."
    return replace(tolerances, touch=touch), [Note(a, "mating", depth, said, other=b)], faults


def floating(assembly: Assembly) -> list[Note]:
    """A note for each part that touches neither another one nor the ground, and is not fixed."""
    touch, bounds, owners = assembly.touch, assembly.body_bounds, assembly.owners
    held = np.array([bool(assembly.fixed_mask >> i & 1) for i in range(len(assembly))])
    held[owners[bounds[:, 0, 2] <= assembly.ground + touch]] = True
    grown = (bounds[:, 0] - touch / 2, bounds[:, 1] + touch / 2)
    pairs = triangles.near_pairs(grown, grown, 50 * triangles.CHUNK)
    pairs = np.zeros((0, 2), dtype=np.int64) if pairs is None else pairs
    pairs = pairs[(pairs[:, 0] < pairs[:, 1]) & (owners[pairs[:, 0]] != owners[pairs[:, 1]])]
    objects: dict[int, object] = {}

    def gap(a: int, b: int) -> float:
        for i in (a, b):
            if i not in objects:
                objects[i] = collision.shape_object(assembly.bodies[i].shape, assembly.X_WB[i])
        return max(collision.distance(objects[a], objects[b]), 0.0)

    for a, b in pairs:
        if not held[owners[[a, b]]].all() and gap(int(a), int(b)) <= touch:
            held[owners[[a, b]]] = True
    notes = []
    for part in np.flatnonzero(~held):
        name = assembly.names[part]
        own, others = np.flatnonzero(owners == part), np.flatnonzero(owners != part)
        away = np.maximum(bounds[own[0], 0] - bounds[others, 1], bounds[others, 0] - bounds[own[0], 1]).max(axis=1)
        near = others[np.argsort(away)[:8]]
        least, nearest = min(
            [(gap(int(i), int(j)), assembly.names[owners[j]]) for i in own[:64] for j in near], default=(np.inf, "")
        )
        above = float(bounds[own, 0, 2].min() - assembly.ground)
        said = f"Part {name!r} touches nothing: it is {above:.4g} above the ground"
        said += f", and {least:.4g} from {nearest!r}, the nearest part." if nearest else "."
        remedy = "Move it, fix it, or state a larger Tolerances(touch=), --touch on the command line."
        notes.append(Note(name, "floating", min(above, least), said, remedy))
    return notes
