"""Which subsets of rigid parts stand still under gravity: a linear program on contact patches with friction.

Forces act at the corners of contact patches, inside linearised Coulomb cones; a subset stands when some choice
of them balances every part's weight and moments (Fahlman 1974; Livesley 1978). The program is solved with
slack in its equations: zero slack is equilibrium, and where there is none the dual values are a virtual
motion in which gravity does work and no contact resists: the evidence, and the parts that move in it.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import csc_array, hstack

from neurosym.errors import NeurosymError
from neurosym.geometry.assembly import Box
from neurosym.geometry.blocking import bits
from neurosym.geometry.contacts import TABLE, Contact, hull_points
from neurosym.geometry.meshes import signed_volume

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]

#: Edges of the pyramid that stands for a friction cone. Its section has the area of the cone's: friction is exact to
#: 2% in every direction, and does not prefer the axes of the world.
CONE_EDGES = 16
_CONE_RADIUS = float(np.sqrt(2 * np.pi / (CONE_EDGES * np.sin(2 * np.pi / CONE_EDGES))))

#: Unbalanced force, as a share of the mean part's weight, below which a subset counts as standing.
BALANCE = 1e-6

#: Speed in the virtual motion, as a share of the fastest part's, above which a part counts as moving.
MOVES = 1e-6


@dataclass(frozen=True)
class Standing:
    """Whether a subset of parts stands.

    Attributes:
        stands: the answer.
        moving: if not, a bitset of parts that move in a virtual motion that nothing resists. While all of them are
            there, none of them held, any smaller subset falls too.
        held: a bitset of the parts that have to be held for it to stand.
    """

    stands: bool
    moving: int = 0
    held: int = 0


class Stability:
    """Answers `standing(subset)` for an assembly; each subset is solved once and remembered.

    Attributes:
        masses: float64 (n_parts,): density times volume.
        touching: touching[i] is a bitset of the parts in contact with part i.
        on_table: bitset of the parts in contact with the table.
        supports: supports[i] is a bitset of the parts with a contact under part i (normal within 45 degrees).
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        n = len(assembly)
        self._answers: dict[tuple[int, int], Standing] = {}
        self.masses, self._centres = _masses(assembly)
        patches = merged_patches(assembly, assembly.contacts())
        self.touching, self.supports, self.on_table, self.table_supports = [0] * n, [0] * n, 0, 0
        for p in patches:
            if p.b == TABLE:
                self.on_table |= 1 << p.a
                continue
            self.touching[p.a] |= 1 << p.b
            self.touching[p.b] |= 1 << p.a
            if p.normal[2] < -0.7:  # from a down to b: b carries a
                self.supports[p.a] |= 1 << p.b
            elif p.normal[2] > 0.7:
                self.supports[p.b] |= 1 << p.a
        self._patch_bits = [(1 << p.a) | (0 if p.b == TABLE else 1 << p.b) for p in patches]
        self._assemble(patches)

    def standing(self, subset: int, held: int = 0) -> Standing:
        """Whether the parts in a bitset stand while those in `held` and the fixed parts cannot move."""
        held &= subset
        answer = self._answers.get((subset, held))
        if answer is None:
            answer = self._solve(subset, held)
            if self.assembly.keeps_answers:
                self._answers[subset, held] = answer
        return answer

    def standing_when_held(self, subset: int, most: int, *, hands: int = -1) -> Standing:
        """Whether the parts in a bitset stand when the right ones, `most` of them at the most, are held.

        Holding helps only against a motion in which the held part moves. So where a subset falls, one of the parts that
        move is held, and the question is asked again: a search for a set that hits every motion.

        Args:
            subset: bitset of the parts that are there.
            most: how many may be held.
            hands: bitset of the parts that can be held; default any that is not fixed.

        Returns:
            `held` is what to hold; if nothing helps, `moving` are the parts that move in one motion or another, whose
            presence is enough for the subset and any smaller one to fall.
        """
        hands &= subset & ~self.assembly.fixed_mask
        motions: list[int] = []

        def search(held: int, left: int, barred: int) -> int | None:
            while True:
                missed = [m & hands & ~barred for m in motions if not m & held]
                if not missed:
                    answer = self.standing(subset, held)
                    if answer.stands:
                        return held
                    motions.append(answer.moving)
                    continue
                if not left:
                    return None
                for part in bits(min(missed, key=int.bit_count)):
                    found = search(held | 1 << part, left - 1, barred)
                    if found is not None:
                        return found
                    barred |= 1 << part
                return None

        found = search(0, most, 0)
        if found is not None:
            return Standing(True, 0, found)
        return Standing(False, functools.reduce(int.__or__, motions, 0))

    def _assemble(self, patches: tuple[Contact, ...]) -> None:
        """The equilibrium matrix of all patches: 6 rows a part, CONE_EDGES columns a patch corner."""
        mu, scale = self.assembly.friction, self.assembly.smallest_extent
        rows, columns, values, patch_of = [], [], [], []
        width = 0
        for number, p in enumerate(patches):
            u, v = _patch_axes(p)
            centre = p.points.mean(axis=0)
            points = centre + (p.points - centre) * (1 - self.assembly.tolerances.patch_shrink)
            angles = 2 * np.pi * (np.arange(CONE_EDGES) + 0.5) / CONE_EDGES
            tangents = np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v
            # The force on a: from b to a, that is against the normal.
            edges = -p.normal + mu * _CONE_RADIUS * tangents
            forces = np.tile(edges, (len(points), 1))
            at = np.repeat(points, CONE_EDGES, axis=0)
            count = len(forces)
            for part, sign in ((p.a, 1.0), (p.b, -1.0)):
                if part == TABLE:
                    continue
                moments = np.cross(at - self._centres[part], forces) / scale
                block = sign * np.concatenate([forces, moments], axis=1)  # (count, 6)
                rows.append(np.tile(6 * part + np.arange(6), count))
                columns.append(np.repeat(width + np.arange(count), 6))
                values.append(block.ravel())
            patch_of.append(np.full(count, number))
            width += count
        self._patch_of = np.concatenate(patch_of) if patch_of else np.zeros(0, dtype=int)
        shape = (6 * len(self.assembly), width)
        if width:
            entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
            self._matrix = csc_array(entries, shape=shape)
        else:
            self._matrix = csc_array(shape)

    def _solve(self, subset: int, held: int) -> Standing:
        parts = bits(subset & ~held & ~self.assembly.fixed_mask)
        if not parts:
            return Standing(True, 0, held)
        present = np.array([(need & subset) == need for need in self._patch_bits], dtype=bool)
        columns = np.flatnonzero(present[self._patch_of]) if len(self._patch_of) else np.zeros(0, dtype=int)
        rows = (6 * np.array(parts)[:, None] + np.arange(6)).ravel()
        matrix = self._matrix[:, columns][rows]
        weights = np.zeros(len(rows))
        weights[2::6] = self.masses[parts] / self.masses.mean()
        # min 1's+ + 1's-  such that  A f + s+ - s- = weight,  f, s >= 0
        identity = np.arange(len(rows))
        slack = csc_array((np.ones(len(rows)), (identity, identity)), shape=(len(rows), len(rows)))
        result = linprog(
            np.concatenate([np.zeros(len(columns)), np.ones(2 * len(rows))]),
            A_eq=hstack([matrix, slack, -slack], format="csc"),
            b_eq=weights,
            method="highs-ds",
        )
        if result.status != 0:
            raise NeurosymError(
                f"Expected the stability program of {self.assembly.in_mask(subset)} to have a solution; "
                f"the solver said: {result.message}. Check the scale of the parts (their units)."
            )
        if result.fun <= BALANCE * len(parts):
            return Standing(True, 0, held)
        speed = np.abs(result.eqlin.marginals.reshape(-1, 6)).max(axis=1)
        moving = sum(1 << parts[i] for i in np.flatnonzero(speed > MOVES * speed.max()))
        return Standing(False, moving, held)


