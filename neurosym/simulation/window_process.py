"""The process that a window has for itself (see `neurosym.simulation.window`), which starts it and feeds it.

It reads one line of JSON, the scene, and then poses, seven numbers a body; it answers a byte for each it has shown.
Whatever PyBullet prints goes nowhere. It ends when there is nothing more to read, or when its window is closed.
"""

import json
import os
import sys
from typing import Any

import numpy as np

from neurosym.simulation.client import pybullet
from neurosym.simulation.drawing import flat_shaded

#: Where bodies that are not there wait, and how large the table is, in scene units.
_AWAY, _TABLE = -1e4, 200.0
_TABLE_COLOUR, _DULL = (0.90, 0.90, 0.88, 1.0), (0.0, 0.0, 0.0)


def main() -> None:
    """Serve one window."""
    answers = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    source = sys.stdin.buffer
    line = source.readline()
    if not line:
        return
    scene = json.loads(line)
    p = pybullet()
    window = p.connect(p.GUI, options="--background_color_red=1 --background_color_green=1 --background_color_blue=1")
    if window < 0:
        return
    for what in (p.COV_ENABLE_GUI, p.COV_ENABLE_KEYBOARD_SHORTCUTS, p.COV_ENABLE_RENDERING):
        p.configureDebugVisualizer(what, 0)
    numbers = [_body(p, body) for body in scene["bodies"]]
    if scene["ground"] is not None:
        thin = [_TABLE, _TABLE, 0.01 * _TABLE]
        slab = p.createVisualShape(p.GEOM_BOX, halfExtents=thin, rgbaColor=_TABLE_COLOUR, specularColor=_DULL)
        p.createMultiBody(0, -1, slab, (0, 0, scene["ground"] - thin[2]))
    p.configureDebugVisualizer(lightPosition=scene["light"])
    distance, yaw, pitch, target = scene["camera"]
    p.resetDebugVisualizerCamera(distance, yaw, pitch, target)
    os.write(answers, b".")
    size, first = 7 * 8 * len(numbers), True
    while len(data := source.read(size)) == size and p.isConnected():
        for number, pose in zip(numbers, np.frombuffer(data).reshape(-1, 7).tolist()):
            # Not a number: not there.
            there = pose[0] == pose[0]
            at, turn = (pose[:3], pose[3:]) if there else ((0, 0, _AWAY), (0, 0, 0, 1))
            p.resetBasePositionAndOrientation(number, at, turn)
        if first:
            p.configureDebugVisualizer(p.COV_ENABLE_RENDERING, 1)
            first = False
        os.write(answers, b".")


def _body(p: Any, body: dict[str, Any]) -> int:
    look = {"rgbaColor": [*body["colour"], 1.0], "specularColor": _DULL}
    if body["mesh"] is not None:
        name, position, turn = body["mesh"]
        look |= {"fileName": name, "visualFramePosition": position, "visualFrameOrientation": turn}
    else:
        look |= flat_shaded(np.array(body["triangles"]))
    shape = p.createVisualShape(p.GEOM_MESH, **look)
    return int(p.createMultiBody(0, -1, shape, (0, 0, _AWAY)))


if __name__ == "__main__":
    main()
