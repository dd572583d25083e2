"""How often does the Panda build the tower of a plan, and why not where it does not?

    python benchmarks/panda.py [TOWERS] [--variant heights|colours|unique] [--seed S]

Towers are drawn at random; where their blocks lie at first, and what OMPL draws, follows from the seed and the tower's
number. A tower counts when every block stands in its place at the end, within the tolerances of `BuildSettings`.
"""

from __future__ import annotations

import argparse
import platform
import time
from collections import Counter
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

import neurosym as ns
from domains.tower_variants import towers
from neurosym.planning.staging import stage
from neurosym.simulation.panda import BuildReport, BuildSettings, build_with_panda


@dataclass(frozen=True)
class Trial:
    """One tower: what the arm did, and how long the computer took (seconds)."""

    number: int
    report: BuildReport
    seconds: float

    @property
    def failure(self) -> str:
        """Why the tower does not stand, without the block's name; empty when it does."""
        if self.report.ok:
            return ""
        last = self.report.placements[-1]
        return last.reason.replace(last.block, "a block") if not last.ok else "A block was shifted after it stood."


def build(number: int, variant: str, seed: int) -> Trial:
    """Plan one tower, and let the arm build it."""
    problem = ns.load_domain("tower").problem(number, variant=variant)
    plan = ns.solve(problem).plan or ()  # each tower has one
    start = time.perf_counter()
    report = build_with_panda(stage(problem, plan), rng=np.random.default_rng([seed, number]))
    return Trial(number, report, time.perf_counter() - start)


def text(trials: list[Trial], settings: BuildSettings) -> str:
    """What came out, as lines."""
    placed = [step for trial in trials for step in trial.report.placements]
    errors = [1000 * step.error for step in placed if step.error is not None]
    planned = sum(trial.report.planned for trial in trials)
    standing = sum(len(trial.report.standing) for trial in trials)
    built = sum(trial.report.ok for trial in trials)
    tried = max(1, len(placed))
    lines = [
        f"{built} of {len(trials)} towers stand ({built / len(trials):.0%}), {standing} of {planned} blocks: within "
        f"{1000 * settings.position_tolerance:.0f} mm of their place and {settings.tilt_tolerance:.0f}° of upright.",
        f"Blocks let go: {len(errors)}, off by {np.median(errors):.1f} mm in the median, {max(errors):.1f} mm at most."
        if errors
        else "No block was let go.",
        f"Grasped more than once: {sum(step.attempts > 1 for step in placed)} of {len(placed)} blocks.",
        f"A block takes {sum(trial.report.seconds for trial in trials) / tried:.1f} s of the arm's time, and "
        f"{sum(trial.seconds for trial in trials) / tried:.1f} s of the computer's.",
    ]
    lines += [f"Failed {n} times: {why}" for why, n in Counter(t.failure for t in trials if t.failure).most_common()]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("towers", type=int, nargs="?", default=20)
    parser.add_argument("--variant", default="heights", choices=["heights", "colours", "unique"])
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    there = len(towers(options.variant))
    chosen = np.random.default_rng(options.seed).choice(there, options.towers, replace=False)
    trials = []
    for number in chosen.tolist():
        trials.append(build(number, options.variant, options.seed))
        said = trials[-1].failure or f"stands, {trials[-1].report.planned} blocks"
        print(f"{options.variant} {number}: {said} ({trials[-1].seconds:.0f} s)", flush=True)
    print(text(trials, BuildSettings()))
    named = ", ".join(f"{name} {version(name)}" for name in ("pybullet", "ompl", "numpy"))
    print(f"Seed {options.seed}; {named}; Python {platform.python_version()} on {platform.machine()}.")


if __name__ == "__main__":
    main()
