"""A temporal convolutional decoder: the network under the priors in `learned_priors.tcn`.

Burke et al. (RA-L 2021, Fig. 2 and appendix) decode with a temporal convolutional network (Bai, Kolter, Koltun,
arXiv:1803.01271) of as many layers as there are steps.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

#: Each layer looks at a step and one before it, as in the reference network; dilation widens that to all steps.
KERNEL = 2


def dilations(n_steps: int) -> tuple[int, ...]:
    """One dilation a layer, as many layers as steps: 1, 2, 4, ... below `n_steps`, then from 1 again.

    A dilation of `n_steps` or more would reach only into the padding; for 7 steps: 1 2 4 1 2 4 1.
    """
    cycle = [1]
    while cycle[-1] * 2 < n_steps:
        cycle.append(cycle[-1] * 2)
    return tuple(cycle[i % len(cycle)] for i in range(n_steps))


class TemporalDecoder(nn.Module):
    """Features of the pictures -> logits of each action at each step, by causal dilated convolutions over the steps.

    A linear layer gives each step a latent state of `width` dimensions (the paper: 16). Layer i is a residual
    block: causal convolution (kernel 2, dilation `dilations(T)[i]`), ReLU, dropout, added to its input. A last
    linear layer, shared by the steps, gives the logits.

    Shapes: (B, features) -> (B, T, N).
    """

    def __init__(self, features: int, n_steps: int, n_actions: int, *, width: int = 16, dropout: float = 0.0) -> None:
        super().__init__()
        self.n_steps, self.width, self.dropout = n_steps, width, dropout
        self.states = nn.Linear(features, n_steps * width)
        self.layers = nn.ModuleList(nn.Conv1d(width, width, KERNEL, dilation=d) for d in dilations(n_steps))
        self.logits = nn.Linear(width, n_actions)

    def forward(self, features: Tensor) -> Tensor:
        x = self.states(features).unflatten(1, (self.width, self.n_steps))
        for layer, dilation in zip(self.layers, dilations(self.n_steps)):
            past = functional.pad(x, ((KERNEL - 1) * dilation, 0))
            x = x + functional.dropout(torch.relu(layer(past)), self.dropout, self.training)
        logits: Tensor = self.logits(x.transpose(1, 2))
        return logits
