"""Forces that hold parts in balance: non-negative least squares on the edges of friction cones, by Newton's method.

Forces f >= 0 act along the edges of linearised Coulomb cones at the corners of contact patches. Which f leaves the
least unbalanced, ``min |A f - w|`` (A: wrenches on the parts, w: what must balance gravity), is asked by proximal
steps ``min |A f - w|^2 + eps |f - f0|^2``. The dual of a step has six unknowns a part and is smooth and piecewise
quadratic: a semismooth Newton method ends after a few sparse factorisations (Mangasarian, "A Newton method for linear
programming", 2004). What is left over, r = w - A f, is zero in equilibrium. Otherwise it is a virtual motion in which
gravity does work (w . r > 0) and no contact resists (A' r <= 0): Farkas' proof that no forces hold the parts, and as
a projection it is unique.

Each part's equations are divided by its own weight and moments by its own size, so that light parts count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_array, csr_array
from scipy.sparse.linalg import splu

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.contacts import TABLE, Contact
from neurosym.geometry.stability.patches import patch_axes
from neurosym.support.arrays import Array, Numbers, Truths
from neurosym.support.deadline import check

#: Edges of the pyramid that stands for a friction cone. Its section has the area of the cone's: friction is exact to
#: 2% in every direction, and does not prefer the axes of the world.
CONE_EDGES = 16
_CONE_RADIUS = float(np.sqrt(2 * np.pi / (CONE_EDGES * np.sin(2 * np.pi / CONE_EDGES))))

#: Unbalanced force or moment, as a share of a part's own weight (times its size), below which the part is in balance.
BALANCE = 1e-6

#: Weights below this share of the heaviest part's are scaled as if they were this: rounding would drown them.
LIGHTEST = 1e-6

#: A virtual motion proves a fall when forces this many times those found could not take the work out of it.
PROOF = 10.0

#: Weights of the proximal term, step by step: the first few, and those that follow where these do not decide. Each is
#: a tenth of the one before at the least: larger leaps cost Newton's method more steps than they save.
QUICK = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
THOROUGH = (1e-6, 1e-7, 1e-8)
_NEWTON_STEPS = 100

#: A line search ends where the slope is this share of what it was, or after so many steps.
_FLAT, _LINE_STEPS = 0.05, 30


@dataclass(frozen=True, eq=False)
class Balance:
    """The forces that come nearest to balance, and what they leave.

    Attributes:
        stands: True and False are proved; None is not decided.
        forces: float64 (n_corners, CONE_EDGES), for the corners asked about.
        residual: float64 (n_parts, 6): what is left unbalanced on each part asked about, scaled.
    """

    stands: bool | None
    forces: Array
    residual: Array


class Equilibrium:
    """The contact corners of an assembly and what forces there do to its parts.

    Attributes:
        patch: int64 (c,): the patch of each corner; corners come patch by patch.
        a, b: int64 (c,): the parts of each corner; b may be `TABLE`.
        weights: float64 (n_parts, 6): what forces must add up to on each part, scaled.
        lift: float64 (c, CONE_EDGES): the upward share of each edge's force on a, per unit of it.
    """

    def __init__(self, assembly: Assembly, patches: tuple[Contact, ...], masses: Array, centres: Array) -> None:
        corners = np.array([len(p.points) for p in patches], dtype=np.int64)
        self.patch = np.repeat(np.arange(len(patches)), corners)
        self.a = np.array([p.a for p in patches], dtype=np.int64)[self.patch]
        self.b = np.array([p.b for p in patches], dtype=np.int64)[self.patch]
        angles = 2 * np.pi * (np.arange(CONE_EDGES) + 0.5) / CONE_EDGES
        reach = assembly.friction * _CONE_RADIUS
        #: float64 (3, CONE_EDGES): edges along a patch's own axes: against its normal, along its tangents.
        self.edges = np.stack([np.ones(CONE_EDGES), reach * np.cos(angles), reach * np.sin(angles)])
        frames, points = np.zeros((len(patches), 3, 3)), []
        for k, p in enumerate(patches):
            frames[k] = np.stack([-p.normal, *patch_axes(p)], axis=1)
            centre = p.points.mean(axis=0)
            points.append(centre + (p.points - centre) * (1 - assembly.tolerances.patch_shrink))
        at = np.concatenate(points) if points else np.zeros((0, 3))
        axes = frames[self.patch]
        n = len(masses)
        scale = np.maximum(masses, LIGHTEST * masses.max())
        sizes = np.full(n, assembly.smallest_extent / 2)
        for part in (self.a, self.b):
            real = part != TABLE
            np.maximum.at(sizes, part[real], np.linalg.norm(at[real] - centres[part[real]], axis=1))
        self.weights = np.zeros((n, 6))
        self.weights[:, 2] = masses / scale
        # All forces are counted in the mean weight: a light part may have to carry a heavy one.
        unit = np.full(len(self.a), scale.mean())
        self.on_a = _wrenches(axes, at - centres[self.a], sizes[self.a]) * (unit / scale[self.a])[:, None, None]
        self.on_b = -_wrenches(axes, at - centres[self.b], sizes[self.b]) * (unit / scale[self.b])[:, None, None]
        self.on_b[self.b == TABLE] = 0.0
        self.lift = axes[:, 2] @ self.edges

    def wrenches(self, corners: Numbers, forces: Array, count: int) -> Array:
        """float64 (count, 6): what forces (k, CONE_EDGES) at these corners add up to on each part, scaled."""
        along = forces @ self.edges.T
        found = np.zeros((count + 1, 6))
        np.add.at(found, self.a[corners], np.einsum("kij,kj->ki", self.on_a[corners], along))
        np.add.at(found, self.b[corners], np.einsum("kij,kj->ki", self.on_b[corners], along))
        return found[:count]  # the table's share, at TABLE = -1, is nobody's

    def balance(
        self,
        parts: Numbers,
        corners: Numbers,
        target: Array,
        start: Array | None = None,
        steps: tuple[float, ...] = QUICK,
    ) -> Balance:
        """Whether forces at some corners can balance some parts; all others are taken to be immovable.

        Args:
            parts: int64 (m,): the parts to be balanced, in increasing order.
            corners: int64 (k,): corners of patches with at least one of them, in increasing order.
            target: float64 (m, 6): what the forces must add up to.
            start: float64 (k, CONE_EDGES): forces to begin with, of a similar subset for instance.
            steps: weights of the proximal term, one step after the other.
        """
        return _Newton(self, parts, corners, target).run(start, steps)


class _Newton:
    """One balance: the operators of its parts and corners, and the iteration."""

    def __init__(self, whole: Equilibrium, parts: Numbers, corners: Numbers, target: Array) -> None:
        self.edges = whole.edges
        self.m = len(parts)
        self.target = target.ravel()
        place = np.full(len(whole.weights) + 1, -1)
        place[parts] = np.arange(self.m)
        # Wrenches on immovable parts are dropped: their row is one beyond the last.
        self.sides = [place[whole.a[corners]], place[whole.b[corners]]]
        self.blocks = [whole.on_a[corners], whole.on_b[corners]]
        count = len(corners)
        rows, columns, values = [], [], []
        for side, block in zip(self.sides, self.blocks):
            kept = np.flatnonzero(side >= 0)
            rows.append((6 * side[kept, None, None] + np.arange(6)[:, None] + np.zeros(3, dtype=int)).ravel())
            columns.append((3 * kept[:, None, None] + np.zeros((6, 1), dtype=int) + np.arange(3)).ravel())
            values.append(block[kept].ravel())
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        self.B = csr_array(entries, shape=(6 * self.m, 3 * count))
        self.BT = self.B.T.tocsr()
        # Blocks of the normal matrix: one a part, two a pair of parts that touch.
        patch = whole.patch[corners]
        self.starts = np.flatnonzero(np.diff(patch, prepend=-1))
        a, b = self.sides[0][self.starts], self.sides[1][self.starts]
        kept_a, kept_b, both = np.flatnonzero(a >= 0), np.flatnonzero(b >= 0), np.flatnonzero((a >= 0) & (b >= 0))
        self.picks = kept_a, kept_b, both
        own = np.arange(self.m)
        row = np.concatenate([own, a[kept_a], b[kept_b], a[both], b[both]])
        column = np.concatenate([own, a[kept_a], b[kept_b], b[both], a[both]])
        keys, number = np.unique(row * self.m + column, return_inverse=True)
        self.gather = csr_array((np.ones(len(row)), (number, np.arange(len(row)))), shape=(len(keys), len(row)))
        self.indices, self.indptr = keys % self.m, np.searchsorted(keys // self.m, np.arange(self.m + 1))

    def run(self, start: Array | None, steps: tuple[float, ...]) -> Balance:
        forces = np.zeros((len(self.sides[0]), CONE_EDGES)) if start is None else start
        residual = self.target - self.B @ (forces @ self.edges.T).ravel()
        stands = self._verdict(forces, residual)
        for weight in steps:
            if stands is not None:
                break
            forces = self._step(forces, weight)
            residual = self.target - self.B @ (forces @ self.edges.T).ravel()
            stands = self._verdict(forces, residual)
        return Balance(stands, forces, residual.reshape(-1, 6))

    def _verdict(self, forces: Array, residual: Array) -> bool | None:
        if np.abs(residual).max(initial=0.0) <= BALANCE:
            return True
        resisted = max(float(((self.BT @ residual).reshape(-1, 3) @ self.edges).max(initial=0.0)), 0.0)
        work = float(self.target @ residual)
        total = float(forces.sum()) + float(np.abs(self.target).sum())
        return False if work > BALANCE and PROOF * resisted * total <= work else None

    def _step(self, f0: Array, weight: float) -> Array:
        """One proximal step: Newton's method on its dual, with an exact line search."""
        z = np.zeros(6 * self.m)
        tolerance = 1e-2 * weight * max(1.0, float(np.abs(self.target).max(initial=0.0)))
        pushed = f0  # f0 + A' z: forces before their negative share is cut off
        f = np.maximum(pushed, 0.0)
        for _ in range(_NEWTON_STEPS):
            check()
            gradient = weight * z - self.target + self.B @ (f @ self.edges.T).ravel()
            if np.abs(gradient).max(initial=0.0) <= tolerance:
                break
            # With no force at all every edge is on the verge of carrying one.
            active = f > 0 if f.any() else np.ones(f.shape, dtype=bool)
            try:
                step = -self._solve(active, weight, gradient)
            except RuntimeError:
                break  # rounding: beside forces this large the proximal term is nothing, and the system is singular
            if not float(gradient @ step) < 0:
                break  # rounding: no better point can be told from this one
            push = (self.BT @ step).reshape(-1, 3) @ self.edges
            share = self._share(z, step, pushed, push, weight)
            z, pushed = z + share * step, pushed + share * push
            f = np.maximum(pushed, 0.0)
        return f

    def _share(self, z: Array, step: Array, pushed: Array, push: Array, weight: float) -> float:
        """How far along a step the dual is least: the zero of its slope, which is piecewise linear and rises.

        Halving the step until the dual falls is not enough where many parts hang together, such as the stones of a
        dome: the shares that it finds are too small by orders of magnitude.
        """
        constant = weight * float(z @ step) - float(self.target @ step)
        linear = weight * float(step @ step)

        def slope(share: float) -> tuple[float, float]:
            """The slope there, and its own slope."""
            forces = pushed + share * push
            pushing = np.where(forces > 0, push, 0.0)
            change = linear + float(np.vdot(pushing, push))
            return constant + linear * share + float(np.vdot(forces, pushing)), change

        first, _ = slope(0.0)
        low, high, share = 0.0, np.inf, 1.0
        for _ in range(_LINE_STEPS):
            rise, change = slope(share)
            if abs(rise) <= _FLAT * abs(first):
                break
            low, high = (share, high) if rise < 0 else (low, share)
            guess = share - rise / change
            if not low < guess < high:
                guess = 2.0 * share if high == np.inf else (low + high) / 2
            share = guess
        return share

    def _solve(self, active: Truths, weight: float, right: Array) -> Array:
        """The Newton system: wrenches of the active edges times their transpose."""
        outer = np.einsum("ie,je->eij", self.edges, self.edges).reshape(CONE_EDGES, 9)
        inner = (active.astype(np.float64) @ outer).reshape(-1, 3, 3)
        left = [block @ inner for block in self.blocks]

        def summed(i: int, j: int, picked: Numbers) -> Array:
            products = left[i] @ np.swapaxes(self.blocks[j], 1, 2)
            return np.asarray(np.add.reduceat(products.reshape(-1, 36), self.starts)[picked])

        kept_a, kept_b, both = self.picks
        parts = [np.tile(weight * np.eye(6).ravel(), (self.m, 1))]
        if len(self.starts):
            mixed = summed(0, 1, both)
            turned = mixed.reshape(-1, 6, 6).swapaxes(1, 2).reshape(-1, 36)
            parts += [summed(0, 0, kept_a), summed(1, 1, kept_b), mixed, turned]
        data = (self.gather @ np.concatenate(parts)).reshape(-1, 6, 6)
        matrix = bsr_array((data, self.indices, self.indptr), shape=(6 * self.m, 6 * self.m)).tocsc()
        options = {"SymmetricMode": True}
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        return np.asarray(factors.solve(right))


def _wrenches(axes: Array, arms: Array, sizes: Array) -> Array:
    """float64 (c, 6, 3): force, and moment over size, of unit forces along each axis at the end of an arm."""
    moments = np.cross(arms[:, :, None], axes, axis=1) / sizes[:, None, None]
    return np.concatenate([axes, moments], axis=1)
