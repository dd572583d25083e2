"""What a replay found, step by step, and in words."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from neurosym.geometry.step_motion import StepMotion
from neurosym.support.words import joined


@dataclass(frozen=True)
class StepReplay:
    """What one step did to the parts that stay.

    Attributes:
        parts, arrives: names of the parts that went, or came; whether they came.
        held: names of the parts that were held meanwhile.
        in_hand: whether it was done in the hand, where nothing else can fall: a group that left, or will arrive, as a
            whole is taken apart, or put together, there.
        displacement: how far the farthest-moved corner of any part that stays went, in the assembly's length unit.
        share: the same, as a share of the smallest part (the smallest extent of any part).
        farthest: name of the part it belongs to; None when no part stays.
        moved: the parts that moved by more than the threshold, with how far.
        in_the_way: names of the parts that the path cuts into; of the moving parts themselves, where they were jammed.
        stood_still: whether nothing was in the way and the rest stood still.
    """

    action: str
    parts: tuple[str, ...]
    arrives: bool
    displacement: float
    share: float
    farthest: str | None
    moved: Mapping[str, float]
    in_the_way: tuple[str, ...]
    stood_still: bool
    reason: str
    held: tuple[str, ...] = ()
    in_hand: bool = False


@dataclass(frozen=True)
class ReplayReport:
    """What a replay found. Truthy exactly when every step left the rest standing still.

    Attributes:
        start: displacements before the first step, of an assembly that stands by itself next to nothing.
        steps: one a step of the plan, or up to the first failure where it was to stop there.
        threshold: the displacement above which a part has moved, in the assembly's length unit.
        smallest: the smallest extent of any part, same unit.
        bodies: ``"rigid"`` or ``"cubes"``, see `replay_plan`.
        unit: of all lengths here, as the assembly says it; None: it does not.
        friction: coefficient between any two bodies, and the table.
    """

    start: StepReplay
    steps: tuple[StepReplay, ...]
    threshold: float
    smallest: float
    bodies: str
    pulled: bool
    unit: str | None = None
    gravity: bool = True
    friction: float | None = None

    @property
    def failed_at(self) -> int | None:
        """Number of the first step (from 0) that did not leave the rest standing still; -1: it never stood; or None."""
        if not self.start.stood_still:
            return -1
        return next((i for i, step in enumerate(self.steps) if not step.stood_still), None)

    @property
    def ok(self) -> bool:
        return self.failed_at is None

    def __bool__(self) -> bool:
        return self.ok

    def as_json(self) -> dict[str, Any]:
        """Plain data, for a file."""
        return {
            "ok": self.ok,
            "failed_at": self.failed_at,
            "unit": self.unit,
            "gravity": self.gravity,
            "friction": self.friction,
            "threshold": self.threshold,
            "smallest_part": self.smallest,
            "bodies": self.bodies,
            "pulled": self.pulled,
            "start": _step_json(self.start),
            "steps": [_step_json(step) for step in self.steps],
        }


def _step_json(step: StepReplay) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in vars(step).items()}


def reason_of(
    motion: StepMotion,
    moved: Mapping[str, float],
    blocked: tuple[str, ...],
    distance: float,
    share: float,
    farthest: str | None,
) -> str:
    sentences = []
    if blocked and set(blocked) == set(motion.parts):
        sentences.append(f"{joined(blocked)} jammed on the way.")
    elif blocked:
        sentences.append(
            f"{joined(blocked)} {'is' if len(blocked) == 1 else 'are'} in the way of {joined(motion.parts)}."
        )
    if moved:
        sentences.append("Moved: " + joined([f"{part} by {far:.3g}" for part, far in moved.items()]) + ".")
    elif farthest is None:
        sentences.append("Nothing is left.")
    elif not sentences:
        sentences.append(f"The rest stood still; {farthest} moved by {distance:.2g}, {share:.2%} of the smallest part.")
    return " ".join(sentences)


def in_hand(action: str, motion: StepMotion, what: str) -> StepReplay:
    """A step that is done where nothing else can fall."""
    where, words = (motion.parts, motion.arrives), f"{joined(motion.parts)} {what}".strip()
    return StepReplay(action, *where, 0.0, 0.0, None, {}, (), True, words, motion.held, in_hand=True)
