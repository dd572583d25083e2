"""Heads: from features of the pictures to logits of each action at each step, and of the number of steps.

Beside these there is a dense head, a perceptron (`learned_priors.networks`).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional
from torch.nn.utils.parametrizations import weight_norm

from learned_priors.encoders import Encoder

#: Each temporal layer looks at a step and one before, as in the reference network; dilation widens that to all steps.
KERNEL = 2
#: Of the published temporal network.
PUBLISHED_DROPOUT = 0.2

#: Glimpses a step. With one, training was stuck in half of the runs: where all pictures show the same colours in other
#: orders, a glimpse that is too wide sees the same in all, and nothing says where to turn.
GLIMPSES = 4
#: What is learned of where to look is multiplied by it, so that glimpses narrow soon.
SHARPNESS = 4.0
#: Deviation of the first weights (logits): glimpses begin at places of their own.
SPREAD = 2.0
#: Neurons that look at one place.
_SEEING = 32


def dilations(n_steps: int) -> tuple[int, ...]:
    """One dilation a layer, as many layers as steps: 1, 2, 4, ... below `n_steps`, then from 1 again.

    A dilation of `n_steps` or more would reach only into the padding; for 7 steps: 1 2 4 1 2 4 1.
    """
    cycle = [1]
    while cycle[-1] * 2 < n_steps:
        cycle.append(cycle[-1] * 2)
    return tuple(cycle[i % len(cycle)] for i in range(n_steps))


class TemporalDecoder(nn.Module):
    """A temporal convolutional network of as many layers as steps, as Burke et al. decode (Fig. 2 and appendix).

    A linear layer gives each step a latent state of `width` dimensions (the paper: 16). Layer i is a residual
    block: causal convolution (kernel 2, dilation `dilations(T)[i]`; Bai, Kolter, Koltun, arXiv:1803.01271), ReLU,
    added to its input. A last linear layer, shared by the steps, gives the logits.

    Shapes: (B, features) -> (B, T, N).
    """

    def __init__(self, features: int, n_steps: int, n_actions: int, *, width: int = 16) -> None:
        super().__init__()
        self.n_steps, self.width = n_steps, width
        self.states = nn.Linear(features, n_steps * width)
        self.layers = nn.ModuleList(nn.Conv1d(width, width, KERNEL, dilation=d) for d in dilations(n_steps))
        self.logits = nn.Linear(width, n_actions)

    def forward(self, features: Tensor) -> Tensor:
        x = self.states(features).unflatten(1, (self.width, self.n_steps))
        for layer, dilation in zip(self.layers, dilations(self.n_steps)):
            x = x + torch.relu(layer(functional.pad(x, ((KERNEL - 1) * dilation, 0))))
        logits: Tensor = self.logits(x.transpose(1, 2))
        return logits


class PublishedTemporalDecoder(nn.Module):
    """The temporal network as its code was published, where the steps are channels.

    A linear layer gives each row a latent state of `width` dimensions; the convolutions run along these dimensions,
    whose order means nothing, and mix all rows at each of them: there is no time in it, and `rows` channels make
    rows^2 weights a convolution. Each block, after Bai, Kolter, Koltun (arXiv:1803.01271): twice a causal convolution
    (kernel 2, weights normalised, dilation 1, 2, 4, ...), ReLU, dropout; added to its input; ReLU.

    Shapes: (B, features) -> (B, rows, columns).
    """

    def __init__(self, features: int, rows: int, columns: int, *, width: int, blocks: int) -> None:
        super().__init__()
        self.rows, self.width = rows, width
        self.states = nn.Linear(features, rows * width)
        self.blocks = nn.ModuleList(_PublishedBlock(rows, 2**i) for i in range(blocks))
        self.logits = nn.Linear(width, columns)

    def forward(self, features: Tensor) -> Tensor:
        x = self.states(features).unflatten(1, (self.rows, self.width))
        for block in self.blocks:
            x = torch.relu(x + block(x))
        logits: Tensor = self.logits(x)
        return logits


class _PublishedBlock(nn.Sequential):
    """Two dilated causal convolutions (B, channels, length), each with ReLU and dropout."""

    def __init__(self, channels: int, dilation: int) -> None:
        layers: list[nn.Module] = []
        for _ in range(2):
            pad = nn.ConstantPad1d(((KERNEL - 1) * dilation, 0), 0.0)
            layers += [pad, weight_norm(nn.Conv1d(channels, channels, KERNEL, dilation=dilation)), nn.ReLU()]
            layers.append(nn.Dropout(PUBLISHED_DROPOUT))
        super().__init__(*layers)


class GlimpseHead(nn.Module):
    """For each step a few glimpses at the picture, and one reading of what is seen that all steps share.

    Where to look is told by the whole picture (a tower stands off the middle, leans, is near or far); what is there is
    told by the place alone. So a colour that was learned at one step is known at all, and sequences that were never
    demonstrated are read as well as those that were: of 670 towers unseen among 720, 50 demonstrations taught a
    perceptron over the whole picture 2%, this head more than 90%.

    A glimpse is soft attention that is separable (weights over views times weights over rows times weights over
    columns), after Gregor et al., "DRAW" (ICML 2015), without its filters' shape.

    `context` numbers that the whole picture tells may be read with all glimpses: light of another colour shows there.

    Shapes: features (B, F) and places (B, V, R, C, channels) -> (B, T, N); `width` neurons share the reading.
    """

    def __init__(
        self,
        features: int,
        places: tuple[int, int, int, int],
        n_steps: int,
        n_actions: int,
        *,
        width: int = 64,
        context: int = 0,
    ) -> None:
        super().__init__()
        self.n_steps, self.axes = n_steps, places[:3]
        self.where = nn.Linear(features, n_steps * GLIMPSES * sum(self.axes))
        nn.init.normal_(self.where.bias, std=SPREAD / SHARPNESS)
        self.see = nn.Sequential(nn.Linear(places[3], _SEEING), nn.ReLU(), nn.Linear(_SEEING, _SEEING), nn.ReLU())
        self.context = nn.Linear(features, context) if context else None
        seen = _SEEING * GLIMPSES + context
        self.read = nn.Sequential(nn.Linear(seen, width), nn.ReLU(), nn.Linear(width, n_actions))

    def forward(self, features: Tensor, places: Tensor) -> Tensor:
        looks = SHARPNESS * self.where(features).unflatten(1, (self.n_steps * GLIMPSES, sum(self.axes)))
        view, row, column = (torch.softmax(part, dim=-1) for part in looks.split(self.axes, dim=-1))
        # One axis after the other: first all views are blended, then rows, then columns.
        seen = self.see(places)  # (B, V, R, C, D)
        rows_of = (view[..., None] * row[:, :, None]).flatten(2)  # (B, G, V R)
        blended = rows_of @ seen.flatten(3).flatten(1, 2)  # (B, G, C D)
        glimpses = column[:, :, None] @ blended.unflatten(2, (self.axes[2], _SEEING))  # (B, G, 1, D)
        seen = glimpses.flatten(1).reshape(-1, self.n_steps, GLIMPSES * _SEEING)
        if self.context is not None:
            told = torch.tanh(self.context(features))[:, None].expand(-1, self.n_steps, -1)
            seen = torch.cat([seen, told], dim=2)
        logits: Tensor = self.read(seen)
        return logits


class StoppingNetwork(nn.Module):
    """The auxiliary network f_phi(I) of Burke et al. (Sec. IV-B): how many steps, by an encoder of its own.

    It is trained by cross-entropy; the losses of the order are masked to the steps taken (`learned_priors.losses`).
    Shapes: prepared pictures -> (B, T + 1).
    """

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

    Shapes: logits of the actions (..., T, N) and of stopping (..., T) -> (..., T + 1), whose exp() sums to one.
    """
    against = stop - torch.logsumexp(order, dim=-1)
    go_on = torch.cumsum(functional.logsigmoid(-against), dim=-1)
    reached = functional.pad(go_on, (1, 0))
    return reached + functional.pad(functional.logsigmoid(against), (0, 1))
