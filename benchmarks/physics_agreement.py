"""How often geometry and PyBullet give the same first failure, over random orders of removal."""

from __future__ import annotations

import sys

import numpy as np

import neurosym as ns
from neurosym.pipeline import open_oracle


def first_failure(search: ns.SearchProblem, order: list[int]) -> int | None:
    state = search.initial
    for step, action in enumerate(order):
        answer = search.attempt(state, action)
        if isinstance(answer, ns.Rejection):
            return step
        state = answer.state
    return None


soma = ns.load_domain("soma")
orders = {"cubes": 240, "rigid": 40}
if len(sys.argv) > 1:
    orders = dict.fromkeys(orders, int(sys.argv[1]))
rng = np.random.default_rng(0)
for rule, count in orders.items():
    same, apart = 0, []
    for _ in range(count):
        number = int(rng.integers(240))
        problem = soma.problem(number, collapse=rule)
        order = [int(a) for a in rng.permutation(7)]
        by_geometry = first_failure(problem.ground(), order)
        with open_oracle(problem, "physics") as search:
            by_physics = first_failure(search, order)
        same += by_geometry == by_physics
        if by_geometry != by_physics:
            apart.append((number, "".join(problem.actions[a] for a in order), by_geometry, by_physics))
    print(f"{rule}: same first failure in {same} of {count} random orders")
    for number, order, ours, theirs in apart:
        print(f"  cube {number}, order {order}: geometry stops at {ours}, PyBullet at {theirs}")
