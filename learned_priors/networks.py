"""The networks that order actions: an encoder of pictures, a head that gives logits for each step and action, and,
where tasks differ in length, something that tells the number of steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from learned_priors.encoders import PictureShape, build_encoder
from learned_priors.heads import (
    GlimpseHead,
    PublishedTemporalDecoder,
    StoppingNetwork,
    TemporalDecoder,
    log_length_of_stops,
)
from learned_priors.sinkhorn import TOLERANCE, log_sinkhorn, scaled_sinkhorn
from neurosym.errors import CheckpointError

Head = Literal["dense", "tcn", "tcn-published", "glimpses"]
Decoding = Literal["sinkhorn", "rows"]
Stop = Literal["none", "head", "network", "class"]
#: How an order is made of a network's answer, see `learned_priors.recipes.Recipe`.
Prediction = Literal["assignment", "independent", "published-assignment", "expected-number"]

#: Column updates when reading: after so many, columns of near ties are off by about 1e-3 (see `MAX_ITERATIONS`).
READ_ITERATIONS = 1_000

#: Pictures prepared, or read, at a time: bounds the memory that float copies of them take.
CHUNK = 256


@dataclass(frozen=True)
class NetworkConfig:
    """Everything that decides a network's shape and reading; it travels in the header of a weights file.

    Attributes:
        encoder: a name that `build_encoder` knows.
        head: "dense" (a perceptron), "tcn" (temporal convolutions), "tcn-published" (the same as published) or
            "glimpses" (looks at one place a step).
        decoding: what turns logits into log-probabilities: "sinkhorn", or "rows" (a softmax a step).
        picture_shape: (V, H, W, 3).
        n_steps, n_actions: T and N; T < N makes a rectangular head.
        width: neurons in the hidden layer of the dense head or of the glimpses' reading, or latent dimensions a step of
            the temporal one.
        temperature: what the order's logits are divided by.
        iterations: of the Sinkhorn operator when reading; None goes on until rows and columns sum to one. Where most
            actions are left over, as many as in training are far from that, and the logits were learned for them: words
            of 98 tiles are 99.3% right after 20, 97.8% at the end.
        stop: what tells how many of the T steps a task takes. "none": all of them; "head": a layer on the features of
            the one encoder; "network": a network of its own, with an encoder of its own (the paper's, Sec. IV-B);
            "class": one more action, to stop, at every step (the paper's extension of its temporal network).
        context: numbers that each glimpse is read with, told by the whole picture: what light of another colour does to
            a place, the place alone does not tell.
        spare_rows: rows beyond the T steps, which learn to stop and are not read.
    """

    encoder: str
    head: Head
    decoding: Decoding
    picture_shape: PictureShape
    n_steps: int
    n_actions: int
    width: int
    temperature: float = 1.0
    stop: Stop = "none"
    iterations: int | None = None
    spare_rows: int = 0
    context: int = 0

    def to_json(self) -> dict[str, Any]:
        return {**asdict(self), "picture_shape": list(self.picture_shape)}

    @property
    def shape(self) -> NetworkConfig:
        """The same, but for what only reading takes: networks that agree in it have weights of the same shapes."""
        return replace(self, temperature=1.0, iterations=None)

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
            if config.stop not in get_args(Stop) or (config.stop == "class" and config.decoding != "rows"):
                raise ValueError(f"unknown stop {config.stop!r}, or a stop class that is not decoded by rows")
            if config.iterations is not None and (type(config.iterations) is not int or config.iterations < 1):
                raise ValueError(f"iterations are to be a positive integer or null: {config.iterations!r}")
            if not all(type(n) is int and n >= 0 for n in (config.spare_rows, config.context)):
                raise ValueError("spare rows and context are to be numbers, 0 or more")
            if config.n_steps > config.n_actions or not config.temperature > 0:
                raise ValueError("more steps than actions, or a temperature that is not positive")
        except (TypeError, KeyError, ValueError) as error:
            raise CheckpointError(
                f"Expected a header whose network is {', '.join(cls.__dataclass_fields__)}; got {given!r}: {error}."
            ) from None
        return config


class Logits(NamedTuple):
    """What a network answers to B pictures.

    Attributes:
        order: (B, T, N), X = g_theta(I): how well action j suits step i.
        length: (B, T + 1), how likely 0 .. T steps are; None unless a stopping head or network answers it.
        stop: (B, T), how well stopping suits step i, on the scale of `order`; None unless stopping is an action.
    """

    order: Tensor
    length: Tensor | None = None
    stop: Tensor | None = None

    def to(self, dtype: torch.dtype) -> Logits:
        """The same in another precision."""
        return Logits(self.order.to(dtype), *(None if part is None else part.to(dtype) for part in self[1:]))

    @staticmethod
    def joined(parts: Sequence[Logits]) -> Logits:
        """One after the other, along the first axis."""
        order, *others = (None if column[0] is None else torch.cat(column) for column in zip(*parts))
        assert order is not None
        return Logits(order, *others)


class OrderNetwork(nn.Module):
    """Pictures -> `Logits` (Burke et al. 2021, X = g_theta(I), and f_phi(I) for the number of steps)."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = build_encoder(config.encoder, config.picture_shape)
        features, steps, width = self.encoder.out_features, config.n_steps + config.spare_rows, config.width
        columns = config.n_actions + (config.stop == "class")
        self.head: nn.Module
        if config.head == "tcn":
            self.head = TemporalDecoder(features, steps, columns, width=width)
        elif config.head == "tcn-published":
            blocks = config.n_steps + (config.stop == "class")
            self.head = PublishedTemporalDecoder(features, steps, columns, width=width, blocks=blocks)
        elif config.head == "glimpses":
            places, context = self.encoder.places_shape, config.context
            self.head = GlimpseHead(features, places, steps, columns, width=width, context=context)
        else:
            layers = nn.Linear(features, width), nn.ReLU(), nn.Linear(width, steps * columns)
            self.head = nn.Sequential(*layers, nn.Unflatten(1, (steps, columns)))
        if config.stop == "head":
            self.length = nn.Linear(features, config.n_steps + 1)
        elif config.stop == "network":
            self.stopping = StoppingNetwork(build_encoder(config.encoder, config.picture_shape), config.n_steps)

    def prepare(self, pictures: Tensor) -> Tensor:
        """uint8 (B, V, H, W, 3) -> what `forward` takes; done once for pictures that are seen many times."""
        return self.encoder.prepare(pictures)

    def chunks(self, pictures: NDArray[np.uint8]) -> Iterator[Tensor]:
        """Any number of pictures as `prepare` takes them, a chunk at a time, on this network's device."""
        device = next(self.parameters()).device
        for start in range(0, len(pictures), CHUNK):
            yield torch.from_numpy(np.ascontiguousarray(pictures[start : start + CHUNK])).to(device)

    def forward(self, prepared: Tensor) -> Logits:
        """What `prepare` gave -> logits."""
        features = self.encoder(prepared)
        places = (self.encoder.places(prepared),) if self.config.head == "glimpses" else ()
        table = self.head(features, *places)
        if not self.training:
            table = table[:, : self.config.n_steps]
        if self.config.stop == "class":
            return Logits(table[..., :-1], stop=table[..., -1])
        if self.config.stop == "head":
            return Logits(table, self.length(features))
        if self.config.stop == "network":
            return Logits(table, self.stopping(prepared))
        return Logits(table)

    def log_prob(self, logits: Logits) -> Tensor:
        """Log-probabilities of actions (B, T, N), float64, given that the step is taken.

        Rows of exp() sum to one, columns to at most one (Sinkhorn). In float64, where sums are exact enough that a
        picture read alone or in a batch stops at the same iteration.
        """
        exact, iterations = logits.order.to(torch.float64) / self.config.temperature, self.config.iterations
        if self.config.decoding == "rows":
            return torch.log_softmax(exact, dim=-1)
        tolerance, most = (TOLERANCE, READ_ITERATIONS) if iterations is None else (None, iterations)
        if exact.device.type == "cpu":
            return torch.from_numpy(scaled_sinkhorn(exact.detach().numpy(), tolerance=tolerance, max_iterations=most))
        return log_sinkhorn(exact, tolerance=tolerance, max_iterations=most)

    def log_length(self, logits: Logits) -> Tensor | None:
        """Log-probabilities that the task takes 0 .. T steps, (B, T + 1), float64; None where it always takes T."""
        exact = logits.to(torch.float64)
        if exact.stop is not None:
            return log_length_of_stops(exact.order, exact.stop)
        return None if exact.length is None else torch.log_softmax(exact.length, dim=-1)

    def tables(self, logits: Logits) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """`log_prob` and `log_length` as arrays."""
        length = self.log_length(logits)
        return self.log_prob(logits).cpu().numpy(), None if length is None else length.cpu().numpy()
