"""Soma cubes to learn from: pictures with orders, for the two training recipes.

``paper``  one demonstration a cube. The paper's demonstrator was a person; ours has a habit: of the pieces that
           may leave under the rule `strict`, the topmost first (highest mean cube), ties by the letters' order.
``full``   symbolic supervision: each cube in all 48 poses (under a reflection A and B change names), with the
           share of all valid `strict` orders that have each piece at each step, counted by the planner.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from domains.soma_pieces import LETTERS, Cell, symmetries, turned
from neurosym.errors import ContractError, InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.language.demonstrations import Demonstrations
from neurosym.language.problem_family import Progress
from neurosym.language.search_problem import Step
from neurosym.planning.planner import OrderCounter
from neurosym.registry import load_planner
from neurosym.support.arrays import Array, Numbers
from neurosym.support.disk_cache import cache_folder, load, store

if TYPE_CHECKING:
    from domains.soma import SomaFamily
    from neurosym.language import Problem

RECIPES = ("full", "paper")
#: Raise it whenever the same cube would get other labels: they are kept on disk.
LABELS_VERSION = 1


def check_seed(seed: object) -> None:
    """Refuse what numpy takes for no seed."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError(f"Expected a seed, an integer of 0 or more; got {seed!r}.")


def picture_seed(seed: int, number: int, pose: int = 0) -> int:
    """The seed of one picture: of cube `number` in pose number `pose`."""
    check_seed(seed)
    return int(np.random.SeedSequence([seed, number, pose]).generate_state(1)[0])


def demonstrate(
    family: SomaFamily,
    numbers: Sequence[int],
    *,
    recipe: str,
    style: str,
    seed: int,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Demonstrations:
    """Demonstrations for the cubes of these numbers; pictures and labels come from disk where they were made before."""
    from neurosym.simulation.render import cached_pictures

    if recipe not in RECIPES:
        raise UnknownNameError("recipe", recipe, RECIPES)
    cubes = family.solutions()
    poses = range(48) if recipe == "full" else range(1)
    jobs, sequences, marginals, groups = [], [], [], []
    total = 2 * len(numbers) * len(poses)
    for k, number in enumerate(numbers):
        orders, shares = _labels(family, cubes[number])
        for pose in poses:
            cells = turned(cubes[number], symmetries()[pose])
            jobs.append((Assembly.from_cells(cells), picture_seed(seed, number, pose)))
            groups.append(number)
        sequences.append(orders[: len(poses)])
        marginals.append(shares[: len(poses)])
        if progress is not None:
            progress((k + 1) * len(poses), total)

    def rendered(done: int, of: int) -> None:
        if progress is not None:
            progress(total - of + done, total)

    pictures = cached_pictures(jobs, style=style, workers=workers or os.cpu_count() or 1, progress=rendered)
    return Demonstrations(
        pictures=pictures,
        sequences=np.concatenate(sequences),
        actions=LETTERS,
        marginals=np.concatenate(marginals) if recipe == "full" else None,
        groups=np.array(groups),
        domain=family.name,
    )


def habit(problem: Problem) -> tuple[str, ...]:
    """The demonstrator's order: whatever may leave, the topmost piece first, ties by the order of the pieces."""
    world, search = problem.world, problem.ground()
    heights = {name: float(world.X_WB[world.owners == i, 2, 3].mean()) for i, name in enumerate(world.names)}
    ranked = sorted(range(len(search.actions)), key=lambda a: (-round(heights[search.actions[a]], 6), a))
    state, order = search.initial, []
    while not search.is_goal(state):
        possible = set(search.candidates(state))
        for action in ranked:
            answer = search.attempt(state, action) if action in possible else None
            if isinstance(answer, Step):
                state = answer.state
                order.append(search.actions[action])
                break
        else:
            raise ContractError(f"Expected the demonstrator to finish {problem.name!r}; stuck after {order}.")
    return tuple(order)


def _labels(family: SomaFamily, cells: Mapping[str, tuple[Cell, ...]]) -> tuple[Numbers, NDArray[np.float32]]:
    """For a cube in its 48 poses: the demonstrator's orders, int64 (48, 7), and the shares, float32 (48, 7, 7)."""
    key = hashlib.sha256(repr((LABELS_VERSION, sorted(cells.items()))).encode()).hexdigest()
    folder = cache_folder() / "soma-labels"
    orders, shares = np.zeros((48, 7), dtype=np.int64), np.zeros((48, 7, 7), dtype=np.float32)
    paths = folder / f"{key}-orders.z", folder / f"{key}-shares.z"
    if not (load(paths[0], orders) and load(paths[1], shares)):
        orders, shares = _count_labels(family, dict(cells))
        store(paths[0], orders)
        store(paths[1], shares)
    return orders, shares


def _count_labels(family: SomaFamily, cells: dict[str, tuple[Cell, ...]]) -> tuple[Numbers, NDArray[np.float32]]:
    """Gravity tells only which way is up, so six problems answer for 48 poses."""
    swap = [LETTERS.index({"A": "B", "B": "A"}.get(name, name)) for name in LETTERS]
    known: dict[tuple[int, ...], tuple[Numbers, Array]] = {}
    orders = np.zeros((48, 7), dtype=np.int64)
    shares = np.zeros((48, 7, 7), dtype=np.float32)
    counter = load_planner("exhaustive")
    assert isinstance(counter, OrderCounter)
    for pose, symmetry in enumerate(symmetries()):
        up = tuple(map(int, symmetry[2]))
        mirrored = np.linalg.det(symmetry) < 0
        if up not in known:  # rotations come first, and every way up has one
            problem = family.problem_from_cells(turned(cells, symmetry), collapse="strict")
            order = np.array([LETTERS.index(name) for name in habit(problem)])
            known[up] = order, counter.order_marginals(problem.ground())
        order, share = known[up]
        orders[pose] = [swap[a] for a in order] if mirrored else order
        shares[pose] = share[:, swap] if mirrored else share
    return orders, shares
