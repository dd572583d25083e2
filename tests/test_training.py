"""Training: it learns, resumes bitwise, leaves global generators alone, refuses what is not its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import neurosym as ns
from learned_priors.checkpoints import read_tensors, write_tensors
from learned_priors.losses import cross_entropy, loss_of, squared_error, summed_by_class, targets_of
from learned_priors.metrics import step_matches, whole_order_accuracy
from learned_priors.network_prior import NetworkPrior
from learned_priors.networks import Logits
from learned_priors.recipes import RECIPES
from learned_priors.sinkhorn import log_sinkhorn
from learned_priors.training import FitProgress
from neurosym.commands.learn import worth
from neurosym.errors import CheckpointError, InputError, UnknownNameError
from neurosym.language.demonstrations import Demonstrations

COLOURS = np.array([[220, 40, 40], [40, 200, 60], [50, 80, 220], [230, 210, 50]], dtype=np.uint8)
TINY = replace(RECIPES["sinkhorn"].train, epochs=6, least_steps=0, batch=16)


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    """Two threads on a busy machine can be tens of times slower than one."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def stripes(m: int, *, n: int = 4, marginals: bool = True, seed: int = 0, side: int = 8) -> Demonstrations:
    """Each picture shows n stripes of colour; the order of the actions is their order from the top."""
    rng = np.random.default_rng(seed)
    orders = np.stack([rng.permutation(n) for _ in range(m)])
    rows = np.repeat(COLOURS[orders], side // n, axis=1)
    pictures = np.repeat(rows[:, None, :, None], side, axis=3)
    noisy = np.clip(pictures + rng.normal(0, 8, pictures.shape), 0, 255).astype(np.uint8)
    soft = np.eye(n, dtype=np.float32)[orders] if marginals else None
    return Demonstrations(noisy, orders, ("red", "green", "blue", "yellow")[:n], soft, domain="stripes")


def weights_of(prior: NetworkPrior, path: Path) -> bytes:
    from safetensors.torch import load_file

    tensors = load_file(prior.save(path))
    return b"".join(tensors[name].numpy().tobytes() for name in sorted(tensors))


@pytest.mark.parametrize("name", sorted(RECIPES))
def test_every_recipe_learns_stripes(name: str) -> None:
    ours = name in ("sinkhorn", "tcn")
    learn, test = stripes(64, marginals=ours), stripes(32, seed=1)
    # A cross-entropy over a softmax of a softmax learns slowly.
    prior = NetworkPrior(name).fit(learn, epochs=120 if "published" in name else 60)
    right = [s.order() == tuple(o) for s, o in zip(prior.read(test.pictures), test.sequences)]
    assert np.mean(right) > 0.9


def test_an_interrupted_run_ends_where_an_uninterrupted_one_does(tmp_path: Path) -> None:
    learn = stripes(64)
    config = replace(TINY, checkpoint_seconds=0.0, held_out=0.2, keep="best")
    whole = NetworkPrior("sinkhorn").fit(learn, config=config, seed=3)

    def stop(progress: FitProgress) -> None:
        if progress.epoch == 2:
            raise KeyboardInterrupt

    at = tmp_path / "run.safetensors"
    with pytest.raises(KeyboardInterrupt):
        NetworkPrior("sinkhorn").fit(learn, config=config, seed=3, checkpoint=at, progress=stop)
    epochs: list[int] = []
    resumed = NetworkPrior("sinkhorn").fit(
        learn, config=config, seed=3, checkpoint=at, progress=lambda p: epochs.append(p.epoch)
    )
    assert epochs == [3, 4, 5, 6], "the finished epochs are not to be done again"
    assert weights_of(resumed, tmp_path / "a.safetensors") == weights_of(whole, tmp_path / "b.safetensors")


KILLED = """
import sys, torch
torch.set_num_threads(1)
sys.path.insert(0, {tests!r})
from test_training import TINY, NetworkPrior, replace, stripes
config = replace(TINY, epochs=40, checkpoint_seconds=0.0)
NetworkPrior("sinkhorn-paper").fit(stripes(64), config=replace(config, loss="gumbel-sinkhorn"), checkpoint={at!r})
"""


def test_a_run_killed_in_the_middle_of_an_epoch_goes_on(tmp_path: Path) -> None:
    at = tmp_path / "run.safetensors"
    code = KILLED.format(tests=str(Path(__file__).parent), at=str(at))
    child = subprocess.Popen([sys.executable, "-c", code])
    try:
        deadline = time.monotonic() + 60
        while not at.exists() and child.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.1)
    finally:
        os.kill(child.pid, signal.SIGKILL)
        child.wait()
    from neurosym.planning.weights_header import read_header

    state = read_header(at)["state"]
    assert 0 < state["updates"] < 160, "the kill came too early or too late to show anything"
    config = replace(TINY, epochs=40, loss="gumbel-sinkhorn")
    learn = stripes(64)
    resumed = NetworkPrior("sinkhorn-paper").fit(learn, config=config, checkpoint=at)
    whole = NetworkPrior("sinkhorn-paper").fit(learn, config=config)
    assert weights_of(resumed, tmp_path / "a.safetensors") == weights_of(whole, tmp_path / "b.safetensors")


