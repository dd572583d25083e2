"""Does a replay in PyBullet say what `validate` says? Soma plans and random orders; each difference with its reason.

    python benchmarks/replay_agreement.py [ORDERS] [--pull N] [--out docs/replay.md]

Each difference is put to PyBullet once more, afresh: does what is left stand, from where it was assembled? And to
MuJoCo (extra `mujoco`).
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from mujoco_referee import settled

import neurosym as ns
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.simulation import ReplayReport, replay_plan
from neurosym.simulation.world import stands as rests
from neurosym.support.files import write_text

#: Tilted by so many degrees: what then falls was about to.
NEARLY = 3.0
#: Of a cube: a part that goes farther has moved.
MOVED = 0.2
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
    account: str
    reason: str = ""
    #: What is left at the first step where they differ: does it stand, by geometry, by Bullet afresh, by MuJoCo?
    verdicts: tuple[bool, bool, bool] = (True, True, True)

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
    account = checked.reason if step is None else report.steps[step].reason
    comparison = Comparison(number, "".join(order), planned, checked.failed_at, step, account)
    if checked.failed_at == step:
        return comparison
    step = min(s for s in (checked.failed_at, report.failed_at) if s is not None)
    left = problem.world.mask(problem.world.names) & ~problem.world.mask(order[: step + 1])
    verdicts = referees(problem.world, left)
    return replace(comparison, reason=reason(problem.world, left, step, checked, report, verdicts), verdicts=verdicts)


def referees(world: ns.Assembly, left: int) -> tuple[bool, bool, bool]:
    """Whether what is left stands where it was assembled: by geometry, by Bullet, by MuJoCo."""
    names = world.in_mask(left)
    if not names:
        return True, True, True
    return stands(world, left), not rests(world, present=names), max(settled(world, names).values()) < MOVED


def reason(
    world: ns.Assembly,
    left: int,
    step: int,
    checked: ns.Validation,
    report: ReplayReport,
    verdicts: tuple[bool, bool, bool],
) -> str:
    """Why the two differ, at the first step where they do."""
    seen = report.steps[step]
    _, afresh, mujoco = verdicts
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
        if not afresh:
            return "falls in Bullet, too, asked afresh: what earlier steps had shifted holds it"
        if not mujoco:
            return "falls, in MuJoCo, too; Bullet alone holds it"
        return "falls; both simulators hold it"
    if seen.in_the_way:
        return "what earlier steps had shifted, by less than counts as moved, is in the way"
    if not stands(world, left, friction=world.friction / DIAGONAL):
        return "stands by friction near its limit: Bullet lets it slip"
    if not stands(world, left, tilt=NEARLY):
        return f"stands, but falls if it is tilted by {NEARLY:g} degrees"
    if afresh:
        return "stands in Bullet, too, asked afresh: what earlier steps had shifted makes it fall"
    if mujoco:
        return "stands, in MuJoCo, too; Bullet alone lets it fall"
    return "stands; both simulators let it fall"


def stands(world: ns.Assembly, parts: int, friction: float | None = None, tilt: float = 0.0) -> bool:
    """What geometry says with another friction, or tilted."""
    changed = world if friction is None else replace(world, friction=friction)
    return bool(AssemblyGeometry(changed, tabulate=False, tilt=tilt).stability.standing(parts).stands)


def pulled_plans(compared: list[Comparison], count: int) -> list[tuple[bool, bool | None]]:
    """Whether the rest stands still while the pieces of a plan are pulled out; and of a plan that was made with that
    in mind (`pull=True`), None where there is none."""
    family, pairs = ns.load_domain("assembly"), []
    for c in [c for c in compared if c.planned][:count]:
        problem = ns.load_domain("soma").problem(c.number, collapse="rigid")
        own = family.problem(problem.world, pull=True)
        planned = ns.solve(own, rng=0).plan
        pairs.append((survives(problem, list(c.order)), None if planned is None else survives(problem, list(planned))))
    return pairs


def survives(problem: ns.Problem, order: list[str]) -> bool:
    return replay_plan(problem, order, pulled=True, stop_at_failure=True).ok


def table(compared: list[Comparison]) -> list[str]:
    lines = ["| orders | n | same verdict | same first failing step |", "|---|---|---|---|"]
    groups = [("planned, accepted by `validate`", [c for c in compared if c.planned])]
    groups += [("random", [c for c in compared if not c.planned]), ("all", compared)]
    for name, group in groups:
        verdict, step = sum(c.agrees for c in group), sum(c.geometry == c.physics for c in group)
        n = len(group)
        lines.append(f"| {name} | {n} | {verdict} ({verdict / n:.1%}) | {step} ({step / n:.1%}) |")
    return lines


def second_opinions(apart: list[Comparison]) -> list[str]:
    """What the two simulators say, asked afresh, of what is left at the step where replay and geometry differ."""
    bullet, mujoco = (sum(c.verdicts[0] == c.verdicts[k] for c in apart) for k in (1, 2))
    split = sum(c.verdicts[1] != c.verdicts[2] for c in apart)
    alone = [f"cube {c.number}, {c.order}" for c in apart if c.verdicts[1] == c.verdicts[2] != c.verdicts[0]]
    return [
        "What is left at that step was then put, where it was assembled, to Bullet afresh and to MuJoCo (round "
        f"friction cones, no slip). Of these {len(apart)}, Bullet says what geometry says in {bullet}, MuJoCo in "
        f"{mujoco}; the two simulators differ in {split}. Both against geometry: {'; '.join(alone) or 'none'}.",
        "",
    ]


def word(rests: bool) -> str:
    return "stands" if rests else "falls"


def steps_of(failed: int | None) -> str:
    return "all" if failed is None else f"stops at {failed + 1}"


def text(compared: list[Comparison], pulled: list[tuple[bool, bool | None]], seconds: float, command: str) -> str:
    apart = [c for c in compared if c.geometry != c.physics]
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
        *table(compared),
        "",
        "## Why they differ",
        "",
        "| reason, at the first step where they differ | orders |",
        "|---|---|",
        *(f"| {why} | {n} |" for why, n in reasons.most_common()),
        "",
        *second_opinions(apart),
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
        "| cube | order | planned | geometry | replay | Bullet afresh | MuJoCo | what the replay saw, or else geometry "
        "| why |",
        "|---|---|---|---|---|---|---|---|---|",
        *(
            f"| {c.number} | {c.order} | {'yes' if c.planned else 'no'} | {steps_of(c.geometry)} | "
            f"{steps_of(c.physics)} | {word(c.verdicts[1])} | {word(c.verdicts[2])} | {c.account} | {c.reason} |"
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
    compared = [compare(seed, planned) for seed in range((options.orders + 1) // 2) for planned in (True, False)]
    pulled = pulled_plans(compared, options.pull)
    command = " ".join(["python benchmarks/replay_agreement.py", *sys.argv[1:]])
    report = text(compared, pulled, time.perf_counter() - start, command)
    print(report)
    if options.out:
        write_text(options.out, report)


if __name__ == "__main__":
    main()
