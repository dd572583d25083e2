"""Does a replay in PyBullet say what `validate` says? Soma plans and random orders; each difference with its reason.

    python benchmarks/replay_agreement.py [ORDERS] [--pull N] [--out docs/replay.md]
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

import neurosym as ns
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.simulation import ReplayReport, replay_plan
from neurosym.support.files import write_text

#: Tilted by so many degrees: what then falls was about to.
NEARLY = 3.0
#: Of a cube: a part that goes farther than this in a second, and not as far as counts as moved, has begun to tilt.
TILTS = 0.005

#: Bullet limits friction along two axes separately: on their diagonal it allows so many times as much.
DIAGONAL = 1.41

#: What is pressed together overlaps a little in Bullet, and wedged parts then stand at a little less friction yet.
WEDGED = 1.5


@dataclass(frozen=True)
class Comparison:
    """One order: what geometry says, what the replay says, and why they differ if they do."""

    number: int
    order: str
    planned: bool
    geometry: int | None
    physics: int | None
    said: str
    reason: str = ""

    @property
    def agrees(self) -> bool:
        return (self.geometry is None) == (self.physics is None)


def compare(seed: int, planned: bool) -> Comparison:
    rng = np.random.default_rng([seed, planned])
    number = int(rng.integers(240))
    problem = ns.load_domain("soma").problem(number, collapse="rigid")
    if planned:
        result = ns.solve(problem, rng=rng)  # each of the 240 has a plan under this rule
        order, motions = tuple(result.plan or ()), result.motions
    else:
        order, motions = tuple(problem.actions[int(a)] for a in rng.permutation(len(problem.actions))), ()
    report = replay_plan(problem, order, motions, stop_at_failure=True)
    checked = ns.validate(problem, order)
    step = report.failed_at
    said = checked.reason if step is None else report.steps[step].reason
    found = Comparison(number, "".join(order), planned, checked.failed_at, step, said)
    if checked.failed_at == step:
        return found
    return replace(found, reason=reason(problem, order, checked, report))


def reason(problem: ns.Problem, order: tuple[str, ...], checked: ns.Validation, report: ReplayReport) -> str:
    """Why the two differ, at the first step where they do."""
    step = min(s for s in (checked.failed_at, report.failed_at) if s is not None)
    world = problem.world
    left = world.mask(world.names) & ~world.mask(order[: step + 1])
    seen = report.steps[step]
    if step != report.failed_at:
        if "blocked" in checked.reason:
            return "geometry: blocked in every direction; the replay found a way past what had shifted"
        if seen.displacement > TILTS:
            return f"begins to tilt, by {seen.displacement:.2f} within the second that is waited: less than counts"
        if stands(world, left, friction=DIAGONAL * world.friction):
            return "stands by friction at its limit: Bullet allows up to 1.41 of it on diagonals (a box, not a cone)"
        if stands(world, left, friction=WEDGED * world.friction):
            return f"stands by friction just beyond that ({WEDGED} of it): wedged parts overlap a little in Bullet"
        shifted = max((s.displacement for s in report.steps[:step]), default=0.0)
        if shifted > TILTS:
            return f"what earlier steps had shifted, by {shifted:.2f}, less than counts as moved, holds it"
        return "geometry: falls; Bullet holds it"
    if seen.in_the_way:
        return "what earlier steps had shifted, by less than counts as moved, is in the way"
    if not stands(world, left, friction=world.friction / DIAGONAL):
        return "stands by friction near its limit: Bullet lets it slip"
    if not stands(world, left, tilt=NEARLY):
        return f"stands, but falls if it is tilted by {NEARLY:g} degrees"
    return "not explained"


def stands(world: ns.Assembly, parts: int, friction: float | None = None, tilt: float = 0.0) -> bool:
    """What geometry says with another friction, or tilted."""
    changed = world if friction is None else replace(world, friction=friction)
    return bool(AssemblyGeometry(changed, tabulate=False, tilt=tilt).stability.standing(parts).stands)


def pulled_plans(found: list[Comparison], count: int) -> list[tuple[bool, bool | None]]:
    """Whether the rest stands still while the pieces of a plan are pulled out; and of a plan that was made with that
    in mind (`pull=True`), None where there is none."""
    family, pairs = ns.load_domain("assembly"), []
    for c in [c for c in found if c.planned][:count]:
        problem = ns.load_domain("soma").problem(c.number, collapse="rigid")
        own = family.problem(problem.world, pull=True)
        planned = ns.solve(own, rng=0).plan
        pairs.append((survives(problem, list(c.order)), None if planned is None else survives(problem, list(planned))))
    return pairs


def survives(problem: ns.Problem, order: list[str]) -> bool:
    return replay_plan(problem, order, pulled=True, stop_at_failure=True).ok


def table(found: list[Comparison]) -> list[str]:
    lines = ["| orders | n | same verdict | same first failing step |", "|---|---|---|---|"]
    groups = [("planned, accepted by `validate`", [c for c in found if c.planned])]
    groups += [("random", [c for c in found if not c.planned]), ("all", found)]
    for name, group in groups:
        verdict, step = sum(c.agrees for c in group), sum(c.geometry == c.physics for c in group)
        n = len(group)
        lines.append(f"| {name} | {n} | {verdict} ({verdict / n:.1%}) | {step} ({step / n:.1%}) |")
    return lines


def steps_of(failed: int | None) -> str:
    return "all" if failed is None else f"stops at {failed + 1}"


def text(found: list[Comparison], pulled: list[tuple[bool, bool | None]], seconds: float, command: str) -> str:
    apart = [c for c in found if c.geometry != c.physics]
    reasons = Counter(c.reason.split(", by")[0] for c in apart)
    lines = [
        "# Replays against `validate`",
        "",
        "`neurosym replay` does a plan in PyBullet: rigid pieces, gravity, friction 0.5, each piece taken along its "
        "path. `validate` asks geometry: is there a straight way out, and does what stays come to rest, rigid parts on "
        "springs? Here both judge the same orders of random Soma cubes (rule `rigid`): half are "
        "plans (backtracking without a prior, ties at random), half are random permutations, most of which fail "
        "somewhere. A part has moved when a corner of it went by more than 0.2 of a cube.",
        "",
        *table(found),
        "",
        "## Why they differ",
        "",
        "| reason, at the first step where they differ | orders |",
        "|---|---|",
        *(f"| {why} | {n} |" for why, n in reasons.most_common()),
        "",
    ]
    if pulled:
        still, made = sum(ok for ok, _ in pulled), [ok for _, ok in pulled if ok is not None]
        lines += [
            "## Pulled instead of taken by hand",
            "",
            "With `--pull` a grip drags each piece along its path, against friction. Of the first "
            f"{len(pulled)} plans, {still} leave the rest standing still: what lies on a piece that is pulled out "
            f"sideways comes along. Asked to plan for that (`pull=True`), neurosym finds a plan for {len(made)} of the "
            f"same cubes, and {sum(made)} of these leave the rest standing still.",
            "",
        ]
    lines += [
        "## All differences",
        "",
        "| cube | order | planned | geometry | replay | what the replay saw, or else geometry | why |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {c.number} | {c.order} | {'yes' if c.planned else 'no'} | {steps_of(c.geometry)} | "
            f"{steps_of(c.physics)} | {c.said} | {c.reason} |"
            for c in apart
        ),
        "",
        f"Made by `{command}` in {seconds:.0f} s (seeds 0, 1, ...; {versions()}).",
        "",
    ]
    return "\n".join(lines)


def versions() -> str:
    from importlib.metadata import version

    named = ", ".join(f"{name} {version(name)}" for name in ("pybullet", "scipy", "numpy"))
    return f"{named}; Python {platform.python_version()} on {platform.system()} {platform.machine()}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("orders", type=int, nargs="?", default=20)
    parser.add_argument("--pull", type=int, default=0, metavar="N", help="pull the pieces of N plans, too")
    parser.add_argument("--out", help="keep it as Markdown")
    options = parser.parse_args()
    start = time.perf_counter()
    found = [compare(seed, planned) for seed in range((options.orders + 1) // 2) for planned in (True, False)]
    pulled = pulled_plans(found, options.pull)
    command = " ".join(["python benchmarks/replay_agreement.py", *sys.argv[1:]])
    said = text(found, pulled, time.perf_counter() - start, command)
    print(said)
    if options.out:
        write_text(options.out, said)


if __name__ == "__main__":
    main()
