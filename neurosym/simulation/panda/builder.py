"""The arm puts an assembly of boxes together from a plan: grasps from above, moves that OMPL plans, contact by physics.

Nothing is glued: a block is held by the friction of two fingers, and let go. Where the blocks are is known exactly, as
a perfect camera would tell; every grasp starts from where the block really lies, and puts it down by where it really
sits in the hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly, Box, boxes_part
from neurosym.geometry.joint_motion import plan_joint_motion
from neurosym.motions import Staging
from neurosym.simulation.panda.arm import HOME, WIDEST, from_above
from neurosym.simulation.panda.cell import TIME_STEP, Cell, Load

Array = NDArray[np.float64]

#: Of each finger when it opens (newtons).
OPENING_FORCE = 30.0
#: Height above a grasp or a place from which, and to which, the hand moves straight down and up (metres).
APPROACH = 0.10
#: How far below a block's top the fingertips' middle grasps, at most.
DEPTH = 0.025
#: The fingers aim for so much less than a block's width: they press with their force, and do not sink into it.
PRESS = 0.006
#: A block is let go so far above what carries it.
DROP = 0.0015
#: Elbows tried, drawn at random, where the nearest one touches something.
ELBOWS = 12
#: The hand must open so much wider than a block.
PLAY = 0.008
#: Straight motions of the hand are made of steps so long (metres).
_STRAIGHT = 0.01
#: Share of the joints' greatest speeds that planned motions, and straight ones, use.
_FAST, _CAREFUL = 0.45, 0.12


@dataclass(frozen=True)
class BuildSettings:
    """How the arm works.

    Attributes:
        metres: length of the assembly's unit.
        site: float64 (2,): where the assembly's origin comes to lie on the table (x, y, metres).
        force: of each finger (newtons).
        attempts: grasps of one block before giving up.
        position_tolerance: how far from its place a block may stand (metres).
        tilt_tolerance: how far from upright (degrees).
    """

    metres: float = 0.05
    site: tuple[float, float] = (0.46, 0.0)
    force: float = 10.0
    attempts: int = 2
    position_tolerance: float = 0.01
    tilt_tolerance: float = 5.0


@dataclass(frozen=True)
class Placement:
    """What became of one block.

    Attributes:
        block: its name.
        ok: it stands where it is to stand.
        reason: one sentence; says what went wrong where something did.
        attempts: grasps tried.
        error: how far its centre was from its place when it had been let go (metres); None when it never got there.
        tilt: how far it was from upright (degrees).
    """

    block: str
    ok: bool
    reason: str
    attempts: int
    error: float | None = None
    tilt: float | None = None


@dataclass(frozen=True, eq=False)
class BuildReport:
    """What the arm did. Truthy exactly when every block stands in its place at the end.

    Attributes:
        placements: one a block that was tried, in order; after a failure no other is tried.
        planned: how many blocks the plan has.
        poses: name -> float64 (4, 4), where every block lies at the end, in the assembly's frame and unit.
        standing: names of the blocks that stand in their place at the end.
        seconds: simulated time.
    """

    placements: tuple[Placement, ...]
    planned: int
    poses: Mapping[str, Array]
    standing: tuple[str, ...]
    seconds: float
    sizes: Mapping[str, Array] = field(repr=False, default_factory=dict)

    @property
    def ok(self) -> bool:
        return len(self.standing) == self.planned

    def __bool__(self) -> bool:
        return self.ok

    def built(self) -> Assembly:
        """The blocks that stand in their place, exactly as they stand, for pictures.

        Raises:
            InputError: none does.
        """
        if not self.standing:
            raise InputError("Expected at least one block that stands in its place; none does.")
        parts = [boxes_part(n, np.zeros((1, 3)), self.sizes[n], self.poses[n]) for n in self.standing]
        return Assembly(tuple(parts), table=0.0)


def build_with_panda(
    staging: Staging,
    *,
    rng: np.random.Generator,
    settings: BuildSettings | None = None,
    starts: Mapping[str, Array] | None = None,
    window: bool = False,
) -> BuildReport:
    """Let the arm build what a plan builds.

    Args:
        staging: the plan in space: each step brings one box, upright, narrow enough for the hand. The table is the
            assembly's.
        rng: where the blocks lie at first, unless told, and what OMPL draws.
        settings: sizes, forces and tolerances.
        starts: name -> float64 (4, 4), where blocks lie at first, in metres, the arm's base at the origin.
        window: show it in PyBullet's own window.

    Raises:
        InputError: a plan of another kind, or blocks that the hand cannot hold.
    """
    chosen = settings or BuildSettings()
    names = [motion.parts[0] for motion in staging.motions]
    sizes, places = _blocks(staging, chosen)
    lying = dict(starts or {}) or starting_places(names, sizes, rng)
    first = {n: places[n] for n in staging.present} | {n: lying[n] for n in names}
    friction = staging.assembly.friction
    with (
        Cell(sizes, first, friction=friction, colours=staging.colours, window=window) as world,
        Cell(sizes, first, friction=friction) as thought,
    ):
        builder = _Builder(world, thought, places, chosen, rng)
        placements: list[Placement] = []
        for name in names:
            placements.append(builder.bring(name))
            if not placements[-1].ok:
                break
        builder.go_home()
        standing = tuple(n for n in names if builder.off(n)[0] and _tried(n, placements))
        found = {n: _in_assembly(world.pose(n), staging.assembly, chosen) for n in sizes}
        units = {n: size / chosen.metres for n, size in sizes.items()}
        return BuildReport(tuple(placements), len(names), found, standing, builder.seconds, units)


def starting_places(names: Sequence[str], sizes: Mapping[str, Array], rng: np.random.Generator) -> dict[str, Array]:
    """Blocks in rows to the left and the right of the arm, a little askew: name -> float64 (4, 4), metres.

    Raises:
        InputError: more blocks than there is room for.
    """
    spots = [(x, side * y) for y in (0.20, 0.33) for x in (0.36, 0.49, 0.62) for side in (1, -1)]
    if len(names) > len(spots):
        raise InputError(f"Expected at most {len(spots)} blocks, which have room beside the arm; got {len(names)}.")
    found = {}
    for name, spot in zip(names, (spots[i] for i in rng.permutation(len(names)))):
        yaw, shift = rng.uniform(-0.35, 0.35), rng.uniform(-0.01, 0.01, 2)
        X = np.eye(4)
        X[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
        X[:3, 3] = spot[0] + shift[0], spot[1] + shift[1], sizes[name][2] / 2
        found[name] = X
    return found


def _blocks(staging: Staging, settings: BuildSettings) -> tuple[dict[str, Array], dict[str, Array]]:
    """Sizes and places of all blocks, in metres, the arm's base at the origin."""
    sizes, places = {}, {}
    ground = staging.assembly.ground
    for motion in staging.motions:
        if not motion.arrives or len(motion.parts) != 1:
            raise InputError(f"Expected a plan whose steps bring one block each; {motion.action!r} does not.")
    for part in staging.assembly.parts:
        if len(part.bodies) != 1 or not isinstance(part.bodies[0].shape, Box):
            raise InputError(f"Expected blocks that are one box each; {part.name!r} is none.")
        X = np.array(part.X_WP @ part.bodies[0].X_PB)
        if not np.isclose(X[2, 2], 1.0):
            raise InputError(f"Expected blocks that stand upright; {part.name!r} does not.")
        X[:3, 3] = (X[:3, 3] - [0, 0, ground]) * settings.metres + [*settings.site, 0.0]
        sizes[part.name] = np.asarray(part.bodies[0].shape.size) * settings.metres
        places[part.name] = X
        if sizes[part.name][:2].min() > WIDEST - PLAY:
            raise InputError(
                f"Expected blocks at most {100 * (WIDEST - PLAY):.1f} cm across, for the hand; {part.name!r} has "
                f"{100 * sizes[part.name][:2].min():.1f} cm. Make the unit (metres) smaller."
            )
    return sizes, places


