"""How many scene updates a second the viewer makes with 184 parts: a cross vault, or boxes where it is absent.

Another folder of parts in metres may be named as an argument.
"""

from __future__ import annotations

import itertools
import sys
import time
from pathlib import Path

import numpy as np

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.staging import staged
from neurosym.geometry.step_motion import StepMotion
from neurosym.viewer.scene import PlanScene
from neurosym.viewer.server import LocalServer
from neurosym.viewer.timeline import Timeline

VAULT = Path(__file__).parents[2] / "shared" / "data" / "crossvault"
UPDATES = 400


def parts() -> Assembly:
    if len(sys.argv) > 1:
        return Assembly.load(sys.argv[1], units="m")
    if VAULT.exists():
        return Assembly.load(VAULT, units="m")
    cells = itertools.islice(itertools.product(range(8), range(6), range(4)), 184)
    return Assembly.from_cells({f"block-{i}": [cell] for i, cell in enumerate(cells)})


def rate(scene: PlanScene, times: np.ndarray) -> float:
    start = time.perf_counter()
    for t in times:
        scene.show(float(t))
    return len(times) / (time.perf_counter() - start)


assembly = parts()
order = [assembly.names[i] for i in np.argsort(-assembly.part_bounds[:, 1, 2], kind="stable")]
up = [StepMotion((name,), (0.0, 0.0, 1.0)) for name in order]
start = time.perf_counter()
timeline = Timeline(staged(assembly, assembly.names, order, up))
print(f"film of {len(order)} steps: {time.perf_counter() - start:.2f} s")
server = LocalServer()
scene = PlanScene(server)
start = time.perf_counter()
scene.put(timeline)
print(f"{len(assembly)} parts, {sum(len(b.shape.faces) for b in assembly.bodies):,} triangles")
print(f"put into the scene: {time.perf_counter() - start:.2f} s")
playing = np.linspace(0, 20, UPDATES)
print(f"film at speed 1, one part moving: {rate(scene, playing):.0f} updates a second")
ends = np.tile([0.0, float(timeline.n_steps)], UPDATES // 2)
print(f"from end to end, all parts moved at every update: {rate(scene, ends):.0f} updates a second")
server.stop()
