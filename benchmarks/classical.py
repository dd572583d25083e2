"""Classical tasks, side by side: ours, pyperplan and Fast Downward (through unified-planning).

Coverage and CPU seconds of each domain, reading and grounding included, importing not; a process of its own for each
run, with limits on CPU time and memory. Ours is greedy search with h_FF, pyperplan's too ("gbf" with "hff"), Fast
Downward is lama-first. Each plan of ours is replayed by our `validate` and by the validator of unified-planning.

    python benchmarks/classical.py [--seconds 60] [--domains blocks gripper] [--planners ours pyperplan]
"""

import argparse
import json
import logging
import resource
import statistics
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from classical_tasks import DOMAINS, SIZES, task

PLANNERS = ("ours", "pyperplan", "fast-downward")
MEMORY = 2 << 30


def cpu() -> float:
    """CPU seconds of this process and of those it started."""
    usages = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return sum(u.ru_utime + u.ru_stime for u in usages)


def ours(domain: Path, problem: Path) -> int | None:
    from unified_planning.io import PDDLReader
    from unified_planning.shortcuts import OneshotPlanner, PlanValidator, get_environment

    import neurosym as ns

    get_environment().credits_stream = None
    ns.register_engine()
    # Compiled loops are loaded from disk once a process.
    ns.solve(ns.from_pddl(*task("gripper", 1)))
    start = cpu()
    given = PDDLReader().parse_problem(str(domain), str(problem))
    read = cpu()
    with OneshotPlanner(name="neurosym") as planner:
        plan = planner.solve(given).plan
    print(json.dumps({"seconds": cpu() - start, "reading": read - start}))
    if plan is None:
        return None
    for name in ("neurosym", "sequential_plan_validator"):
        with PlanValidator(name=name) as validator:
            assert validator.validate(given, plan), name
    return len(plan.actions)


def pyperplan(domain: Path, problem: Path) -> int | None:
    from pyperplan import planner

    logging.getLogger().setLevel(logging.ERROR)
    start = cpu()
    plan = planner.search_plan(str(domain), str(problem), planner.SEARCHES["gbf"], planner.HEURISTICS["hff"])
    print(json.dumps({"seconds": cpu() - start}))
    return None if plan is None else len(plan)


def fast_downward(domain: Path, problem: Path) -> int | None:
    from unified_planning.io import PDDLReader
    from unified_planning.shortcuts import OneshotPlanner, get_environment

    get_environment().credits_stream = None
    start = cpu()
    given = PDDLReader().parse_problem(str(domain), str(problem))
    with OneshotPlanner(name="fast-downward", params={"fast_downward_alias": "lama-first"}) as planner:
        plan = planner.solve(given).plan
    print(json.dumps({"seconds": cpu() - start}))
    return None if plan is None else len(plan.actions)


def run(planner: str, domain: str, size: int, seconds: float) -> dict[str, float]:
    """One run in a process of its own: seconds and the plan's length; nothing where a limit came first."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 5, int(seconds) + 6))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))

    command = [sys.executable, __file__, "--one", planner, domain, str(size)]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=limit)
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    found = {key: value for line in lines for key, value in line.items()}
    if done.returncode or "length" not in found or found["seconds"] > seconds:
        if "assert" in done.stderr.lower():
            sys.exit(f"{planner} on {domain} {size}: {done.stderr[-500:]}")
        return {}
    return found


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seconds", type=float, default=60.0)
    options.add_argument("--domains", nargs="+", choices=sorted(DOMAINS), default=list(SIZES))
    options.add_argument("--planners", nargs="+", choices=PLANNERS, default=list(PLANNERS))
    options.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    given = options.parse_args()
    if find_spec("unified_planning") is None or find_spec("pyperplan") is None:
        print("Expected the planners of the extra pddl, which are not installed: pip install '.[pddl]'.")
        return
    if given.one:
        planner, domain, size = given.one
        with tempfile.TemporaryDirectory() as folder:
            files = Path(folder) / "domain.pddl", Path(folder) / "problem.pddl"
            for file, text in zip(files, task(domain, int(size))):
                file.write_text(text)
            length = {"ours": ours, "pyperplan": pyperplan, "fast-downward": fast_downward}[planner](*files)
        print(json.dumps({} if length is None else {"length": length}))
        return
    ratios: list[float] = []
    for domain in given.domains:
        own: dict[str, list[dict[str, float]]] = {p: [] for p in given.planners}
        for size in SIZES[domain]:
            for planner in given.planners:
                own[planner].append(run(planner, domain, size, given.seconds))
        for planner, runs in own.items():
            solved = [r for r in runs if r]
            lengths = " ".join(f"{r['length']:.0f}" if r else "-" for r in runs)
            times = " ".join(f"{r['seconds']:.2f}" if r else "-" for r in runs)
            print(f"{domain:11} {planner:14} {len(solved)}/{len(runs)}  seconds {times}  lengths {lengths}", flush=True)
        for mine, theirs in zip(own.get("ours", ()), own.get("pyperplan", ())):
            if mine and theirs:
                ratios.append(mine["seconds"] / theirs["seconds"])
    if ratios:
        print(f"ours / pyperplan, where both solved: median {statistics.median(ratios):.2f} of {len(ratios)}")


if __name__ == "__main__":
    main()
