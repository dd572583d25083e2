"""The question of standing as one linear program, solved with slack in its equations (HiGHS, by scipy)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csc_array, hstack

from neurosym.errors import NeurosymError
from neurosym.geometry.contact.contacts import TABLE
from neurosym.geometry.stability.equilibrium import BALANCE, CONE_EDGES, Balance, Equilibrium
from neurosym.support.arrays import Numbers
from neurosym.support.deadline import check, remaining


def solve_program(whole: Equilibrium, parts: Numbers, corners: Numbers, names: Sequence[str]) -> Balance:
    """The least unbalanced weight, ``min 1's+ + 1's-  such that  A f + s+ - s- = w,  f, s >= 0``.

    Zero slack is equilibrium; where there is none, the dual values are a virtual motion that nothing resists.

    Args:
        whole: the assembly's corners; `parts` (m,) and `corners` (k,) are numbers of the movable parts and of corners
            with at least one of them.
        names: of the parts that are there, for the message where the solver fails.
    """
    if not len(parts):
        return Balance(True, np.zeros((0, CONE_EDGES)), np.zeros((0, 6)))
    place = np.full(len(whole.weights) + 1, -1)
    place[parts] = np.arange(len(parts))
    rows, columns, values = [], [], []
    width = len(corners) * CONE_EDGES
    for part, wrench in ((whole.a, whole.on_a), (whole.b, whole.on_b)):
        own = place[np.where(part[corners] == TABLE, len(whole.weights), part[corners])]
        kept = np.flatnonzero(own >= 0)
        shape = len(kept), 6, CONE_EDGES
        rows.append(np.broadcast_to((6 * own[kept, None] + np.arange(6))[..., None], shape).ravel())
        edge = CONE_EDGES * kept[:, None] + np.arange(CONE_EDGES)
        columns.append(np.broadcast_to(edge[:, None], shape).ravel())
        values.append((wrench[corners[kept]] @ whole.edges).ravel())
    count = 6 * len(parts)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    matrix = csc_array(entries, shape=(count, width))
    identity = np.arange(count)
    slack = csc_array((np.ones(count), (identity, identity)), shape=(count, count))
    result = linprog(
        np.concatenate([np.zeros(width), np.ones(2 * count)]),
        A_eq=hstack([matrix, slack, -slack], format="csc"),
        b_eq=whole.weights[parts].ravel(),
        method="highs-ds",
        options={} if math.isinf(remaining()) else {"time_limit": max(remaining(), 0.0)},
    )
    check()
    if result.status != 0:
        raise NeurosymError(
            f"Expected the stability program of {', '.join(names)} to have a solution; "
            f"the solver said: {result.message}. Check the scale of the parts (their units)."
        )
    forces = result.x[:width].reshape(-1, CONE_EDGES)
    residual = result.eqlin.marginals.reshape(-1, 6)
    return Balance(bool(result.fun <= BALANCE * len(parts)), forces, residual)
