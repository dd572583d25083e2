"""What stays on the device while a network is trained, and one update of it."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import torch

from learned_priors.augment import augmented
from learned_priors.losses import cross_entropy, loss_of, targets_of
from learned_priors.metrics import whole_order_accuracy
from learned_priors.networks import Logits, NetworkConfig, OrderNetwork
from learned_priors.train_config import TrainConfig
from neurosym.errors import InputError
from neurosym.language.demonstrations import Demonstrations
from neurosym.support.arrays import Numbers, Pixels

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
        self.pictures = demonstrations.pictures
        with torch.no_grad():
            chunks, ready = self.network.chunks(self.pictures), self.network.encoder
            self.kept = torch.cat([(ready.reduced if config.augment else ready.prepare)(chunk) for chunk in chunks])

    def update(self, index: Numbers, done: int) -> float:
        """Update number `done` (from 0) on the demonstrations at `index`; their loss, weighted by their number."""
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate(done, self.total, self.config)
        self.network.train()
        i = torch.from_numpy(index).to(self.device)
        with self._noise(done):
            logits: Logits = self.network(self._seen(index))
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
            logits = self._logits(index).to(torch.float32)
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
        self.network.eval()
        i = torch.from_numpy(index).to(self.device)
        calibrate(self.network, self.pictures[index], self.target[i], self.config.classes)

    def _logits(self, index: Numbers) -> Logits:
        """The network's answers as it reads, without dropout, to pictures as they are."""
        self.network.eval()
        return read(self.network, self.pictures[index])

    def _seen(self, index: Numbers) -> torch.Tensor:
        """What is learned from: prepared pictures, changed by chance where the settings say so."""
        kept = self.kept[torch.from_numpy(index).to(self.device)]
        return self.network.prepare(augmented(kept, self.config.augment)) if self.config.augment else kept

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


def read(network: OrderNetwork, pictures: Pixels) -> Logits:
    """A network's answers to pictures, chunk by chunk."""
    return Logits.joined([network(network.prepare(chunk)) for chunk in network.chunks(pictures)])


@torch.no_grad()
def calibrate(network: OrderNetwork, pictures: Pixels, target: torch.Tensor, classes: Sequence[int]) -> None:
    """Set a network's temperature to the one of the least cross-entropy on pictures that it did not learn from.

    `target`: float (M, T, N), as `targets_of` gives it. Guo et al., "On calibration of modern neural networks" (2017).
    """
    logits, exact, before = read(network, pictures), target.to(torch.float64), network.config

    def loss_at(temperature: float) -> float:
        network.config = replace(before, temperature=temperature)
        return float(cross_entropy(network.log_prob(logits), exact, classes))

    best = min((before.temperature * 2 ** (k / 4) for k in range(-8, 17)), key=loss_at)
    network.config = replace(before, temperature=best)


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
