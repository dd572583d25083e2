"""Training of `graph-sinkhorn`: cross-entropy of log S(X) against shares of orders, resumable by epochs."""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from learned_priors.assembly_graph import AssemblyGraph
from learned_priors.checkpoints import in_precision
from learned_priors.graph_network import GraphBatch, GraphConfig, GraphNetwork
from learned_priors.learner import learning_rate
from learned_priors.losses import cross_entropy
from learned_priors.resume import RunState, load_state, save_state
from learned_priors.sinkhorn import log_sinkhorn
from learned_priors.train_config import TrainConfig
from learned_priors.training import FitProgress
from neurosym.support.arrays import Array, Numbers

#: A learning rate up and down, as for pictures; graphs of a size are stacked, so many at the most.
TRAINING = TrainConfig(loss="sinkhorn", soft=True, epochs=24, batch=16, rate=3e-3, iterations=12)
#: Longest gradient of an update.
CLIP = 1.0


@dataclass(frozen=True, eq=False)
class Example:
    """A graph, and the share of its orders with each action at each step: float64 (n, n)."""

    graph: AssemblyGraph
    shares: Array


def fit_graphs(
    examples: Sequence[Example],
    config: GraphConfig,
    *,
    seed: int = 0,
    epochs: int | None = None,
    progress: Callable[[FitProgress], None] | None = None,
    checkpoint: Path | None = None,
    resume: bool = True,
) -> tuple[GraphNetwork, dict[str, Any]]:
    """Train a network. The same seed gives the same weights, on the same number of threads.

    Returns:
        The network, its weights rounded to float16 values, and what its header will say of the training.
    """
    epochs = TRAINING.epochs if epochs is None else epochs
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = GraphNetwork(config)
    optimizer = torch.optim.AdamW(network.parameters(), lr=TRAINING.rate, weight_decay=TRAINING.weight_decay)
    state, mark = RunState(), _fingerprint(examples, config, seed, epochs) if checkpoint else ""
    if checkpoint and resume and checkpoint.exists():
        state = load_state(checkpoint, mark, network, optimizer)
    total = epochs * len(_batches(examples, np.random.default_rng(0)))
    started = written = time.monotonic()
    before = state.seconds
    network.train()
    while state.epoch < epochs:
        loss_sum = steps = 0.0
        for index in _batches(examples, np.random.default_rng([seed, state.epoch])):
            for group in optimizer.param_groups:
                group["lr"] = learning_rate(state.updates, total, TRAINING)
            target = torch.stack([torch.from_numpy(examples[k].shares) for k in index]).float()
            logits = network(GraphBatch.of([examples[k].graph for k in index]))
            loss = cross_entropy(log_sinkhorn(logits, tolerance=None, max_iterations=TRAINING.iterations), target)
            optimizer.zero_grad(set_to_none=True)
            torch.autograd.backward(loss)
            torch.nn.utils.clip_grad_norm_(network.parameters(), CLIP)
            optimizer.step()
            own = len(index) * target.shape[1]
            loss_sum, steps, state.updates = loss_sum + float(loss.detach()) * own, steps + own, state.updates + 1
        state.epoch, state.seconds = state.epoch + 1, before + time.monotonic() - started
        state.figures = {"train_loss": loss_sum / max(steps, 1)}
        last = state.epoch == epochs
        if checkpoint and (last or time.monotonic() - written >= TRAINING.checkpoint_seconds):
            save_state(checkpoint, mark, state, network, optimizer)
            written = time.monotonic()
        if progress:
            progress(FitProgress(state.epoch, epochs, state.figures["train_loss"], None, None, state.seconds))
    network.load_state_dict(in_precision(network.state_dict(), torch.float16))
    figures = {"seed": seed, "epochs": epochs, "demonstrations": len(examples), "seconds": round(state.seconds, 1)}
    kept = {"train_loss": round(state.figures.get("train_loss", math.nan), 6), "torch": torch.__version__}
    return network.eval().requires_grad_(False), {**figures, **kept, "config": TRAINING.to_json()}


def _batches(examples: Sequence[Example], rng: np.random.Generator) -> list[Numbers]:
    """Indices of examples that stack, in random order: as many parts, actions and directions."""
    sizes: dict[tuple[int, ...], list[int]] = {}
    for k, example in enumerate(examples):
        graph = example.graph
        sizes.setdefault((len(graph.parts), len(graph.moved), len(graph.directions)), []).append(k)
    batches = []
    for own in sizes.values():
        order = rng.permutation(own)
        batches += [order[k : k + TRAINING.batch] for k in range(0, len(order), TRAINING.batch)]
    return [batches[k] for k in rng.permutation(len(batches))]


def _fingerprint(examples: Sequence[Example], config: GraphConfig, seed: int, epochs: int) -> str:
    """What must agree for a run to go on."""
    settings = json.dumps([config.to_json(), TRAINING.to_json(), seed, epochs], sort_keys=True)
    digest = hashlib.blake2b(settings.encode(), digest_size=16)
    for example in examples:
        for array in (example.shares, *asdict(example.graph).values()):
            digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()
