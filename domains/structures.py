"""Structures made at random, by number: those of the kinds in `KINDS` that come apart.

Structure i of kind k has the number ``SPAN * (k + 1) + i``, kinds in the order of `KINDS`; it is the same wherever it
is made. The first `TESTING` of each kind are for tests, the `LEARNING` after them to learn from.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from domains import structure_boxes, structure_masonry
from domains.structure_shapes import FIXED
from neurosym.errors import ContractError, InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.rigid_motions import posed
from neurosym.geometry.shapes import Part
from neurosym.planning.budget import Budget
from neurosym.planning.outermost_first import OutermostFirst
from neurosym.planning.result import Status
from neurosym.registry import load_planner

if TYPE_CHECKING:
    from neurosym.language.problem_family import ProblemFamily

#: Name of a kind -> what draws the parts of one.
KINDS: dict[str, Callable[[np.random.Generator], list[Part]]] = {
    "stack": structure_masonry.stack,
    "corbel": structure_masonry.corbel,
    "scale": structure_masonry.scale,
    "arch": structure_masonry.arch,
    "flat arch": structure_masonry.flat_arch,
    "lean": structure_masonry.lean,
    "bridge": structure_masonry.bridge,
    "wall": structure_masonry.wall,
    "nested": structure_boxes.nested,
    "burr": structure_boxes.burr,
    "pins": structure_boxes.pins,
}

#: Numbers of a kind begin at its multiple; how many are for tests, and to learn from.
SPAN, TESTING, LEARNING = 10_000, 20, 60
#: Fewest and most parts.
SIZES = 4, 40
#: Attempts a part within which a structure is to come apart, or another is drawn.
ATTEMPTS, DRAWS = 40, 200


class Structure(NamedTuple):
    """An assembly, how many of its parts may be held, and its difficulty: how often `outermost-first` is refused."""

    assembly: Assembly
    held: int
    difficulty: int


def kind_of(number: int) -> str:
    """The kind of a structure's number. Raises InputError: it is none."""
    k, i = divmod(number, SPAN)
    if not 1 <= k <= len(KINDS) or i < 0:
        raise InputError(f"Expected a structure's number, {SPAN} to {SPAN * (len(KINDS) + 1) - 1}; got {number!r}.")
    return list(KINDS)[k - 1]


def structure_numbers(part: str, kind: str | None = None) -> tuple[int, ...]:
    """Numbers of the structures of a part, "train", "test" or "all", and of one kind or all of them.

    Raises UnknownNameError: there is no such kind.
    """
    if kind is not None and kind not in KINDS:
        raise UnknownNameError("kind of structure", kind, KINDS)
    own = {"test": range(TESTING), "train": range(TESTING, TESTING + LEARNING), "all": range(TESTING + LEARNING)}
    return tuple(SPAN * (k + 1) + i for k, name in enumerate(KINDS) if kind in (None, name) for i in own[part])


@lru_cache(maxsize=1000)
def structure(family: ProblemFamily, number: int) -> Structure:
    """The structure of a number; a problem of the family is solved to see that it comes apart.

    Raises InputError: there is no such number.
    """
    make = KINDS[kind_of(number)]
    for draw in range(DRAWS):
        rng = np.random.default_rng([number, draw])
        parts = make(rng)
        if not SIZES[0] <= len(parts) <= SIZES[1]:
            continue
        rng.shuffle(parts)
        fixed = [p.name for p in parts if p.name.startswith(FIXED)]
        turn = posed(Rotation.from_euler("z", int(rng.integers(4)) * 90, degrees=True).as_matrix().round(), np.zeros(3))
        assembly, held = Assembly(tuple(parts)).with_fixed(fixed).transformed(turn), int(bool(fixed))
        problem = family.problem(assembly, held=held)
        scores = OutermostFirst().scores([problem])[0]
        budget = Budget(attempts=ATTEMPTS * len(parts))
        result = load_planner("backtracking").plan(problem.ground(), scores, budget=budget, rng=rng)
        if result.status is Status.SOLVED:
            return Structure(assembly, held, result.iterations)
    raise ContractError(f"Expected a structure of number {number} that comes apart; none of {DRAWS} did.")
