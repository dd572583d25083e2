"""A new domain from symbols and geometry: unload a balance that tips when the wrong weight goes first.

It shows that a domain is a few lines, and what dead ends do to planners: once both inner weights are gone, neither
outer one can follow. Swap repair, which never takes a step back, gets stuck; complete planners do not, and prove that
a balance which starts like that cannot be unloaded one weight at a time.

    python examples/new_domain.py [--seeds 20]
"""

import argparse

import numpy as np

import neurosym as ns

# -- the definition -------------------------------------------------------------------------------------------
part = ns.Type("part")
weight = ns.Type("weight", part)
present = ns.Fluent("present", part)
stable_without = ns.predicates.stable_without(present)  # friction, contacts and masses: a linear program

w = weight("w")
take = ns.Action("take", w, pre=[present(w), stable_without(w)], eff=[~present(w)], label="{w}", once=True)
BALANCE = ns.Domain("balance", fluents=[present], actions=[take])

#: Each weight is a stack of two cells, so many cells left (-) or right (+) of the post.
PLACES = {"far-left": -4, "near-left": -2, "middle": 0, "near-right": 2, "far-right": 4}


def balance(weights=tuple(PLACES)):
    """A plank on a narrow post, with these weights on it, to be unloaded."""
    cells = {"post": [(0, 0, 0)], "plank": [(x, 0, 1) for x in range(-4, 5)]}
    cells |= {name: [(PLACES[name], 0, 2), (PLACES[name], 0, 3)] for name in weights}
    return BALANCE.problem(
        world=ns.Assembly.from_cells(cells),
        objects={part: ["post", "plank"], weight: weights},
        init=[present(name) for name in cells],
        goal=[~present(name) for name in weights],
    )


# -- what it shows --------------------------------------------------------------------------------------------
def main(seeds: int = 20) -> dict[str, int]:
    problem = balance()
    print(f"{ns.count_plans(problem)} of 120 orders unload the balance.")
    solved = {}
    for planner in ("swap-repair", "backtracking", "best-first"):
        results = [ns.solve(problem, planner=planner, rng=np.random.default_rng(s)) for s in range(seeds)]
        solved[planner] = sum(r.solved for r in results)
        most = max(r.iterations for r in results)
        print(f"{planner:<13} unloads it with {solved[planner]} of {seeds} seeds; at most {most} refusals")
    print("one plan:    ", ", ".join(ns.solve(problem).plan))

    stuck = ns.solve(balance(["far-left", "far-right"]))
    print(f"With only the outer two on it: {stuck.status.sentence}")
    for refusal in stuck.blame:
        print(f"  not {refusal.action}: {refusal.reason}")
    return solved


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seeds", type=int, default=20)
    main(options.parse_args().seeds)
