"""The Franka Panda that ships with PyBullet: its joints, its hand, and inverse kinematics. Lengths are metres."""

from pathlib import Path
from typing import Any

import numpy as np

from neurosym.geometry.rigid_motions import posed
from neurosym.simulation.client import Client
from neurosym.simulation.solids import matrix, quaternion
from neurosym.simulation.window import Shown
from neurosym.support.arrays import Array

#: Numbers of the arm's seven joints, the two fingers, and the point between the fingertips.
JOINTS = tuple(range(7))
FINGERS = (9, 10)
TOOL = 11
#: Upright, elbow bent, hand above the table in front of the arm, fingers pointing down (radians).
HOME = np.array([0.0, -0.55, 0.0, -2.35, 0.0, 1.8, 0.785])
#: How far the fingers open, both together.
WIDEST = 0.08
#: Share of each joint's range kept free at both ends, so that controllers never meet the stops.
_SLACK = 0.01
#: Inverse kinematics counts as solved within so much (metres, radians).
IK_POSITION, IK_TURN = 5e-4, 5e-3
#: Arm bodies that could meet one another: the hand's side of the wrist, and what is near the base.
_FAR, _NEAR = (6, 8, 9, 10), (-1, 0, 1, 2, 3)
#: Coefficient of the fingers' rubber against wood; Bullet multiplies the two bodies' own.
FINGER_FRICTION = 1.5


class PandaArm:
    """An arm on its base at the origin, looking along +x, in one simulator.

    Attributes:
        body: the simulator's number of the arm.
        lower, upper: float64 (7,): limits of the joints (radians), a little inside the true ones.
        speed: float64 (7,): the joints' greatest speeds (radians a second).
    """

    def __init__(self, client: Client) -> None:
        import pybullet_data

        self._p: Any = client.p
        urdf = Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf"
        self.body: int = self._p.loadURDF(str(urdf), useFixedBase=True)
        info = [self._p.getJointInfo(self.body, j) for j in JOINTS]
        low, high = np.array([i[8] for i in info]), np.array([i[9] for i in info])
        self.lower, self.upper = low + _SLACK * (high - low), high - _SLACK * (high - low)
        self.speed = np.array([i[11] for i in info])
        for finger in FINGERS:
            self._p.changeDynamics(self.body, finger, lateralFriction=FINGER_FRICTION, spinningFriction=0.01)
        self.put(HOME, WIDEST)
        # The real hand drives both fingers by one motor.
        gear = self._p.createConstraint(
            self.body, FINGERS[0], self.body, FINGERS[1], self._p.JOINT_GEAR, (1, 0, 0), (0, 0, 0), (0, 0, 0)
        )  # fmt: skip
        self._p.changeConstraint(gear, gearRatio=-1, erp=0.1, maxForce=50)

    @property
    def joints(self) -> Array:
        """float64 (7,): where the joints are now."""
        states = self._p.getJointStates(self.body, JOINTS)
        return np.array([s[0] for s in states])

    @property
    def width(self) -> float:
        """How far apart the fingers are now."""
        return float(sum(s[0] for s in self._p.getJointStates(self.body, FINGERS)))

    @property
    def X_WT(self) -> Array:
        """float64 (4, 4): pose of the tool, the point between the fingertips; its z points where the fingers do."""
        state = self._p.getLinkState(self.body, TOOL, computeForwardKinematics=True)
        return matrix(state[4], state[5])

    def looks(self) -> list[tuple[int, Shown]]:
        """The numbers of the links that can be seen (-1 is the base), and what they look like."""
        found = []
        for _, link, kind, _, file, at, turn, rgba, *_ in self._p.getVisualShapeData(self.body):
            if kind == self._p.GEOM_MESH:
                found.append((int(link), Shown(tuple(rgba[:3]), mesh=(file.decode(), at, turn))))
        return found

    def frame(self, link: int) -> tuple[float, ...]:
        """Position and quaternion (x, y, z, w) of a link now, seven numbers."""
        if link < 0:
            at, turn = self._p.getBasePositionAndOrientation(self.body)
        else:
            state = self._p.getLinkState(self.body, link, computeForwardKinematics=True)
            at, turn = state[4], state[5]
        return (*at, *turn)

    def put(self, q: Array, width: float | None = None) -> None:
        """Set the joints, and the fingers, at once and at rest: for thinking, not for acting."""
        for joint, value in zip(JOINTS, q.tolist()):
            self._p.resetJointState(self.body, joint, value)
        if width is not None:
            for finger in FINGERS:
                self._p.resetJointState(self.body, finger, width / 2)

    def drive(self, q: Array) -> None:
        """Let the joints' motors go for a configuration."""
        self._p.setJointMotorControlArray(
            self.body,
            JOINTS,
            self._p.POSITION_CONTROL,
            targetPositions=q.tolist(),
            forces=[87.0] * 4 + [12.0] * 3,
            positionGains=[0.2] * 7,
        )

    def squeeze(self, width: float, force: float) -> None:
        """Let the fingers go for a width, each with at most `force` (newtons)."""
        for finger in FINGERS:
            self._p.setJointMotorControl2(
                self.body, finger, self._p.POSITION_CONTROL, targetPosition=width / 2, force=force, maxVelocity=0.05
            )

    def inverse(self, X_WT: Array, seed: Array) -> Array | None:
        """Joints, float64 (7,), near to `seed` that bring the tool to a pose; None where none are found.

        Seven joints have a circle of answers for one pose: another seed may give another elbow. For thinking, not for
        acting: the joints are left where the search ended.
        """
        q = seed
        for _ in range(8):
            # PyBullet solves from where the joints are, and forgets the limits: asked again, it comes nearer.
            self.put(q)
            solved = self._p.calculateInverseKinematics(
                self.body,
                TOOL,
                X_WT[:3, 3].tolist(),
                quaternion(X_WT[:3, :3]).tolist(),
                maxNumIterations=60,
                residualThreshold=1e-5,
            )
            q = np.asarray(np.clip(solved[:7], self.lower, self.upper))
            self.put(q)
            X = self.X_WT
            turn = float(np.arccos(np.clip((np.trace(X[:3, :3].T @ X_WT[:3, :3]) - 1) / 2, -1, 1)))
            if np.linalg.norm(X[:3, 3] - X_WT[:3, 3]) < IK_POSITION and turn < IK_TURN:
                return q
        return None

    def meets_itself(self) -> bool:
        """Whether the wrist or the hand touches the lower arm or the base, where the joints are now."""
        return any(self._p.getClosestPoints(self.body, self.body, 0.0, far, near) for far in _FAR for near in _NEAR)


def from_above(position: Array, yaw: float) -> Array:
    """float64 (4, 4): a tool pose at a position (3,), pointing straight down; fingers open along y turned by `yaw`."""
    c, s = np.cos(yaw), np.sin(yaw)
    # z down; x and y turned about the vertical, mirrored so that the frame stays right-handed.
    return posed(np.array([[c, s, 0], [s, -c, 0], [0, 0, -1]]), position)
