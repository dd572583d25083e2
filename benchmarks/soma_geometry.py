"""Building a Soma problem with all its geometry through FCL, and answering attempts afterwards."""

from __future__ import annotations

import itertools
import statistics
import time

import neurosym as ns
from domains.collapse import RULES, stacks_of


def build(number: int, rule: str) -> tuple[ns.Problem, float]:
    """A problem with every table that its rule needs, and the milliseconds it took."""
    start = time.perf_counter()
    problem = soma.problem(number, collapse=rule)
    if rule == "rigid":
        problem.geometry.blocking()
        _ = problem.geometry.stability
    else:
        stacks_of(problem.geometry)
    return problem, 1e3 * (time.perf_counter() - start)


def attempts(problem: ns.Problem) -> list[float]:
    """Microseconds an attempt, the first time each (state, action) of the problem is asked."""
    search = problem.ground()
    seen, waiting, times = {search.initial}, [search.initial], []
    while waiting:
        state = waiting.pop()
        for action in search.candidates(state):
            start = time.perf_counter()
            answer = search.attempt(state, action)
            times.append(1e6 * (time.perf_counter() - start))
            if isinstance(answer, ns.Step) and answer.state not in seen:
                seen.add(answer.state)
                waiting.append(answer.state)
    return times


soma = ns.load_domain("soma")
soma.solutions()
print("rule     build, ms: median (max)   attempt, µs: median, mean (each asked once)")
for rule in RULES:
    numbers = range(0, 240, 8 if rule != "rigid" else 40)
    build(0, rule)  # imports
    problems = [build(n, rule) for n in numbers]
    times = list(itertools.chain.from_iterable(attempts(p) for p, _ in problems))
    ms = [t for _, t in problems]
    print(
        f"{rule:8} {statistics.median(ms):10.1f} ({max(ms):.1f}) {statistics.median(times):20.1f}, "
        f"{statistics.mean(times):.1f}   ({len(times)} attempts)"
    )
