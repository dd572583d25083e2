"""How a network is trained: every number in one place."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, Self

from neurosym.errors import UnknownNameError

Loss = Literal["gumbel-sinkhorn", "gumbel-sinkhorn-numbers", "sinkhorn", "rows", "rows-twice"]


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """How a network is trained.

    Attributes:
        loss: "gumbel-sinkhorn" (the paper's: samples of the permutation against the demonstration, mean squared
            error), "sinkhorn" (cross-entropy of log S(X)) or "rows" (cross-entropy of a softmax a step). As published:
            "gumbel-sinkhorn-numbers" (squared error of the expected number, see `numbers`) and "rows-twice" (a softmax
            of the softmax).
        soft: learn from the demonstrations' marginals where there are some; otherwise from their sequences.
        epochs: passes over the demonstrations.
        least_steps: with few demonstrations, epochs are added until so many updates are made.
        most_steps: with many demonstrations, epochs are left out until there are no more updates; None leaves out none.
        batch: demonstrations an update.
        optimizer: "adam" or "adamw" (with `weight_decay`).
        rate: learning rate (the peak, with "one-cycle").
        schedule: "constant", or "one-cycle" (up for 30% of the updates, then down to nothing, by cosines).
        iterations: of the Sinkhorn operator, a fixed number in training.
        samples, temperature, noise: of Gumbel-Sinkhorn.
        classes: one integer an action; actions of one class are interchangeable, their probabilities are summed
            before the logarithm. Empty: each is its own.
        sum_classes: take `classes` from the demonstrations where it is empty.
        numbers: of the actions, where they are learned or read as numbers; empty: 0 to N - 1, as they are listed.
        held_out: share of the groups of demonstrations that is kept from training and only measured.
        keep: "last" or "best", the weights of the epoch with the least held-out loss.
        patience: stop when the held-out loss has not improved for so many epochs; None never stops early.
        calibrate: divide the logits by the temperature that suits what is held out best (Guo et al., ICML 2017), if
            anything is held out. It changes how sure the network is, hardly which order it prefers.
        augment: how much pictures are changed by chance at every update, 0 (not at all) to 1, see
            `learned_priors.augment`.
        precision: "float32" or "bfloat16" (autocast; pays for convolutions on hardware made for it).
        checkpoint_seconds: least time between two checkpoints, if one is asked for.
    """

    loss: Loss
    soft: bool
    epochs: int
    least_steps: int = 0
    most_steps: int | None = None
    batch: int = 128
    optimizer: Literal["adam", "adamw"] = "adamw"
    weight_decay: float = 0.01
    rate: float = 2e-3
    schedule: Literal["constant", "one-cycle"] = "one-cycle"
    iterations: int = 20
    samples: int = 5
    temperature: float = 1.0
    noise: float = 1.0
    classes: tuple[int, ...] = ()
    sum_classes: bool = False
    numbers: tuple[int, ...] = ()
    held_out: float = 0.0
    keep: Literal["last", "best"] = "last"
    patience: int | None = None
    calibrate: bool = False
    augment: float = 0.0
    precision: Literal["float32", "bfloat16"] = "float32"
    checkpoint_seconds: float = 5.0

    def changed(self, settings: Mapping[str, Any]) -> Self:
        """With other values of some fields. Raises `UnknownNameError` for what is none."""
        for name in settings:
            if name not in self.__dataclass_fields__:
                raise UnknownNameError("training setting", name, self.__dataclass_fields__)
        return replace(self, **settings)

    def to_json(self) -> dict[str, Any]:
        return {**asdict(self), "classes": list(self.classes), "numbers": list(self.numbers)}
