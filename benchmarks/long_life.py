"""How much a process grows that plans again and again: MB of resident memory over 2,000 Soma cubes, made and solved.

    python benchmarks/long_life.py [SOLVES]

The first 240 are left out: what is kept by design (the 240 solutions, compiled code) is there by then.
"""

from __future__ import annotations

import gc
import sys
from pathlib import Path

import neurosym as ns

#: Bytes of a page of memory.
PAGE = 4096


def resident() -> float:
    """MB of resident memory (Linux)."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE / 1e6


def main(solves: int) -> None:
    soma = ns.load_domain("soma")
    for number in range(240):
        ns.solve(soma.problem(number), rng=0)
    before = resident()
    for number in range(solves):
        ns.solve(soma.problem(number % 240), rng=number)
    print(f"{resident() - before:.1f} MB over {solves:,} solves; {before:.0f} MB before")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2_000)
