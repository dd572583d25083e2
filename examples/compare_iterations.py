"""How many iterations do planners need, with and without a prior, and what does it take to beat guessing?

It shows a comparison from Python: the same runs as `neurosym compare`, as rows and as a figure. A prior of your own
is one method; here one that asks the geometry itself, which a prior that reads pictures must guess: top pieces first.

    python examples/compare_iterations.py [--problems 24] [--prior sinkhorn] [--out iterations.png]
"""

import argparse

import neurosym as ns
from neurosym.experiments.benchmark import Comparison, Outcome, ask_priors, run
from neurosym.experiments.reporting import figure_of, rows
from neurosym.plotting import save


class TallestFirst(ns.Prior):
    """Believes in taking the pieces from the top down."""

    def scores(self, problems):
        found = []
        for problem in problems:
            world = problem.world
            heights = [world.body_bounds[world.owners == world.index[a], 1, 2].mean() for a in problem.actions]
            order = sorted(range(len(heights)), key=lambda i: -heights[i])
            found.append(ns.OrderScores.from_order(order, problem.actions))
        return found


def main(problems: int = 24, priors: tuple[str, ...] = (), out: str | None = None) -> dict[tuple[str, str], float]:
    comparison = Comparison(
        domain="soma",
        numbers=ns.load_domain("soma").numbers("test")[:problems],
        planners=("swap-repair", "backtracking", "best-first"),
        priors=("none", "tallest-first", *priors),
        options={"collapse": "cubes"},
    )
    scores = ask_priors(comparison, loaded={"tallest-first": TallestFirst()})
    runs = run(comparison, scores)

    outcome = Outcome(comparison, runs)
    means = {}
    print(f"{problems} Soma cubes: mean iterations (refusals before the plan)")
    for row in rows(outcome):
        means[row["planner"], row["prior"]] = row["iterations_mean"]
        print(f"  {row['planner']:<13} {row['prior']:<14} {row['iterations_mean']:5.2f}")
    for planner in comparison.planners:
        fewer = means[planner, "tallest-first"] < means[planner, "none"]
        print(f"{planner}: looking at heights {'saves' if fewer else 'does not save'} iterations")
    if out:
        print(f"figure: {save(figure_of(outcome), out)}")
    return means


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--problems", type=int, default=24)
    options.add_argument("--prior", action="append", default=[], help="a name or a weights file; may be repeated")
    options.add_argument("--out", help="write the figure here")
    given = options.parse_args()
    main(given.problems, tuple(given.prior), given.out)