@pytest.mark.parametrize("change", ["seed", "pictures", "config"])
def test_a_checkpoint_of_another_run_is_refused(tmp_path: Path, change: str) -> None:
    at = tmp_path / "run.safetensors"
    NetworkPrior("sinkhorn").fit(stripes(32), config=TINY, checkpoint=at)
    seed = 1 if change == "seed" else 0
    learn = stripes(32, seed=1) if change == "pictures" else stripes(32)
    config = replace(TINY, rate=1e-3) if change == "config" else TINY
    with pytest.raises(CheckpointError, match="resume=False"):
        NetworkPrior("sinkhorn").fit(learn, config=config, seed=seed, checkpoint=at)
    NetworkPrior("sinkhorn").fit(learn, config=config, seed=seed, checkpoint=at, resume=False)


def test_weights_are_no_checkpoint_and_a_checkpoint_is_no_weights(tmp_path: Path) -> None:
    at = tmp_path / "run.safetensors"
    prior = NetworkPrior("sinkhorn").fit(stripes(32), config=TINY, checkpoint=at)
    with pytest.raises(CheckpointError):
        NetworkPrior("sinkhorn", weights=at)
    with pytest.raises(CheckpointError, match="another"):
        NetworkPrior("sinkhorn").fit(stripes(32), config=TINY, checkpoint=prior.save(tmp_path / "w.safetensors"))


def test_global_generators_are_left_alone_and_do_not_matter(tmp_path: Path) -> None:
    torch.manual_seed(1)
    before = torch.get_rng_state()
    one = NetworkPrior("sinkhorn-paper").fit(stripes(32, marginals=False), epochs=3)
    assert torch.equal(torch.get_rng_state(), before)
    torch.manual_seed(2)
    two = NetworkPrior("sinkhorn-paper").fit(stripes(32, marginals=False), epochs=3)
    other = NetworkPrior("sinkhorn-paper").fit(stripes(32, marginals=False), epochs=3, seed=1)
    files = [weights_of(p, tmp_path / f"{i}.safetensors") for i, p in enumerate((one, two, other))]
    assert files[0] == files[1] != files[2]


def test_full_recipe_without_marginals_says_so(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="no marginals"):
        prior = NetworkPrior("sinkhorn").fit(stripes(32, marginals=False), epochs=2)
    assert prior.header["training"]["labels"] == "sequences"
    assert NetworkPrior("sinkhorn").fit(stripes(32), epochs=2).header["training"]["labels"] == "marginals"


