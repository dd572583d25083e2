"""The priors by name, as entry points declare them: each is a `NetworkPrior` of the recipe of that name.

All take ``weights=FILE`` (None: the bundled ones), ``domain=NAME`` (whose bundled weights), ``encoder=NAME`` (what
`fit` builds) and ``device=``; see `NetworkPrior`. What is in them stands in `learned_priors.recipes`. The paper is
Burke, Subr, Ramamoorthy (RA-L 2021).
"""

from functools import partial

from learned_priors.network_prior import NetworkPrior

sinkhorn = partial(NetworkPrior, "sinkhorn")
"""The full recipe: the share of all valid orders with each action at each step, cross-entropy through Sinkhorn."""

sinkhorn_paper = partial(NetworkPrior, "sinkhorn-paper")
"""The paper's recipe: one demonstration a picture, Gumbel-Sinkhorn with five samples, mean squared error."""

tcn = partial(NetworkPrior, "tcn")
"""The full recipe: the share of all valid orders with each action at each step, cross-entropy by step.

Its network models what follows what, but unlike a permutation it may name an action twice (Fig. 2 and appendix).
"""

tcn_paper = partial(NetworkPrior, "tcn-paper")
"""The paper's BC+TCN: one demonstration a picture, cross-entropy by step; `predict` may use an action twice."""

tcn_paper_hungarian = partial(NetworkPrior, "tcn-paper+hungarian")
"""The paper's BC+TCN+Hungarian: the same network, `predict` assigns each action at most once."""

bc = partial(NetworkPrior, "bc")
"""The paper's BC: `predict` takes the likeliest action of each step, so it may use one twice (Sec. III-B, eq. 1)."""

bc_hungarian = partial(NetworkPrior, "bc+hungarian")
"""The paper's BC+Hungarian: the same network, `predict` assigns each action at most once."""
