"""What stands, by springs and by limit analysis: against simulation, and how fast.

    python benchmarks/standing.py [agreement [SUBSETS]] [speed] [sizes]

agreement: random subsets of random Soma cubes, as rigid pieces, against PyBullet; what differs is put to MuJoCo, too
(extra `mujoco`). speed: parts are taken out as chance has it, topmost likelier, and after each the question is whether
the rest stands; what falls is put back. The same questions, in that order, go to springs, to limit analysis and to one
linear program each (HiGHS). sizes: walls of bricks, a pyramid, real structures: judged whole, with two parts taken out
anywhere (by springs alone, and as it is asked), and, where nothing is fixed, taken down from the top.
CPU seconds of one thread, the contacts known beforehand.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from assembly_scaling import pyramid, wall

import neurosym as ns
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.stability.of_assembly import spring_stability
from neurosym.geometry.stability.spring_stability import SpringStability
from neurosym.simulation.world import stands
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
    rng, stability = np.random.default_rng(0), AssemblyGeometry(assembly, tabulate=False).limit
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


def by_springs_of(assembly: ns.Assembly) -> SpringStability:
    return spring_stability(assembly, AssemblyGeometry(assembly).contacts)


def agreement(subsets: int, seed: int = 1000) -> None:
    """Springs and limit analysis against PyBullet."""
    rng, soma = np.random.default_rng(seed), ns.load_domain("soma")
    wrong = {"springs": [0, 0], "limit analysis": [0, 0]}
    for _ in range(subsets):
        number, gone = int(rng.integers(240)), rng.choice(7, int(rng.integers(1, 6)), replace=False)
        world = soma.problem(number, collapse="rigid").world
        subset = 0b1111111 & ~sum(1 << int(k) for k in gone)
        names = world.in_mask(subset)
        seen = not stands(world, present=names)
        springs = by_springs_of(world)
        answers = {
            "springs": springs.standing(subset),
            "limit analysis": AssemblyGeometry(world).limit.standing(subset),
        }
        for name, answer in answers.items():
            wrong[name][answer.stands] += answer.stands != seen
        if answers["springs"].stands != seen:
            others = f"PyBullet {_word(seen)}{referee(world, names)}"
            print(f"  cube {number}, {' '.join(names)}: springs: {_word(not seen)}; {others}")
            for movement in springs.movements(subset)[:1]:
                print(f"    {movement.sentence(world.names)} {movement.share:.0%} of its weight is not carried.")
    for name, (falls, rests) in wrong.items():
        alike = 1 - (falls + rests) / subsets
        print(f"{name:15} {alike:.2%} of {subsets} alike; {rests} wrong 'stands', {falls} wrong 'falls'", flush=True)


def referee(world: ns.Assembly, names: tuple[str, ...]) -> str:
    """What MuJoCo says, where it is installed."""
    try:
        from mujoco_referee import settled
    except ImportError:
        return ""
    return f", MuJoCo {_word(max(settled(world, names).values()) < 0.2)}"


def _word(stands: bool) -> str:
    return "stands" if stands else "falls"


def measure(name: str, assembly: ns.Assembly, program: bool = True) -> None:
    """The same questions to springs, limit analysis and linear programs."""
    asked = questions(assembly)
    springs, quick = by_springs_of(assembly), AssemblyGeometry(assembly).limit
    slow = AssemblyGeometry(assembly, tabulate=False).limit
    springs.standing((1 << len(assembly)) - 1)
    start = time.process_time()
    by_springs = [springs.standing(subset).stands for subset in asked]
    first = time.process_time()
    by_limit = [quick.standing(subset).stands for subset in asked]
    second = time.process_time()
    if program:
        assert len([slow.by_program(subset).stands for subset in asked]) == len(asked)
    end = time.process_time()
    each = [1e3 * t / len(asked) for t in (first - start, second - first, end - second)]
    falls = sum(b and not a for a, b in zip(by_springs, by_limit))
    stands_ = sum(a and not b for a, b in zip(by_springs, by_limit))
    print(
        f"{name:11} {len(assembly):5} {each[0]:9.1f} {each[1]:9.1f} {each[2]:9.1f}   of {len(asked)} {sum(by_springs)}"
        f" stand; limit analysis: {falls} more, {stands_} fewer",
        flush=True,
    )


def size(name: str, assembly: ns.Assembly) -> None:
    """How long it takes to judge the whole, what has lost parts from its midst, and each step of taking it down."""
    full, rng = (1 << len(assembly)) - 1, np.random.default_rng(0)
    contacts = AssemblyGeometry(assembly).contacts
    start = time.process_time()
    springs = spring_stability(assembly, contacts)
    built = time.process_time() - start
    loose = bits(full & ~assembly.fixed_mask)
    asked = [full & ~sum(1 << int(k) for k in rng.choice(loose, 2, replace=False)) for _ in range(20)]
    whole = _milliseconds(lambda subset: springs.settled(subset), [full] * 3)
    alone = _milliseconds(lambda subset: springs.settled(subset), asked)
    midst = _milliseconds(springs.standing, asked)
    down, order = [], sorted(loose, key=lambda k: -assembly.body_bounds[assembly.owners == k, 1, 2].max())
    for part in order if assembly.fixed_mask == 0 else []:
        down.append(full & ~(1 << part) if not down else down[-1] & ~(1 << part))
    top = _milliseconds(spring_stability(assembly, contacts).standing, down[:-1]) if down else np.zeros(1)
    figures = np.median(whole), np.median(alone), np.median(midst), midst.max(), top.mean()
    told = " ".join(f"{x:8.1f}" for x in figures)
    print(f"{name:11} {len(assembly):5} {built:8.2f} {told}   {_counts(springs)}", flush=True)


def _milliseconds(ask, asked: list[int]) -> np.ndarray:
    seconds = []
    for subset in asked:
        start = time.process_time()
        ask(subset)
        seconds.append(1e3 * (time.process_time() - start))
    return np.array(seconds)


def _counts(springs: SpringStability) -> str:
    return ", ".join(f"{n} by {name}" for name, n in springs.asked.items() if n)


if __name__ == "__main__":
    words = sys.argv[1:] or ["agreement", "speed", "sizes"]
    number = next((int(w) for w in words if w.isdigit()), 400)
    if "agreement" in words:
        agreement(number)
    structures = {name: DATA / name for name in ("arch", "wall", "crossvault", "dome")}
    if "speed" in words:
        print("structure   parts  ms each: springs, limit analysis, linear program")
        measure("bricks 6x5", bricks(6, 5))
        measure("bricks 15x8", bricks(15, 8))
        for name, folder in structures.items():
            if folder.is_dir() and name != "dome":
                measure(name, ns.Assembly.load(folder))
    if "sizes" in words:
        print("structure   parts  build s  ms: whole, springs alone, a question, longest, taken down")
        for n in (10, 22, 31):
            size(f"wall-{n}", ns.Assembly.from_cells(wall(n, n)))
        size("pyramid-14", ns.Assembly.from_cells(pyramid(14)))
        for name, folder in structures.items():
            if folder.is_dir():
                size(name, ns.Assembly.load(folder))
