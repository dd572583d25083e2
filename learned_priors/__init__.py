"""Priors learned from pictures of finished work: Sinkhorn, temporal and plain networks, and their training.

Importing this package loads nothing; names resolve on first use (PEP 562), so that a command which needs no
network does not wait for torch.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from learned_priors.encoders import Encoder as Encoder
    from learned_priors.encoders import encoder_names as encoder_names
    from learned_priors.encoders import register_encoder as register_encoder
    from learned_priors.network_prior import NetworkPrior as NetworkPrior
    from learned_priors.sinkhorn import gumbel_sinkhorn as gumbel_sinkhorn
    from learned_priors.sinkhorn import log_sinkhorn as log_sinkhorn
    from learned_priors.train_config import TrainConfig as TrainConfig
    from learned_priors.training import FitProgress as FitProgress

_HOME = {
    "Encoder": "encoders",
    "encoder_names": "encoders",
    "register_encoder": "encoders",
    "NetworkPrior": "network_prior",
    "TrainConfig": "train_config",
    "gumbel_sinkhorn": "sinkhorn",
    "log_sinkhorn": "sinkhorn",
    "FitProgress": "training",
}

__all__ = [
    "Encoder",
    "FitProgress",
    "NetworkPrior",
    "TrainConfig",
    "encoder_names",
    "gumbel_sinkhorn",
    "log_sinkhorn",
    "register_encoder",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'learned_priors' has no attribute {name!r}")
    return getattr(importlib.import_module(f"learned_priors.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
