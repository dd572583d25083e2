"""A Sinkhorn network over an assembly's graph: renaming or reordering parts and directions permutes its scores.

In each layer a part hears from the parts that it touches, and along each direction from all that block it, summed; of
the directions the largest counts. So "all of these must be gone, along any of those" can be learned (AND, then OR).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import torch
from torch import Tensor, nn

from learned_priors.assembly_graph import CONTACT, DIRECTION, PART, AssemblyGraph
from neurosym.errors import CheckpointError

#: Waves in which a step's place in the order is written.
WAVES = 6


@dataclass(frozen=True, kw_only=True)
class GraphConfig:
    """How wide the network is, how many layers, and how far a part is from its place outermost first (steps)."""

    width: int = 48
    layers: int = 3
    decay: float = 2.0

    @classmethod
    def from_json(cls, given: Mapping[str, Any]) -> Self:
        """Raises `CheckpointError`: other fields, or none that make a network."""
        try:
            config = cls(width=int(given["width"]), layers=int(given["layers"]), decay=float(given["decay"]))
        except (KeyError, TypeError, ValueError) as error:
            raise CheckpointError(f"Expected width, layers and decay of a network; got {dict(given)}.") from error
        if not (1 <= config.width <= 1024 and 1 <= config.layers <= 64 and config.decay > 0):
            raise CheckpointError(f"Expected a network that can be built; got {dict(given)}.")
        return config

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True, eq=False)
class GraphBatch:
    """Graphs of as many parts, actions and directions each, stacked; contacts number the parts of all of them."""

    parts: Tensor
    blocks: Tensor
    directions: Tensor
    contacts: Tensor
    contact: Tensor
    moved: Tensor
    place: Tensor

    @classmethod
    def of(cls, graphs: list[AssemblyGraph]) -> Self:
        m = graphs[0].parts.shape[0]

        def stacked(name: str) -> Tensor:
            return torch.stack([torch.from_numpy(getattr(graph, name)) for graph in graphs])

        contacts = torch.cat([torch.from_numpy(graph.contacts) + m * k for k, graph in enumerate(graphs)])
        contact = torch.cat([torch.from_numpy(graph.contact) for graph in graphs])
        names = ("parts", "blocks", "directions", "moved", "place")
        given = {name: stacked(name) for name in names}
        return cls(**given, contacts=contacts, contact=contact)


class _Layer(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.mine, self.theirs = nn.Linear(width, width), nn.Linear(width, width, bias=False)
        self.touch = nn.Linear(CONTACT, width, bias=False)
        self.blocker, self.blocked = nn.Linear(width, width, bias=False), nn.Linear(width, width, bias=False)
        self.along, self.own = nn.Linear(DIRECTION, width), nn.Linear(width, width)
        self.join = nn.Sequential(nn.Linear(6 * width, 2 * width), nn.ReLU(), nn.Linear(2 * width, width))

    def forward(self, state: Tensor, batch: GraphBatch) -> Tensor:
        count, m, width = state.shape
        h = self.norm(state)
        flat = h.reshape(count * m, width)
        to, of = batch.contacts.T
        message = torch.relu(self.mine(flat)[to] + self.theirs(flat)[of] + self.touch(batch.contact))
        empty = torch.zeros_like(flat)
        index = to[:, None].expand_as(message)
        summed = empty.index_add(0, to, message).view_as(h) / 2
        largest = empty.scatter_reduce(0, index, message, "amax").view_as(h)
        base = self.own(h)[:, None] + self.along(batch.directions)[:, :, None]
        stopped = _heard(batch.blocks, self.blocker(h)) + base
        stopping = _heard(batch.blocks.transpose(-1, -2), self.blocked(h)) + base
        ways = [torch.relu(heard).amax(dim=1) for heard in (stopped, stopping)]
        whole = h.mean(dim=1, keepdim=True).expand_as(h)
        joined: Tensor = self.join(torch.cat([h, summed, largest, *ways, whole], dim=-1))
        return state + joined


def _heard(blocks: Tensor, said: Tensor) -> Tensor:
    """(B, k, m, W): what each part hears along each direction, summed; of many, as the root of their number."""
    return (blocks @ said[:, None]) / (1 + blocks.sum(dim=-1, keepdim=True)).sqrt()


class GraphNetwork(nn.Module):
    """Logits of each action at each step, (B, n, n), to be balanced by Sinkhorn's iteration."""

    def __init__(self, config: GraphConfig) -> None:
        super().__init__()
        self.config, width = config, config.width
        self.read = nn.Sequential(nn.Linear(PART, width), nn.ReLU(), nn.Linear(width, width))
        self.layers = nn.ModuleList(_Layer(width) for _ in range(config.layers))
        self.key = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.ReLU(), nn.Linear(width, width))
        self.query = nn.Sequential(nn.Linear(2 * WAVES + 1, width), nn.ReLU(), nn.Linear(width, width))
        #: How late a part leaves (0 to 1), how sure that is, and how much outermost first is heeded.
        self.late = nn.Linear(width, 3)

    def forward(self, batch: GraphBatch) -> Tensor:
        state: Tensor = self.read(batch.parts)
        for layer in self.layers:
            state = layer(state, batch)
        index = batch.moved[..., None].expand(-1, -1, state.shape[-1])
        moved = torch.gather(state, 1, index)
        n = moved.shape[1]
        when = torch.linspace(0, 1, n) if n > 1 else torch.zeros(1)
        waves = when[:, None] * math.pi * torch.arange(1, WAVES + 1)
        query = self.query(torch.cat([when[:, None], waves.sin(), waves.cos()], dim=1))
        late, sure, heed = self.late(moved).unbind(dim=-1)
        steps = n / self.config.decay
        outermost = (when[:, None] - batch.place[:, None]).abs() * steps * torch.sigmoid(heed)[:, None]
        own = (when[:, None] - torch.sigmoid(late)[:, None]).abs() * steps * torch.sigmoid(sure)[:, None]
        logits: Tensor = (query @ self.key(moved).transpose(-1, -2)) / math.sqrt(query.shape[1]) - outermost - own
        return logits
