"""Whether budgets are kept on shapes that are hard: by how much each overruns the seconds that it was given.

    python benchmarks/budgets.py [--seconds 1] [SHAPE ...]

Each runs in a process of its own, with what is compiled on disk already. "read" is from the file to the problem, "over"
how much longer than the budget the plan took; the status has to be true: out of budget wherever the time ended first.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from fine_shapes import gears, plates, washers, written

import neurosym as ns

Made = tuple[ns.Assembly, dict[str, Any]]


def tori(sections: tuple[int, int]) -> dict[str, trimesh.Trimesh]:
    """Six tori, each through the next, that nothing takes apart."""
    meshes = {}
    for k in range(6):
        mesh = trimesh.creation.torus(10, 2, major_sections=sections[0], minor_sections=sections[1])
        turn = trimesh.transformations.rotation_matrix(np.pi / 2 * (k % 2), [1, 0, 0])
        meshes[f"ring{k}"] = mesh.apply_transform(turn).apply_translation((12 * k, 0, 0))
    return meshes


def shell() -> dict[str, trimesh.Trimesh]:
    """A ball in a hollow one, with room to move and no way out."""
    outer, inner = (trimesh.creation.icosphere(subdivisions=4, radius=r) for r in (10, 8))
    inner.invert()
    hollow = trimesh.util.concatenate([outer, inner])
    return {"shell": hollow, "ball": trimesh.creation.icosphere(subdivisions=4, radius=5)}


def meshes(given: dict[str, trimesh.Trimesh], **options: Any) -> Made:
    return ns.Assembly.from_meshes(given, units="mm"), options


def cubes(count: int) -> Made:
    """A heap of unit cubes, as high as wide."""
    side = round(count ** (1 / 3) + 0.5)
    places = np.stack(np.unravel_index(np.arange(count), (side, side, side)), axis=1)[:, ::-1]
    return ns.Assembly.from_cells({f"c{k}": [tuple(map(int, p))] for k, p in enumerate(places)}), {}


SHAPES: dict[str, Callable[[], Made]] = {
    "fine linked tori": lambda: meshes(tori((160, 80)), gravity=False),
    "fine linked tori, groups": lambda: meshes(tori((160, 80)), gravity=False, groups=True),
    "fine linked tori, any path": lambda: meshes(tori((160, 80)), gravity=False, paths="any"),
    "coarse linked tori, groups, any path": lambda: meshes(tori((24, 12)), gravity=False, groups=True, paths="any"),
    "ball in a shell, any path": lambda: meshes(shell(), gravity=False, paths="any"),
    "gears, contact directions": lambda: meshes(gears(), directions="contacts"),
    "washers, any path": lambda: meshes(washers(), paths="any", gravity=False),
    "plates, 200 directions": lambda: meshes(plates(), directions=200),
    "3,000 cubes": lambda: cubes(3_000),
    "3,000 cubes, any path": lambda: (cubes(3_000)[0], {"paths": "any"}),
    "10,000 cubes, groups": lambda: (cubes(10_000)[0], {"groups": True}),
}


def run(name: str, seconds: float) -> dict[str, Any]:
    start = time.perf_counter()
    assembly, options = SHAPES[name]()
    problem = ns.load_domain("assembly").problem(assembly, **options)
    made = time.perf_counter()
    result = ns.solve(problem, prior="outermost-first", budget=ns.Budget(seconds=seconds))
    took = time.perf_counter() - made
    return {
        "shape": name, "read": made - start, "took": took, "over": took - seconds, "status": result.status.name,
        "prefix": len(result.best_prefix), "GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }  # fmt: skip


def by_command(seconds: float) -> dict[str, Any]:
    """10,000 cubes as a file of meshes, read and planned by command."""
    with tempfile.TemporaryDirectory() as folder:
        path = written({f"c{k}": trimesh.creation.box((1, 1, 1)).apply_translation(
            (k % 22, k // 22 % 22, k // 484)) for k in range(10_000)}, Path(folder) / "cubes")  # fmt: skip
        start = time.perf_counter()
        command = [sys.executable, "-m", "neurosym.cli", "plan", str(path), "--units", "mm", "--seconds", str(seconds)]
        code = subprocess.run(command, capture_output=True, check=False).returncode
        took = time.perf_counter() - start
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    return {"shape": BY_COMMAND, "took": took, "over": took - seconds, "status": f"exit code {code}", "GB": used}


BY_COMMAND = "10,000 cubes by command"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("shapes", nargs="*")
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    if given.json:
        name = given.shapes[0]
        print(json.dumps(by_command(given.seconds) if name == BY_COMMAND else run(name, given.seconds)))
        return
    print(f"{'shape':40} {'read':>6} {'took':>6} {'over':>6}  {'GB':>4}  status, longest prefix")
    for name in given.shapes or [*SHAPES, BY_COMMAND]:
        again = [sys.executable, __file__, "--json", "--seconds", str(given.seconds), name]
        done = subprocess.run(again, capture_output=True, text=True, check=False)
        if done.returncode:
            print(f"{name:40} {done.stderr.strip().splitlines()[-1]}")
            continue
        row = json.loads(done.stdout)
        print(
            f"{name:40} {row.get('read', 0):6.1f} {row['took']:6.2f} {row['over']:+6.2f}  {row['GB']:4.1f}  "
            f"{row['status']}, {row.get('prefix', '-')}",
            flush=True,
        )


if __name__ == "__main__":
    main()
