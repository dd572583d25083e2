"""The Sinkhorn operator, for training and for reading.

S(X) alternates row and column normalisation of exp(X) until both sum to one: "the permutation analogue of a
softmax" (Burke, Subr, Ramamoorthy, RA-L 2021, eqs. 3 to 5; Mena, Belanger, Linderman, Snoek, ICLR 2018,
arXiv:1802.08665). It runs here on logarithms, so that no spread of the logits under- or overflows, and ends on
ROWS: a row is a distribution over actions at one step, which is what the losses and planners read. (A row
likelihood taken after a last column normalisation is not bounded below.)
"""

import math

import numpy as np
import torch
from torch import Tensor

from neurosym.support.arrays import Array, Numbers

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

#: Largest factor by which a row may be scaled in float32: its square, which a gradient needs, is still a number.
LARGEST_SCALE = 1e19


def log_sinkhorn(
    logits: Tensor, *, tolerance: float | None = TOLERANCE, max_iterations: int = MAX_ITERATIONS
) -> Tensor:
    """log S(X), differentiable.

    With potentials u (rows) and v (columns), starting from v = 0, it iterates

        u_i = log sum_j exp(X_ij - v_j)        v_j = log sum_i exp(X_ij - u_i)

    and returns X - u - v right after a row update. The sum of column j is then exp(v'_j - v_j), where v' is the
    next column update: the stopping test costs nothing extra.

    With fewer steps than actions (T < N), a slack row of constant logits and mass N - T takes the actions that are
    not used: rows sum to one, columns to at most one. Each matrix of a batch stops on its own.

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
    x = logits if steps == actions else torch.cat([logits, torch.zeros_like(logits[..., :1, :])], dim=-2)
    log_mass = x.new_zeros(x.shape[-2], 1)
    if steps < actions:
        log_mass[-1] = math.log(actions - steps)
    v = torch.zeros_like(x[..., :1, :])
    u = torch.logsumexp(x - v, dim=-1, keepdim=True) - log_mass
    for _ in range(max_iterations):
        v_next = torch.logsumexp(x - u, dim=-2, keepdim=True)
        if tolerance is not None:
            with torch.no_grad():
                off = torch.expm1(v_next - v).abs().amax(dim=(-2, -1), keepdim=True) > tolerance
                if not bool(off.any()):
                    break
            v_next = torch.where(off, v_next, v)
        v = v_next
        u = torch.logsumexp(x - v, dim=-1, keepdim=True) - log_mass
    return (x - u - v)[..., :steps, :]


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
        samples: their number; the paper's models use five.
        temperature: tau; towards 0 the samples become permutations.
        noise: factor on the Gumbel noise; 0 makes every sample the same.
        generator: source of the noise; None is torch's global one.

    Returns:
        (samples, ..., T, N), log-probabilities by row.
    """
    shape = (samples, *logits.shape)
    uniform = torch.rand(shape, generator=generator, dtype=logits.dtype, device=logits.device)
    limits = torch.finfo(logits.dtype)
    gumbel = -torch.log(-torch.log(uniform.clamp(limits.tiny, 1 - limits.eps)))
    noisy = (logits + noise * gumbel) / temperature
    steps, actions = logits.shape[-2:]
    if steps < actions and steps**iterations < LARGEST_SCALE:
        return _log_sinkhorn_by_scaling(noisy, iterations)
    return log_sinkhorn(noisy, tolerance=None, max_iterations=iterations)


def _log_sinkhorn_by_scaling(logits: Tensor, iterations: int) -> Tensor:
    """As `log_sinkhorn` with a slack row and a fixed number of iterations, differentiable; 6 times as fast for 6 x 98.

    It scales the rows and columns of exp(X), each row's largest entry being one. No column vanishes beside the slack
    row's ones, and an iteration raises a row's factor at most T times, whatever the logits are.
    """
    steps, actions = logits.shape[-2:]
    x = logits - logits.detach().amax(dim=-1, keepdim=True)
    table = torch.exp(x)
    down = torch.ones_like(table[..., :1, :])
    for _ in range(iterations):
        across = 1 / (table * down).sum(dim=-1, keepdim=True)
        slack = (actions - steps) / down.sum(dim=-1, keepdim=True)
        down = 1 / ((table * across).sum(dim=-2, keepdim=True) + slack)
    # In logarithms the entries that exp() lost are there again.
    return x + down.log() - torch.log((table * down).sum(dim=-1, keepdim=True))


