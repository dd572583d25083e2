"""One `fit` for every network: resumable at any update, the same result from the same seed.

Nothing random outlives an update: the order of an epoch is drawn from (seed, epoch), dropout and Gumbel noise from
(seed, update). So a checkpoint needs no state of a generator, and a run that was killed ends where it would have.
"""

import copy
import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from learned_priors.checkpoints import in_precision
from learned_priors.learner import Learner
from learned_priors.networks import NetworkConfig, OrderNetwork
from learned_priors.resume import RunState, fingerprint, load_state, save_state
from learned_priors.train_config import TrainConfig
from neurosym.errors import DemonstrationError, InputError
from neurosym.language.demonstrations import Demonstrations
from neurosym.support.arrays import Numbers

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


def fit(
    demonstrations: Demonstrations,
    network: NetworkConfig,
    config: TrainConfig,
    *,
    seed: int = 0,
    device: str | torch.device = "cpu",
    progress: Callable[[FitProgress], None] | None = None,
    checkpoint: Path | None = None,
    resume: bool = True,
    start: OrderNetwork | None = None,
) -> tuple[OrderNetwork, dict[str, Any]]:
    """Train a network on demonstrations.

    Args:
        progress: called after each epoch; what it raises ends the training.
        checkpoint: where to keep the state of the run. It stays after the run, so that a kill before the weights are
            saved costs nothing: delete it then.
        resume: go on from `checkpoint` if it is there. One of another run (other demonstrations, settings or seed)
            raises `CheckpointError`.
        start: a network of the same shape, whose weights are gone on from instead of chance ones.

    Returns:
        The network, its weights rounded to float16 values, and what its header will say of the training.
    """
    if config.sum_classes and not config.classes:
        config = replace(config, classes=demonstrations.classes)
    soft = config.soft and demonstrations.marginals is not None
    # Where actions are interchangeable, summing them stands in for the other orders.
    if config.soft and not soft and not config.classes:
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
    if start is not None:
        run.network.load_state_dict(start.state_dict())
    state = RunState()
    mark = fingerprint(demonstrations, network, config, seed, start) if checkpoint else ""
    if checkpoint and resume and checkpoint.exists():
        state = load_state(checkpoint, mark, run.network, run.optimizer)

    started = time.monotonic() - state.seconds
    written = time.monotonic()

    def keep(*, always: bool = False) -> None:
        nonlocal written
        state.seconds = time.monotonic() - started
        if checkpoint and (always or time.monotonic() - written >= config.checkpoint_seconds):
            save_state(checkpoint, mark, state, run.network, run.optimizer)
            written = time.monotonic()

    while state.epoch < epochs and not state.stopped:
        order = learn[np.random.default_rng([seed, _ORDER, state.epoch]).permutation(len(learn))]
        for step in range(state.step, steps_per_epoch):
            state.loss_sum += run.update(order[step * config.batch : (step + 1) * config.batch], state.updates)
            state.step, state.updates = step + 1, state.updates + 1
            if state.step < steps_per_epoch:
                keep()
        _finish_epoch(run, state, len(learn), held)
        keep(always=state.epoch == epochs or state.stopped)
        if progress:
            progress(FitProgress(epoch=state.epoch, epochs=epochs, seconds=state.seconds, **state.figures))

    if config.keep == "best" and state.best:
        run.network.load_state_dict(state.best)
    # Files hold float16: the network in memory and the one read back are the same.
    run.network.load_state_dict(in_precision(run.network.state_dict(), torch.float16))
    if config.calibrate and len(held):
        run.calibrate(held)
    return run.network.eval().requires_grad_(False), {
        "seed": seed,
        "epochs": state.epoch,
        "epochs_planned": epochs,
        "demonstrations": len(learn),
        "held_out": len(held),
        "labels": "marginals" if soft else "sequences",
        "best_epoch": state.best_epoch or None,
        "seconds": round(state.seconds, 1),
        "torch": torch.__version__,
        **{name: None if figure is None else round(figure, 6) for name, figure in state.figures.items()},
        "config": config.to_json(),
    }


def _finish_epoch(run: Learner, state: RunState, seen: int, held: Numbers) -> None:
    """Measure, keep the best weights, decide whether to stop."""
    held_loss, right = run.measure(held) if len(held) else (None, None)
    if held_loss is not None and held_loss < state.best_loss:
        state.best_loss, state.best_epoch = held_loss, state.epoch + 1
        if run.config.keep == "best":
            state.best = copy.deepcopy(run.network.state_dict())
    measured = {"held_out_loss": held_loss, "held_out_whole_order_accuracy": right}
    state.figures = {"train_loss": state.loss_sum / seen, **measured}
    state.epoch, state.step, state.loss_sum = state.epoch + 1, 0, 0.0
    patience = run.config.patience
    state.stopped = patience is not None and len(held) > 0 and state.epoch - state.best_epoch >= patience


def _split(demonstrations: Demonstrations, share: float, seed: int) -> tuple[Numbers, Numbers]:
    """Indices to learn from and to hold out; whole groups, so that a turned copy of a problem is not measured."""
    groups = np.unique(np.asarray(demonstrations.groups))
    n_held = round(share * len(groups))
    if not 0 <= share < 1 or (share > 0 and len(groups) - n_held < 1):
        raise DemonstrationError(f"Expected to hold out a share of the groups from 0 to below 1; got {share}.")
    chosen = np.random.default_rng([seed, _SPLIT]).permutation(groups)[:n_held]
    out = np.isin(np.asarray(demonstrations.groups), chosen)
    return np.flatnonzero(~out), np.flatnonzero(out)
