"""How parts on springs settle: Newton's method for given slip bounds, and rounds that bring these to Coulomb's law."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from neurosym.geometry.stability import spring_kernels as kernels
from neurosym.geometry.stability.equilibrium import LIGHTEST
from neurosym.geometry.stability.springs import Springs
from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.deadline import check

#: Newton's steps in a round while nothing falls: the bounds are about to change. What falls is followed to the end.
_STEPS, _MOST_STEPS = 3, 200
#: Forces left over on a part, as a share of its weight, with which a round may end: while all stands, while some fall.
_LEFT_STANDING, _LEFT_FALLING = 1e-3, 1e-1
#: Forces below this share of those on a part are rounding.
_ROUNDING = 1e-9
#: A line search ends where the slope is this share of what it was, or after so many steps.
_FLAT, _LINE_STEPS = 1e-2, 40
#: Rounds at the most. Structures that stand after them, forces still wandering between equal states, stand.
_ROUNDS = 100
#: From this share of the threshold on a part is near falling: friction has to agree with Coulomb's law by this share of
#: what is enough elsewhere.
NEAR, NEARER = 0.25, 0.1
#: So many rounds are remembered in mixing them.
_MEMORY = 4


@dataclass(frozen=True, eq=False)
class Settled:
    """Where parts come to rest, or how they fall.

    Attributes:
        stands: whether springs carry all of them.
        parts: int64 (m,): the movable parts. corners: int64 (k,): the corners at them.
        u: float64 (m, 6): displacements, scaled (translation, rotation times size).
        share: float64 (m,): the share of each part's weight that springs do not carry.
        forces: float64 (k, 3): on a's side, along the corners' axes, in units of the mean weight.
        rounds, factorisations: what it took.
    """

    stands: bool
    parts: Numbers
    corners: Numbers
    u: Array
    share: Array
    forces: Array
    rounds: int
    factorisations: int


def settle(
    springs: Springs, parts: Numbers, corners: Numbers, load: Array, *, slippery: Truths | None = None
) -> Settled:
    """Let parts settle under a load while all others stay where they are.

    Where rounding would drown a weight beside the heaviest, a little more makes no difference to that one; and where
    the springs are too stiff for all of them, they are counted in the heaviest.

    Args:
        parts: int64 (m,): those that can move. corners: int64 (k,): those of `springs` that are there, at these parts.
        load: float64 (n, 6), scaled: `Springs.gravity` and what is added to it.
        slippery: bool (k,): corners without friction.
    """
    heaviest = float(springs.weights[parts].max(initial=0.0))
    light = parts[springs.weights[parts] < LIGHTEST * heaviest]
    if not len(light) and (heaviest >= LIGHTEST or not heaviest):
        return _settle(springs, parts, corners, load, slippery)
    load = load.copy()
    load[light] *= (LIGHTEST * heaviest / springs.weights[light])[:, None]
    unit = heaviest if heaviest < LIGHTEST else 1.0
    counted = replace(springs, weights=np.maximum(springs.weights, LIGHTEST * heaviest) / unit)
    settled = _settle(counted, parts, corners, load / unit, slippery)
    return replace(settled, forces=settled.forces * unit)


def _settle(springs: Springs, parts: Numbers, corners: Numbers, load: Array, slippery: Truths | None) -> Settled:
    numbers = springs.numbers
    system = _System(springs, parts, corners, load)
    m, k = len(parts), len(corners)
    friction = np.full(k, springs.friction)
    if slippery is not None:
        friction[slippery] = 0.0
    bound = np.where(friction > 0, np.abs(system.load).sum() + system.weights.sum(), 0.0)
    mixing = _Mixing(numbers.damping)
    u, d = np.zeros((m, 6)), np.zeros((k, 3))
    fell, rounds = 0, 0
    for rounds in range(_ROUNDS):
        u, d, forces, done = system.newton(u, d, bound, _LEFT_STANDING, _STEPS)
        if system.share(u).max(initial=0.0) > numbers.falls:
            u, d, forces, done = system.newton(u, d, bound, _LEFT_FALLING, _MOST_STEPS)
        share = system.share(u)
        falls = bool(share.max(initial=0.0) > numbers.falls)
        fell = fell + 1 if falls else 0
        limit = friction * forces[:, 0]
        # Near the edge between the two, rest has to be nearer than elsewhere.
        near = share.max(initial=0.0) > NEAR * numbers.falls
        if fell >= numbers.patience or (not falls and done and system.agrees(forces, bound, limit, near)):
            break
        bound = np.minimum(bound, limit) if rounds == 0 else mixing.next(bound, limit)
    share = system.share(u)
    stands = bool(share.max(initial=0.0) <= numbers.falls)
    return Settled(stands, system.parts, corners, u, share, forces, rounds + 1, system.factorisations)


class _Mixing:
    """Anderson's method: the next bounds, from those of the last few rounds and what they should have been."""

    def __init__(self, damping: float) -> None:
        self.damping = damping
        self.bounds: list[Array] = []
        self.errors: list[Array] = []

    def next(self, bound: Array, limit: Array) -> Array:
        self.bounds = [*self.bounds[1 - _MEMORY :], bound]
        self.errors = [*self.errors[1 - _MEMORY :], limit - bound]
        following = bound + self.damping * self.errors[-1]
        if len(self.bounds) > 1:
            errors = np.stack([self.errors[-1] - e for e in self.errors[:-1]], axis=1)
            bounds = np.stack([bound - b for b in self.bounds[:-1]], axis=1)
            # Least squares by the normal equations: a few unknowns, and as many rows as corners.
            square = errors.T @ errors
            square += 1e-12 * np.trace(square) * np.eye(len(square))
            if square[0, 0] > 0:
                following -= (bounds + self.damping * errors) @ np.linalg.solve(square, errors.T @ self.errors[-1])
        return np.maximum(following, 0.0)


