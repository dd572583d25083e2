"""`NetworkPrior`: order scores from pictures, by a network that was trained, or that `fit` trains."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from learned_priors.checkpoints import save_network
from learned_priors.learner import calibrate
from learned_priors.losses import targets_of
from learned_priors.recipes import Recipe, recipe_named
from learned_priors.train_config import TrainConfig
from learned_priors.trained_network import TrainedNetwork
from learned_priors.training import FitProgress, fit
from learned_priors.weight_files import WeightStore
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
    def trained_as(self) -> str:
        """Priors that agree in it read each other's weights."""
        return self.recipe.trained_as

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
        """Order scores from pictures alone, uint8 (V, H, W, 3) of one piece of work, or a batch (M, V, H, W, 3).

        Returns:
            One `OrderScores` for one set of pictures, a list of M for a batch; columns named as in the training.
        """
        batch, single = as_picture_batch(pictures)
        scores = self._weights.for_pictures(batch.shape[1:]).scores(batch)
        return scores[0] if single else scores

    def predict(self, pictures: ArrayLike, *, lengths: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
        """The model's own order, as the paper compares it; unlike one of `OrderScores`, it may be wrong by itself.

        Plain ``bc`` and ``tcn-paper`` take the likeliest action of each step, so the same one may come twice; those as
        published read a number (`learned_priors.recipes`). All others take the likeliest number of steps, if that is
        unsure, and the best assignment of actions to them; the full recipes sum the probabilities of interchangeable
        actions first.

        Args:
            pictures: as for `read`.
            lengths: int64 (M,), the true numbers of steps, as the published evaluations give them; None reads them.

        Returns:
            int64 (M, T) for a batch, (T,) for one: indices into the actions of the training; -1 after the last step.
        """
        batch, single = as_picture_batch(pictures)
        trained = self._weights.for_pictures(batch.shape[1:])
        sum_classes = self.recipe.train.sum_classes
        orders = trained.orders(batch, predicts=self.recipe.predicts, sum_classes=sum_classes, lengths=lengths)
        return orders[0] if single else orders

    def scores(self, problems: Sequence[Problem]) -> list[OrderScores]:
        """One `OrderScores` a problem, columns in the order of its actions; problems are read in batches.

        A problem with fewer actions than the network knows (a partial start) gets the last steps and its columns.

        Raises:
            InputError: a problem has no pictures, pictures of another shape, or actions that the network does not know.
        """
        groups: dict[TrainedNetwork, list[int]] = {}
        pictures: list[NDArray[np.uint8]] = []
        for k, problem in enumerate(problems):
            if problem.observation is None:
                raise InputError(
                    f"Expected pictures of the problem {problem.name!r}, from which this prior reads; it has none. "
                    "Give it some (problem.with_pictures), or plan with prior=None."
                )
            trained = self._weights.for_problem(problem)
            pictures.append(trained.checked(np.asarray(problem.observation)))
            groups.setdefault(trained, []).append(k)
        answers: dict[int, OrderScores] = {}
        for trained, index in groups.items():
            for k, scores in zip(index, trained.scores(np.stack([pictures[k] for k in index]))):
                left = scores.restricted(problems[k].actions)
                answers[k] = OrderScores(left.log_prob, left.actions, left.log_length, tuple(problems[k].classes))
        return [answers[k] for k in range(len(problems))]

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
        start: str | Path | None = None,
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
                Besides, ``"head"`` and ``"width"`` of the network.
            start: weights of this recipe, of the same actions, to go on from instead of chance ones.
        """
        if device is not None:
            self.device = self._weights.device = _checked_device(device)
        given, train = self.recipe.configured(
            demonstrations, encoder=self.encoder or "small", epochs=epochs, config=config, settings=settings
        )
        kept = Path(checkpoint) if checkpoint else None
        known = self._weights.load(Path(start)) if start else None
        actions = list(demonstrations.actions)
        if known and (known.header["actions"], known.network.config.shape) != (actions, given.shape):
            raise InputError(f"Expected weights of the same network and actions to start from; {start} has others.")
        network, figures = fit(
            demonstrations,
            given,
            train,
            seed=seed,
            device=self.device,
            progress=progress,
            checkpoint=kept,
            resume=resume,
            start=known.network if known else None,
        )
        header = {
            "prior": self.recipe.name,
            "domain": demonstrations.domain,
            "actions": list(demonstrations.actions),
            "network": network.config.to_json(),
            "training": figures,
        }
        classes = {"classes": list(demonstrations.classes)} if demonstrations.classes else {}
        self._weights.own = TrainedNetwork(network, {**header, **classes})
        return self

    def calibrate(self, demonstrations: Demonstrations) -> Self:
        """Set how sure the scores are by demonstrations that were not learned from. Returns itself.

        The logits are divided by the temperature of the least cross-entropy (Guo et al., ICML 2017); which order is the
        likeliest hardly changes. The temperature is in the header that `save` writes.
        """
        own = self._weights.own
        if own is None:
            raise InputError("Expected a prior that was trained, or given weights; this one has none. Call fit first.")
        marginals = None if demonstrations.marginals is None else torch.from_numpy(demonstrations.marginals)
        target = targets_of(torch.from_numpy(demonstrations.sequences), own.network.config.n_actions, marginals)
        calibrate(own.network, demonstrations.pictures, target.to(self.device), own.classes)
        header = {**own.header, "network": own.network.config.to_json()}
        self._weights.own = TrainedNetwork(own.network, header)
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


def _checked_device(name: str) -> torch.device:
    try:
        device = torch.device(name)
    except RuntimeError:
        raise InputError(f"Expected a device, 'cpu' or 'cuda'; got {name!r}.") from None
    if device.type == "cuda" and not torch.cuda.is_available():
        raise InputError("Expected a CUDA device, as asked for; torch finds none. Use device='cpu'.")
    return device
