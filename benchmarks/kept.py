"""How much sooner a model is understood the second time, when what was read, contacts and blocking are on disk.

Each measurement is a process of its own, compiled functions on disk; ratios of seconds, first to second.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "examples"))
from bearing_block import write

ASK = """
import sys, time
start = time.perf_counter()
import neurosym as ns
world = ns.AssemblyGeometry(ns.Assembly.load(sys.argv[1]))
world.contacts, world.blocking("axes")
print(time.perf_counter() - start)
"""


def seconds(path: Path, cache: str, keep: str) -> float:
    """Of one process that reads a model and asks for contacts and six directions."""
    told = {**os.environ, "NEUROSYM_CACHE": cache, "NEUROSYM_KEEP": keep, "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", ASK, str(path)], env=told, capture_output=True, text=True, check=True)
    return float(done.stdout)


with tempfile.TemporaryDirectory() as folder:
    write(Path(folder))
    print(f"{'model':14} {'anew, s':>8} {'first, s':>9} {'second, s':>10} {'ratio':>6}")
    for path in (Path(folder, "block.step"), Path(folder, "block.glb"), Path(folder, "stl")):
        seconds(path, folder, "0")  # compiles
        anew, first, second = seconds(path, folder, "0"), seconds(path, folder, "1"), seconds(path, folder, "1")
        print(f"{path.name:14} {anew:8.2f} {first:9.2f} {second:10.2f} {anew / second:6.1f}")