def _patch_axes(patch: Contact) -> tuple[Array, Array]:
    """Tangents (3,) of a patch along and across its longest edge: the cone turns with the parts, not with the world."""
    following = np.roll(patch.points, -1, axis=0) - patch.points
    u = following[np.argmax(np.linalg.norm(following, axis=1))]
    u = u - (u @ patch.normal) * patch.normal
    u = u / np.linalg.norm(u)
    return u, np.cross(patch.normal, u)


def merged_patches(assembly: Assembly, contacts: tuple[Contact, ...]) -> tuple[Contact, ...]:
    """Contacts between parts, those in one plane merged into the convex hull of their corners; a, b are parts.

    For rigid parts nothing is lost: a force anywhere in the hull with a cone's direction is a sum of such
    forces at its corners.
    """
    owners, touch = assembly.owners, assembly.touch
    groups: dict[tuple[int, int], list[tuple[Array, float, list[Array], float]]] = {}
    for c in contacts:
        a, b = int(owners[c.a]), TABLE if c.b == TABLE else int(owners[c.b])
        normal = c.normal
        if b != TABLE and a > b:
            a, b, normal = b, a, -normal
        offset = float(c.points.mean(axis=0) @ normal)
        planes = groups.setdefault((a, b), [])
        for k, (known, distance, points, area) in enumerate(planes):
            if known @ normal > 1 - 1e-6 and abs(distance - offset) <= 2 * touch:
                planes[k] = (known, distance, [*points, c.points], area + c.area)
                break
        else:
            planes.append((normal, offset, [c.points], c.area))
    found = []
    for (a, b), planes in groups.items():
        for normal, _, points, area in planes:
            corners = points[0] if len(points) == 1 else hull_points(np.concatenate(points), normal)
            found.append(Contact(a, b, corners, normal, area))
    return tuple(found)


def _masses(assembly: Assembly) -> tuple[Array, Array]:
    """Masses (n,) and centres of mass (n, 3), in the world, of the parts."""
    volumes, moments = np.zeros(len(assembly)), np.zeros((len(assembly), 3))
    for i, body in enumerate(assembly.bodies):
        owner = assembly.owners[i]
        if isinstance(body.shape, Box):
            volume, centre = float(np.prod(body.shape.size)), assembly.X_WB[i][:3, 3]
        else:
            vertices, faces = assembly.body_vertices(i), body.shape.faces
            volume = signed_volume(vertices, faces)
            a, b, c = (vertices[faces[:, k]] - vertices[0] for k in range(3))
            each = np.einsum("nd,nd->n", a, np.cross(b, c)) / 6
            centre = vertices[0] + (each[:, None] * (a + b + c)).sum(axis=0) / (4 * volume)
        volumes[owner] += volume
        moments[owner] += volume * centre
    densities = np.array([p.density for p in assembly.parts])
    return volumes * densities, moments / volumes[:, None]
