"""How the cost of an assembly grows with its parts: loading with all geometry, a gravity-checked plan, memory.

Real structures from ../shared/data (fixed supports, friction 0.5) and synthetic ones from cells. The plan takes the
highest part that is free and without which the rest stands; where gravity lets no further part go, it says how far it
came. CPU seconds of one thread, imports left out; each structure runs in a process of its own. Arguments name
structures (wall-22, dome, ...); default all.
"""

from __future__ import annotations

import itertools
import json
import multiprocessing
import os
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import trimesh

import neurosym as ns

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
    meshes = {p.stem: trimesh.load(p, force="mesh") for p in sorted((DATA / name / "parts").glob("*.obj"))}
    fixed = json.loads((DATA / name / "supports.json").read_text())["fixed"]
    return ns.Assembly.from_meshes(meshes).with_fixed(fixed)


STRUCTURES: dict[str, Callable[[], ns.Assembly]] = {
    **{name: lambda name=name: real(name) for name in ("arch", "wall", "crossvault", "dome")},
    **{f"wall-{n}": lambda n=n: ns.Assembly.from_cells(wall(n, n)) for n in (10, 15, 22, 31)},
    **{f"pyramid-{n}": lambda n=n: ns.Assembly.from_cells(pyramid(n)) for n in (6, 8, 11, 14)},
}


def measure(name: str) -> tuple[int, float, float, float, int, float]:
    """Parts; seconds to load with contacts and blocking in six directions; to judge the whole; to plan; steps; MB."""
    ns.Assembly.from_cells({"warm": [(0, 0, 0)], "up": [(0, 0, 1)]}).blocking()  # imports
    start = time.process_time()
    assembly = STRUCTURES[name]()
    assembly.contacts()
    graph = assembly.blocking()
    loaded = time.process_time()
    stability = assembly.stability()
    there = (1 << len(assembly)) - 1
    stands = stability.standing(there).stands
    judged = time.process_time()
    tops = np.full(len(assembly), -np.inf)
    np.maximum.at(tops, assembly.owners, assembly.body_bounds[:, 1, 2])
    left = [int(p) for p in np.argsort(-tops, kind="stable") if not assembly.fixed_mask >> int(p) & 1]
    steps = 0
    while stands and left:
        going = (p for p in left if graph.free_directions(p, there) and stability.standing(there & ~(1 << p)).stands)
        part = next(going, None)
        if part is None:
            break
        there &= ~(1 << part)
        left.remove(part)
        steps += 1
    planned = time.process_time()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return len(assembly), loaded - start, judged - loaded, planned - judged, steps, memory


def exponent(sizes: list[int], seconds: list[float]) -> float:
    """The p of the power law n^p that fits best."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


if __name__ == "__main__":
    chosen = sys.argv[1:] or list(STRUCTURES)
    print("structure     parts  geometry, s  whole stands, s  plan, s  steps   peak MB")
    found: dict[str, list[tuple[int, float, float, float, int, float]]] = {}
    for name in chosen:
        if "-" not in name and not (DATA / name).is_dir():
            print(f"{name:13} skipped: no ../shared/data/{name} here")
            continue
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            row = pool.apply(measure, (name,))
        found.setdefault(name.partition("-")[0] if "-" in name else "real", []).append(row)
        n, geometry, whole, plan, steps, memory = row
        print(f"{name:13} {n:5} {geometry:12.2f} {whole:16.2f} {plan:8.2f} {steps:6} {memory:9.0f}", flush=True)
    for family, rows in found.items():
        if len(rows) > 2:
            sizes = [r[0] for r in rows]
            fits = [exponent(sizes, [r[k] for r in rows]) for k in (1, 2, 3)]
            said = "geometry n^{:.2f}, whole n^{:.2f}, plan n^{:.2f}".format(*fits)
            print(f"{family}: {said} (plan per step n^{exponent(sizes, [r[3] / max(r[4], 1) for r in rows]):.2f})")
