"""Numbers of the simulation: time steps, thresholds, friction; and where bodies lay at one moment."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from neurosym.errors import InputError

#: A body of a world: the part's name, and which of its pieces (always 0 for whole parts).
BodyKey = tuple[str, int]
#: Position and quaternion (x, y, z, w) of a body's centre-of-mass frame, in the scene's scale.
Frame = tuple[tuple[float, ...], tuple[float, ...]]
#: Steps of settling: one second. With a quarter of it 8 verdicts in 100 are wrong, as things fall too slowly.
SETTLE_STEPS = 240
#: A part has moved when a corner of it did by more than this share of a typical body. Settling itself shifts
#: things by thousandths; what topples or drops moves by halves. In between, verdicts do not depend on it.
MOVED_SHARE = 0.2
#: A body is at rest when v^2 + w^2 is below this, in squared scene units and radians a second: a tenth of the
#: threshold at which the paper's simulation says that a cube moves.
REST = 1e-4


@dataclass(frozen=True, slots=True)
class Physics:
    """Numbers of the simulation.

    Attributes:
        friction: coefficient between any two bodies, and the table; None takes the assembly's.
        gravity: in scene units per second squared, downward along z.
        time_step: seconds. 1/60 changes 6 verdicts in 100.
        clearance: share of its width that an upright box gives up at its sides, so that neighbours side by side
            do not touch. With none, Bullet's solver lets them press on one another, and what should fall may jam.
    """

    friction: float | None = None
    gravity: float = 9.81
    time_step: float = 1 / 240
    solver_iterations: int = 50
    clearance: float = 0.0

    def __post_init__(self) -> None:
        if self.friction is not None and not 0.0 <= self.friction < inf:
            raise InputError(f"Expected a coefficient of friction of 0 or more, or None; got {self.friction!r}.")


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Where the bodies of a world lay: each body's centre-of-mass frame, in the scene's scale.

    A snapshot can be given to `World.restore` of the same world, or of another one made from the same assembly.
    """

    frames: Mapping[BodyKey, Frame] = field(default_factory=dict)
