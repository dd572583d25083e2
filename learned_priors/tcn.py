"""The three priors that decode with a temporal convolutional network (`learned_priors.temporal`).

Burke et al. (RA-L 2021, Fig. 2 and appendix). The network models what follows what, but unlike a permutation it may
name an action twice; the Hungarian algorithm repairs that afterwards (BC+TCN+Hungarian).
"""

from __future__ import annotations

from pathlib import Path

from learned_priors.network_prior import NetworkPrior
from learned_priors.temporal import TemporalDecoder as TemporalDecoder
from learned_priors.temporal import dilations as dilations


def tcn(
    *,
    weights: str | Path | None = None,
    domain: str | None = None,
    encoder: str | None = None,
    device: str = "cpu",
) -> NetworkPrior:
    """The full recipe: the share of all valid orders with each action at each step, cross-entropy by step.

    Arguments as for `learned_priors.sinkhorn.sinkhorn`.
    """
    return NetworkPrior("tcn", weights=weights, domain=domain, encoder=encoder, device=device)


def tcn_paper(
    *,
    weights: str | Path | None = None,
    domain: str | None = None,
    encoder: str | None = None,
    device: str = "cpu",
) -> NetworkPrior:
    """The paper's BC+TCN: one demonstration a picture, cross-entropy by step; `predict` may use an action twice.

    Arguments as for `learned_priors.sinkhorn.sinkhorn`.
    """
    return NetworkPrior("tcn-paper", weights=weights, domain=domain, encoder=encoder, device=device)


def tcn_paper_hungarian(
    *,
    weights: str | Path | None = None,
    domain: str | None = None,
    encoder: str | None = None,
    device: str = "cpu",
) -> NetworkPrior:
    """The paper's BC+TCN+Hungarian: the same network, `predict` assigns each action at most once.

    Arguments as for `learned_priors.sinkhorn.sinkhorn`; it also reads weights that were trained as `tcn-paper`.
    """
    return NetworkPrior("tcn-paper+hungarian", weights=weights, domain=domain, encoder=encoder, device=device)
