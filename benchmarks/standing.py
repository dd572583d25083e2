"""What judging by Newton's method on contact forces saves, against one linear program a question; do they agree?

Parts are taken out as chance has it, topmost likelier, and after each the question is whether the rest stands; what
falls is put back. The same questions go to the library, in that order, and to HiGHS. CPU seconds of one thread, the
contacts known beforehand. Of the dome every 17th stone is asked about, and only of the library: a linear program takes
minutes there.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import neurosym as ns
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.support.bitsets import bits

DATA = Path(__file__).parents[2] / "shared" / "data"

#: Questions a structure.
QUESTIONS = 40


def bricks(length: int, height: int) -> ns.Assembly:
    """Bricks of two cells in running bond."""
    cells = {
        f"{z}-{x}": [(2 * x + z % 2, 0, z), (2 * x + z % 2 + 1, 0, z)] for z in range(height) for x in range(length)
    }
    return ns.Assembly.from_cells(cells)


def questions(assembly: ns.Assembly) -> list[int]:
    """Bitsets of parts, each what is left after one more removal from the last that stood."""
    rng, stability = np.random.default_rng(0), AssemblyGeometry(assembly, tabulate=False).stability
    height = np.array([assembly.body_bounds[assembly.owners == k, 1, 2].max() for k in range(len(assembly))])
    there, asked = (1 << len(assembly)) - 1, []
    while len(asked) < QUESTIONS and there & ~assembly.fixed_mask:
        loose = np.array(bits(there & ~assembly.fixed_mask))
        top = np.exp(4 * (height[loose] - height[loose].max()) / np.ptp(height))
        left = there & ~(1 << int(rng.choice(loose, p=top / top.sum())))
        asked.append(left)
        if stability.standing(left).stands:
            there = left
    return asked


def measure(name: str, assembly: ns.Assembly) -> None:
    asked = questions(assembly)
    quick, slow = AssemblyGeometry(assembly).stability, AssemblyGeometry(assembly, tabulate=False).stability
    start = time.process_time()
    answers = [quick.standing(subset).stands for subset in asked]
    middle = time.process_time()
    program = [slow.by_program(subset).stands for subset in asked]
    end = time.process_time()
    differ = sum(a != b for a, b in zip(answers, program))
    ours, theirs = (middle - start) / len(asked), (end - middle) / len(asked)
    print(
        f"{name:11} {len(assembly):5} {1e3 * ours:12.1f} {1e3 * theirs:15.1f} {theirs / ours:7.1f}"
        f"   {differ} of {len(asked)} differ, {sum(answers)} stand",
        flush=True,
    )


if __name__ == "__main__":
    print("structure   parts  ours, ms each  program, ms each  ratio")
    measure("bricks 6x5", bricks(6, 5))
    measure("bricks 15x8", bricks(15, 8))
    for name in ("arch", "wall", "crossvault", "dome"):
        if not (DATA / name).is_dir():
            print(f"{name:11} skipped: no ../shared/data/{name} here")
        elif name != "dome":
            measure(name, ns.Assembly.load(DATA / name))
        else:
            dome = ns.Assembly.load(DATA / name)
            stability, full, seconds = AssemblyGeometry(dome).stability, (1 << len(dome)) - 1, []
            stability.standing(full)
            for part in bits(full & ~dome.fixed_mask)[::17]:
                start = time.process_time()
                stability.standing(full & ~(1 << part))
                seconds.append(time.process_time() - start)
            said = f"median {np.median(seconds):.2f} s, longest {max(seconds):.2f} s"
            print(f"{name:11} {len(dome):5} {said} of {len(seconds)}; {stability.asked['program']} went to a program")
