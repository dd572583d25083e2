"""What the swept-bounds filter and the pairwise table save: the same answers, three ways, in one run."""

from __future__ import annotations

import random
import time

import neurosym as ns
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.support.bitsets import bits

#: One question to the table is shorter than a clock is exact.
REPEATS = 100

soma = ns.load_domain("soma")
chance = random.Random(0)
table = stepped = filtered = unfiltered = 0.0
questions = wrong = 0
for number in range(0, 240, 30):
    assembly = ns.Assembly.from_cells(soma.solutions()[number])
    start = time.perf_counter()
    geometry = AssemblyGeometry(assembly)
    graph = geometry.blocking()
    filtered += time.perf_counter() - start
    n = len(assembly.bodies)
    unfiltered += n * (n - 1) * len(graph.directions)
    for _ in range(40):
        there = chance.randrange(1, 1 << len(assembly))
        part = chance.choice(bits(there))
        direction = chance.randrange(len(graph.directions))
        start = time.perf_counter()
        for _ in range(REPEATS):
            quick = graph.blockers(part, direction, there)
        table += (time.perf_counter() - start) / REPEATS
        start = time.perf_counter()
        slow = geometry.hits_along(part, graph.directions[direction], there & ~(1 << part))
        stepped += time.perf_counter() - start
        questions += 1
        wrong += quick != slow
    pairs = graph.queries
print(f"pairs of cubes put to FCL: {pairs} of {n * (n - 1) * len(graph.directions)} in the last cube")
print(f"table of all pairs, six directions: {1e3 * filtered / 8:.1f} ms a cube")
micro, milli = 1e6 * table / questions, 1e3 * stepped / questions
print(f"a question about a subset: {micro:.2f} µs from the table, {milli:.2f} ms by stepping through FCL")
print(f"ratio {stepped / table:.0f}; {wrong} of {questions} answers differ")
