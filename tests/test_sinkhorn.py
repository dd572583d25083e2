"""The Sinkhorn operator: doubly stochastic, equivariant, differentiable, safe at any spread."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from learned_priors.sinkhorn import TOLERANCE, gumbel_sinkhorn, log_sinkhorn, scaled_sinkhorn


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    """Two threads on a busy machine can be tens of times slower than one."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def logits(n: int, spread: float, seed: int, *, steps: int | None = None, dtype: torch.dtype = torch.float32):
    generator = torch.Generator().manual_seed(seed)
    return torch.rand(steps or n, n, generator=generator, dtype=torch.float64).mul(spread).to(dtype)


def assert_doubly_stochastic(log_p: torch.Tensor) -> None:
    p = log_p.exp()
    assert torch.isfinite(log_p).all()
    torch.testing.assert_close(p.sum(-1), torch.ones_like(p.sum(-1)), atol=TOLERANCE, rtol=0)
    if p.shape[-1] == p.shape[-2]:
        # A float32 at 1,000 resolves 6e-5, which the exponential turns into as much of a column's sum.
        torch.testing.assert_close(p.sum(-2), torch.ones_like(p.sum(-2)), atol=1.5 * TOLERANCE, rtol=0)
    else:
        assert p.sum(-2).max() <= 1 + 1.5 * TOLERANCE


@pytest.mark.parametrize("spread", [0.1, 1.0, 10.0, 100.0, 1000.0])
@pytest.mark.parametrize("n", [1, 2, 7, 30, 98, 200])
def test_rows_and_columns_sum_to_one_in_float32(n: int, spread: float) -> None:
    assert_doubly_stochastic(log_sinkhorn(logits(n, spread, seed=n)))


@pytest.mark.parametrize("spread", [0.1, 1000.0])
def test_a_thousand_actions_in_float32(spread: float) -> None:
    assert_doubly_stochastic(log_sinkhorn(logits(1000, spread, seed=1)))


@settings(max_examples=40, deadline=None)
@given(
    n=st.integers(1, 20),
    spread=st.sampled_from([0.1, 3.0, 30.0, 300.0, 1000.0]),
    seed=st.integers(0, 10**6),
    data=st.data(),
)
def test_any_shape_is_stochastic(n: int, spread: float, seed: int, data: st.DataObject) -> None:
    steps = data.draw(st.integers(1, n))
    assert_doubly_stochastic(log_sinkhorn(logits(n, spread, seed, steps=steps)))


@settings(max_examples=30, deadline=None)
@given(n=st.integers(1, 8), seed=st.integers(0, 10**6))
def test_permuting_the_input_permutes_the_output(n: int, seed: int) -> None:
    x = logits(n, 5.0, seed, dtype=torch.float64)
    rng = np.random.default_rng(seed)
    rows, columns = rng.permutation(n), rng.permutation(n)
    torch.testing.assert_close(log_sinkhorn(x[rows][:, columns]), log_sinkhorn(x)[rows][:, columns])


def test_adding_to_a_row_or_a_column_changes_nothing() -> None:
    x = logits(6, 5.0, 0, dtype=torch.float64)
    moved = x + torch.arange(6.0)[:, None] + 3 * torch.arange(6.0)[None, :]
    torch.testing.assert_close(
        log_sinkhorn(moved, tolerance=1e-12), log_sinkhorn(x, tolerance=1e-12), atol=1e-9, rtol=0
    )


def test_it_ends_on_rows() -> None:
    p = log_sinkhorn(logits(7, 20.0, 1), tolerance=None, max_iterations=2).exp()
    assert (p.sum(-1) - 1).abs().max() < 1e-5
    assert (p.sum(-2) - 1).abs().max() > 1e-3, "two iterations should leave the columns off, else this shows nothing"


def test_fewer_steps_than_actions_is_a_square_problem_with_steps_that_do_not_care() -> None:
    x = logits(5, 4.0, 2, steps=3, dtype=torch.float64)
    square = torch.cat([x, torch.zeros(2, 5, dtype=torch.float64)])
    torch.testing.assert_close(
        log_sinkhorn(x, tolerance=1e-12), log_sinkhorn(square, tolerance=1e-12)[:3], atol=1e-9, rtol=0
    )


def test_more_steps_than_actions_is_refused() -> None:
    with pytest.raises(ValueError, match="at most as many steps"):
        log_sinkhorn(torch.zeros(3, 2))


def test_a_matrix_does_not_depend_on_its_batch() -> None:
    easy, hard = logits(7, 1.0, 3), logits(7, 100.0, 4)
    both = log_sinkhorn(torch.stack([easy, hard]))
    torch.testing.assert_close(both[0], log_sinkhorn(easy), atol=1e-6, rtol=0)
    torch.testing.assert_close(both[1], log_sinkhorn(hard), atol=1e-6, rtol=0)


READ = st.tuples(st.integers(0, 5), st.integers(1, 9), st.sampled_from([0, 1, 4, 90]))


