"""The paper's Table II: a network looks at a Soma cube and says in which order to take it apart; a planner goes on.

It shows on how many unseen cubes each network's own order fails, and how many iterations planners then need. The same
as `neurosym reproduce soma`; a run that was killed goes on where it was.

    python examples/reproduce_soma.py
"""

from pathlib import Path

from neurosym.experiments.reproduce import Experiment, reproduce, soma_experiment


def main(given: Experiment, out: str = "out/reproduce-soma", **options) -> dict[str, float]:
    records = reproduce(given, Path(out), say=print, **options)
    failures = records[records["metric"] == "initial_failures"].groupby(["method", "pictures"], sort=False)["value"]
    shares = {f"{method}, {pictures} pictures": share for (method, pictures), share in failures.mean().items()}
    for what, share in shares.items():
        print(f"{what}: the first order fails on {100 * share:.1f}% of the cubes")
    print(f"{out}: report.md, results.csv and figures")
    return shares


if __name__ == "__main__":
    main(soma_experiment(), workers=None)  # as many processes as processors
