"""A lattice of translations whose lines lie where faces come level, and quarter turns if wanted, searched by A*.

Offsets along each axis of the moving parts are those at which one of their faces comes level with a face of the others
(`levels`), so passages without any play have lattice lines in them. Between boxes with common axes those are all the
offsets that matter: there a search that ends without a way out proves that no translations lead out. For other shapes
it proves nothing.

With turns, parts may also turn by 90° about their axes, through the middle of any of their bodies: a key in its lock.
That proves nothing.
"""

from __future__ import annotations

import heapq
from bisect import bisect_left, bisect_right
from itertools import pairwise, permutations, product

import numpy as np

from neurosym.geometry.paths.levels import commonest, levels_along
from neurosym.geometry.paths.removal import Removal
from neurosym.geometry.rigid_motions import Interpolation, posed
from neurosym.support.arrays import Array
from neurosym.support.deadline import check

#: Orientation (a number) and offset along the three axes.
Node = tuple[int, float, float, float]

#: Poses between the ends of a quarter turn, and bodies through whose middles turns are tried.
TURN_STEPS = 9
MAX_PIVOTS = 8


class Lattice:
    """The lattice of one removal. `complete`: no way out on it means that there is none by translations."""

    def __init__(self, removal: Removal, *, turns: bool = False) -> None:
        self.removal = removal
        self._frame = removal.frame
        # Offsets are rounded far below the tolerance, so that the same place reached twice is the same node.
        self._digits = int(np.ceil(2 - np.log10(removal.assembly.touch)))
        ground = removal.ground is None or bool(np.isclose(np.abs(self._frame[2]).max(), 1.0, atol=1e-9))
        self.complete = removal.aligned and ground and not turns
        self._own = removal.assembly.bodies.points(removal.moving) - removal.centre
        self._rotations = [np.eye(3)]
        self._pivots = np.zeros((0, 3))
        if turns:
            turned = [self._frame @ local @ self._frame.T for local in _quarter_turns()]
            self._rotations += [r for r in turned if not np.allclose(r, np.eye(3))]
            self._pivots = self._middles()
        self._offsets: dict[int, list[list[float]]] = {}
        self._known: dict[tuple[Node, Node], bool] = {}

    def search(self) -> list[Array] | None:
        """Poses (4, 4) of a way out, where it bends only; None: there is none. `OutOfBudget` ends it before."""
        while True:
            way = self._shortest()
            if way is None:
                return None
            poses = [self._pose(way[0])]
            bad = False
            for a, b in pairwise(way):
                leg = self._leg(a, b)
                # Straight edges between boxes were answered exactly; others only at some places.
                if not (self.removal.aligned and a[0] == b[0] == 0) and not all(
                    self.removal.is_clear(Interpolation(x, y, self.removal.centre)) for x, y in pairwise(leg)
                ):
                    self._known[_edge(a, b)] = False
                    bad = True
                poses += leg[1:]
            if not bad:
                return _bends(poses)

    def _shortest(self) -> list[Node] | None:
        """A* from rest to the first node that is out; straight on is a little cheaper than round a corner."""
        start: Node = (0, 0.0, 0.0, 0.0)
        corner = 1e-3 * self.removal.assembly.smallest_extent
        best = {start: 0.0}
        came: dict[Node, Node] = {}
        queue: list[tuple[float, float, Node, int]] = [(self.removal.left(self._pose(start)), 0.0, start, -1)]
        done = set()
        while queue:
            _, cost, at, heading = heapq.heappop(queue)
            if at in done:
                continue
            done.add(at)
            self.removal.spend()
            if self.removal.left(self._pose(at)) == 0.0:
                way = [at]
                while way[-1] in came:
                    way.append(came[way[-1]])
                return way[::-1]
            for following, step, axis in self._neighbours(at):
                reached = cost + step + (0.0 if heading == axis else corner)
                if following in done or reached >= best.get(following, np.inf) or not self._is_free(at, following):
                    continue
                best[following], came[following] = reached, at
                heapq.heappush(queue, (reached + self.removal.left(self._pose(following)), reached, following, axis))
        return None

    def _neighbours(self, at: Node) -> list[tuple[Node, float, int]]:
        """Nodes one step away, how far that is, and a number for the direction in which they lie."""
        found: list[tuple[Node, float, int]] = []
        for axis, levels in enumerate(self._levels(at[0])):
            here = at[1 + axis]
            for place in (bisect_left(levels, here) - 1, bisect_right(levels, here)):
                if 0 <= place < len(levels):
                    offset = [*at[1:]]
                    offset[axis] = levels[place]
                    found.append(((at[0], offset[0], offset[1], offset[2]), abs(levels[place] - here), axis))
        pose = self._pose(at)
        for pivot, axis, sign in product(self._pivots, range(3), (1, -1)):
            turned = self._turned(pose, pivot, axis, sign * np.pi / 2)
            way = float(np.linalg.norm(self.removal.centre - pivot)) + self.removal.assembly.smallest_extent
            found.append((self._node(turned), way, 3))
        return found

    def _is_free(self, a: Node, b: Node) -> bool:
        edge = _edge(a, b)
        known = self._known.get(edge)
        if known is None:
            check()
            known = self._known[edge] = self._asked(a, b)
        return known

    def _asked(self, a: Node, b: Node) -> bool:
        removal = self.removal
        if removal.aligned and a[0] == b[0] == 0:
            return removal.is_clear(Interpolation(self._pose(a), self._pose(b), removal.centre))
        if removal.hit(self._pose(b)):
            return False
        leg = self._leg(a, b)
        if len(leg) == 2:
            motion = Interpolation(leg[0], leg[1], removal.centre)
            count = max(int(np.ceil(np.linalg.norm(motion.way) / (0.2 * removal.assembly.smallest_extent))), 2)
            leg = [motion.at(k / count) for k in range(count + 1)]
        return not any(removal.hit(X) for X in leg[1:-1])

    def _leg(self, a: Node, b: Node) -> list[Array]:
        """Poses from one node to a neighbour: two, or those of a quarter turn."""
        first, last = self._pose(a), self._pose(b)
        if a[0] == b[0]:
            return [first, last]
        # The pivot stays in place: it is the fixed point of the turn, up to the turn's axis.
        turn: Array = last @ np.linalg.inv(first)
        fixed: Array = np.linalg.pinv(np.eye(3) - turn[:3, :3], rcond=1e-6) @ turn[:3, 3]
        motion = Interpolation(np.eye(4), _about(fixed, turn[:3, :3]), fixed)
        return [first, *(motion.at(k / TURN_STEPS) @ first for k in range(1, TURN_STEPS)), last]

    def _turned(self, pose: Array, pivot: Array, axis: int, angle: float) -> Array:
        """A pose turned about an axis of the frame through where it has a point (3,) of the assembled parts."""
        x, y, z = self._frame[:, axis]
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        R = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
        return np.asarray(_about(pose[:3, :3] @ pivot + pose[:3, 3], R) @ pose)

    def _pose(self, node: Node) -> Array:
        R = self._rotations[node[0]]
        return posed(R, self.removal.centre + self._frame @ node[1:] - R @ self.removal.centre)

    def _node(self, X: Array) -> Node:
        """The node of a pose that is turned by quarters."""
        near = [float(np.abs(r - X[:3, :3]).max()) for r in self._rotations]
        local = self._frame.T @ (X[:3, :3] @ self.removal.centre + X[:3, 3] - self.removal.centre)
        x, y, z = (round(float(v), self._digits) + 0.0 for v in local)
        return int(np.argmin(near)), x, y, z

    def _middles(self) -> Array:
        """Points of the moving parts to turn about, float64 (n, 3), each once.

        The middles of the parts and of their largest bodies; and, for bodies that are more than a box, those between
        the two levels along each axis on which most corners lie, as those of a shaft do.
        """
        bounds = self.removal.assembly.body_bounds[self.removal.own_bodies]
        largest = np.argsort(-np.ptp(bounds, axis=1).max(axis=1), kind="stable")[:MAX_PIVOTS]
        local = self._own @ self._frame
        spans = [commonest(axis, self.removal.assembly.touch)[:2].mean() for axis in local.T]
        between = np.array(list(product(*((0.0, span) for span in spans)))) @ self._frame.T + self.removal.centre
        points = np.concatenate([self.removal.centre[None], bounds[largest].mean(axis=1), between])
        _, first = np.unique(np.round(points, self._digits), axis=0, return_index=True)
        return np.asarray(points[np.sort(first)])

    def _levels(self, orientation: int) -> list[list[float]]:
        """Offsets along the three axes, in order; 0 and one beyond each end are among them."""
        known = self._offsets.get(orientation)
        if known is None:
            known = self._offsets[orientation] = [
                levels_along(self.removal, axis, self._rotations[orientation], self._digits) for axis in self._frame.T
            ]
        return known


def _quarter_turns() -> list[Array]:
    """The 24 rotations (3, 3) that map the axes onto one another."""
    found = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        matrix = np.zeros((3, 3))
        matrix[range(3), order] = signs
        if np.linalg.det(matrix) > 0:
            found.append(matrix)
    return found


def _about(point: Array, R: Array) -> Array:
    """The rotation R (3, 3) about a point (3,), as a motion (4, 4)."""
    return posed(R, point - R @ point)


def _edge(a: Node, b: Node) -> tuple[Node, Node]:
    return (a, b) if a < b else (b, a)


def _bends(poses: list[Array]) -> list[Array]:
    """Poses without those that lie between two others on one straight line."""
    kept = [poses[0]]
    for before, at, after in zip(poses, poses[1:], poses[2:]):
        step, following = at[:3, 3] - before[:3, 3], after[:3, 3] - at[:3, 3]
        turns = not np.allclose(before[:3, :3], after[:3, :3], atol=1e-9)
        across = np.linalg.norm(np.cross(step, following))
        if turns or across > 1e-9 * np.linalg.norm(step) * np.linalg.norm(following) or step @ following < 0:
            kept.append(at)
    return [*kept, poses[-1]] if len(poses) > 1 else kept
