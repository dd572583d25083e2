"""A plan as a film: where every part is at any time t, from 0 (before the first step) to the number of steps.

Step i fills the time from i to i + 1. What leaves goes along the step's path and is then set down before the work, in
rows in the order of the plan; a group that leaves together is set down as one, and what is taken off it later leaves
it there. A plan that puts together is the film of its reverse, run backwards.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.rigid_motions import shifted
from neurosym.geometry.staging import Staging
from neurosym.geometry.step_motion import Track
from neurosym.support.arrays import Array, Numbers, Pixels, Truths

#: Share of a step's time that the path of the plan takes; the rest is the carrying to or from the place before it.
ON_PATH = 0.65
#: Space between what is set down (a share of the parts' median width), and between it and the work (a share of the
#: work's largest extent).
GAP, CLEAR = 0.35, 0.35
#: Where a part is between two steps: nowhere, in the work, or set down before it.
ABSENT, IN_PLACE, APART = 0, 1, 2


class Timeline:
    """The film of a staged plan.

    Attributes:
        staging: what happens.
        geometry: what answers questions about its assembly.
        names: names of the parts, in the order of every array here.
        bounds_at_rest, centres: float64 (n_parts, 2, 3) and (n_parts, 3): of the parts in the work, and their middle.
        n_steps: the last time.
        where: uint8 (n_steps + 1, n_parts): `ABSENT`, `IN_PLACE` or `APART` at each whole time.
        shifts: float64 (n_steps + 1, n_parts, 3): how far each part is from its rest in the work at each whole time.
        backwards: whether the film is that of taking apart, run backwards.
    """

    def __init__(self, staging: Staging, geometry: AssemblyGeometry | None = None) -> None:
        self.staging = staging
        known = geometry is not None and geometry.assembly is staging.assembly
        self.geometry = geometry if geometry and known else AssemblyGeometry(staging.assembly)
        self.names = staging.assembly.names
        self.bounds_at_rest = staging.assembly.part_bounds
        self.centres = np.asarray(self.bounds_at_rest.mean(axis=1))
        self.n_steps = len(staging.motions)
        moving = [m for m in staging.motions if m.parts]
        self.backwards = bool(moving) and all(m.arrives for m in moving)
        # From here on, times and steps are those of the film as it is made, where `_played` has turned them.
        present, self._motions = staging.present, staging.motions
        if self.backwards:
            present = (*present, *(n for m in self._motions for n in m.parts))
            self._motions = tuple(m.reversed() for m in reversed(self._motions))
        index = staging.assembly.index
        self._movers = [np.array([index[n] for n in m.parts], dtype=np.int64) for m in self._motions]
        self._where, self._shifts = self._between_steps([index[n] for n in present])
        back = -1 if self.backwards else 1
        self.where, self.shifts = self._where[::back], self._shifts[::back]

    def _between_steps(self, present: Sequence[int]) -> tuple[Pixels, Array]:
        """`where` and `shifts`; what is to arrive waits before the work."""
        n, places = len(self.names), _rows_before(self.staging.assembly, self._movers, self.backwards)
        where, shifts = np.zeros((self.n_steps + 1, n), dtype=np.uint8), np.zeros((self.n_steps + 1, n, 3))
        where[0, present] = IN_PLACE
        for motion, movers, place in zip(self._motions, self._movers, places):
            waiting = movers[where[0, movers] == ABSENT]
            if motion.arrives:
                where[0, waiting], shifts[0, waiting] = APART, place
        for step, (motion, movers) in enumerate(zip(self._motions, self._movers)):
            where[step + 1], shifts[step + 1] = where[step], shifts[step]
            where[step + 1, movers] = IN_PLACE if motion.arrives else APART
            shifts[step + 1, movers] = 0.0 if motion.arrives else places[step]
        return where, shifts

    def step_at(self, t: float) -> int | None:
        """Number of the step that is under way at time t, or None at a whole time."""
        step = int(np.floor(self._within(t)))
        return step if t > step and step < self.n_steps else None

    def state_at(self, t: float) -> tuple[str, ...]:
        """Names of the parts in place when the step under way at time t began."""
        return self.staging.there(int(np.floor(self._within(t))))

    def motions(self, t: float) -> Array:
        """float64 (n_parts, 4, 4): how each part has moved at time t from its rest in the work."""
        t = self._played(self._within(t))
        step = int(np.floor(t))
        X = np.tile(np.eye(4), (len(self.names), 1, 1))
        X[:, :3, 3] = self._shifts[step]
        if t > step:
            index = self.staging.assembly.index
            for name, moved in self._under_way(step, t - step).items():
                X[index[name]] = moved
        return X

    def frames(self, t: float) -> tuple[Array, Array]:
        """The parts' centres, float64 (n_parts, 3), and turns, float64 (n_parts, 4), quaternions w, x, y, z."""
        X = self.motions(t)
        positions: Array = np.einsum("nij,nj->ni", X[:, :3, :3], self.centres) + X[:, :3, 3]
        turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(X), 1))
        turned = (X[:, :3, :3] != np.eye(3)).any(axis=(1, 2))
        if turned.any():
            turns[turned] = Rotation.from_matrix(X[turned, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
        return positions, turns

    def visible(self, t: float) -> Truths:
        """bool (n_parts,): which parts are to be seen at time t."""
        t = self._within(t)
        step = int(np.floor(t))
        return np.asarray((self.where[step] != ABSENT) | (self.where[int(np.ceil(t))] != ABSENT))

    def bounds(self) -> Array:
        """float64 (2, 3): bounds of what is to be seen at whole times, and at the outer ends of all paths."""
        boxes = self.boxes()
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def boxes(self) -> Array:
        """float64 (k, 2, 3): bounds of each part wherever it is to be seen at those times."""
        boxes = self.bounds_at_rest[None] + self.shifts[:, :, None]
        seen = [boxes[self.where != ABSENT] if self.where.any() else self.bounds_at_rest]
        for number, (motion, movers) in enumerate(zip(self._motions, self._movers)):
            if not motion.tracks:
                continue
            middle, end = self._middle(number), motion.tracks[0].poses[-1]
            shift = end[:3, :3] @ middle + end[:3, 3] - middle
            seen.append(self.bounds_at_rest[movers] + self._base(number) + shift)
        return np.concatenate(seen)

    def path_of(self, step: int) -> Array:
        """float64 (k, 3): the path of the middle of what moves in a step, out from where it rests."""
        number = int(self._played(step + 0.5))
        if not self._motions[number].tracks:
            return np.zeros((0, 3))
        path, middle = self._motions[number].tracks[0].poses, self._middle(number)
        return np.asarray(path[:, :3, :3] @ middle + path[:, :3, 3] + self._base(number))

    def _within(self, t: float) -> float:
        if not np.isfinite(t):
            raise InputError(f"Expected a time from 0 to {self.n_steps}; got {t!r}.")
        return float(np.clip(t, 0.0, self.n_steps))

    def _played(self, t: float) -> float:
        """The time, in the film as it is made, of a time of the plan."""
        return self.n_steps - t if self.backwards else t

    def _base(self, number: int) -> Array:
        """float64 (3,): how far from the work the path of a motion begins: 0, or where its group was set down."""
        return np.asarray(self._shifts[number + self._motions[number].arrives, self._movers[number][0]])

    def _middle(self, number: int) -> Array:
        """float64 (3,): the middle of what a motion moves, at rest in the work."""
        boxes = self.bounds_at_rest[self._movers[number]]
        return np.asarray((boxes[:, 0].min(axis=0) + boxes[:, 1].max(axis=0)) / 2)

    def _under_way(self, number: int, share: float) -> dict[str, Array]:
        """Name -> float64 (4, 4): the motions of the parts that move, when `share` of a step's time has passed."""
        motion = self._motions[number]
        if not motion.tracks:
            return {}
        share = 1.0 - share if motion.arrives else share
        base = shifted(self._base(number))
        if share <= ON_PATH:
            return {name: base @ X for name, X in motion.out(_eased(share / ON_PATH)).items()}
        share = _eased((share - ON_PATH) / (1 - ON_PATH))
        # What made way goes back while the others are carried on.
        moved = {name: base @ X for name, X in motion.out(1 - share).items()}
        there = self._shifts[number + (not motion.arrives), self._movers[number][0]]
        carried = self._carried(base @ motion.tracks[0].poses[-1], there, self._middle(number), share)
        return moved | dict.fromkeys(motion.parts, carried)

    def _carried(self, end: Array, there: Array, middle: Array, share: float) -> Array:
        """float64 (4, 4): on the way from the end of the path, over everything, to where it is set down."""
        last = shifted(there)
        over_end, over_last = end.copy(), last.copy()
        over_end[2, 3] += max(self._top - float(end[2, :3] @ middle + end[2, 3]), 0.0)
        over_last[2, 3] = max(self._top - float(middle[2]), float(last[2, 3]))
        over = Track((), np.stack([end, over_end, over_last, last]), middle)
        return over.at(over.key(share))

    @cached_property
    def _top(self) -> float:
        """Height (z) to which the middle of what is carried over the others is raised."""
        boxes = self.bounds_at_rest
        return float(boxes[:, 1, 2].max() + 0.6 * np.ptp(boxes[..., 2], axis=1).max())


def floor_of(assembly: Assembly) -> float:
    """Height (z) of the table, or of the lowest point where there is no table."""
    return assembly.ground if assembly.has_table else float(assembly.bounds[0, 2])


def _rows_before(assembly: Assembly, groups: Sequence[Numbers], backwards: bool) -> Array:
    """Shifts, float64 (n_groups, 3), that set groups of parts down in rows before the work, towards -y, left to right.

    The groups, numbers of parts, are in the order of the rows, or `backwards` against it.
    """
    moving = np.array([len(group) > 0 for group in groups], dtype=bool)
    if not moving.all():
        places = np.zeros((len(groups), 3))
        places[moving] = _rows_before(assembly, [group for group in groups if len(group)], backwards)
        return places
    shifts = np.zeros((len(groups), 3))
    if not len(groups):
        return shifts
    boxes = assembly.part_bounds
    low = np.array([boxes[g, 0].min(axis=0) for g in groups])
    size = np.array([boxes[g, 1].max(axis=0) for g in groups]) - low
    gap = GAP * float(np.median(size[:, :2]))
    work = assembly.bounds
    # About as wide as the work, or three times as wide as deep: many rows would push the work out of sight.
    area = float(np.prod(size[:, :2] + gap, axis=1).sum())
    width = max(float(work[1, 0] - work[0, 0]), float(np.sqrt(3.0 * area)))
    left = float(work[0, 0] + work[1, 0] - width) / 2
    x, y, deep = left, float(work[0, 1]) - CLEAR * float(np.ptp(work, axis=0).max()), 0.0
    for i in reversed(range(len(groups))) if backwards else range(len(groups)):
        if x > left and x + size[i, 0] > left + width:
            x, y, deep = left, y - deep - gap, 0.0
        shifts[i] = np.array([x, y - size[i, 1], floor_of(assembly)]) - low[i]
        x += float(size[i, 0]) + gap
        deep = max(deep, float(size[i, 1]))
    return shifts


def _eased(share: float) -> float:
    """Slow at both ends."""
    return float(share * share * (3 - 2 * share))
