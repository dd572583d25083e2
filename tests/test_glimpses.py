"""The head that looks at one place a step: what it reads it reads at any step, also in orders it never saw."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import torch

from learned_priors.encoders import build_encoder
from learned_priors.network_prior import NetworkPrior
from learned_priors.networks import NetworkConfig, OrderNetwork
from neurosym.language.demonstrations import Demonstrations
from neurosym.planning.weights_header import read_header
from neurosym.registry import load_prior

#: Five colours that a picture shows from the bottom up, each somewhere else every time.
COLOURS = np.array([[230, 60, 60], [60, 200, 60], [70, 70, 230], [230, 220, 60], [60, 220, 220]])


def stacks(orders: list[tuple[int, ...]], seed: int) -> Demonstrations:
    """Pictures of 32 x 32: each order is a stack of five bars, shifted and of noisy colours."""
    rng = np.random.default_rng(seed)
    pictures = np.zeros((len(orders), 1, 32, 32, 3))
    for picture, order in zip(pictures[:, 0], orders):
        low, left = 31 - rng.integers(0, 4), rng.integers(4, 14)
        for level, kind in enumerate(order):
            top = low - 5 * (level + 1)
            picture[top : top + 5, left : left + 12] = COLOURS[kind] * rng.uniform(0.8, 1.1)
    noisy = np.clip(pictures + rng.normal(0, 8, pictures.shape), 0, 255).astype(np.uint8)
    return Demonstrations(noisy, np.array(orders), tuple("abcde"), groups=np.arange(len(orders)), domain="bars")


def test_orders_never_seen_are_read_as_well_as_those_that_were() -> None:
    every = list(itertools.permutations(range(5)))
    chosen = np.random.default_rng(0).permutation(len(every))
    learn, rest = stacks([every[i] for i in chosen[:40]], 1), stacks([every[i] for i in chosen[40:]], 2)
    prior = load_prior("sinkhorn")
    assert isinstance(prior, NetworkPrior)
    with pytest.warns(UserWarning, match="marginals"):
        prior.fit(learn, seed=0, settings={"least_steps": 700})
    right = (prior.predict(rest.pictures) == rest.sequences).all(axis=1).mean()
    assert right > 0.9


@pytest.mark.parametrize("encoder", ["small", "paper", "resnet18"])
@pytest.mark.parametrize("views", [1, 3])
def test_every_encoder_shows_its_places(encoder: str, views: int) -> None:
    made = build_encoder(encoder, (views, 64, 64, 3))
    pictures = torch.zeros(2, views, 64, 64, 3, dtype=torch.uint8)
    pictures[1, views - 1, :32, :, 0] = 255  # the upper half of one view is red
    places = made.places(made.prepare(pictures))
    assert places.shape == (2, *made.places_shape)
    half = made.places_shape[1] // 2
    assert (places[1, -1, :half, :, 0] == 1).all()
    assert (places[1, -1, half:] == -1).all()
    assert (places[0] == -1).all()
    assert views == 1 or (places[1, 0] == -1).all()


@pytest.mark.parametrize("views", [1, 3])
def test_what_is_seen_does_not_depend_on_where(views: int) -> None:
    """If the glimpses stay, moving what they look at moves what is read, and nothing else decides."""
    config = NetworkConfig("small", "glimpses", "sinkhorn", (views, 64, 64, 3), 3, 4, 16)
    torch.manual_seed(0)
    network = OrderNetwork(config).eval()
    torch.nn.init.zeros_(network.head.where.weight)  # type: ignore[union-attr, arg-type]
    bias = network.head.where.bias  # type: ignore[union-attr]
    sizes = torch.tensor([views, 16, 16])
    with torch.no_grad():
        looks = torch.full((3, 4, int(sizes.sum())), -50.0)
        # Step i looks at row 5 i, column 2 of the last view.
        looks[:, :, views - 1] = looks[:, :, views + 16 + 2] = 50.0
        for step in range(3):
            looks[step, :, views + 5 * step] = 50.0
        bias.copy_(looks.flatten())  # type: ignore[union-attr, operator]
    pictures = torch.randint(0, 255, (1, views, 64, 64, 3), dtype=torch.uint8)
    moved = pictures.clone()
    moved[:, -1, 20:24, 8:12] = pictures[:, -1, 0:4, 8:12]  # place (5, 2) shows what (0, 2) shows
    with torch.no_grad():
        before, after = (network(network.prepare(p)).order for p in (pictures, moved))
    torch.testing.assert_close(after[:, 1], before[:, 0])
    torch.testing.assert_close(after[:, [0, 2]], before[:, [0, 2]])


def test_several_views_and_strips_keep_their_heads(tmp_path: Path) -> None:
    """Glimpses are for one square view; Soma's four views and rows of tiles are read as a whole."""
    rng = np.random.default_rng(0)
    for shape, head in (((4, 16, 16), "dense"), ((1, 16, 96), "dense"), ((1, 16, 16), "glimpses")):
        pictures = rng.integers(0, 255, (6, *shape, 3), dtype=np.uint8)
        demos = Demonstrations(
            pictures,
            np.tile(np.arange(3), (6, 1)),
            ("a", "b", "c"),
            marginals=np.tile(np.eye(3, dtype=np.float32), (6, 1, 1)),
        )
        prior = load_prior("sinkhorn")
        assert isinstance(prior, NetworkPrior)
        saved = prior.fit(demos, epochs=1).save(tmp_path / "weights.safetensors")
        assert read_header(saved)["network"]["head"] == head
