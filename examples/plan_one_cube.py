"""Plan the disassembly of a cube of your own, given as cells, and check the plan.

It shows planning in three lines, what a refusal says, that a wrong order is caught with its reason, and that a wish
(the L before everything else) is answered with a plan, or with a proof that there is none.

    python examples/plan_one_cube.py [--collapse cubes|strict|rigid]
"""

import argparse

import neurosym as ns

#: A 3 x 3 x 3 cube of the seven Soma pieces: piece -> cells (x, y, z), z up. Any polycubes will do.
CUBE = {
    "V": [(0, 0, 1), (0, 0, 2), (0, 1, 1)],
    "L": [(1, 2, 0), (2, 2, 0), (2, 2, 1), (2, 2, 2)],
    "T": [(0, 0, 0), (0, 1, 0), (0, 2, 0), (1, 1, 0)],
    "Z": [(1, 0, 1), (1, 1, 1), (1, 1, 2), (1, 2, 2)],
    "A": [(1, 0, 0), (2, 0, 0), (2, 1, 0), (2, 1, 1)],
    "B": [(0, 1, 2), (0, 2, 1), (0, 2, 2), (1, 2, 1)],
    "P": [(1, 0, 2), (2, 0, 1), (2, 0, 2), (2, 1, 2)],
}


def main(collapse: str = "cubes") -> tuple[ns.PlanResult, ns.PlanResult]:
    soma = ns.load_domain("soma")
    problem = soma.problem_from_cells(CUBE, collapse=collapse)
    result = ns.solve(problem)

    print(f"plan: {' '.join(result.plan)}   ({result.iterations} refusals, {result.attempts} attempts)")
    for refusal in result.blame:
        print(f"  after {' '.join(refusal.after) or 'nothing'}, not {refusal.action}: {refusal.reason}")

    backwards = ns.validate(problem, result.plan[::-1])
    print(f"the same backwards: {'fine' if backwards else backwards.reason}")

    wish = [("L", other) for other in CUBE if other != "L"]
    first = ns.solve(soma.problem_from_cells(CUBE, collapse=collapse, before=wish))
    print(f"the L before all others: {first.status.sentence} {' '.join(first.plan or ())}")
    for refusal in first.blame:
        print(f"  not {refusal.action}: {refusal.reason}")
    return result, first


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--collapse", default="cubes", choices=["cubes", "strict", "rigid"])
    main(options.parse_args().collapse)
