"""`NetworkPrior`: order scores from pictures, by a network that was trained, or that `fit` trains."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from learned_priors.checkpoints import save_network
from learned_priors.learner import CHUNK
from learned_priors.metrics import decoded
from learned_priors.networks import Logits
from learned_priors.recipes import Recipe, recipe_named
from learned_priors.train_config import TrainConfig
from learned_priors.training import FitProgress, fit
from learned_priors.weight_store import Weights, WeightStore
from neurosym.errors import InputError
from neurosym.language.demonstrations import Demonstrations
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.prior import Prior, as_picture_batch

if TYPE_CHECKING:
    from neurosym.language.problem import Problem


class NetworkPrior(Prior):
    """A prior that looks at pictures of finished work.

    Of a problem it reads the pictures and the names of the actions, nothing else: the same pictures with other
    geometry behind them get the same scores.

    Args:
        recipe: a name in `learned_priors.recipes.RECIPES`, or a `Recipe`.
        weights: a ``.safetensors`` file written by `save`. None takes weights that come with the package, chosen by
            the problem's domain when they are first needed.
        domain: whose bundled weights to take; None asks each problem.
        encoder: what `fit` builds (``"small"``, ``"paper"``, ``"resnet18"``, or one registered); None is the small one.
        device: ``"cpu"`` or ``"cuda"``; reading and training happen there.

    Raises:
        CheckpointError: the file is damaged, of another recipe or another schema.
        InputError: the device is not there.
    """

    def __init__(
        self,
        recipe: str | Recipe,
        *,
        weights: str | Path | None = None,
        domain: str | None = None,
        encoder: str | None = None,
        device: str = "cpu",
    ) -> None:
        self.recipe = recipe if isinstance(recipe, Recipe) else recipe_named(recipe)
        self.domain = domain
        self.encoder = encoder
        self.device = _checked_device(device)
        self._weights = WeightStore(self.recipe, domain, encoder, self.device)
        if weights is not None:
            self._weights.own = self._weights.load(Path(weights))

    @property
    def labels(self) -> str:
        """Which demonstrations this recipe learns from: ``"full"``, with shares of valid orders, or ``"paper"``."""
        return "full" if self.recipe.train.soft else "paper"

    @property
    def settings(self) -> dict[str, Any]:
        """All that decides what `fit` makes of demonstrations, as JSON has it."""
        return {**asdict(self.recipe), "encoder": self.encoder}

    @property
    def header(self) -> dict[str, Any]:
        """What the weights say of themselves: prior, domain, actions, network, training. Empty before there are any."""
        return dict(self._weights.own.header) if self._weights.own else {}

    @overload
    def read(self, pictures: NDArray[np.uint8]) -> OrderScores: ...
    @overload
    def read(self, pictures: ArrayLike) -> OrderScores | list[OrderScores]: ...
    def read(self, pictures: ArrayLike) -> OrderScores | list[OrderScores]:
        """Order scores from pictures alone.

        Args:
            pictures: uint8 (V, H, W, 3) of one piece of work, or a batch (M, V, H, W, 3).

        Returns:
            One `OrderScores` for one set of pictures, a list of M for a batch; columns named as in the training.
        """
        batch, single = as_picture_batch(pictures)
        weights = self._weights.for_pictures(batch.shape[1:])
        found = self._read(weights, batch)
        return found[0] if single else found

    def predict(self, pictures: ArrayLike) -> NDArray[np.int64]:
        """The model's own order, as the paper compares it; unlike one of `OrderScores`, it may be wrong by itself.

        Plain ``bc`` and ``tcn-paper`` take the likeliest action of each step, so the same one may come twice. All
        others take the likeliest number of steps, if that is unsure, and the best assignment of actions to them;
        the full recipes sum the probabilities of interchangeable actions first.

        Args:
            pictures: uint8 (V, H, W, 3) of one piece of work, or a batch (M, V, H, W, 3).

        Returns:
            int64 (M, T) for a batch, (T,) for one: indices into the actions of the training; -1 after the last step.
        """
        batch, single = as_picture_batch(pictures)
        weights = self._weights.for_pictures(batch.shape[1:])
        config = weights.network.config
        classes = weights.classes if self.recipe.train.sum_classes else ()
        found = [np.empty((0, config.n_steps), dtype=np.int64)]
        for logits in self._logits(weights, batch):
            if self.recipe.predicts == "independent":
                found.append(_likeliest_by_step(logits))
                continue
            length = weights.network.log_length(logits)
            table = weights.network.log_prob(logits).cpu().numpy()
            found.append(decoded(table, classes, log_length=None if length is None else length.cpu().numpy()))
        orders = np.concatenate(found)
        return orders[0] if single else orders

    def scores(self, problems: Sequence[Problem]) -> list[OrderScores]:
        """One `OrderScores` a problem, columns in the order of its actions; problems are read in batches.

        A problem with fewer actions than the network knows (a partial start) gets the last steps and its columns.

        Raises:
            InputError: a problem has no pictures, pictures of another shape, or actions that the network does not know.
        """
        groups: dict[Weights, list[int]] = {}
        pictures: list[NDArray[np.uint8]] = []
        for k, problem in enumerate(problems):
            observation = problem.observation
            if observation is None:
                raise InputError(
                    f"Expected pictures of the problem {problem.name!r}, from which this prior reads; it has none. "
                    "Give it some (problem.with_pictures), or plan with prior=None."
                )
            weights = self._weights.for_problem(problem)
            pictures.append(weights.checked(np.asarray(observation)))
            groups.setdefault(weights, []).append(k)
        found: dict[int, OrderScores] = {}
        for weights, index in groups.items():
            for k, scores in zip(index, self._read(weights, np.stack([pictures[k] for k in index]))):
                left = scores.restricted(problems[k].actions)
                found[k] = OrderScores(left.log_prob, left.actions, left.log_length, tuple(problems[k].classes))
        return [found[k] for k in range(len(problems))]

    def fit(
        self,
        demonstrations: Demonstrations,
        *,
        seed: int = 0,
        epochs: int | None = None,
        device: str | None = None,
        progress: Callable[[FitProgress], None] | None = None,
        checkpoint: str | Path | None = None,
        resume: bool = True,
        config: TrainConfig | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> Self:
        """Train a network on demonstrations; this prior then reads with it. Returns itself.

        Args:
            seed: the same seed gives the same weights, on the CPU with the same number of threads.
            epochs: None takes the recipe's; a number is taken as it is.
            device: where to train, and to read afterwards; None is this prior's.
            progress: called after each epoch.
            checkpoint: file that keeps the state of the run; see `learned_priors.training.fit`.
            resume: go on from the checkpoint if it is there.
            config: instead of the recipe's `TrainConfig`.
            settings: fields of the `TrainConfig` to change, ``{"epochs": 25, "rate": 4e-3}``; `epochs` goes before.
        """
        if device is not None:
            self.device = self._weights.device = _checked_device(device)
        network, train = self.recipe.configured(
            demonstrations, encoder=self.encoder or "small", epochs=epochs, config=config, settings=settings
        )
        fitted = fit(
            demonstrations,
            network,
            train,
            seed=seed,
            device=str(self.device),
            progress=progress,
            checkpoint=Path(checkpoint) if checkpoint else None,
            resume=resume,
        )
        header: dict[str, Any] = {
            "prior": self.recipe.name,
            "domain": demonstrations.domain,
            "actions": list(demonstrations.actions),
            "training": fitted.figures,
        }
        if demonstrations.classes:
            header["classes"] = list(demonstrations.classes)
        self._weights.own = Weights(fitted.network, header)
        return self

    def save(self, path: str | Path, *, notes: Mapping[str, Any] | None = None) -> Path:
        """Write the weights and their header to a ``.safetensors`` file (whole or not at all); returns its path.

        Args:
            notes: kept in the header under ``"demonstrations"``: where they came from (split, pictures, seed).
        """
        own = self._weights.own
        if own is None:
            raise InputError("Expected a prior that was trained, or given weights; this one has none. Call fit first.")
        header = {**own.header, "demonstrations": dict(notes)} if notes else own.header
        save_network(Path(path), own.network, header)
        return Path(path)

    def _read(self, weights: Weights, batch: NDArray[np.uint8]) -> list[OrderScores]:
        network, actions, classes = weights.network, tuple(weights.header["actions"]), weights.classes
        found: list[OrderScores] = []
        for logits in self._logits(weights, batch):
            tables = network.log_prob(logits).cpu().numpy()
            length = network.log_length(logits)
            lengths = [None] * len(tables) if length is None else length.cpu().numpy()
            found += [OrderScores(table, actions, n, classes) for table, n in zip(tables, lengths)]
        return found

    def _logits(self, weights: Weights, batch: NDArray[np.uint8]) -> Iterator[Logits]:
        """What the network says of the pictures, chunk by chunk."""
        if len(batch):
            weights.checked(batch[0])
        for start in range(0, len(batch), CHUNK):
            with torch.inference_mode():
                pictures = torch.from_numpy(np.ascontiguousarray(batch[start : start + CHUNK])).to(self.device)
                logits: Logits = weights.network(weights.network.prepare(pictures))
            yield logits


def _likeliest_by_step(logits: Logits) -> NDArray[np.int64]:
    """Each step by itself: int64 (B, T), -1 from the first step on whose likeliest choice is to stop."""
    steps, actions = logits.order.shape[1:]
    if logits.length is not None:
        ended = torch.arange(steps, device=logits.order.device) >= logits.length.argmax(dim=-1, keepdim=True)
        choice = logits.order.argmax(dim=-1)
    else:
        stop = [] if logits.stop is None else [logits.stop[..., None]]
        choice = torch.cat([logits.order, *stop], dim=-1).argmax(dim=-1)
        ended = (choice == actions).cumsum(dim=-1) > 0
    order: NDArray[np.int64] = choice.masked_fill(ended, -1).cpu().numpy()
    return order


def _checked_device(name: str) -> torch.device:
    try:
        device = torch.device(name)
    except RuntimeError:
        raise InputError(f"Expected a device, 'cpu' or 'cuda'; got {name!r}.") from None
    if device.type == "cuda" and not torch.cuda.is_available():
        raise InputError("Expected a CUDA device, as asked for; torch finds none. Use device='cpu'.")
    return device
