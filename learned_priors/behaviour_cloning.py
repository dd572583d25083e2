"""Behaviour cloning: an encoder and a dense layer, each step classified by itself.

Burke et al. (RA-L 2021), Sec. III-B, eq. 1. Nothing keeps it from naming an action twice; the Hungarian algorithm
repairs that afterwards (BC+Hungarian). Both are one network, read in two ways.
"""

from __future__ import annotations

from pathlib import Path

from learned_priors.network_prior import NetworkPrior


def bc(
    *,
    weights: str | Path | None = None,
    domain: str | None = None,
    encoder: str | None = None,
    device: str = "cpu",
) -> NetworkPrior:
    """The paper's BC: `predict` takes the likeliest action of each step, so it may use one twice.

    Arguments as for `learned_priors.sinkhorn.sinkhorn`.
    """
    return NetworkPrior("bc", weights=weights, domain=domain, encoder=encoder, device=device)


def bc_hungarian(
    *,
    weights: str | Path | None = None,
    domain: str | None = None,
    encoder: str | None = None,
    device: str = "cpu",
) -> NetworkPrior:
    """The paper's BC+Hungarian: the same network, `predict` assigns each action at most once.

    Arguments as for `learned_priors.sinkhorn.sinkhorn`; it also reads weights that were trained as `bc`.
    """
    return NetworkPrior("bc+hungarian", weights=weights, domain=domain, encoder=encoder, device=device)
