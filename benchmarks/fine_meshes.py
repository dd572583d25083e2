"""Fine meshes: the whole job, beside what one would otherwise write, in one run.

Ours: load the files and check them, contacts, blocking in six directions, a plan (gravity aside), its validation. The
other: load with trimesh, one FCL tree a part through `trimesh.collision.CollisionManager`, and each ordered pair of
parts in six directions, the first moved in 40 steps until it meets the second. Which pairs block one another is known
of the shapes that are made here (`fine_shapes`): wrong answers of both are counted. CPU seconds, of child processes
too; medians of three; imports, and compiling for the first time, are left out.

Then: how the cost of three washers under gravity grows with the sections of their rims, and whether they come apart
from above within a budget of five seconds. Arguments name shapes; default all.
"""

from __future__ import annotations

import os
import resource
import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import trimesh
from fine_shapes import BLOCKED, DIRECTIONS, SHAPES, Blocked, washers, written

import neurosym as ns

AS1 = Path(__file__).parents[2] / "shared" / "data" / "as1" / "as1_pe_203.stp"
STEPS, REPEATS = 40, 3
SECTIONS = (64, 128, 256, 512, 1024)


class Clock:
    """CPU seconds of this process and of its children, by what they went into."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = self._now()

    def lap(self, name: str) -> None:
        now = self._now()
        self.seconds[name] = now - self._last
        self._last = now

    @staticmethod
    def _now() -> float:
        used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        return sum(u.ru_utime + u.ru_stime for u in used)  # os.times() counts in hundredths


def ours(path: Path, *, gravity: bool = False) -> tuple[dict[str, float], Blocked, ns.PlanResult]:
    """Times, (mover, number of the direction, obstacle) of all that is blocked, and the plan."""
    clock = Clock()
    assembly = ns.Assembly.load(path)
    clock.lap("load")
    problem = ns.load_domain("assembly").problem(assembly, directions=DIRECTIONS, gravity=gravity)
    geometry = problem.geometry
    geometry.contacts  # noqa: B018
    clock.lap("contacts")
    graph = geometry.blocking(DIRECTIONS)
    clock.lap("directions")
    result = ns.solve(problem, budget=ns.Budget(seconds=5 if gravity else 60))
    clock.lap("plan, validated")
    names = assembly.names
    blocked = {
        (names[i], d, other)
        for d in range(len(DIRECTIONS))
        for i in range(len(names))
        for other in assembly.in_mask(graph.by_part[d][i])
    }
    return clock.seconds, blocked, result


def stepping(path: Path) -> tuple[dict[str, float], Blocked, int]:
    """The same by stepping; and how many facets there are."""
    clock = Clock()
    meshes = {p.stem: trimesh.load(p) for p in sorted(path.glob("*.stl"))} if path.is_dir() else scene_meshes(path)
    clock.lap("load")
    managers = {name: trimesh.collision.CollisionManager() for name in meshes}
    for name, mesh in meshes.items():
        managers[name].add_object(name, mesh)
    clock.lap("trees")
    distance = float(np.linalg.norm(np.ptp([m.bounds for m in meshes.values()], axis=(0, 1))))
    blocked = set()
    for name in meshes:
        for d, direction in enumerate(DIRECTIONS):
            for other in meshes:
                for step in range(1, STEPS + 1) if other != name else ():
                    at = trimesh.transformations.translation_matrix(direction * distance * step / STEPS)
                    managers[name].set_transform(name, at)
                    if managers[name].in_collision_other(managers[other]):
                        blocked.add((name, d, other))
                        break
        managers[name].set_transform(name, np.eye(4))
    clock.lap("steps")
    return clock.seconds, blocked, sum(len(m.faces) for m in meshes.values())


def scene_meshes(path: Path) -> dict[str, trimesh.Trimesh]:
    scene = trimesh.load(path)
    placed = {node: scene.graph[node] for node in scene.graph.nodes_geometry}
    return {
        node: scene.geometry[name].copy().apply_transform(X)
        for node, (X, name) in placed.items()
        if isinstance(scene.geometry[name], trimesh.Trimesh)
    }


def median(job: Callable[[], tuple[dict[str, float], Blocked, object]]) -> tuple[dict[str, float], Blocked, object]:
    runs = [job() for _ in range(REPEATS)]
    return {k: statistics.median(seconds[k] for seconds, *_ in runs) for k in runs[0][0]}, *runs[-1][1:]


def compare(title: str, path: Path, truth: Blocked | None) -> float:
    theirs, stepped, facets = median(lambda: stepping(path))
    mine, answered, result = median(lambda: ours(path))
    ratio = sum(mine.values()) / sum(theirs.values())
    wrong = f"{len(stepped ^ truth)} / {len(answered ^ truth)}" if truth is not None else "not known"
    parts = " ".join(f"{seconds:8.3f}" for seconds in (*theirs.values(), *mine.values()))
    print(f"{title:9} {facets:8,} {parts} {ratio:6.2f}  {wrong:11} {result.status.name.lower()}", flush=True)
    return ratio


def growth(folder: Path) -> None:
    print("\nthree washers under gravity: CPU seconds of the whole job, and the order, within a budget of 5 s")
    totals = []
    for sections in SECTIONS:
        path = written(washers(sections), folder / f"washers-{sections}")
        seconds, _, result = median(lambda path=path: ours(path, gravity=True))
        totals.append(sum(seconds.values()))
        print(f"{sections:6} sections {totals[-1]:7.3f}  {result.status.name.lower()}: {', '.join(result.plan or ())}")
    power = np.polyfit(np.log(SECTIONS), np.log(totals), 1)[0]
    print(f"growth: n^{power:.2f} over {SECTIONS[0]} to {SECTIONS[-1]:,} sections")


if __name__ == "__main__":
    chosen = sys.argv[1:] or [*SHAPES, "as1", "growth"]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for warm in ("washers", "plates"):  # imports, and what is compiled or loaded when it is first called
            path = written(SHAPES[warm](), folder / f"warm-{warm}")
            stepping(path)
            ours(path, gravity=True)
        columns = "stepping: load    trees    steps; ours: load contacts directions plan  ratio  wrong: theirs / ours"
        print(f"          facets: {columns}")
        ratios = [compare(n, written(SHAPES[n](), folder / n), BLOCKED[n]()) for n in chosen if n in SHAPES]
        if "as1" in chosen and AS1.exists():
            ratios.append(compare("as1", AS1, None))
        if ratios:
            print(f"ratio to stepping: median {statistics.median(ratios):.2f}, largest {max(ratios):.2f}")
        if "growth" in chosen:
            growth(folder)
