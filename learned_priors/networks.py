"""The networks that order actions: an encoder of pictures and a head that gives logits for each step and action."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

import torch
from torch import Tensor, nn

from learned_priors.encoders import PictureShape, build_encoder
from learned_priors.sinkhorn import TOLERANCE, log_sinkhorn
from learned_priors.tcn import TemporalDecoder
from neurosym.errors import CheckpointError

Head = Literal["dense", "tcn"]
Decoding = Literal["sinkhorn", "rows"]

#: Column updates when reading: after so many, columns of near ties are off by about 1e-3 (see `MAX_ITERATIONS`).
READ_ITERATIONS = 1_000


@dataclass(frozen=True)
class NetworkConfig:
    """Everything that decides a network's shape and how it is read; it travels in the header of a weights file.

    Attributes:
        encoder: a name that `build_encoder` knows.
        head: "dense" (a perceptron) or "tcn" (temporal convolutions).
        decoding: how logits become log-probabilities: "sinkhorn", or "rows" (a softmax a step).
        picture_shape: (V, H, W, 3).
        n_steps, n_actions: T and N; T < N makes a rectangular head.
        width: neurons in the dense head's hidden layer, or latent dimensions a step of the temporal one.
        temperature: of the Sinkhorn operator.
    """

    encoder: str
    head: Head
    decoding: Decoding
    picture_shape: PictureShape
    n_steps: int
    n_actions: int
    width: int
    temperature: float = 1.0

    def to_json(self) -> dict[str, Any]:
        return {**asdict(self), "picture_shape": list(self.picture_shape)}

    @classmethod
    def from_json(cls, given: Mapping[str, Any]) -> NetworkConfig:
        """Raises `CheckpointError` where a field is missing, unknown or of another kind."""
        try:
            config = cls(**{**given, "picture_shape": tuple(given["picture_shape"])})
            sizes = (*config.picture_shape, config.n_steps, config.n_actions, config.width)
            if len(config.picture_shape) != 4 or not all(type(s) is int and s > 0 for s in sizes):
                raise ValueError(f"sizes are to be positive integers: {sizes}")
            if config.head not in get_args(Head) or config.decoding not in get_args(Decoding):
                raise ValueError(f"unknown head {config.head!r} or decoding {config.decoding!r}")
            if config.n_steps > config.n_actions or not config.temperature > 0:
                raise ValueError("more steps than actions, or a temperature that is not positive")
        except (TypeError, KeyError, ValueError) as error:
            raise CheckpointError(
                f"Expected a header whose network is {', '.join(cls.__dataclass_fields__)}; got {given!r}: {error}."
            ) from None
        return config


class OrderNetwork(nn.Module):
    """Pictures -> logits X (B, T, N): how well action j suits step i (Burke et al. 2021, X = g_theta(I))."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = build_encoder(config.encoder, config.picture_shape)
        features, steps, actions = self.encoder.out_features, config.n_steps, config.n_actions
        self.head: nn.Module
        if config.head == "tcn":
            self.head = TemporalDecoder(features, steps, actions, width=config.width)
        else:
            self.head = nn.Sequential(
                nn.Linear(features, config.width),
                nn.ReLU(),
                nn.Linear(config.width, steps * actions),
                nn.Unflatten(1, (steps, actions)),
            )

    def prepare(self, pictures: Tensor) -> Tensor:
        """uint8 (B, V, H, W, 3) -> what `forward` takes; done once for pictures that are seen many times."""
        return self.encoder.prepare(pictures)

    def forward(self, prepared: Tensor) -> Tensor:
        """What `prepare` gave -> logits, float (B, T, N)."""
        logits: Tensor = self.head(self.encoder(prepared))
        return logits

    def log_prob(self, logits: Tensor) -> Tensor:
        """Logits -> log-probabilities (B, T, N), float64; rows of exp() sum to one, columns to at most one (Sinkhorn).

        In float64, where sums are exact enough that a picture read alone or in a batch stops at the same iteration.
        """
        exact = logits.to(torch.float64)
        if self.config.decoding == "rows":
            return torch.log_softmax(exact, dim=-1)
        return log_sinkhorn(exact / self.config.temperature, tolerance=TOLERANCE, max_iterations=READ_ITERATIONS)