def test_held_out_groups_are_whole_and_measured() -> None:
    learn = stripes(60)
    learn = replace(learn, groups=np.arange(60) // 6)
    seen: list[FitProgress] = []
    config = replace(TINY, held_out=0.2)
    prior = NetworkPrior("sinkhorn").fit(learn, config=config, progress=seen.append)
    assert [p.epoch for p in seen] == [1, 2, 3, 4, 5, 6]
    assert all(p.held_out_loss is not None and p.held_out_whole_order_accuracy is not None for p in seen)
    assert seen[-1].train_loss < seen[0].train_loss
    assert prior.header["training"]["held_out"] == 12


def test_patience_stops_early() -> None:
    config = replace(TINY, epochs=200, held_out=0.3, patience=2, schedule="constant", rate=0.02)
    prior = NetworkPrior("sinkhorn").fit(stripes(40), config=config)
    assert prior.header["training"]["epochs"] < 200


def test_a_loss_that_diverges_is_named() -> None:
    config = replace(TINY, loss="rows", rate=1e30, schedule="constant", epochs=50)
    with pytest.raises(InputError, match="learning rate"):
        NetworkPrior("tcn").fit(stripes(32), config=config)


def test_bfloat16_learns_too() -> None:
    learn, test = stripes(64), stripes(32, seed=1)
    prior = NetworkPrior("sinkhorn").fit(learn, config=replace(TINY, epochs=40, precision="bfloat16"))
    right = [s.order() == tuple(o) for s, o in zip(prior.read(test.pictures), test.sequences)]
    assert np.mean(right) > 0.9


def test_variable_lengths_mask_the_steps_not_taken() -> None:
    sequences = torch.tensor([[2, 0, -1], [1, 2, 0]])
    target = targets_of(sequences, 4)
    assert target.sum(-1).tolist() == [[1, 1, 0], [1, 1, 1]]
    logits = torch.randn(2, 3, 4, generator=torch.Generator().manual_seed(0))
    moved = logits.clone()
    moved[0, 2] += torch.tensor([5.0, 0.0, 0.0, 0.0])
    config = replace(TINY, loss="rows")
    assert loss_of(Logits(logits), target, config) == loss_of(Logits(moved), target, config)
    samples = torch.log_softmax(torch.stack([logits, moved]), -1)
    assert squared_error(samples[:1], target) == squared_error(samples[1:], target)


def test_rectangular_heads_learn_from_variable_lengths() -> None:
    learn = stripes(96)
    short = learn.sequences[:, :3].copy()
    short[::3, 2] = -1
    soft = Demonstrations(learn.pictures, short, learn.actions)
    with pytest.warns(UserWarning, match="no marginals"):
        prior = NetworkPrior("sinkhorn").fit(soft, epochs=60)
    scores = prior.read(learn.pictures[1])
    assert scores.log_prob.shape == (3, 4)
    assert scores.order() == tuple(learn.sequences[1, :3])


def test_interchangeable_actions_are_summed() -> None:
    log_prob = torch.log_softmax(torch.randn(2, 3, 3, generator=torch.Generator().manual_seed(0)), -1)
    summed = summed_by_class(log_prob, (5, 1, 5)).exp()
    torch.testing.assert_close(summed[..., 0], log_prob[..., 1].exp())
    torch.testing.assert_close(summed[..., 1], log_prob[..., 0].exp() + log_prob[..., 2].exp())
    one, other = torch.eye(3)[None, [0, 1, 2]], torch.eye(3)[None, [2, 1, 0]]
    classes = (0, 1, 0)
    assert cross_entropy(log_prob[:1], one, classes) == cross_entropy(log_prob[:1], other, classes)
    assert cross_entropy(log_prob[:1], one) != cross_entropy(log_prob[:1], other)
    distinct = cross_entropy(log_prob[:1], one, (2, 0, 1))
    torch.testing.assert_close(distinct, cross_entropy(log_prob[:1], one))


def test_summing_survives_probabilities_that_underflow() -> None:
    log_prob = torch.tensor([[[0.0, -500.0, -501.0]]], requires_grad=True)
    loss = cross_entropy(log_prob, torch.tensor([[[0.0, 1.0, 0.0]]]), (0, 1, 1))
    loss.backward()
    assert torch.isfinite(loss)
    assert log_prob.grad is not None
    assert log_prob.grad[0, 0, 1] < -0.5


def test_classes_of_another_length_are_refused() -> None:
    with pytest.raises(InputError, match="4 classes"):
        NetworkPrior("sinkhorn").fit(stripes(32), config=replace(TINY, classes=(0, 1)))


def test_cross_entropy_is_least_at_the_marginals() -> None:
    target = log_sinkhorn(torch.randn(1, 5, 5, generator=torch.Generator().manual_seed(1)), tolerance=1e-7).exp()
    at = cross_entropy(target.log(), target)
    for seed in range(5):
        other = log_sinkhorn(torch.randn(1, 5, 5, generator=torch.Generator().manual_seed(seed + 2)))
        assert cross_entropy(other, target) > at


def test_metrics_count_whole_orders_and_steps() -> None:
    orders = np.array([[0, 1, 2], [2, 1, 0]])
    tables = np.log(np.eye(3)[orders] * 0.98 + 0.01)
    shown = np.array([[0, 1, 2], [0, 1, 2]])
    assert whole_order_accuracy(tables, shown) == 0.5
    assert whole_order_accuracy(tables, shown, classes=(4, 1, 4)) == 1.0
    assert step_matches(orders, shown).tolist() == [[True] * 3, [False, True, False]]
    assert step_matches(orders, np.array([[0, -1, -1], [0, 1, -1]])).tolist() == [[True] * 3, [False, True, True]]
    possible = np.full((2, 3, 3), 0.5, dtype=np.float32)
    possible[1, 0, 2] = 0.0
    assert whole_order_accuracy(tables, shown, marginals=possible) == 0.5


def test_an_unknown_recipe_is_named() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'sinkhorn'"):
        NetworkPrior("sinkhron")


def test_what_a_prior_saves_is_told_and_one_that_harms_is_warned_of() -> None:
    """Soma under `strict`: the share of orders in which each piece has each step, and the same upside down."""
    problems = [ns.load_domain("soma").problem(n, collapse="strict") for n in (3, 17)]

    class Shares(ns.Prior):
        def __init__(self, backwards: bool) -> None:
            self.backwards = backwards

        def scores(self, problems: Sequence[ns.Problem]) -> list[ns.OrderScores]:
            tables = [np.log(ns.order_marginals(p) + 1e-9) for p in problems]
            return [ns.OrderScores(t[::-1] if self.backwards else t, p.actions) for t, p in zip(tables, problems)]

    good, bad = worth(Shares(False), problems), worth(Shares(True), problems)
    assert good.startswith("On 2 problems kept from training: ")
    assert good.endswith(" saved.")
    assert bad.startswith("Warning: this prior makes planning worse. On 2 problems")


def test_shares_of_orders_sum_to_one_and_know_what_never_comes_first() -> None:
    problem = ns.load_domain("assembly").problem(ns.Assembly.from_cells({"low": [(0, 0, 0)], "high": [(0, 0, 1)]}))
    assert ns.order_marginals(problem).tolist() == [[0.0, 1.0], [1.0, 0.0]]


def test_a_flipped_bit_is_not_trained_on(tmp_path):
    path = tmp_path / "state.safetensors"
    write_tensors(path, {"a": torch.ones(3, 2), "n": torch.tensor(4)}, {"kind": "x"})
    assert read_tensors(path)[0]["n"] == 4
    data = bytearray(path.read_bytes())
    data[-3] ^= 1
    path.write_bytes(data)
    with pytest.raises(ns.CheckpointError, match="--no-resume"):
        read_tensors(path)
