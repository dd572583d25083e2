"""What springs say, with its evidence: what moves, along what and why, and the forces at contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from neurosym.geometry.stability.holding import Standing
from neurosym.geometry.stability.settling import Settled
from neurosym.geometry.stability.springs import Springs
from neurosym.support.arrays import Array, Numbers
from neurosym.support.words import joined

#: A part moves with those that fall when the ground carries this share of what it carries of the part that falls most.
_MOVES_ALONG = 0.1
#: A part is touched when it is pressed by this share of its weight.
_PRESSED = 1e-3


@dataclass(frozen=True)
class Movement:
    """How a part begins to fall.

    Attributes:
        part: its number.
        kind: dropping: nothing carries it; sliding: along what still presses it; tilting: it turns more than it goes.
        direction: float (3,), unit: along which its centre goes; when it tilts, the axis about which it turns
            (right-hand rule).
        share: of its weight that nothing carries, from 0 to about 1.
        lost: bitset of absent parts that would touch it, those below it if there are such: the support that it lost.
    """

    part: int
    kind: Literal["dropping", "sliding", "tilting"]
    direction: tuple[float, float, float]
    share: float
    lost: int = 0

    def sentence(self, names: Sequence[str]) -> str:
        """It, told with the parts' names."""
        verb = {"dropping": "drops", "sliding": "slides", "tilting": "tilts"}[self.kind]
        along = "about" if self.kind == "tilting" else "along"
        way = ", ".join(f"{x:.2g}" for x in np.round(self.direction, 2) + 0.0)
        gone = joined(tuple(n for i, n in enumerate(names) if self.lost >> i & 1))
        return f"{names[self.part]} {verb} {along} ({way}){f', without {gone}' if gone else ''}."


@dataclass(frozen=True)
class SpringStanding(Standing):
    """Whether a subset stands, by springs.

    Attributes:
        balanced: False where limit analysis proves that no forces balance `moving`: a nogood as `Standing` has it.
            A fall where this is True promises nothing.
        along: bitset of the parts that lie on nothing but what falls.
    """

    balanced: bool = True
    along: int = 0

    @property
    def promises(self) -> bool:
        return not self.stands and not self.balanced

    @property
    def falling(self) -> int:
        return self.moving | self.along


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Forces at the corners of contacts, for drawing.

    Attributes:
        a, b: int64 (k,): parts; b is -1 for the table.
        points: float64 (k, 3). forces: float64 (k, 3), on a, in the world, in units of mass (times gravity).
        slipping: float64 (k,): 0 where there is no friction, 1 where it slips.
    """

    a: Numbers
    b: Numbers
    points: Array
    forces: Array
    slipping: Array


def moving_parts(settled: Settled) -> int:
    """Bitset of the parts that fall, or go along."""
    least = _MOVES_ALONG * settled.share.max(initial=0.0)
    return sum(1 << int(p) for p in settled.parts[settled.share >= least])


def movements(springs: Springs, settled: Settled) -> list[Movement]:
    """How parts begin to fall, the one that falls most first."""
    pressed = np.zeros(len(springs.weights) + 1)
    for ends in (springs.a, springs.b):
        np.add.at(pressed, ends[settled.corners], settled.forces[:, 0])
    found = []
    least = _MOVES_ALONG * settled.share.max(initial=0.0)
    for k in np.argsort(-settled.share):
        if settled.share[k] < least:
            break
        part, goes, turns = int(settled.parts[k]), settled.u[k, :3], settled.u[k, 3:]
        kind: Literal["dropping", "sliding", "tilting"] = "sliding"
        if np.linalg.norm(turns) > np.linalg.norm(goes):
            kind = "tilting"
        elif pressed[part] <= _PRESSED * springs.weights[part]:
            kind = "dropping"
        way = turns if kind == "tilting" else goes
        x, y, z = (way / np.linalg.norm(way)).tolist()
        found.append(Movement(part, kind, (x, y, z), min(1.0, float(settled.share[k]))))
    return found


def contact_forces(springs: Springs, settled: Settled) -> ContactForces:
    """The forces at the corners of contacts that press, after settling."""
    pressing = settled.forces[:, 0] > 0
    corners, forces = settled.corners[pressing], settled.forces[pressing]
    world = np.einsum("ki,kij->kj", forces, springs.axes[corners]) * springs.unit
    limit = springs.friction * forces[:, 0]
    rubbing = np.hypot(forces[:, 1], forces[:, 2])
    slipping = np.where(limit > 0, np.minimum(rubbing / np.maximum(limit, 1e-300), 1.0), 0.0)
    return ContactForces(springs.a[corners], springs.b[corners], springs.at[corners], world, slipping)
