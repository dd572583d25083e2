"""Where a network prior has its weights from: trained here, a file, or those that come with the package."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray

from learned_priors import bundled
from learned_priors.checkpoints import load_network
from learned_priors.networks import OrderNetwork
from learned_priors.recipes import RECIPES, Recipe
from neurosym.errors import CheckpointError, InputError

if TYPE_CHECKING:
    from neurosym.language.problem import Problem


@dataclass(frozen=True, eq=False)
class Weights:
    """A network with its header, and the file it came from (None: it was trained here)."""

    network: OrderNetwork
    header: dict[str, Any]
    path: Path | None = None

    @property
    def classes(self) -> tuple[int, ...]:
        """One integer an action; empty where each is its own."""
        return tuple(self.header.get("classes", ()))

    def checked(self, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The pictures of one piece of work, if they are such as the network was trained on."""
        expected = self.network.config.picture_shape
        if pictures.shape != expected or pictures.dtype != np.uint8:
            raise InputError(
                f"Expected pictures as uint8 (V, H, W, 3) = {expected}, as this prior was trained on; "
                f"got {pictures.dtype} {pictures.shape}. Render them alike, or train a prior on yours."
            )
        return pictures


class WeightStore:
    """Finds the weights that answer a question; which file does is looked up once, and loaded once.

    Args:
        recipe: whose weights.
        domain: whose bundled weights to take; None asks each problem.
        encoder: refuse files of another; None takes what they have.
        device: where networks are put.
    """

    def __init__(self, recipe: Recipe, domain: str | None, encoder: str | None, device: torch.device) -> None:
        self.recipe, self.domain, self.encoder, self.device = recipe, domain, encoder, device
        self.own: Weights | None = None
        self._choices: dict[Hashable, Weights] = {}

    def load(self, path: Path) -> Weights:
        """Weights from a file.

        Raises:
            CheckpointError: it is damaged, or of another recipe or encoder.
        """
        network, header = load_network(path)
        trained = RECIPES.get(str(header.get("prior")))
        shared = trained is not None and trained.trained_as == self.recipe.trained_as
        if header.get("prior") != self.recipe.name and not shared:
            raise CheckpointError(
                f"Expected weights of the prior {self.recipe.name!r} in {path}; got those of {header.get('prior')!r}. "
                f"Load them by the file's name: load_prior({str(path)!r})."
            )
        if self.encoder not in (None, network.config.encoder):
            raise CheckpointError(
                f"Expected weights of the encoder {self.encoder!r} in {path}; got {network.config.encoder!r}. "
                "Leave encoder=None to take what the file has."
            )
        # What is saved from here is to be read as this prior reads it.
        return Weights(network.to(self.device), {**header, "prior": self.recipe.name}, path)

    def for_problem(self, problem: Problem) -> Weights:
        """Those that know the problem's actions."""
        family, actions = problem.family, tuple(problem.actions)
        return self._chosen((family, actions), lambda: bundled.for_actions(self.recipe.trained_as, family, actions))

    def for_pictures(self, shape: tuple[int, ...]) -> Weights:
        """Those for pictures of that shape (V, H, W, 3)."""
        return self._chosen(shape, lambda: bundled.for_pictures(self.recipe.trained_as, shape))

    def _chosen(self, question: Hashable, choose: Callable[[], Path]) -> Weights:
        if self.own:
            return self.own
        if question not in self._choices:
            name = self.recipe.trained_as
            path = bundled.for_domain(name, self.domain) if self.domain is not None else choose()
            known = [w for w in self._choices.values() if w.path == path]
            self._choices[question] = known[0] if known else self.load(path)
        return self._choices[question]