def _in_assembly(X: Array, assembly: Assembly, settings: BuildSettings) -> Array:
    found = X.copy()
    found[:3, 3] = (X[:3, 3] - [*settings.site, 0.0]) / settings.metres + [0, 0, assembly.ground]
    return found


def _tried(name: str, placements: Sequence[Placement]) -> bool:
    return any(p.block == name for p in placements)


class _Failed(Exception):
    """Something did not work; the sentence says what."""


class _Builder:
    """Moves the arm in the world, after having thought it through in another cell."""

    def __init__(
        self, world: Cell, thought: Cell, places: Mapping[str, Array], settings: BuildSettings, rng: np.random.Generator
    ) -> None:
        self.world, self.thought, self.places, self.settings, self.rng = world, thought, places, settings, rng
        self.steps = 0

    @property
    def seconds(self) -> float:
        return self.steps * TIME_STEP

    def bring(self, name: str) -> Placement:
        """Grasp a block, carry it, put it down; again, should the grasp fail."""
        reason = ""
        for attempt in range(1, self.settings.attempts + 1):
            try:
                self._bring(name)
            except _Failed as failed:
                reason = str(failed)
                self._open()
                self._retreat()
                continue
            ok, error, tilt = self.off(name)
            said = "It stands in its place." if ok else f"It lies {1000 * error:.0f} mm and {tilt:.0f}° off its place."
            return Placement(name, ok, said, attempt, error, tilt)
        return Placement(name, False, reason, self.settings.attempts)

    def off(self, name: str) -> tuple[bool, float, float]:
        """Whether a block stands in its place; how far off it is (metres), and how far from upright (degrees)."""
        X, place = self.world.pose(name), self.places[name]
        error = float(np.linalg.norm(X[:3, 3] - place[:3, 3]))
        tilt = float(np.degrees(np.arccos(np.clip(X[2, 2], -1, 1))))
        return error <= self.settings.position_tolerance and tilt <= self.settings.tilt_tolerance, error, tilt

    def go_home(self) -> None:
        """Back to where the arm is in nobody's way, if there is a way."""
        self._retreat()
        self._see()
        here = self.world.arm.joints
        path = self._planned(here, HOME, None)
        if path is not None:
            self._follow(path, _FAST)
        self._wait(120)

    def _bring(self, name: str) -> None:
        self._see()
        X_WB, size = self.world.pose(name), self.world.sizes[name]
        if X_WB[2, 2] < np.cos(np.radians(self.settings.tilt_tolerance)):
            raise _Failed(f"{name} does not lie upright on the table, so it cannot be grasped from above.")
        X_WT, down = self._grasp(name, X_WB, size)
        self._open()
        self._transit(down[0], None, f"over {name}")
        self._follow(np.array(down), _CAREFUL)
        self._close(name, self._width_across(name, X_WT))
        up = self._straight(self.world.arm.joints, X_WT, _lifted(X_WT, APPROACH))
        if up is None:
            raise _Failed(f"The arm cannot lift {name} straight up.")
        self._follow(np.array(up), _CAREFUL)
        if not self.world.pinched(name):
            raise _Failed(f"{name} slipped out of the fingers when it was lifted.")
        load = Load(name, np.linalg.inv(self.world.arm.X_WT) @ self.world.pose(name))
        self._see()
        over = self._place(name, load)
        self._transit(over[0], load, f"with {name} over its place")
        if not self.world.pinched(name):
            raise _Failed(f"{name} slipped out of the fingers on the way.")
        self._follow(np.array(over), _CAREFUL)
        self._open()
        self._retreat()
        self._wait(60)

    def _width_across(self, name: str, X_WT: Array) -> float:
        """How wide a block is between the fingers of a hand at a pose."""
        R = self.world.pose(name)[:3, :3]
        return float(np.abs(R.T @ X_WT[:3, 1]) @ self.world.sizes[name])

    def _grasp(self, name: str, X_WB: Array, size: Array) -> tuple[Array, list[Array]]:
        """A tool pose, and joints on the straight way down to it, both sides of the block that are narrow enough."""
        height = X_WB[2, 3] + size[2] / 2 - min(DEPTH, size[2] / 2)
        yaw = float(np.arctan2(X_WB[1, 0], X_WB[0, 0]))
        # The fingers open along the tool's y: across the block's y, or turned by a quarter across its x.
        turns = [yaw + k * np.pi / 2 for k in (0, 2, 1, 3) if size[1 if k % 2 == 0 else 0] <= WIDEST - PLAY]
        turns.sort(key=lambda t: abs((t + np.pi / 2) % np.pi - np.pi / 2))
        poses = [from_above(np.array([X_WB[0, 3], X_WB[1, 3], height]), turn) for turn in turns]
        found = self._way_down(poses, None, ignored=(name,))
        if found is None:
            raise _Failed(f"There is no grasp of {name} from above that the arm reaches without touching something.")
        return found

    def _place(self, name: str, load: Load) -> list[Array]:
        """Joints on the straight way down to where the block is let go."""
        place = self.places[name].copy()
        place[2, 3] += DROP
        # A block may as well stand turned by a half, or by a quarter where that leaves its shape the same.
        size, poses = self.world.sizes[name], []
        for k in (0, 2, 1, 3) if np.isclose(size[0], size[1]) else (0, 2):
            turned = place.copy()
            turned[:3, :3] = place[:3, :3] @ Rotation.from_euler("z", k * np.pi / 2).as_matrix()
            poses.append(turned @ np.linalg.inv(load.X_TB))
        # On the last centimetres the block nears what carries it, and is to.
        found = self._way_down(poses, load, unasked=3)
        if found is None:
            raise _Failed(f"The arm does not reach the place of {name} from above without touching something.")
        return found[1]

    def _way_down(
        self, poses: Sequence[Array], load: Load | None, *, ignored: Sequence[str] = (), unasked: int = 0
    ) -> tuple[Array, list[Array]] | None:
        """The first of some tool poses that the arm reaches straight from above, and joints on the way down to it.

        Args:
            load: what the arm carries.
            ignored: names of blocks that the arm may touch.
            unasked: so many configurations at the end of the way may touch something.
        """
        arm = self.thought.arm
        spread = np.array([1.0, 0.5, 1.2, 0.4, 1.2, 0.5, 0.6])
        near = [self.world.arm.joints, HOME]
        elbows = [np.clip(HOME + spread * self.rng.uniform(-1, 1, 7), arm.lower, arm.upper) for _ in range(ELBOWS)]
        for seed in (*near, *elbows):
            for X_WT in poses:
                q = arm.inverse(_lifted(X_WT, APPROACH), seed)
                if q is None or not self.thought.is_free(q, load):
                    continue
                down = self._straight(q, _lifted(X_WT, APPROACH), X_WT)
                if down is not None and all(
                    self.thought.is_free(p, load, ignored) for p in down[: len(down) - unasked]
                ):
                    return X_WT, down
        return None

    def _transit(self, goal: Array, load: Load | None, where: str) -> None:
        path = self._planned(self.world.arm.joints, goal, load)
        if path is None:
            raise _Failed(f"No free motion of the arm was found to get {where}.")
        self._follow(path, _FAST)

    def _planned(self, start: Array, goal: Array, load: Load | None) -> Array | None:
        arm = self.thought.arm
        begin = np.clip(start, arm.lower, arm.upper)
        return plan_joint_motion(
            arm.lower, arm.upper, begin, goal, lambda q: self.thought.is_free(q, load), rng=self.rng
        )

    def _straight(self, q: Array, first: Array, last: Array) -> list[Array] | None:
        """Joints along a straight motion of the tool, from `q` at its first pose; None where the arm would jump."""
        count = max(2, int(np.ceil(np.linalg.norm(last[:3, 3] - first[:3, 3]) / _STRAIGHT)))
        found = [q]
        for i in range(1, count + 1):
            X = last.copy()
            X[:3, 3] = first[:3, 3] + (last[:3, 3] - first[:3, 3]) * i / count
            near = self.thought.arm.inverse(X, found[-1])
            if near is None or np.abs(near - found[-1]).max() > 0.35:
                return None
            found.append(near)
        return found

    def _retreat(self) -> None:
        """Straight up from where the hand is."""
        X = self.world.arm.X_WT
        up = self._straight(self.world.arm.joints, X, _lifted(X, APPROACH))
        if up is not None:
            self._follow(np.array(up), _CAREFUL)

    def _follow(self, path: Array, share: float) -> None:
        """Let the joints go along a path, slowly at both ends, and come to rest at its end."""
        times = [float((np.abs(b - a) / (share * self.world.arm.speed)).max()) for a, b in pairwise(path)]
        marks = np.concatenate([[0.0], np.cumsum(times)])
        # Smoothstep is half again as fast in the middle.
        steps = max(1, int(np.ceil(1.5 * marks[-1] / TIME_STEP)))
        for i in range(1, steps + 1):
            s = i / steps
            at = marks[-1] * s * s * (3 - 2 * s)
            self.world.arm.drive(np.array([np.interp(at, marks, path[:, j]) for j in range(path.shape[1])]))
            self._wait(1)
        for _ in range(120):
            if np.abs(self.world.arm.joints - path[-1]).max() < 1e-3:
                break
            self._wait(1)

    def _open(self) -> None:
        self.world.arm.squeeze(WIDEST, OPENING_FORCE)
        self._wait(120)

    def _close(self, name: str, width: float) -> None:
        self.world.arm.squeeze(max(0.0, width - PRESS), self.settings.force)
        self._wait(180)
        if not self.world.pinched(name):
            raise _Failed(f"The fingers closed without getting hold of {name}.")

    def _wait(self, steps: int) -> None:
        self.world.step(steps)
        self.steps += steps

    def _see(self) -> None:
        """Bring what is thought of up to what is there."""
        for name in self.world.sizes:
            self.thought.put(name, self.world.pose(name))
        self.thought.arm.put(self.world.arm.joints, self.world.arm.width)


def _lifted(X: Array, by: float) -> Array:
    found = X.copy()
    found[2, 3] += by
    return found
