"""A robot builds towers from plans, and its work becomes demonstrations to learn from, as in the paper.

It shows a Franka Panda in PyBullet that picks blocks up from the table and places them in the order of a plan, by
grasps from above, motions that OMPL plans and friction alone. Each finished tower is pictured as it stands, and
pictures and orders go to a file that `neurosym train` reads.

    python examples/panda_builds_a_tower.py [--gui] [--film tower.gif]
"""

import argparse

import numpy as np

import neurosym as ns
from neurosym.planning.staging import stage
from neurosym.simulation.film_files import write_film
from neurosym.simulation.panda import BuildReport, CellFilm, build_with_panda

VARIANT = "heights"


def build(
    number: int, rng: np.random.Generator, *, window: bool = False, film: CellFilm | None = None
) -> tuple[ns.Problem, BuildReport]:
    """Plan one tower, and let the arm build it."""
    problem = ns.load_domain("tower").problem(number, variant=VARIANT)
    result = ns.solve(problem)
    report = build_with_panda(stage(problem, result.plan or ()), rng=rng, window=window, watch=film)
    print(f"{problem.name}: {', '.join(result.plan or ())}")
    for step in report.placements:
        again = f" (grasp {step.attempts})" if step.attempts > 1 else ""
        print(f"  {step.block}{again}: {step.reason}" + (f" Off by {1000 * step.error:.1f} mm." if step.error else ""))
    return problem, report


def main(
    towers: tuple[int, ...] = (57, 203, 640),
    out: str = "panda-demonstrations.npz",
    *,
    window: bool = False,
    film: str | None = None,
) -> ns.Demonstrations | None:
    """Build towers, and keep those that stand as demonstrations; None when none does. The first may be filmed."""
    rng = np.random.default_rng(0)
    family = ns.load_domain("tower")
    pictures, orders, actions, classes = [], [], (), ()
    for number in towers:
        camera = CellFilm() if film and number == towers[0] else None
        problem, report = build(number, rng, window=window, film=camera)
        if camera and film:
            print(f"  {write_film(iter(camera.pictures), film)}: the arm at work, four times as fast.")
        if not report.ok:
            print("  Not a demonstration: the tower is not what the plan asked for.")
            continue
        # The same camera as everywhere, on the blocks where the arm really put them.
        offsets = [report.poses[name][:2, 3] for name in report.standing]
        pictures.append(family.problem(number, variant=VARIANT, offsets=offsets).observation)
        actions, classes = problem.actions, problem.classes
        orders.append([actions.index(name) for name in report.standing] + [-1] * (6 - len(report.standing)))
    if not orders:
        print("No tower stands, so there is nothing to learn from.")
        return None
    found = ns.Demonstrations(np.array(pictures), np.array(orders), actions, domain="tower", classes=classes)
    found.save(out)
    print(f"{len(found)} of {len(towers)} towers stand: {out}, for `neurosym train tower --demos {out} ...`.")
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gui", action="store_true", help="show it in a window, in real time")
    parser.add_argument("--film", help="of the first tower: .gif, .mp4 or a folder")
    options = parser.parse_args()
    main(window=options.gui, film=options.film)
