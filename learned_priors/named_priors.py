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

bc_published = partial(NetworkPrior, "bc-published")
"""BC as its code was published: cross-entropy of a softmax of the softmax, each step read as round(sum p id).

The loss hardly falls once an action is a little likelier than others, and the mean number of two blocks that look alike
is right only where they are numbered as neighbours.
"""

bc_published_hungarian = partial(NetworkPrior, "bc-published+hungarian")
"""BC+Hungarian as published: the same network, each action assigned at most once, at the cost 1 - p."""

tcn_published = partial(NetworkPrior, "tcn-published")
"""BC+TCN as published: loss and reading as of ``bc-published``, and a temporal network whose channels are the steps.

It convolves over latent dimensions, not over time. Where orders may end early it has N + 1 rows and N + 1 classes, and
nearly all that it learns is to stop: with many actions the few rows that are read hardly count.
"""

tcn_published_hungarian = partial(NetworkPrior, "tcn-published+hungarian")
"""BC+TCN+Hungarian as published: the same network, each action assigned at most once, at the cost 1 - p."""

sinkhorn_published = partial(NetworkPrior, "sinkhorn-published")
"""BC+Sinkhorn as its towers' code was published: a_o are integers, so each step's expected number is compared.

Blocks of one colour have neighbouring numbers there. So the loss tells which blocks are nearly alike; numbered apart,
it reads hardly any tower. The paper's text has one-hot vectors, ``sinkhorn-paper``.
"""