class _System:
    """The movable parts in an order that keeps the system's band narrow, and their corners."""

    def __init__(self, springs: Springs, parts: Numbers, corners: Numbers, load: Array) -> None:
        numbers = springs.numbers
        m = len(parts)
        place = np.full(len(springs.weights) + 1, -1)
        place[parts] = np.arange(m)
        pa, pb = place[springs.a[corners]], place[springs.b[corners]]
        both = (pa >= 0) & (pb >= 0)
        graph = csr_array(
            (np.ones(2 * both.sum()), (np.r_[pa[both], pb[both]], np.r_[pb[both], pa[both]])), shape=(m, m)
        )
        order = reverse_cuthill_mckee(graph, symmetric_mode=True) if m else np.zeros(0, dtype=np.int64)
        self.parts: Numbers = parts[order]
        place[self.parts] = np.arange(m)
        self.pa, self.pb = place[springs.a[corners]], place[springs.b[corners]]
        self.Ja, self.Jb = springs.Ja[corners], springs.Jb[corners]
        self.across, self.along, self.gap = springs.across[corners], springs.along[corners], springs.gap[corners]
        self.load, self.weights = load[self.parts], springs.weights[self.parts]
        self.eps, self.agreement = numbers.ground, numbers.agreement
        self.ground = numbers.ground * self.weights
        width = int(np.abs(self.pa - self.pb)[both].max(initial=0))
        self.band = np.zeros((6 * m, 6 * width + 6))
        self.factorisations = 0

    def share(self, u: Array) -> Array:
        """float64 (m,): the share of each part's weight that the ground carries."""
        return np.asarray(self.eps * np.abs(u).max(axis=1, initial=0.0))

    def agrees(self, forces: Array, bound: Array, limit: Array, near: bool) -> bool:
        """Whether friction is as Coulomb's law has it: no more than mu N, and as much where it slips."""
        agreement = self.agreement * (NEARER if near else 1.0)
        rubbing = np.hypot(forces[:, 1], forces[:, 2])
        slips = rubbing >= bound * (1 - 1e-9)
        wrong = np.maximum(rubbing - limit, 0.0) + np.where(slips, np.maximum(limit - bound, 0.0), 0.0)
        total, pressed = np.zeros(len(self.weights) + 1), np.zeros(len(self.weights) + 1)
        for place in (self.pa, self.pb):
            np.add.at(total, place, wrong)
            np.add.at(pressed, place, forces[:, 0])
        scale = np.maximum(self.weights, agreement * pressed[:-1])
        return bool((total[:-1] <= agreement * scale).all())

    def newton(self, u: Array, d: Array, bound: Array, left: float, most: int) -> tuple[Array, Array, Array, bool]:
        """Displacements u (m, 6) and d (k, 3) of least energy, the forces (k, 3), and whether they are found."""
        spring = (bound, self.across, self.along, self.gap)
        ends = (self.Ja, self.Jb, self.pa, self.pb)
        m = len(u)
        for step in range(most + 1):
            forces = kernels.pushed(d, *spring)
            total, pressed = kernels.summed(forces, *ends, m)
            residual = self.load + total - self.ground[:, None] * u
            tolerance = np.maximum(left * self.weights, _ROUNDING * pressed)
            if (np.abs(residual).max(axis=1, initial=0.0) <= tolerance).all():
                return u, d, forces, True
            if step == most:
                break
            check()
            kernels.fill(self.band, self.ground, d, *spring, *ends)
            factor, fault = dpbtrf(self.band.T, lower=1, overwrite_ab=1)
            if fault:
                break  # rounding: no better point can be told from this one
            solution, _ = dpbtrs(factor, residual.ravel(), lower=1)
            self.factorisations += 1
            way = solution.reshape(m, 6)
            change = kernels.opened(*ends, way)
            far = self._far(u, way, d, change, spring)
            u, d = u + far * way, d + far * change
        return u, d, forces, False

    def _far(self, u: Array, way: Array, d: Array, change: Array, spring: tuple[Array, ...]) -> float:
        """How far along a step the energy is least: the zero of its slope, which rises, piece by piece smooth."""
        constant = float(np.vdot(self.ground[:, None] * u - self.load, way))
        linear = float(np.vdot(self.ground[:, None] * way, way))
        low, high, far = 0.0, np.inf, 1.0
        first = kernels.slope(0.0, d, change, *spring)[0] + constant
        for _ in range(_LINE_STEPS):
            slope, curve = kernels.slope(far, d, change, *spring)
            slope, curve = slope + constant + linear * far, curve + linear
            if abs(slope) <= _FLAT * abs(first):
                break
            low, high = (far, high) if slope < 0 else (low, far)
            guess = far - slope / curve if curve > 0 else np.inf
            if not low < guess < high:
                guess = 2 * far if high == np.inf else (low + high) / 2
            far = guess
        return far
