"""What stays on the device while a network is trained, and one update of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from learned_priors.losses import cross_entropy, loss_of, targets_of
from learned_priors.metrics import whole_order_accuracy
from learned_priors.networks import Logits, NetworkConfig, OrderNetwork
from learned_priors.train_config import TrainConfig
from neurosym.errors import InputError
from neurosym.language.demonstrations import Demonstrations

#: Pictures prepared, or read, at a time: bounds the memory that float copies of them take.
CHUNK = 256

#: Keeps the draws for dropout and Gumbel noise apart from other uses of the seed.
_NOISE = 2


class Learner:
    """What stays on the device while training goes on: prepared pictures, targets, network, optimiser."""

    def __init__(
        self,
        demonstrations: Demonstrations,
        network: NetworkConfig,
        config: TrainConfig,
        seed: int,
        device: torch.device,
        total_updates: int,
    ) -> None:
        self.config, self.seed, self.device, self.total = config, seed, device, total_updates
        with _seeded(seed, device):
            self.network = OrderNetwork(network).to(device)
        kind = torch.optim.AdamW if config.optimizer == "adamw" else torch.optim.Adam
        self.optimizer = kind(self.network.parameters(), lr=config.rate, weight_decay=config.weight_decay, fused=True)
        self.demonstrations = demonstrations
        marginals = demonstrations.marginals if config.soft else None
        self.target = targets_of(
            torch.from_numpy(demonstrations.sequences),
            len(demonstrations.actions),
            None if marginals is None else torch.from_numpy(marginals),
        ).to(device)
        self.prepared = prepare(self.network, demonstrations.pictures, device)

    def update(self, index: NDArray[np.int64], done: int) -> float:
        """Update number `done` (from 0) on the demonstrations at `index`; their loss, weighted by their number."""
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate(done, self.total, self.config)
        self.network.train()
        i = torch.from_numpy(index).to(self.device)
        with _seeded(_seed_of(self.seed, _NOISE, done), self.device), self._autocast():
            logits: Logits = self.network(self.prepared[i])
            loss = loss_of(logits.to(torch.float32), self.target[i], self.config)
        value = float(loss.detach())
        if not math.isfinite(value):
            raise InputError(
                f"Expected a finite loss; got {value} at update {done}. Lower the learning rate ({self.config.rate})."
            )
        self.optimizer.zero_grad(set_to_none=True)
        torch.autograd.backward(loss)
        self.optimizer.step()
        return value * len(index)

    @torch.no_grad()
    def measure(self, index: NDArray[np.int64]) -> tuple[float, float]:
        """Held-out loss and share of whole orders right."""
        self.network.eval()
        i = torch.from_numpy(index).to(self.device)
        with _seeded(_seed_of(self.seed, _NOISE, 0), self.device), self._autocast():
            logits = Logits.joined([self.network(self.prepared[part]) for part in torch.split(i, CHUNK)])
            logits = logits.to(torch.float32)
            loss = float(loss_of(logits, self.target[i], self.config))
        table = self.network.log_prob(logits).cpu().numpy()
        length = self.network.log_length(logits)
        demos = self.demonstrations
        soft = demos.marginals[index] if self.config.soft and demos.marginals is not None else None
        right = whole_order_accuracy(
            table,
            demos.sequences[index],
            log_length=None if length is None else length.cpu().numpy(),
            marginals=soft,
            classes=self.config.classes,
        )
        return loss, right

    @torch.no_grad()
    def calibrate(self, index: NDArray[np.int64]) -> float:
        """Set the network's temperature to the one of the least cross-entropy on `index`; returns it."""
        self.network.eval()
        i = torch.from_numpy(index).to(self.device)
        logits = Logits.joined([self.network(self.prepared[part]) for part in torch.split(i, CHUNK)])
        target, before = self.target[i].to(torch.float64), self.network.config

        def loss_at(temperature: float) -> float:
            self.network.config = replace(before, temperature=temperature)
            return float(cross_entropy(self.network.log_prob(logits), target, self.config.classes))

        best = min((before.temperature * 2 ** (k / 4) for k in range(-8, 17)), key=loss_at)
        self.network.config = replace(before, temperature=best)
        return best

    def _autocast(self) -> torch.autocast:
        return torch.autocast(self.device.type, torch.bfloat16, enabled=self.config.precision == "bfloat16")


def prepare(network: OrderNetwork, pictures: NDArray[np.uint8], device: torch.device) -> Tensor:
    """The fixed work on pictures (M, V, H, W, 3), done once, chunk by chunk; first axis M."""
    with torch.no_grad():
        chunks = [
            network.prepare(torch.from_numpy(np.ascontiguousarray(pictures[k : k + CHUNK])).to(device))
            for k in range(0, len(pictures), CHUNK)
        ]
    return torch.cat(chunks)


def learning_rate(update: int, total: int, config: TrainConfig) -> float:
    """The rate of an update, a function of its number alone (Smith & Topin, arXiv:1708.07120, without momentum)."""
    if config.schedule == "constant":
        return config.rate
    warm = 0.3 * total
    if update < warm:
        low, high, share = config.rate / 25, config.rate, update / warm
    else:
        low, high, share = config.rate, 0.0, (update - warm) / max(total - warm, 1)
    return low + (high - low) * 0.5 * (1 - math.cos(math.pi * share))


def _seed_of(*numbers: int) -> int:
    """A 63-bit seed from several numbers, the same on every machine."""
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0] >> np.uint64(1))


@contextmanager
def _seeded(seed: int, device: torch.device) -> Iterator[None]:
    """torch's generators start from `seed` inside, and are as they were outside: no global seed is set."""
    devices = [device] if device.type == "cuda" else []
    with torch.random.fork_rng(devices=devices):
        torch.manual_seed(seed)
        yield
