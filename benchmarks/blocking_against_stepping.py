"""The same blocking questions put to the table and to what one would otherwise write, side by side in one run.

The questions are those of taking an assembly apart: after each removal, of each part left and each of six directions,
whether it can leave. The other way is a `trimesh.collision.CollisionManager` of the parts left, out of which the part
is moved in steps of a quarter of its own smallest extent, until it is past all. To FCL meshes that touch collide, so it
is also tried with the part shrunk by 1% about its middle, as is often done. Who is right is known on voxel assemblies,
by integers. CPU time; building the table is counted, as is filling the manager; reading meshes is not. Argument: how
many of the (subset, part) to put to stepping (default 12; Soma: all).
"""

from __future__ import annotations

import itertools
import os
import random
import statistics
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import trimesh

import neurosym as ns
from neurosym.geometry.queries import AssemblyGeometry

DATA = Path(__file__).parents[2] / "shared" / "data"
DIRECTIONS = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0], [0, 0, -1.0], [-1, 0, 0], [0, -1, 0]])

Cells = Mapping[str, list[tuple[int, int, int]]]


def boxes_mesh(cells: list[tuple[int, int, int]]) -> trimesh.Trimesh:
    boxes = [trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix(np.add(c, 0.5))) for c in cells]
    return trimesh.util.concatenate(boxes)


def stepped(others: Any, mesh: trimesh.Trimesh, direction: np.ndarray, distance: float, shrink: float) -> bool:
    """Whether a part can leave the others, by stepping."""
    middle = mesh.bounds.mean(axis=0)
    smaller = trimesh.Trimesh(middle + (mesh.vertices - middle) * (1 - shrink), mesh.faces, process=False)
    step = mesh.extents.min() / 4
    for travelled in np.arange(0, distance + step, step):
        if others.in_collision_single(smaller, trimesh.transformations.translation_matrix(travelled * direction)):
            return False
    return True


def exactly(cells: Cells, there: list[str], part: str, direction: np.ndarray) -> bool:
    """Whether a part can leave, by integers: no cell of another straight ahead of one of its own."""
    axis, sign = int(np.abs(direction).argmax()), int(direction.sum())
    across = [k for k in range(3) if k != axis]
    for name in there:
        for a, b in itertools.product(cells[part], cells[name]) if name != part else ():
            if all(a[k] == b[k] for k in across) and sign * (b[axis] - a[axis]) > 0:
                return False
    return True


def compare(title: str, meshes: Mapping[str, Any], sample: int | None, cells: Cells | None) -> None:
    """One row of the table."""
    names = list(meshes)
    states = [names[k:] for k in range(len(names))]
    asked = [(k, name) for k, there in enumerate(states) for name in there]

    ours: dict[tuple[int, str, int], bool] = {}
    took = []
    for _ in range(5):
        assembly = ns.Assembly.from_meshes(meshes)  # one that remembers nothing
        start = time.process_time()
        graph = AssemblyGeometry(assembly).blocking(DIRECTIONS)
        for k, there in enumerate(states):
            mask = assembly.mask(there)
            for name in there:
                for d in range(len(DIRECTIONS)):
                    ours[k, name, d] = not graph.blockers(assembly.index[name], d, mask)
        took.append(time.process_time() - start)
    mine = 1e3 * statistics.median(took) / len(ours)

    if sample is not None:
        asked = random.Random(0).sample(asked, min(sample, len(asked)))
    differ, wrong, seconds = [0, 0], [0, 0, 0], 0.0
    for k, name in asked:
        distance = float(np.linalg.norm(np.ptp([meshes[n].bounds for n in states[k]], axis=(0, 1))))
        start = time.process_time()
        others = trimesh.collision.CollisionManager()
        for other in states[k]:
            if other != name:
                others.add_object(other, meshes[other])
        seconds += time.process_time() - start
        for d, direction in enumerate(DIRECTIONS):
            truth = exactly(cells, states[k], name, direction) if cells is not None else None
            wrong[0] += truth is not None and ours[k, name, d] is not truth
            for which, shrink in enumerate((0.0, 0.01)):
                start = time.process_time()
                free = stepped(others, meshes[name], direction, distance, shrink)
                seconds += (time.process_time() - start) / 2
                differ[which] += free is not ours[k, name, d]
                wrong[which + 1] += truth is not None and free is not truth
    count = len(asked) * len(DIRECTIONS)
    theirs = 1e3 * seconds / count
    known = "/".join(map(str, wrong)) if cells is not None else "not known"
    print(
        f"{title:10} {len(ours):9} {count:9} {mine:9.4f} {theirs:9.2f} {theirs / mine:7.0f} "
        f"{differ[0]:6}/{differ[1]:<6} {known}",
        flush=True,
    )


if __name__ == "__main__":
    few = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    print("questions put to the table, and of these to stepping; CPU ms a question; answers of stepping (as it is /")
    print("with the part shrunk) that differ from the table's; wrong answers of the table / stepping / shrunk stepping")
    print("assembly   questions   stepped  table ms stepped ms  ratio   differ     wrong")
    soma = ns.load_domain("soma").solutions()
    for number in (0, 80, 160):
        cells = {name: [tuple(map(int, c)) for c in own] for name, own in soma[number].items()}
        compare(f"soma {number}", {n: boxes_mesh(c) for n, c in cells.items()}, None, cells)
    for name in ("arch", "wall"):
        folder = DATA / name / "parts"
        if not folder.is_dir():
            print(f"{name:10} skipped: no ../shared/data/{name} here")
            continue
        meshes = {p.stem: trimesh.load(p, force="mesh") for p in sorted(folder.glob("*.obj"))}
        compare(name, meshes, few, None)
