"""Priors: what gives order scores for problems, before any search."""

from __future__ import annotations

import zlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from neurosym.errors import InputError
from neurosym.planning.order_scores import OrderScores
from neurosym.support.arrays import Pixels

if TYPE_CHECKING:
    from neurosym.language.problem import Problem


class Prior(ABC):
    """A prior: one method, batched over problems."""

    @abstractmethod
    def scores(self, problems: Sequence[Problem]) -> list[OrderScores]:
        """One `OrderScores` a problem, each with as many columns as the problem has action primitives."""


class UniformPrior(Prior):
    """Knows nothing: planners break the ties."""

    def scores(self, problems: Sequence[Problem]) -> list[OrderScores]:
        return [OrderScores.uniform(len(p.actions), p.actions, p.classes) for p in problems]


class RandomPrior(Prior):
    """Believes in one random permutation a problem, drawn from the seed and the problem's name."""

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed

    def scores(self, problems: Sequence[Problem]) -> list[OrderScores]:
        found = []
        for problem in problems:
            rng = np.random.default_rng([self.seed, zlib.crc32(problem.name.encode())])
            order = [int(a) for a in rng.permutation(len(problem.actions))]
            found.append(OrderScores.from_order(order, problem.actions))
        return found


def as_picture_batch(pictures: ArrayLike) -> tuple[Pixels, bool]:
    """Pictures as uint8 (M, V, H, W, 3), and whether one set (V, H, W, 3) was given instead of a batch."""
    array = np.asarray(pictures)
    if array.dtype != np.uint8 or array.ndim not in (4, 5) or array.shape[-1] != 3:
        raise InputError(
            "Expected pictures as uint8 of shape (V, H, W, 3), or a batch (M, V, H, W, 3); "
            f"got {array.dtype} of shape {array.shape}."
        )
    return (array[None], True) if array.ndim == 4 else (array, False)
