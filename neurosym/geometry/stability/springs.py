"""Rigid parts on springs: what gravity makes of contacts that only push, and rub no more than they are pressed.

Parts move by small displacements u. At each corner of a contact patch a spring resists compression, never opening, and
another resists sliding until its force reaches a bound s. For given s the energy is convex in u, and Newton's method
finds its least value (`neurosym.geometry.stability.settling`). Then s is brought nearer to Coulomb's mu N, from
the total weight (everything glued) until both agree: forces arise as parts sink into their places, and nothing is
clamped by a preload that nobody applied. Limit analysis, which asks whether some forces balance, cannot tell.
Kao et al., "Coupled rigid-block analysis" (Computer-Aided Design, 2022), couple forces and motions to the same end.

Everything is counted in units of the structure's own: lengths in a part's size, displacements in `softness` times the
mean size, forces in the mean weight. So no verdict depends on units, and a light part counts as much as a heavy one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from neurosym.support.arrays import Array, Numbers, Truths

#: Gravity.
DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True)
class SpringNumbers:
    """The numbers of the model, chosen by experiment.

    On 400 random subsets of Soma cubes, 126 questions about arches, walls, a vault, a dome and pyramids, and 51 cases
    by hand, halving or doubling any of them changes two verdicts: of one subset that PyBullet lets fall and MuJoCo
    does not, and of one state of the vault.

    Attributes:
        tangential: stiffness along a contact, as a share of that across it. It decides which contacts rub first.
        softness: how far the mean weight compresses the mean patch, as a share of the mean part's size. It matters only
            beside gaps: springs must be stiff for a gap to close before they carry, so it is small.
        ground: stiffness of a spring that ties each part to its place, in units of its weight by displacement. It keeps
            the system solvable. A part that falls is carried by nothing else, and goes 1 / ground far; a part that
            stands goes 1 to 1,000.
        falls: a part falls when the ground carries more of its weight than this share. An imbalance of a thousandth
            of a part's weight, or of its weight times its size, is taken for balance: on a knife's edge a part stands.
        agreement: friction may differ from Coulomb's law by this share of a part's weight.
        damping: of the steps of s; they are mixed by Anderson's method, which takes 3 to 10 rounds where plain damped
            steps take 20 to 60 and oscillate in narrow wedges.
        patience: a part falls when it does so in so many rounds in a row: at first s may be too small for a moment.
    """

    tangential: float = 0.3
    softness: float = 1e-6
    ground: float = 1e-9
    falls: float = 1e-3
    agreement: float = 1e-2
    damping: float = 0.5
    patience: int = 3


DEFAULT_NUMBERS = SpringNumbers()


@dataclass(frozen=True, eq=False)
class Springs:
    """Corners of contact patches between n parts, as arrays.

    Attributes:
        a, b: int64 (c,): the parts at each corner; b is -1 for the table.
        at: float64 (c, 3): where it is, in the world.
        axes: float64 (c, 3, 3): rows are the normal, from b to a, and two tangents.
        Ja, Jb: float64 (c, 3, 6): displacement of a, and of b, (translation, rotation times size) to how far the
            corner's sides move apart along the axes.
        across, along: float64 (c,): stiffness along the normal and along the tangents.
        gap: float64 (c,): how far a's side must go before the normal spring begins.
        weights: float64 (n,), in units of their mean.
        centres: float64 (n, 3): centres of mass. sizes: float64 (n,): distance to the farthest corner (length).
        unit: what a weight of 1 is (mass).
        friction: Coulomb's coefficient.
        numbers: of the model.
    """

    a: Numbers
    b: Numbers
    at: Array
    axes: Array
    Ja: Array
    Jb: Array
    across: Array
    along: Array
    gap: Array
    weights: Array
    centres: Array
    sizes: Array
    unit: float
    friction: float
    numbers: SpringNumbers

    def gravity(self, direction: Array) -> Array:
        """float64 (n, 6): what gravity does to each part along a direction (3,), whose length counts."""
        load = np.zeros((len(self.weights), 6))
        load[:, :3] = self.weights[:, None] * direction
        return load

    def scaled(self, wrench: Array, part: int) -> Array:
        """A force and a torque about a part's centre, float64 (6,), from the parts' masses and lengths to own units."""
        result: Array = wrench / self.unit
        result[3:] /= self.sizes[part]
        return result

    def corners_of(self, there: Truths, moving: Truths) -> Numbers:
        """Corners between parts that are there, one of them moving at least; masks bool (n + 1,), the table's last."""
        return np.flatnonzero(there[self.a] & there[self.b] & (moving[self.a] | moving[self.b]))


def tilted(gravity: Array, degrees: float) -> Array:
    """float64 (4, 3): gravity tilted by so many degrees in each of four horizontal directions."""
    angle = np.radians(degrees)
    sideways = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    return np.asarray(np.cos(angle) * gravity + np.sin(angle) * sideways)
