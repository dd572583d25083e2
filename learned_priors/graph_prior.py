"""`graph-sinkhorn`: order scores for assemblies never seen, from their blocking, contacts and loads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import torch

from learned_priors.assembly_graph import read_graph
from learned_priors.checkpoints import in_precision, read_tensors, write_tensors
from learned_priors.graph_network import GraphBatch, GraphConfig, GraphNetwork
from learned_priors.graph_training import Example, fit_graphs
from learned_priors.sinkhorn import scaled_sinkhorn
from learned_priors.training import FitProgress
from learned_priors.weight_files import FOLDER
from neurosym.errors import CheckpointError, InputError
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.prior import Prior

if TYPE_CHECKING:
    from neurosym.language.labelled_problems import LabelledProblems
    from neurosym.language.problem import Problem

NAME = "graph-sinkhorn"
BUNDLED = FOLDER / f"assembly-{NAME}.safetensors"


class GraphSinkhorn(Prior):
    """Learned from structures made at random: what lies outermost first, but not what holds up others.

    It looks at no picture. Of a problem it reads the geometry of its assembly: sizes, heights, contacts with the forces
    in which the whole rests, and what blocks what. Names and numbers of parts do not count.

    `weights`: a ``.safetensors`` file written by `save`; None takes those that come with the package.
    """

    #: What it is trained on: problems with shares of orders (`ProblemFamily.labelled_problems`).
    labels = "problems"

    def __init__(self, *, weights: str | Path | None = None) -> None:
        self._given = None if weights is None else load_graph_network(Path(weights))

    @cached_property
    def _network(self) -> tuple[GraphNetwork, dict[str, Any]]:
        return self._given or load_graph_network(BUNDLED)

    @property
    def header(self) -> dict[str, Any]:
        """What the weights say of themselves: prior, domain, network, training."""
        return dict(self._network[1])

    def scores(self, problems: Sequence[Problem]) -> list[OrderScores]:
        """One table a problem, (n_actions, n_actions).

        Raises InputError: the problem's world is no `Assembly`, or its actions are not named after parts.
        """
        return [self._scores(problem) for problem in problems]

    def _scores(self, problem: Problem) -> OrderScores:
        graph = read_graph(problem)
        with torch.inference_mode():
            logits = self._network[0](GraphBatch.of([graph])).double().numpy()
        return OrderScores(scaled_sinkhorn(logits)[0], problem.actions, classes=problem.classes)

    def fit(
        self,
        demonstrations: LabelledProblems | Iterable[Example],
        *,
        seed: int = 0,
        epochs: int | None = None,
        device: str | None = None,
        progress: Callable[[FitProgress], None] | None = None,
        checkpoint: str | Path | None = None,
        resume: bool = True,
        config: GraphConfig | None = None,
    ) -> Self:
        """Train a network on problems with shares of their orders; this prior then reads with it. Returns itself.

        `demonstrations` may be graphs that were read before, too.
        `seed`, `epochs`, `progress`, `checkpoint` and `resume` are as for `NetworkPrior.fit`. `config`: of the network.
        """
        if device not in (None, "cpu"):
            raise InputError(f"Expected device='cpu': graphs are small, and their sizes differ; got {device!r}.")
        graphs = [d if isinstance(d, Example) else Example(read_graph(d[0]), d[1]) for d in demonstrations]
        kept = Path(checkpoint) if checkpoint else None
        given: dict[str, Any] = {"progress": progress, "checkpoint": kept, "resume": resume}
        network, figures = fit_graphs(graphs, config or GraphConfig(), seed=seed, epochs=epochs, **given)
        self._given = network, {"prior": NAME, "domain": "assembly", "training": figures}
        self.__dict__.pop("_network", None)
        return self

    def save(self, path: str | Path, *, notes: Mapping[str, Any] | None = None) -> Path:
        """Write the weights, in float16, and their header to a ``.safetensors`` file; returns its path."""
        network, header = self._network
        if Path(path).suffix != ".safetensors":
            raise CheckpointError(f"Expected a file name that ends in .safetensors; got {Path(path).name!r}.")
        made = {**header, "network": network.config.to_json()} | ({"demonstrations": dict(notes)} if notes else {})
        write_tensors(Path(path), in_precision(network.state_dict(), torch.float16), made)
        return Path(path)


def load_graph_network(path: Path) -> tuple[GraphNetwork, dict[str, Any]]:
    """A network and its header. Raises `CheckpointError`: a file that is damaged, or holds something else."""
    tensors, header = read_tensors(path)
    own = header.get("prior")
    if own != NAME or not isinstance(header.get("network"), dict):
        raise CheckpointError(f"Expected weights of the prior {NAME!r} in {path}; got those of {own!r}.")
    with torch.device("meta"):
        network = GraphNetwork(GraphConfig.from_json(header["network"]))
    expected, got = ({n: tuple(t.shape) for n, t in d.items()} for d in (network.state_dict(), tensors))
    if expected != got or not all(bool(torch.isfinite(tensor).all()) for tensor in tensors.values()):
        raise CheckpointError(f"Expected in {path} finite weights of the network in its header; some are not.")
    network.load_state_dict(in_precision(tensors, torch.float32), assign=True)
    return network.eval().requires_grad_(False), header
