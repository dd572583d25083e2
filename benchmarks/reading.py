"""How long a prior takes to read pictures that are in memory, one thread, small encoder."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics
import time

import numpy as np

import neurosym as ns

#: Domain, options of its problems, and the priors whose bundled weights read them.
READ = (
    ("soma", {}, ("sinkhorn", "tcn", "sinkhorn-paper", "tcn-paper")),
    ("tower", {"variant": "heights", "pictures": "hard"}, ("sinkhorn",)),
    ("tower-unique", {"variant": "unique", "pictures": "hard"}, ("sinkhorn",)),
    ("scrabble", {}, ("sinkhorn",)),
)

print(f"{'pictures':14} {'prior':16} {'one, ms':>8} {'256, ms':>8}   (medians)")
for kind, options, priors in READ:
    family = ns.load_domain(kind.partition("-")[0])
    problems = [family.problem(n, **options) for n in range(32)]
    pictures = np.stack([p.observation for p in family.observed(problems)] * 8)
    for name in priors:
        prior = ns.load_prior(name, domain=kind)
        times = {}
        for batch, repeats in ((pictures[0], 50), (pictures, 10)):
            prior.read(batch)
            found = []
            for _ in range(repeats):
                start = time.perf_counter()
                prior.read(batch)
                found.append(1e3 * (time.perf_counter() - start))
            times[batch.ndim] = statistics.median(found)
        print(f"{kind:14} {name:16} {times[4]:8.2f} {times[5]:8.1f}")
