"""What the arm can do: go somewhere past everything, straight up and down, open and close its hand. In the world.

Each motion is thought through in a second cell first, where asking whether something is touched changes nothing.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from neurosym.geometry.paths.joint_motion import plan_joint_motion
from neurosym.simulation.panda.arm import HOME, WIDEST
from neurosym.simulation.panda.cell import TIME_STEP, Cell, Load
from neurosym.support.arrays import Array

#: Of each finger when it opens (newtons).
OPENING_FORCE = 30.0
#: Height above a grasp or a place from which, and to which, the hand moves straight down and up (metres).
APPROACH = 0.10
#: The fingers aim for so much less than a block's width: they press with their force, and do not sink into it.
PRESS = 0.006
#: Elbows tried, drawn at random, where the nearest one touches something.
ELBOWS = 12
#: Straight motions of the hand are made of steps so long (metres).
_STRAIGHT = 0.01
#: Share of the joints' greatest speeds that planned motions, and straight ones, use.
_FAST, CAREFUL = 0.45, 0.12


class Failed(Exception):
    """Something did not work; the sentence says what."""


class Hand:
    """Moves the arm in the world, after having thought it through in another cell.

    `world`: where it acts. `thought`: where it thinks. `rng`: elbows, and what OMPL draws. `force`: of each finger when
    it holds (newtons).
    """

    def __init__(self, world: Cell, thought: Cell, rng: np.random.Generator, force: float) -> None:
        self.world, self.thought, self.rng, self.force = world, thought, rng, force
        self.steps = 0

    @property
    def seconds(self) -> float:
        """Simulated time that has passed."""
        return self.steps * TIME_STEP

    def go_home(self) -> None:
        """Back to where the arm is in nobody's way, if there is a way."""
        self.retreat()
        self.see()
        here = self.world.arm.joints
        path = self._planned(here, HOME, None)
        if path is not None:
            self.follow(path, _FAST)
        self.wait(120)

    def way_down(
        self, poses: Sequence[Array], load: Load | None, *, ignored: Sequence[str] = (), unasked: int = 0
    ) -> tuple[Array, list[Array]] | None:
        """The first of some tool poses that the arm reaches straight from above, and joints on the way down to it.

        `load`: what the arm carries. `ignored`: names of blocks that the arm may touch. `unasked`: so many
        configurations at the end of the way may touch something.
        """
        arm = self.thought.arm
        spread = np.array([1.0, 0.5, 1.2, 0.4, 1.2, 0.5, 0.6])
        near = [self.world.arm.joints, HOME]
        elbows = [np.clip(HOME + spread * self.rng.uniform(-1, 1, 7), arm.lower, arm.upper) for _ in range(ELBOWS)]
        for seed in (*near, *elbows):
            for X_WT in poses:
                q = arm.inverse(lifted(X_WT, APPROACH), seed)
                if q is None or not self.thought.is_free(q, load):
                    continue
                down = self.straight(q, lifted(X_WT, APPROACH), X_WT)
                if down is not None and all(
                    self.thought.is_free(p, load, ignored) for p in down[: len(down) - unasked]
                ):
                    return X_WT, down
        return None

    def transit(self, goal: Array, load: Load | None, where: str) -> None:
        """Go to a configuration, past everything. Raises Failed: no free motion was found to get `where`."""
        path = self._planned(self.world.arm.joints, goal, load)
        if path is None:
            raise Failed(f"No free motion of the arm was found to get {where}.")
        self.follow(path, _FAST)

    def _planned(self, start: Array, goal: Array, load: Load | None) -> Array | None:
        arm = self.thought.arm
        begin = np.clip(start, arm.lower, arm.upper)
        return plan_joint_motion(
            arm.lower, arm.upper, begin, goal, lambda q: self.thought.is_free(q, load), rng=self.rng
        )

    def straight(self, q: Array, first: Array, last: Array) -> list[Array] | None:
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

    def retreat(self) -> None:
        """Straight up from where the hand is."""
        X = self.world.arm.X_WT
        up = self.straight(self.world.arm.joints, X, lifted(X, APPROACH))
        if up is not None:
            self.follow(np.array(up), CAREFUL)

    def follow(self, path: Array, share: float) -> None:
        """Let the joints go along a path, slowly at both ends, and come to rest at its end."""
        times = [float((np.abs(b - a) / (share * self.world.arm.speed)).max()) for a, b in pairwise(path)]
        marks = np.concatenate([[0.0], np.cumsum(times)])
        # Smoothstep is half again as fast in the middle.
        steps = max(1, int(np.ceil(1.5 * marks[-1] / TIME_STEP)))
        for i in range(1, steps + 1):
            s = i / steps
            at = marks[-1] * s * s * (3 - 2 * s)
            self.world.arm.drive(np.array([np.interp(at, marks, path[:, j]) for j in range(path.shape[1])]))
            self.wait(1)
        for _ in range(120):
            if np.abs(self.world.arm.joints - path[-1]).max() < 1e-3:
                break
            self.wait(1)

    def open(self) -> None:
        """Let go."""
        self.world.arm.squeeze(WIDEST, OPENING_FORCE)
        self.wait(120)

    def close(self, name: str, width: float) -> None:
        """Take hold of a block that is so wide between the fingers.

        Raises Failed: both fingers do not touch it then.
        """
        self.world.arm.squeeze(max(0.0, width - PRESS), self.force)
        self.wait(180)
        if not self.world.pinched(name):
            raise Failed(f"The fingers closed without getting hold of {name}.")

    def wait(self, steps: int) -> None:
        """Let time pass."""
        self.world.step(steps)
        self.steps += steps

    def see(self) -> None:
        """Bring what is thought of up to what is there."""
        for name in self.world.sizes:
            self.thought.put(name, self.world.pose(name))
        self.thought.arm.put(self.world.arm.joints, self.world.arm.width)


def lifted(X: Array, by: float) -> Array:
    """A pose, float64 (4, 4), so much higher."""
    found = X.copy()
    found[2, 3] += by
    return found
