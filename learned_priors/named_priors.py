"""The priors by name, as entry points declare them: each is a `NetworkPrior` of the recipe of that name.

All take ``weights=FILE`` (None: the bundled ones), ``domain=NAME`` (whose bundled weights), ``encoder=NAME`` (what
`fit` builds) and ``device=``; see `NetworkPrior`. What is in them stands in `learned_priors.recipes`.
"""

from __future__ import annotations

from functools import partial

from learned_priors.network_prior import NetworkPrior

#: Ours: the share of all valid orders with each action at each step, cross-entropy through Sinkhorn.
sinkhorn = partial(NetworkPrior, "sinkhorn")

#: The paper's: one demonstration a picture, Gumbel-Sinkhorn with five samples, mean squared error (RA-L 2021, eq. 7).
sinkhorn_paper = partial(NetworkPrior, "sinkhorn-paper")

#: Ours with a temporal network: shares of valid orders, cross-entropy by step.
tcn = partial(NetworkPrior, "tcn")

#: The paper's BC+TCN (Fig. 2 and appendix): one demonstration a picture, cross-entropy by step. It models what follows
#: what, but unlike a permutation it may name an action twice.
tcn_paper = partial(NetworkPrior, "tcn-paper")

#: BC+TCN+Hungarian: the same network and weights; `predict` assigns each action at most once.
tcn_paper_hungarian = partial(NetworkPrior, "tcn-paper+hungarian")

#: The paper's behaviour cloning (Sec. III-B, eq. 1): an encoder and a dense layer, each step classified by itself.
bc = partial(NetworkPrior, "bc")

#: BC+Hungarian: the same network and weights; `predict` assigns each action at most once.
bc_hungarian = partial(NetworkPrior, "bc+hungarian")
