"""A trained network as a model: it reads pictures, and answers with order scores or with an order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from learned_priors.metrics import decoded
from learned_priors.networks import Logits, OrderNetwork, Prediction
from neurosym.errors import InputError
from neurosym.planning.order_scores import OrderScores


@dataclass(frozen=True, eq=False)
class TrainedNetwork:
    """A network, and what its weights say of themselves.

    Attributes:
        header: prior, domain, actions, network, training, and classes where actions are interchangeable.
    """

    network: OrderNetwork
    header: Mapping[str, Any]

    @property
    def classes(self) -> tuple[int, ...]:
        """One integer an action; empty where each is its own."""
        return tuple(self.header.get("classes", ()))

    def checked(self, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The pictures of one piece of work, if they are such as the network was trained on."""
        expected = self.network.config.picture_shape
        if pictures.shape != expected or pictures.dtype != np.uint8:
            raise InputError(
                f"Expected pictures as uint8 (V, H, W, 3) = {expected}, as this prior was trained on; "
                f"got {pictures.dtype} {pictures.shape}. Render them alike, or train a prior on yours."
            )
        return pictures

    def scores(self, batch: NDArray[np.uint8]) -> list[OrderScores]:
        """Order scores from pictures (M, V, H, W, 3); columns named as in the training."""
        actions = tuple(self.header["actions"])
        scores: list[OrderScores] = []
        for logits in self._logits(batch):
            tables, lengths = self.network.tables(logits)
            by_table = [None] * len(tables) if lengths is None else lengths
            scores += [OrderScores(table, actions, length, self.classes) for table, length in zip(tables, by_table)]
        return scores

    def orders(
        self,
        batch: NDArray[np.uint8],
        *,
        predicts: Prediction,
        sum_classes: bool,
        lengths: NDArray[np.int64] | None = None,
    ) -> NDArray[np.int64]:
        """The network's own orders: int64 (M, T), -1 after the last step.

        Args:
            predicts: see `learned_priors.recipes.Recipe`.
            sum_classes: sum the probabilities of interchangeable actions before they are assigned.
            lengths: int64 (M,), the numbers of steps where they are known; None reads them, too.
        """
        if predicts not in get_args(Prediction):
            raise InputError(f"Expected how to predict, one of {', '.join(get_args(Prediction))}; got {predicts!r}.")
        classes = self.classes if sum_classes else ()
        orders = [np.empty((0, self.network.config.n_steps), dtype=np.int64)]
        for logits in self._logits(batch):
            table, length = self.network.tables(logits)
            done = sum(len(own) for own in orders)
            steps = None if lengths is None else lengths[done : done + len(table)]
            if steps is not None:
                length = np.where(np.arange(table.shape[1] + 1) == steps[:, None], 0.0, -np.inf)
            if predicts == "assignment":
                orders.append(decoded(table, classes, log_length=length))
                continue
            if predicts == "independent":
                order = table.argmax(axis=-1)
            elif predicts == "published-assignment":
                order = np.stack([linear_sum_assignment(1 - np.exp(rows))[1] for rows in table])
            else:
                order = self._nearest_number(table)
            steps = _likeliest_length(logits) if steps is None else steps
            order[np.arange(order.shape[1]) >= steps[:, None]] = -1
            orders.append(order)
        return np.concatenate(orders)

    def _nearest_number(self, table: NDArray[np.float64]) -> NDArray[np.int64]:
        """Of each step the action whose number is next to the expected one, int64 (B, T)."""
        numbers = self.header["training"]["config"].get("numbers") or range(table.shape[-1])
        number = np.asarray(numbers, dtype=np.float64)
        expected = np.exp(table) @ number
        nearest: NDArray[np.int64] = np.abs(expected[..., None] - number).argmin(axis=-1)
        return nearest

    def _logits(self, batch: NDArray[np.uint8]) -> Iterator[Logits]:
        """The network's answers, chunk by chunk."""
        if len(batch):
            self.checked(batch[0])
        for pictures in self.network.chunks(batch):
            with torch.inference_mode():
                logits: Logits = self.network(self.network.prepare(pictures))
            yield logits


def _likeliest_length(logits: Logits) -> NDArray[np.int64]:
    """int64 (B,): the likeliest number of steps, or those before the first whose likeliest choice is to stop."""
    if logits.length is not None:
        length: NDArray[np.int64] = logits.length.argmax(dim=-1).cpu().numpy()
        return length
    if logits.stop is None:
        return np.full(logits.order.shape[0], logits.order.shape[1])
    going = (logits.order.amax(dim=-1) >= logits.stop).cpu().numpy()
    before_the_stop: NDArray[np.int64] = np.cumprod(going, axis=1, dtype=np.int64).sum(axis=1)
    return before_the_stop
