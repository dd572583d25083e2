"""The state of a training run on disk, so that a run that was killed goes on where it was."""

import hashlib
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from learned_priors.checkpoints import read_tensors, write_tensors
from learned_priors.networks import NetworkConfig, OrderNetwork
from learned_priors.train_config import TrainConfig
from neurosym.errors import CheckpointError
from neurosym.language.demonstrations import Demonstrations

_KIND = "training-state"


@dataclass
class RunState:
    """Where a run is: `step` updates into epoch number `epoch` (from 0), and its figures so far."""

    epoch: int = 0
    step: int = 0
    updates: int = 0
    loss_sum: float = 0.0
    seconds: float = 0.0
    best_loss: float = math.inf
    best_epoch: int = 0
    stopped: bool = False
    figures: dict[str, Any] = field(default_factory=dict)
    best: dict[str, Tensor] = field(default_factory=dict)


def fingerprint(
    demonstrations: Demonstrations,
    network: NetworkConfig,
    config: TrainConfig,
    seed: int,
    start: OrderNetwork | None = None,
) -> str:
    """What must agree for a run to go on: demonstrations, network, settings, seed, and the weights it began with."""
    settings = {k: v for k, v in config.to_json().items() if k != "checkpoint_seconds"}
    text = json.dumps([network.to_json(), settings, seed, demonstrations.actions], sort_keys=True)
    digest = hashlib.blake2b(text.encode(), digest_size=16)
    arrays = (demonstrations.pictures, demonstrations.sequences, demonstrations.groups, demonstrations.marginals)
    for array in arrays:
        if array is not None:
            digest.update(str((array.dtype, array.shape)).encode())
            digest.update(np.ascontiguousarray(array).data)
    for tensor in start.state_dict().values() if start else ():
        digest.update(tensor.cpu().numpy().tobytes())
    return digest.hexdigest()


def save_state(path: Path, mark: str, state: RunState, network: nn.Module, optimizer: torch.optim.Optimizer) -> None:
    """Write the run's state, whole or not at all."""
    tensors = {f"model.{name}": tensor for name, tensor in network.state_dict().items()}
    tensors |= {f"best.{name}": tensor for name, tensor in state.best.items()}
    for i, slots in optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{i}.{key}": torch.as_tensor(value) for key, value in slots.items()}
    plain: dict[str, Any] = {k: v for k, v in vars(state).items() if k != "best"}
    plain["best_loss"] = None if math.isinf(state.best_loss) else state.best_loss
    write_tensors(path, tensors, {"kind": _KIND, "fingerprint": mark, "state": plain})


def load_state(path: Path, mark: str, network: nn.Module, optimizer: torch.optim.Optimizer) -> RunState:
    """Load network and optimiser from `path`, and give the rest; `CheckpointError` if damaged or of another run."""
    tensors, header = read_tensors(path)
    if header.get("kind") != _KIND or header.get("fingerprint") != mark:
        raise CheckpointError(
            f"Expected the checkpoint {path} to be of this run; it was made with other demonstrations, settings or "
            "seed. Delete it, name another file, or start over (resume=False; --no-resume on the command line)."
        )
    given = header["state"]
    state = RunState(**{**given, "best_loss": math.inf if given["best_loss"] is None else given["best_loss"]})

    def part(prefix: str) -> dict[str, Tensor]:
        return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}

    state.best = part("best.")
    network.load_state_dict(part("model."))
    slots: dict[int, dict[str, Tensor]] = {}
    for name, tensor in part("optimizer.").items():
        i, _, key = name.partition(".")
        slots.setdefault(int(i), {})[key] = tensor
    optimizer.load_state_dict({"state": slots, "param_groups": optimizer.state_dict()["param_groups"]})
    return state
