"""The Sinkhorn operator, for training and for reading.

S(X) alternates row and column normalisation of exp(X) until both sum to one: "the permutation analogue of a
softmax" (Burke, Subr, Ramamoorthy, RA-L 2021, eqs. 3 to 5; Mena, Belanger, Linderman, Snoek, ICLR 2018,
arXiv:1802.08665). It runs here on logarithms, so that no spread of the logits under- or overflows, and ends on
ROWS: a row is a distribution over actions at one step, which is what the losses and planners read. (A row
likelihood taken after a last column normalisation is not bounded below.)
"""

from __future__ import annotations

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

#: Sums of rows and columns may be off by this much: far below what changes an order, and reached within some tens
#: of iterations on trained logits.
TOLERANCE = 1e-3

#: Two nearly tied orders converge as 1/iterations, so the tolerance is met within a few thousand in the worst case
#: (seen: 3,500 at 30 x 30 and a spread of 1,000).
MAX_ITERATIONS = 10_000


#: `scaled_sinkhorn` alternates rows and columns so often before it turns to Newton's method, which is for fewer rows
#: than this, since its work grows with their cube; it takes at most so many steps, and stops at this relative error.
SINKHORN_FIRST, NEWTON_ROWS, NEWTON_STEPS, NEWTON_EXACT = 12, 64, 100, 1e-7

#: Widest spread of logits that `scaled_sinkhorn` takes: its scales reach the exponential of about twice as much.
SAFE_SPREAD = 150.0


def log_sinkhorn(
    logits: Tensor, *, tolerance: float | None = TOLERANCE, max_iterations: int = MAX_ITERATIONS
) -> Tensor:
    """log S(X), differentiable.

    With potentials u (rows) and v (columns), starting from v = 0, it iterates

        u_i = log sum_j exp(X_ij - v_j)        v_j = log sum_i exp(X_ij - u_i)

    and returns X - u - v right after a row update. The sum of column j is then exp(v'_j - v_j), where v' is the
    next column update: the stopping test costs nothing extra.

    With fewer steps than actions (T < N), a slack row of constant logits and mass N - T takes the actions that are
    not used: rows sum to one, columns to at most one.

    Each matrix of a batch stops on its own, so its result does not depend on its neighbours.

    Args:
        logits: floating point, shape (..., T, N) with T <= N; finite.
        tolerance: largest |column sum - 1| to stop at; None runs exactly `max_iterations` (in training, where the
            length of the graph should not depend on the data).
        max_iterations: most column updates.

    Returns:
        log P, shape (..., T, N), in the dtype of `logits`; rows of exp() sum to one.
    """
    steps, actions = logits.shape[-2:]
    if steps > actions:
        raise ValueError(f"Expected at most as many steps as actions; got logits of shape {tuple(logits.shape)}.")
    x, row_mass = logits, None
    if steps < actions:
        x = torch.cat([logits, torch.zeros_like(logits[..., :1, :])], dim=-2)
        row_mass = logits.new_zeros(steps + 1, 1)
        row_mass[-1] = math.log(actions - steps)
    v = torch.zeros_like(x[..., :1, :])
    u = _row_potentials(x, v, row_mass)
    for _ in range(max_iterations):
        v_next = torch.logsumexp(x - u, dim=-2, keepdim=True)
        if tolerance is not None:
            with torch.no_grad():
                off = torch.expm1(v_next - v).abs().amax(dim=(-2, -1), keepdim=True) > tolerance
                if not bool(off.any()):
                    break
            v_next = torch.where(off, v_next, v)
        v = v_next
        u = _row_potentials(x, v, row_mass)
    return (x - u - v)[..., :steps, :]


def _row_potentials(x: Tensor, v: Tensor, row_mass: Tensor | None) -> Tensor:
    u = torch.logsumexp(x - v, dim=-1, keepdim=True)
    return u if row_mass is None else u - row_mass


def scaled_sinkhorn(
    logits: NDArray[np.float64], *, tolerance: float | None = TOLERANCE, max_iterations: int = MAX_ITERATIONS
) -> NDArray[np.float64]:
    """`log_sinkhorn` for reading: the same matrix, without gradients, several to a hundred times faster.

    It scales the rows and columns of exp(X) (Sinkhorn and Knopp, 1967) instead of adding to logarithms, so that an
    iteration is two products of a matrix and a vector. What takes more than a few iterations (many more actions than
    steps, nearly tied orders) goes on by Newton's method, see `_balanced`. Logits of a spread that exp() does not bear
    go to `log_sinkhorn`.

    Args:
        logits: float64 (B, T, N) with T <= N; finite.
        tolerance: None runs exactly `max_iterations`.
    """
    steps, actions = logits.shape[-2:]
    spread = np.ptp(logits, axis=(-2, -1)).max(initial=0.0)
    small = steps < NEWTON_ROWS and tolerance is not None
    # With a slack row, whose entries are one, no column can vanish.
    safe = spread < (SAFE_SPREAD if steps == actions else 2 * SAFE_SPREAD)
    if (not safe and not small) or steps > actions:
        exact = log_sinkhorn(torch.from_numpy(logits), tolerance=tolerance, max_iterations=max_iterations)
        answer: NDArray[np.float64] = exact.numpy()
        return answer
    x, mass = logits, np.ones((steps, 1))
    if steps < actions:
        x = np.concatenate([logits, np.zeros_like(logits[:, :1])], axis=1)
        mass = np.append(mass, [[actions - steps]], axis=0)
    x = x - x.max(axis=2, keepdims=True)
    # Potentials: P = exp(x + rows + columns).
    rows, columns = np.zeros((*x.shape[:2], 1)), np.zeros((len(x), 1, actions))
    going = np.arange(len(x))
    if safe:
        most = min(max_iterations, SINKHORN_FIRST) if small else max_iterations
        going = _alternated(x, mass, rows, columns, tolerance, most)
    if small and len(going) and max_iterations > SINKHORN_FIRST:
        rows[going], columns[going] = _balanced(x[going], mass, rows[going])
    found: NDArray[np.float64] = (x + rows + columns)[:, :steps]
    return found


