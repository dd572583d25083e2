"""How the arm is to work, and what came of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.shapes import boxes_part
from neurosym.support.arrays import Array


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

    `block`: its name. `ok`: it stands where it is to stand. `reason`: one sentence; says what went wrong where
    something did. `attempts`: grasps tried. `error`: how far its centre was from its place when it had been let go
    (metres); None when it never got there. `tilt`: how far it was from upright (degrees).
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

    `placements`: one a block that was tried, in order; after a failure no other is tried. `planned`: how many blocks
    the plan has. `poses`: name -> float64 (4, 4), where every block lies at the end, in the assembly's frame and unit.
    `standing`: names of the blocks that stand in their place at the end. `seconds`: simulated time.
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
        """The blocks that stand in their place, exactly as they stand, for pictures. Raises InputError: none does."""
        if not self.standing:
            raise InputError("Expected at least one block that stands in its place; none does.")
        parts = [boxes_part(n, np.zeros((1, 3)), self.sizes[n], self.poses[n]) for n in self.standing]
        return Assembly(tuple(parts), table=0.0)
