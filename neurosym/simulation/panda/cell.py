"""A work cell: table, blocks and the arm in one simulator. One is acted in; a second one is only thought in.

Everything is at its true size in metres, at 1/240 s a step. The table is the plane z = 0, the arm stands at the origin.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from neurosym.simulation.client import Client, Closeable
from neurosym.simulation.panda.arm import PandaArm
from neurosym.simulation.scene import RGB
from neurosym.simulation.solids import matrix, quaternion
from neurosym.support.arrays import Array

TIME_STEP = 1 / 240
#: Small bodies that touch many others want more of the contact solver than Bullet's usual 50.
SOLVER_ITERATIONS = 150
#: Of beech, kg a cubic metre: a 5 cm cube weighs 85 g.
DENSITY = 680.0
#: Free space that a planned motion keeps (metres): of arm and load to blocks, and to the table.
MARGIN, TABLE_MARGIN = 0.006, 0.002
#: Middle of the table top that is drawn (metres).
_TABLE = (0.3, 0.0, -0.0101)
#: Of blocks without a colour of their own.
_WOOD: RGB = (0.8, 0.7, 0.5)


@dataclass(frozen=True)
class Load:
    """A block in the hand: its name, and its pose in the tool's frame, float64 (4, 4)."""

    name: str
    X_TB: Array


class Cell(Closeable):
    """Table, blocks and arm (a context manager).

    `sizes`: name of a block -> float64 (3,), its edges. `poses`: name of a block -> float64 (4, 4), where it lies at
    first. `friction`: between any two blocks, and of blocks on the table. `colours`: name of a block -> RGB in 0..1,
    for those who watch. `watchers`: called with the cell after each time step.
    """

    def __init__(
        self,
        sizes: Mapping[str, Array],
        poses: Mapping[str, Array],
        *,
        friction: float = 0.5,
        colours: Mapping[str, RGB] | None = None,
    ) -> None:
        self.sizes = dict(sizes)
        self.colours = {name: (colours or {}).get(name, _WOOD) for name in sizes}
        self.watchers: list[Callable[[Cell], None]] = []
        self.client = Client()
        self._p: Any = self.client.p
        try:
            self._build(poses, friction)
        except BaseException:
            self.close()
            raise

    def _build(self, poses: Mapping[str, Array], friction: float) -> None:
        p = self._p
        p.setGravity(0, 0, -9.81)
        p.setPhysicsEngineParameter(
            fixedTimeStep=TIME_STEP, numSolverIterations=SOLVER_ITERATIONS, deterministicOverlappingPairs=1
        )
        plane = p.createCollisionShape(p.GEOM_PLANE)
        # Only looks: the table is the whole plane.
        half = [0.45, 0.55, 0.01]
        slab = p.createVisualShape(
            p.GEOM_BOX, halfExtents=half, visualFramePosition=_TABLE, rgbaColor=[0.87, 0.87, 0.84, 1]
        )
        self._table = p.createMultiBody(0, plane, slab)
        surface = float(np.sqrt(friction))
        p.changeDynamics(self._table, -1, lateralFriction=surface)
        self.arm = PandaArm(self.client)
        self._blocks: dict[str, int] = {}
        for name, size in self.sizes.items():
            half = (size / 2).tolist()
            shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=half)
            rgba = [*self.colours[name], 1.0]
            visual = p.createVisualShape(p.GEOM_BOX, halfExtents=half, rgbaColor=rgba)
            number = p.createMultiBody(DENSITY * float(np.prod(size)), shape, visual)
            p.changeDynamics(number, -1, lateralFriction=surface, spinningFriction=0.001)
            self._blocks[name] = number
            self.put(name, poses[name])

    def close(self) -> None:
        """Close the simulator; closing twice does nothing."""
        self.client.close()

    def pose(self, block: str) -> Array:
        """float64 (4, 4): where a block lies now."""
        return matrix(*self._p.getBasePositionAndOrientation(self._blocks[block]))

    def frames(self) -> dict[str, tuple[float, ...]]:
        """Position and quaternion (x, y, z, w) of each block now, seven numbers."""
        p = self._p
        frames = {n: p.getBasePositionAndOrientation(i) for n, i in self._blocks.items()}
        return {name: (*at, *turn) for name, (at, turn) in frames.items()}

    def put(self, block: str, X: Array) -> None:
        """Set a block's pose at once."""
        turn = quaternion(X[:3, :3]).tolist()
        number = self._blocks[block]
        self._p.resetBasePositionAndOrientation(number, X[:3, 3].tolist(), turn)

    def step(self, steps: int = 1) -> None:
        """Let time pass."""
        for _ in range(steps):
            self._p.stepSimulation()
            for watcher in self.watchers:
                watcher(self)

    def pinched(self, block: str) -> bool:
        """Whether both fingers touch a block now."""
        touching = self._p.getContactPoints(self.arm.body, self._blocks[block])
        return {9, 10} <= {point[3] for point in touching}

    def is_free(self, q: Array, load: Load | None = None, ignored: Collection[str] = ()) -> bool:
        """Whether the arm, and what it carries, would touch nothing at a configuration: to be asked in thought only.

        `q`: float64 (7,). `load`: what it carries. `ignored`: names of blocks that the arm may touch.
        """
        p, arm = self._p, self.arm
        arm.put(q)
        for name, number in self._blocks.items():
            if name in ignored or (load is not None and name == load.name):
                continue
            if p.getClosestPoints(arm.body, number, MARGIN):
                return False
        # The base stands on the table.
        if any(point[3] > 0 for point in p.getClosestPoints(arm.body, self._table, TABLE_MARGIN)):
            return False
        if load is not None:
            self.put(load.name, arm.X_WT @ load.X_TB)
            held = self._blocks[load.name]
            if p.getClosestPoints(held, self._table, TABLE_MARGIN):
                return False
            others = [number for name, number in self._blocks.items() if name != load.name and name not in ignored]
            if any(p.getClosestPoints(held, number, MARGIN) for number in others):
                return False
        return not arm.meets_itself()