def _alternated(
    x: NDArray[np.float64],
    mass: NDArray[np.float64],
    rows: NDArray[np.float64],
    columns: NDArray[np.float64],
    tolerance: float | None,
    iterations: int,
) -> NDArray[np.int64]:
    """Fill in the potentials after at most so many iterations; returns which matrices miss the tolerance then."""
    within = -1.0 if tolerance is None else tolerance  # nothing is
    table = np.exp(x)
    turned = np.ascontiguousarray(table.swapaxes(1, 2))
    going, down = np.arange(len(x)), np.ones((len(x), x.shape[2], 1))
    for k in range(iterations + 1):
        across = mass / (table @ down)
        sums = turned @ across
        off = np.abs(down * sums - 1)[..., 0].max(axis=1) > within
        if k == iterations or not off.all():
            # Matrices that are done are left out of the work; most are, long before the last.
            rows[going], columns[going] = np.log(across), np.log(down).swapaxes(1, 2)
            going, table, turned, sums = going[off], table[off], turned[off], sums[off]
            if not len(going):
                break
        down = 1 / sums
    return going


def _balanced(
    x: NDArray[np.float64], mass: NDArray[np.float64], rows: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Potentials by Newton's method, where alternating rows and columns would take hundreds of iterations.

    With columns normalised, the rows' potentials u minimise the convex function
    sum_j log sum_i exp(u_i + x_ij) - sum_i m_i u_i, whose gradient is by how much the rows' sums miss their masses
    (the semi-dual of entropic transport; Brauer, Clason, Lorenz, Wirth, arXiv:1710.06635). There are as many unknowns
    as rows, so its Hessian is small. Steps are halved until the function falls. Each matrix goes on until it is exact,
    whatever its neighbours do.

    Args:
        x: float64 (B, R, N).
        mass: float64 (R, 1), what rows are to sum to; columns are to sum to one.
        rows: float64 (B, R, 1), where to start.

    Returns:
        Potentials of rows (B, R, 1), exact at the last, and of columns (B, 1, N).
    """
    u, n_rows = rows.copy(), x.shape[1]
    # Adding a number to all of u changes nothing; this makes the Hessian regular without changing its other directions.
    gauge = np.full((n_rows, n_rows), 1 / n_rows)
    diagonal = np.arange(n_rows)

    def columns_of(u: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        joint = u + x
        top = joint.max(axis=1, keepdims=True)
        found: NDArray[np.float64] = top + np.log(np.exp(joint - top).sum(axis=1, keepdims=True))
        return found

    going, own, here, log_sums = np.arange(len(x)), x, u, columns_of(u, x)
    for _ in range(NEWTON_STEPS):
        share = np.exp(here + own - log_sums)
        sums = share.sum(axis=2, keepdims=True)
        miss = sums - mass
        left = np.abs(miss / mass).max(axis=(1, 2)) > NEWTON_EXACT
        if not left.all():
            going, own, here, log_sums = going[left], own[left], here[left], log_sums[left]
            share, sums, miss = share[left], sums[left], miss[left]
            if not len(going):
                break
        hessian = gauge - share @ share.swapaxes(1, 2)
        hessian[:, diagonal, diagonal] += sums[..., 0] + 1e-13 * mass[:, 0]
        step = -np.linalg.solve(hessian, miss)
        known = log_sums.sum(axis=(1, 2)) - (here * mass).sum(axis=(1, 2))
        slope = (step * miss).sum(axis=(1, 2))
        length = np.ones(len(going))
        for _ in range(40):
            tried = here + length[:, None, None] * step
            sums_there = columns_of(tried, own)
            value = sums_there.sum(axis=(1, 2)) - (tried * mass).sum(axis=(1, 2))
            good = value <= known + 1e-4 * length * slope + 1e-14 * np.abs(known)
            if good.all():
                break
            length = np.where(good, length, length / 2)
        middle = tried.mean(axis=1, keepdims=True)
        here, log_sums = tried - middle, sums_there - middle
        u[going] = here
    columns = -columns_of(u, x)
    joint = x + columns
    top = joint.max(axis=2, keepdims=True)
    return np.log(mass) - top - np.log(np.exp(joint - top).sum(axis=2, keepdims=True)), columns


def gumbel_sinkhorn(
    logits: Tensor,
    *,
    samples: int = 5,
    temperature: float = 1.0,
    noise: float = 1.0,
    iterations: int = 20,
    generator: torch.Generator | None = None,
) -> Tensor:
    """Samples of log S((X + noise * G) / temperature), G independent standard Gumbel (Mena et al. 2018, Sec. 3).

    Args:
        logits: (..., T, N).
        samples: how many; the paper's models use five.
        temperature: tau; towards 0 the samples become permutations.
        noise: factor on the Gumbel noise; 0 makes every sample the same.
        iterations: column updates, a fixed number.
        generator: source of the noise; None is torch's global one.

    Returns:
        (samples, ..., T, N), log-probabilities by row.
    """
    shape = (samples, *logits.shape)
    uniform = torch.rand(shape, generator=generator, dtype=logits.dtype, device=logits.device)
    tiny = torch.finfo(logits.dtype).tiny
    gumbel = -torch.log(-torch.log(uniform.clamp(tiny, 1 - torch.finfo(logits.dtype).eps)))
    return log_sinkhorn((logits + noise * gumbel) / temperature, tolerance=None, max_iterations=iterations)
