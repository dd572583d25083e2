"""Where a network prior has its weights from: trained here, a file, or one of those that come with the package.

These are named ``{domain}-{prior}.safetensors``, or ``{domain}-{kind}-{prior}`` where one network does not serve all of
a domain's problems; their headers say the rest.
"""

from collections.abc import Collection
from functools import cached_property
from pathlib import Path
from typing import Any

import torch

from learned_priors.checkpoints import load_network
from learned_priors.recipes import RECIPES, Recipe
from learned_priors.trained_network import TrainedNetwork
from neurosym.errors import CheckpointError, InputError
from neurosym.language.problem import Problem
from neurosym.planning.weights_header import read_header

FOLDER = Path(__file__).parent / "weights"


class WeightStore:
    """Finds the network of a recipe that answers for a problem or for pictures; each file is loaded once.

    With a domain, its bundled weights answer; with an encoder, files of another are refused.
    """

    def __init__(self, recipe: Recipe, domain: str | None, encoder: str | None, device: torch.device) -> None:
        self.recipe, self.domain, self.encoder, self.device = recipe, domain, encoder, device
        #: Trained here, or from a file that was named: it answers for everything.
        self.own: TrainedNetwork | None = None
        self._loaded: dict[str, TrainedNetwork] = {}
        self._ending = f"-{recipe.trained_as}.safetensors"

    def load(self, path: Path) -> TrainedNetwork:
        """The network of a file. Raises `CheckpointError` if it is damaged, or of another recipe or encoder."""
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
        return TrainedNetwork(network.to(self.device), {**header, "prior": self.recipe.name})

    def for_problem(self, problem: Problem) -> TrainedNetwork:
        """The one that knows the problem's actions: of its family if that has any, otherwise of any."""
        if self.own:
            return self.own
        family, actions = problem.family, problem.actions
        of_family = {name for name, header in self._headers.items() if header.get("domain") == family}
        fit = {name for name, header in self._headers.items() if set(actions) <= set(header.get("actions", ()))}
        # The family's only file answers even where it does not know the actions: it then says which it knows.
        names = fit & of_family or (of_family if len(of_family) == 1 else fit)
        return self._bundled(names, f"a problem of the family {family!r} with the actions {', '.join(actions)}")

    def for_pictures(self, shape: tuple[int, ...]) -> TrainedNetwork:
        """The only one for pictures of that shape (V, H, W, 3)."""
        if self.own:
            return self.own
        networks = {name: header.get("network") for name, header in self._headers.items()}
        fit = [n for n, given in networks.items() if isinstance(given, dict) and given.get("picture_shape") == [*shape]]
        return self._bundled(fit, f"pictures of shape {shape}")

    @cached_property
    def _headers(self) -> dict[str, dict[str, Any]]:
        """Of the bundled files: the name of a domain, or of one kind of its problems -> header."""
        headers = {path: read_header(path) for path in sorted(FOLDER.glob(f"*{self._ending}"))}
        # A prior's name may end in another's: the header says which it is.
        own = {path: header for path, header in headers.items() if header.get("prior") == self.recipe.trained_as}
        return {path.name.removesuffix(self._ending): header for path, header in own.items()}

    def _bundled(self, names: Collection[str], what: str) -> TrainedNetwork:
        if self.domain is not None:
            names, what = {self.domain} & self._headers.keys(), f"the domain {self.domain!r}"
        listed = ", ".join(sorted(names or self._headers)) or "nothing"
        if len(names) > 1:
            raise InputError(f"Expected one set of bundled weights for {what}; got several: {listed}. Say domain=NAME.")
        if not names:
            raise InputError(
                f"Expected bundled weights of the prior {self.recipe.trained_as!r} for {what}; there are some for: "
                f"{listed}. Train your own (`neurosym train`, or fit), and give weights=FILE."
            )
        (name,) = names
        if name not in self._loaded:
            self._loaded[name] = self.load(FOLDER / f"{name}{self._ending}")
        return self._loaded[name]
