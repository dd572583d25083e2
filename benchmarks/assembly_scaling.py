"""How the cost of an assembly grows with its parts: loading with all geometry, a gravity-checked plan, memory.

Real structures from ../shared/data (fixed supports, friction 0.5; their files are read and checked) and synthetic
ones from cells. Plans are `ns.solve` with the prior `outermost-first`, the independent replay included: under gravity,
within 60 seconds, and with gravity left aside. CPU seconds of one thread, imports left out; each structure runs in a
process of its own. Arguments name structures (wall-22, dome, ...); default all.
"""

from __future__ import annotations

import itertools
import multiprocessing
import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import neurosym as ns
import neurosym.geometry.readers.loading  # its imports are not to be timed
from neurosym.geometry.queries import AssemblyGeometry

DATA = Path(__file__).parents[2] / "shared" / "data"

Cells = dict[str, list[tuple[int, int, int]]]


def wall(length: int, height: int) -> Cells:
    """Bricks of two cells in running bond, half bricks at the ends."""
    cells: Cells = {}
    for z in range(height):
        ends = [0, *range(1 + (z + 1) % 2, 2 * length, 2), 2 * length]
        for k, (start, stop) in enumerate(itertools.pairwise(ends)):
            cells[f"{z}-{k}"] = [(x, 0, z) for x in range(start, stop)]
    return cells


def pyramid(base: int) -> Cells:
    """Square blocks of four cells, each on the corners of four below."""
    return {
        f"{z}-{x}-{y}": [(2 * x + z + i, 2 * y + z + j, z) for i in (0, 1) for j in (0, 1)]
        for z in range(base)
        for x in range(base - z)
        for y in range(base - z)
    }


def real(name: str) -> ns.Assembly:
    return ns.Assembly.load(DATA / name)


#: Needs no training.
PRIOR = "outermost-first"

STRUCTURES: dict[str, Callable[[], ns.Assembly]] = {
    **{name: lambda name=name: real(name) for name in ("arch", "wall", "crossvault", "dome")},
    **{f"wall-{n}": lambda n=n: ns.Assembly.from_cells(wall(n, n)) for n in (10, 15, 22, 31)},
    **{f"pyramid-{n}": lambda n=n: ns.Assembly.from_cells(pyramid(n)) for n in (6, 8, 11, 14)},
}


@dataclass(frozen=True)
class Row:
    """Parts; CPU seconds to load with contacts and blocking in six directions, to judge the whole, to plan; peak MB."""

    parts: int
    geometry: float
    whole: float
    plan: float
    status: str
    without_gravity: float
    memory: float


def measure(name: str) -> Row:
    ns.solve(_problem(ns.Assembly.from_cells({"warm": [(0, 0, 0)], "up": [(0, 0, 1)]})), prior=PRIOR)  # imports
    start = time.process_time()
    assembly = STRUCTURES[name]()
    geometry = AssemblyGeometry(assembly)
    _ = geometry.contacts, geometry.blocking()
    loaded = time.process_time()
    geometry.stability.standing((1 << len(assembly)) - 1)
    judged = time.process_time()
    # What was asked above is kept; a plan is to be judged from the start.
    fresh = STRUCTURES[name]()
    began = time.process_time()
    result = ns.solve(_problem(fresh), prior=PRIOR, budget=ns.Budget(seconds=60))
    planned = time.process_time()
    status = result.status.name.lower().replace("_", " ")
    if result.plan is None and result.status is not ns.Status.UNSOLVABLE:
        status += f" at {len(result.best_prefix)}"
    if not ns.solve(_problem(fresh, gravity=False), prior=PRIOR).solved:
        status += ", interlocked"
    without = time.process_time() - planned
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Row(len(assembly), loaded - start, judged - loaded, planned - began, status, without, memory)


def _problem(assembly: ns.Assembly, *, gravity: bool = True) -> ns.Problem:
    return ns.load_domain("assembly").problem(assembly, gravity=gravity)


def exponent(sizes: list[int], seconds: list[float]) -> float:
    """The p of the power law n^p that fits best."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


if __name__ == "__main__":
    chosen = sys.argv[1:] or list(STRUCTURES)
    print("structure     parts  geometry, s  whole, s  plan, s  under gravity         plan without, s  peak MB")
    found: dict[str, list[Row]] = {}
    for name in chosen:
        if "-" not in name and not (DATA / name).is_dir():
            print(f"{name:13} skipped: no ../shared/data/{name} here")
            continue
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            row = pool.apply(measure, (name,))
        found.setdefault(name.partition("-")[0] if "-" in name else "real", []).append(row)
        times = f"{row.geometry:12.2f} {row.whole:9.2f} {row.plan:8.2f}  {row.status:21}"
        print(f"{name:13} {row.parts:5} {times} {row.without_gravity:15.2f} {row.memory:8.0f}", flush=True)
    for family, rows in found.items():
        if len(rows) > 2:
            sizes = [r.parts for r in rows]
            whats = {"geometry": [r.geometry for r in rows], "whole": [r.whole for r in rows]}
            whats["plan without gravity"] = [r.without_gravity for r in rows]
            if all(r.status == "solved" for r in rows):
                whats["plan"] = [r.plan for r in rows]
            fits = ", ".join(f"{what} n^{exponent(sizes, seconds):.2f}" for what, seconds in whats.items())
            print(f"{family}: {fits}")
