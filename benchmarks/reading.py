"""How long a prior takes to read pictures that are in memory, one thread, small encoder."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics
import time

import numpy as np

import neurosym as ns

soma = ns.load_domain("soma")
pictures = np.stack([soma.problem(n).observation for n in range(16)] * 16)
print("prior            one, ms   256, ms   (medians)")
for name in ("sinkhorn", "tcn", "sinkhorn-paper", "tcn-paper"):
    prior = ns.load_prior(name)
    times = {}
    for batch, repeats in ((pictures[0], 50), (pictures, 10)):
        prior.read(batch)
        found = []
        for _ in range(repeats):
            start = time.perf_counter()
            prior.read(batch)
            found.append(1e3 * (time.perf_counter() - start))
        times[batch.ndim] = statistics.median(found)
    print(f"{name:16} {times[4]:7.2f} {times[5]:9.1f}")