@settings(max_examples=60, deadline=None)
@given(
    shape=READ,
    spread=st.sampled_from([0.1, 3.0, 30.0, 140.0, 160.0, 1000.0]),
    seed=st.integers(0, 10**6),
)
def test_reading_gives_the_operators_matrix(shape: tuple[int, int, int], spread: float, seed: int) -> None:
    """There is one matrix that scales rows and columns of exp(X) and has their sums: this is it."""
    batch, steps, more = shape
    generator = np.random.default_rng(seed)
    # Some easy, some hard, so that they stop at different iterations.
    x = generator.random((batch, steps, steps + more)) * spread * generator.random((batch, 1, 1))
    found = scaled_sinkhorn(x)
    shares = np.exp(found)
    np.testing.assert_allclose(shares.sum(axis=2), 1, atol=1e-9)
    columns = shares.sum(axis=1)
    assert (columns <= 1 + 2 * TOLERANCE).all()
    if not more:
        np.testing.assert_allclose(columns, 1, atol=2 * TOLERANCE)
    # Potentials of rows and columns are all that was added.
    added = found - x
    np.testing.assert_allclose(added - added[:, :1] - added[:, :, :1] + added[:, :1, :1], 0, atol=1e-6)
    if more:  # what a column lacks, the slack row has: a constant before the columns' potentials were added
        lacking = np.maximum(1 - columns, 1e-12)
        sure = lacking > 0.05
        slack = np.log(lacking) - added[:, 0]
        for own, chosen in zip(slack, sure):
            np.testing.assert_allclose(own[chosen], own[chosen].mean() if chosen.any() else 0, atol=0.1)


@settings(max_examples=30, deadline=None)
@given(shape=READ, spread=st.sampled_from([0.1, 3.0, 10.0]), seed=st.integers(0, 10**6))
def test_reading_agrees_with_many_iterations(shape: tuple[int, int, int], spread: float, seed: int) -> None:
    batch, steps, more = shape
    x = np.random.default_rng(seed).random((batch, steps, steps + more)) * spread
    exact = log_sinkhorn(torch.from_numpy(x), tolerance=1e-9, max_iterations=20_000).numpy()
    np.testing.assert_allclose(np.exp(scaled_sinkhorn(x, tolerance=1e-6)), np.exp(exact), atol=1e-5)
    some = log_sinkhorn(torch.from_numpy(x), max_iterations=7).numpy()
    np.testing.assert_allclose(scaled_sinkhorn(x, max_iterations=7), some, atol=1e-8)
    fixed = log_sinkhorn(torch.from_numpy(x), tolerance=None, max_iterations=20).numpy()
    np.testing.assert_allclose(scaled_sinkhorn(x, tolerance=None, max_iterations=20), fixed, atol=1e-8)


@pytest.mark.parametrize("steps", [3, 4])
@pytest.mark.parametrize("tolerance", [None, 1e-6])
def test_gradients_match_finite_differences(steps: int, tolerance: float | None) -> None:
    x = logits(4, 3.0, 5, steps=steps, dtype=torch.float64).requires_grad_()
    iterations = 20 if tolerance is None else 1000

    def operator(x: torch.Tensor) -> torch.Tensor:
        return log_sinkhorn(x, tolerance=tolerance, max_iterations=iterations)

    assert torch.autograd.gradcheck(operator, (x,))


def test_gradients_are_finite_at_a_large_spread() -> None:
    x = logits(10, 1000.0, 6).requires_grad_()
    log_sinkhorn(x, tolerance=None, max_iterations=20).diagonal().sum().backward()
    assert x.grad is not None
    assert torch.isfinite(x.grad).all()


def test_cold_samples_are_permutations_and_the_likeliest_is_the_best_assignment() -> None:
    x = torch.tensor([[3.0, 0.0, 0.0], [0.0, 0.0, 3.0], [0.0, 3.0, 0.0]])
    samples = gumbel_sinkhorn(
        x, samples=200, temperature=0.05, iterations=200, generator=torch.Generator().manual_seed(0)
    ).exp()
    assert samples.shape == (200, 3, 3)
    orders = samples.argmax(-1)
    assert (samples.max(-1).values > 0.9).float().mean() > 0.9
    counts = {p: (orders == torch.tensor(p)).all(-1).sum().item() for p in itertools.permutations(range(3))}
    assert max(counts, key=lambda p: counts[p]) == (0, 2, 1)


def test_without_noise_all_samples_are_the_operator() -> None:
    x = logits(5, 4.0, 7)
    samples = gumbel_sinkhorn(x, samples=3, noise=0.0, iterations=50)
    torch.testing.assert_close(samples, log_sinkhorn(x, tolerance=None, max_iterations=50).expand(3, 5, 5))


def test_samples_follow_their_generator() -> None:
    x = logits(5, 4.0, 8)
    one, same, other = (gumbel_sinkhorn(x, generator=torch.Generator().manual_seed(s)) for s in (1, 1, 2))
    assert torch.equal(one, same)
    assert not torch.equal(one, other)


@pytest.mark.parametrize("spread", [1.0, 30.0, 300.0])
def test_samples_of_few_steps_by_scaling_are_those_in_logarithms(spread):
    """The same values and gradients, also where exp() underflows; float32, as in training."""
    x = (spread * torch.randn(3, 6, 40, generator=torch.Generator().manual_seed(0))).requires_grad_()
    target = torch.eye(40)[:6]

    def gradient(log_prob):
        (own,) = torch.autograd.grad(((log_prob.exp() - target) ** 2).sum(), x)
        return own

    samples = gumbel_sinkhorn(x, samples=2, noise=0.0, iterations=20)
    exact = log_sinkhorn(x, tolerance=None, max_iterations=20).expand(2, -1, -1, -1)
    torch.testing.assert_close(samples.exp(), exact.exp(), rtol=1e-3, atol=1e-5)
    torch.testing.assert_close(gradient(samples), gradient(exact), rtol=1e-2, atol=1e-4)
    torch.testing.assert_close(samples.exp().sum(-1), torch.ones(2, 3, 6))
