"""How many steps a task takes, where demonstrations differ in length: a network that says so, or an action to stop.

Burke et al. (RA-L 2021), Sec. IV-B: an auxiliary network f_phi(I), trained by cross-entropy, predicts the number of
actions; the losses of the order are masked to the steps taken (`learned_priors.losses`).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from learned_priors.encoders import Encoder


class StoppingNetwork(nn.Module):
    """The paper's f_phi(I): an encoder of its own and one linear layer. Prepared pictures -> logits (B, T + 1)."""

    def __init__(self, encoder: Encoder, n_steps: int) -> None:
        super().__init__()
        self.encoder = encoder
        self.logits = nn.Linear(encoder.out_features, n_steps + 1)

    def forward(self, prepared: Tensor) -> Tensor:
        logits: Tensor = self.logits(self.encoder(prepared))
        return logits


def log_length_of_stops(order: Tensor, stop: Tensor) -> Tensor:
    """Log-probability of each length when stopping is one more action of every step.

    A task takes n steps when the first n rows do not choose to stop and the next one does; it takes T when none
    does. So with s_i the probability of stopping at step i, P(n) = s_n prod_{i < n} (1 - s_i).

    Args:
        order: logits of the actions, (..., T, N).
        stop: logits of stopping, (..., T).

    Returns:
        (..., T + 1); exp() sums to one.
    """
    against = stop - torch.logsumexp(order, dim=-1)
    go_on = torch.cumsum(functional.logsigmoid(-against), dim=-1)
    reached = functional.pad(go_on, (1, 0))
    return reached + functional.pad(functional.logsigmoid(against), (0, 1))
