"""Iterations of each planner on the test cubes, as a ratio to the paper's swap repair, under the bundled priors."""

from __future__ import annotations

from neurosym.experiments.benchmark import NO_PRIOR, OUTERMOST, Comparison, Outcome, run
from neurosym.experiments.engines import cores
from neurosym.experiments.reporting import rows
from neurosym.registry import load_domain

PRIORS = (NO_PRIOR, OUTERMOST, "tcn-paper", "sinkhorn-paper", "tcn", "sinkhorn")
numbers = tuple(load_domain("soma").numbers("test"))
comparison = Comparison("soma", numbers, ("swap-repair", "backtracking", "best-first"), PRIORS, seeds=5)
found = {(r["prior"], r["planner"]): r for r in rows(Outcome(comparison, run(comparison, workers=cores())))}
print("iterations (ratio to swap repair with the same prior), 120 test cubes x 5 seeds")
for prior in PRIORS:
    swap = found[prior, "swap-repair"]["iterations_mean"]
    said = []
    for planner in comparison.planners:
        mean = found[prior, planner]["iterations_mean"]
        said.append(f"{planner} {mean:.3f} ({mean / swap:.2f})" if swap else f"{planner} {mean:.3f}")
    print(f"{prior:16} " + ", ".join(said))
