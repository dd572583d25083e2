"""From the full side, the empty side or both: how each search ends on real structures under gravity, and in what time.

Structures from ../shared/data, backtracking with the prior `outermost-first`, each search on geometry of its own in a
process of its own, CPU seconds of one thread, loading left out. Arguments: seconds a search may take (60, by the
clock), then names of structures, each with how many parts may be held (crossvault:1); default arch, wall, dome and
crossvault with none, and the vault with one and two.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import neurosym as ns
from neurosym.planning.result import PlanResult, Status

DATA = Path(__file__).parents[2] / "shared" / "data"
DEFAULT = ("arch:0", "wall:0", "dome:0", "crossvault:0", "crossvault:1", "crossvault:2")


def search(name: str, held: int, side: str, seconds: float) -> tuple[PlanResult, int, float]:
    """The result, how many actions there are, and the CPU seconds that it took."""
    problem = ns.load_domain("assembly").problem(DATA / name, held=held)
    start = time.process_time()
    result = ns.solve(problem, prior="outermost-first", side=side, budget=ns.Budget(seconds=seconds))
    return result, len(problem.actions), time.process_time() - start


def row(name: str, held: int, seconds: float) -> str:
    told, took, decided = [], {}, {}
    for side in ("full", "empty", "both"):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            result, count, took[side] = pool.apply(search, (name, held, side, seconds))
        decided[side] = result.status is not Status.OUT_OF_BUDGET
        far = f"{len(result.best_prefix)} down" if side == "full" else f"{len(result.best_suffix or ())} up"
        told.append(f"{result.status.name.lower()} in {took[side]:.1f} s ({far}, {result.attempts:,} questions)")
    ratio = took["full"] / took["empty"]
    least = "" if decided["full"] and decided["empty"] else ">= " if decided["empty"] else "<= "
    compared = f"{least}{ratio:.2g}" if decided["full"] or decided["empty"] else "-"
    return f"| {name} | {count} | {held} | {' | '.join(told)} | {compared} |"


def main() -> None:
    given = sys.argv[1:]
    seconds = float(given.pop(0)) if given and given[0].replace(".", "").isdigit() else 60.0
    print("| structure | loose parts | held | full | empty | both | full / empty |\n|---|---|---|---|---|---|---|")
    for name, _, held in (text.partition(":") for text in given or DEFAULT):
        if (DATA / name).is_dir():
            print(row(name, int(held or 0), seconds), flush=True)
        else:
            print(f"{name} is not here ({DATA})", file=sys.stderr)


if __name__ == "__main__":
    main()
