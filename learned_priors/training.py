"""One `fit` for every network: resumable at any update, the same result from the same seed.

Nothing random outlives an update: the order of an epoch is drawn from (seed, epoch), dropout and Gumbel noise from
(seed, update). So a checkpoint needs no state of a generator, and a run that was killed ends where it would have.
"""

from __future__ import annotations

import copy
import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from learned_priors.learner import Learner
from learned_priors.networks import NetworkConfig, OrderNetwork
from learned_priors.resume import RunState, fingerprint, load_state, save_state
from learned_priors.train_config import TrainConfig
from neurosym.errors import DemonstrationError, InputError
from neurosym.language.demonstrations import Demonstrations

#: Keep the draws for the order of an epoch and for what is held out apart from other uses of the seed.
_ORDER, _SPLIT = 1, 3


@dataclass(frozen=True)
class FitProgress:
    """Figures after an epoch: losses in nats a step (the paper's: squared error); None where nothing is held out."""

    epoch: int
    epochs: int
    train_loss: float
    held_out_loss: float | None
    held_out_whole_order_accuracy: float | None
    seconds: float


@dataclass
class Fitted:
    """A trained network, and what its header will say of the training."""

    network: OrderNetwork
    figures: dict[str, Any] = field(default_factory=dict)


def fit(
    demonstrations: Demonstrations,
    network: NetworkConfig,
    config: TrainConfig,
    *,
    seed: int = 0,
    device: str = "cpu",
    progress: Callable[[FitProgress], None] | None = None,
    checkpoint: Path | None = None,
    resume: bool = True,
) -> Fitted:
    """Train a network on demonstrations.

    Args:
        progress: called after each epoch; what it raises ends the training.
        checkpoint: where to keep the state of the run. It stays after the run, so that a kill before the weights are
            saved costs nothing: delete it then.
        resume: go on from `checkpoint` if it is there. One of another run (other demonstrations, settings or seed)
            raises `CheckpointError`.

    Returns:
        The network, its weights rounded to float16 values, and figures.
    """
    if config.sum_classes and not config.classes:
        config = replace(config, classes=demonstrations.classes)
    soft = demonstrations.marginals if config.soft else None
    # Where actions are interchangeable, summing them stands in for the other orders.
    if config.soft and soft is None and not config.classes:
        warnings.warn(
            "These demonstrations have no marginals (shares of valid orders): learning from the sequences alone.",
            UserWarning,
            stacklevel=2,
        )
    if config.classes and len(config.classes) != len(demonstrations.actions):
        raise InputError(f"Expected {len(demonstrations.actions)} classes, one an action; got {len(config.classes)}.")
    learn, held = _split(demonstrations, config.held_out, seed)
    steps_per_epoch = math.ceil(len(learn) / config.batch)
    epochs = config.epochs
    if config.most_steps is not None:
        epochs = max(1, min(epochs, config.most_steps // steps_per_epoch))
    epochs = max(epochs, math.ceil(config.least_steps / steps_per_epoch))
    run = Learner(demonstrations, network, config, seed, torch.device(device), steps_per_epoch * epochs)
    state = RunState()
    mark = fingerprint(demonstrations, network, config, seed) if checkpoint else ""
    if checkpoint and resume and checkpoint.exists():
        state = load_state(checkpoint, mark, run.network, run.optimizer)

    started = time.monotonic() - state.seconds
    written = time.monotonic()
    while state.epoch < epochs and not state.stopped:
        order = learn[np.random.default_rng([seed, _ORDER, state.epoch]).permutation(len(learn))]
        for step in range(state.step, steps_per_epoch):
            state.loss_sum += run.update(order[step * config.batch : (step + 1) * config.batch], state.updates)
            state.step, state.updates = step + 1, state.updates + 1
            if checkpoint and state.step < steps_per_epoch and time.monotonic() - written >= config.checkpoint_seconds:
                state.seconds = time.monotonic() - started
                save_state(checkpoint, mark, state, run.network, run.optimizer)
                written = time.monotonic()
        figures = _finish_epoch(run, state, held)
        state.seconds = time.monotonic() - started
        done = state.epoch == epochs or state.stopped
        if checkpoint and (done or time.monotonic() - written >= config.checkpoint_seconds):
            save_state(checkpoint, mark, state, run.network, run.optimizer)
            written = time.monotonic()
        if progress:
            progress(FitProgress(state.epoch, epochs, *figures, state.seconds))

    trained = run.network
    if config.keep == "best" and state.best:
        trained.load_state_dict(state.best)
    _round_to_half(trained)
    if config.calibrate and len(held):
        run.calibrate(held)
    return Fitted(trained.eval().requires_grad_(False), _header_figures(state, config, seed, epochs, learn, held, soft))


def _finish_epoch(run: Learner, state: RunState, held: NDArray[np.int64]) -> tuple[float, float | None, float | None]:
    """Measure, keep the best weights, decide whether to stop; the figures of the epoch."""
    seen = len(run.demonstrations) - len(held)
    train_loss = state.loss_sum / seen
    held_loss: float | None = None
    right: float | None = None
    if len(held):
        held_loss, right = run.measure(held)
        if held_loss < state.best_loss:
            state.best_loss, state.best_epoch = held_loss, state.epoch + 1
            if run.config.keep == "best":
                state.best = copy.deepcopy(run.network.state_dict())
    state.epoch, state.step, state.loss_sum = state.epoch + 1, 0, 0.0
    state.figures = {"train_loss": train_loss, "held_out_loss": held_loss, "held_out_whole_order_accuracy": right}
    patience = run.config.patience
    state.stopped = patience is not None and len(held) > 0 and state.epoch - state.best_epoch >= patience
    return train_loss, held_loss, right


def _split(demonstrations: Demonstrations, share: float, seed: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices to learn from and to hold out; whole groups, so that a turned copy of a problem is not measured."""
    groups = np.unique(np.asarray(demonstrations.groups))
    n_held = round(share * len(groups))
    if not 0 <= share < 1 or (share > 0 and len(groups) - n_held < 1):
        raise DemonstrationError(f"Expected to hold out a share of the groups from 0 to below 1; got {share}.")
    chosen = np.random.default_rng([seed, _SPLIT]).permutation(groups)[:n_held]
    out = np.isin(np.asarray(demonstrations.groups), chosen)
    return np.flatnonzero(~out), np.flatnonzero(out)


def _header_figures(
    state: RunState,
    config: TrainConfig,
    seed: int,
    epochs: int,
    learn: NDArray[np.int64],
    held: NDArray[np.int64],
    soft: NDArray[np.float32] | None,
) -> dict[str, Any]:
    return {
        "seed": seed,
        "epochs": state.epoch,
        "epochs_planned": epochs,
        "demonstrations": len(learn),
        "held_out": len(held),
        "labels": "marginals" if soft is not None else "sequences",
        "best_epoch": state.best_epoch or None,
        "seconds": round(state.seconds, 1),
        "torch": torch.__version__,
        **{k: None if v is None else round(v, 6) for k, v in state.figures.items()},
        "config": config.to_json(),
    }


def _round_to_half(network: OrderNetwork) -> None:
    """Files hold float16; rounding here makes the network in memory and the one read back the same."""
    with torch.no_grad():
        for tensor in network.state_dict().values():
            if tensor.is_floating_point():
                tensor.copy_(tensor.to(torch.float16).to(tensor.dtype))
