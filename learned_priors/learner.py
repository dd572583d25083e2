"""What stays on the device while a network is trained, and one update of it."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import torch

from learned_priors.losses import cross_entropy, loss_of, targets_of
from learned_priors.metrics import whole_order_accuracy
from learned_priors.networks import CHUNK, Logits, NetworkConfig, OrderNetwork
from learned_priors.train_config import TrainConfig
from neurosym.errors import InputError
from neurosym.language.demonstrations import Demonstrations
from neurosym.support.arrays import Numbers

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
        with self._seeded(seed):
            self.network = OrderNetwork(network).to(device)
        kind = torch.optim.AdamW if config.optimizer == "adamw" else torch.optim.Adam
        self.optimizer = kind(self.network.parameters(), lr=config.rate, weight_decay=config.weight_decay, fused=True)
        self.sequences = demonstrations.sequences
        self.marginals = demonstrations.marginals if config.soft else None
        marginals = None if self.marginals is None else torch.from_numpy(self.marginals)
        self.target = targets_of(torch.from_numpy(self.sequences), network.n_actions, marginals).to(device)
        with torch.no_grad():
            chunks = self.network.chunks(demonstrations.pictures)
            self.prepared = torch.cat([self.network.prepare(chunk) for chunk in chunks])

    def update(self, index: Numbers, done: int) -> float:
        """Update number `done` (from 0) on the demonstrations at `index`; their loss, weighted by their number."""
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate(done, self.total, self.config)
        self.network.train()
        i = torch.from_numpy(index).to(self.device)
        with self._noise(done):
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
    def measure(self, index: Numbers) -> tuple[float, float]:
        """Held-out loss and share of whole orders right."""
        i = torch.from_numpy(index).to(self.device)
        with self._noise(0):
            logits = self._logits(i).to(torch.float32)
            loss = float(loss_of(logits, self.target[i], self.config))
        table, length = self.network.tables(logits)
        marginals, classes = None if self.marginals is None else self.marginals[index], self.config.classes
        right = whole_order_accuracy(
            table, self.sequences[index], log_length=length, marginals=marginals, classes=classes
        )
        return loss, right

    @torch.no_grad()
    def calibrate(self, index: Numbers) -> None:
        """Set the network's temperature to the one of the least cross-entropy on `index`."""
        i = torch.from_numpy(index).to(self.device)
        logits, target, before = self._logits(i), self.target[i].to(torch.float64), self.network.config

        def loss_at(temperature: float) -> float:
            self.network.config = replace(before, temperature=temperature)
            return float(cross_entropy(self.network.log_prob(logits), target, self.config.classes))

        best = min((before.temperature * 2 ** (k / 4) for k in range(-8, 17)), key=loss_at)
        self.network.config = replace(before, temperature=best)

    def _logits(self, index: torch.Tensor) -> Logits:
        """The network's answers as it reads, without dropout."""
        self.network.eval()
        return Logits.joined([self.network(self.prepared[part]) for part in torch.split(index, CHUNK)])

    @contextmanager
    def _noise(self, update: int) -> Iterator[None]:
        """The draws of an update, whatever was drawn before it, in the precision asked for."""
        enabled = self.config.precision == "bfloat16"
        # A 63-bit seed, the same on every machine.
        seed = np.random.SeedSequence((self.seed, _NOISE, update)).generate_state(1, np.uint64)[0] >> np.uint64(1)
        with self._seeded(int(seed)), torch.autocast(self.device.type, torch.bfloat16, enabled=enabled):
            yield

    @contextmanager
    def _seeded(self, seed: int) -> Iterator[None]:
        """torch's generators start from `seed` inside, and are as they were outside: no global seed is set."""
        with torch.random.fork_rng(devices=[self.device] if self.device.type == "cuda" else []):
            torch.manual_seed(seed)
            yield


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