def scaled_sinkhorn(
    logits: Array, *, tolerance: float | None = TOLERANCE, max_iterations: int = MAX_ITERATIONS
) -> Array:
    """`log_sinkhorn` for reading: the same matrix, without gradients, several to a hundred times faster.

    It scales the rows and columns of exp(X) (Sinkhorn and Knopp, 1967), so that an iteration is two products of a
    matrix and a vector. What takes more than a few iterations (many more actions than steps, nearly tied orders) goes
    on by Newton's method, see `_balanced`. Logits of a spread that exp() does not bear go to `log_sinkhorn`.
    Arguments as for that, the logits float64 (B, T, N).
    """
    steps, actions = logits.shape[-2:]
    spread = np.ptp(logits, axis=(-2, -1)).max(initial=0.0)
    small = steps < NEWTON_ROWS and tolerance is not None
    # With a slack row, whose entries are one, no column can vanish.
    safe = spread < (SAFE_SPREAD if steps == actions else 2 * SAFE_SPREAD)
    if (not safe and not small) or steps > actions:
        exact = log_sinkhorn(torch.from_numpy(logits), tolerance=tolerance, max_iterations=max_iterations)
        return np.asarray(exact.numpy(), dtype=np.float64)
    x, mass = logits, np.ones((steps, 1))
    if steps < actions:
        x = np.concatenate([logits, np.zeros_like(logits[:, :1])], axis=1)
        mass = np.append(mass, [[actions - steps]], axis=0)
    x = x - x.max(axis=2, keepdims=True)
    # Potentials: P = exp(x + rows + columns).
    rows, columns = np.zeros((*x.shape[:2], 1)), np.zeros((len(x), 1, actions))
    unfinished = np.arange(len(x))
    if safe:
        iterations = min(max_iterations, SINKHORN_FIRST) if small else max_iterations
        unfinished = _alternated(x, mass, rows, columns, tolerance, iterations)
    if small and len(unfinished) and max_iterations > SINKHORN_FIRST:
        rows[unfinished], columns[unfinished] = _balanced(x[unfinished], mass, rows[unfinished])
    log_prob: Array = (x + rows + columns)[:, :steps]
    return log_prob


def _alternated(
    x: Array, mass: Array, rows: Array, columns: Array, tolerance: float | None, iterations: int
) -> Numbers:
    """Fill in the potentials after at most so many iterations; returns which matrices miss the tolerance then."""
    within = -1.0 if tolerance is None else tolerance  # nothing is
    table = np.exp(x)
    transposed = np.ascontiguousarray(table.swapaxes(1, 2))
    unfinished, down = np.arange(len(x)), np.ones((len(x), x.shape[2], 1))
    for k in range(iterations + 1):
        across = mass / (table @ down)
        sums = transposed @ across
        off = np.abs(down * sums - 1)[..., 0].max(axis=1) > within
        if k == iterations or not off.all():
            # Matrices that are done are left out of the work; most are, long before the last.
            rows[unfinished], columns[unfinished] = np.log(across), np.log(down).swapaxes(1, 2)
            unfinished, table, transposed, sums = unfinished[off], table[off], transposed[off], sums[off]
            if not len(unfinished):
                break
        down = 1 / sums
    return unfinished


def _log_sum(x: Array, axis: int) -> Array:
    """log of the sum of exp(x) along an axis, which is kept."""
    top = x.max(axis=axis, keepdims=True)
    log_sum: Array = top + np.log(np.exp(x - top).sum(axis=axis, keepdims=True))
    return log_sum


def _balanced(x: Array, mass: Array, rows: Array) -> tuple[Array, Array]:
    """Potentials by Newton's method, where alternating rows and columns would take hundreds of iterations.

    With columns normalised, the rows' potentials u minimise the convex function
    sum_j log sum_i exp(u_i + x_ij) - sum_i m_i u_i, whose gradient is by how much the rows' sums miss their masses
    (the semi-dual of entropic transport; Brauer, Clason, Lorenz, Wirth, arXiv:1710.06635). There are as many unknowns
    as rows, so its Hessian is small. Steps are halved until the function falls. Each matrix goes on until it is exact,
    whatever its neighbours do.

    Of x (B, R, N) rows are to sum to `mass` (R, 1), columns to one; `rows` (B, R, 1) is where to start. Returns
    potentials of rows (B, R, 1), exact at the last, and of columns (B, 1, N).
    """
    potentials, n_rows = rows.copy(), x.shape[1]
    # Adding a number to all of u changes nothing; this makes the Hessian regular without changing its other directions.
    gauge = np.full((n_rows, n_rows), 1 / n_rows)
    diagonal = np.arange(n_rows)
    # Of the matrices that are not exact yet: which they are, their x, their u, and the logarithms of their column sums.
    unfinished, part, u, log_sums = np.arange(len(x)), x, potentials, _log_sum(potentials + x, 1)
    for _ in range(NEWTON_STEPS):
        share = np.exp(u + part - log_sums)
        sums = share.sum(axis=2, keepdims=True)
        miss = sums - mass
        off = np.abs(miss / mass).max(axis=(1, 2)) > NEWTON_EXACT
        if not off.all():
            unfinished, part, u, log_sums = unfinished[off], part[off], u[off], log_sums[off]
            share, sums, miss = share[off], sums[off], miss[off]
            if not len(unfinished):
                break
        hessian = gauge - share @ share.swapaxes(1, 2)
        hessian[:, diagonal, diagonal] += sums[..., 0] + 1e-13 * mass[:, 0]
        step = -np.linalg.solve(hessian, miss)
        value = log_sums.sum(axis=(1, 2)) - (u * mass).sum(axis=(1, 2))
        slope = (step * miss).sum(axis=(1, 2))
        length = np.ones(len(unfinished))
        for _ in range(40):
            tried = u + length[:, None, None] * step
            tried_sums = _log_sum(tried + part, 1)
            tried_value = tried_sums.sum(axis=(1, 2)) - (tried * mass).sum(axis=(1, 2))
            falls = tried_value <= value + 1e-4 * length * slope + 1e-14 * np.abs(value)
            if falls.all():
                break
            length = np.where(falls, length, length / 2)
        middle = tried.mean(axis=1, keepdims=True)
        u, log_sums = tried - middle, tried_sums - middle
        potentials[unfinished] = u
    columns = -_log_sum(potentials + x, 1)
    return np.log(mass) - _log_sum(x + columns, 2), columns
