"""A trained network as a model: it reads pictures, and answers with order scores or with an order."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from learned_priors.metrics import decoded
from learned_priors.networks import Logits, OrderNetwork
from neurosym.errors import InputError
from neurosym.planning.order_scores import OrderScores
from neurosym.support.arrays import Numbers, Pixels


@dataclass(frozen=True, eq=False)
class TrainedNetwork:
    """A network, and what its weights say of themselves.

    `header`: prior, domain, actions, network, training, and classes where actions are interchangeable.
    """

    network: OrderNetwork
    header: Mapping[str, Any]

    @property
    def classes(self) -> tuple[int, ...]:
        """One integer an action; empty where each is its own."""
        return tuple(self.header.get("classes", ()))

    def checked(self, pictures: Pixels) -> Pixels:
        """The pictures of one piece of work, if they are such as the network was trained on."""
        expected = self.network.config.picture_shape
        if pictures.shape != expected or pictures.dtype != np.uint8:
            raise InputError(
                f"Expected pictures as uint8 (V, H, W, 3) = {expected}, as this prior was trained on; "
                f"got {pictures.dtype} {pictures.shape}. Render them alike, or train a prior on yours."
            )
        return pictures

    def scores(self, batch: Pixels) -> list[OrderScores]:
        """Order scores from pictures (M, V, H, W, 3); columns named as in the training."""
        actions = tuple(self.header["actions"])
        scores: list[OrderScores] = []
        for logits in self._logits(batch):
            tables, lengths = self.network.tables(logits)
            by_table = [None] * len(tables) if lengths is None else lengths
            scores += [OrderScores(table, actions, length, self.classes) for table, length in zip(tables, by_table)]
        return scores

    def orders(self, batch: Pixels, *, assigned: bool, sum_classes: bool) -> Numbers:
        """The network's own orders: int64 (M, T), -1 after the last step.

        Args:
            assigned: the likeliest number of steps, and the best assignment of actions to them; otherwise the
                likeliest action of each step by itself, which may be the same twice.
            sum_classes: sum the probabilities of interchangeable actions before they are assigned.
        """
        classes = self.classes if sum_classes else ()
        orders = [np.empty((0, self.network.config.n_steps), dtype=np.int64)]
        for logits in self._logits(batch):
            if assigned:
                table, length = self.network.tables(logits)
                orders.append(decoded(table, classes, log_length=length))
            else:
                orders.append(_likeliest_by_step(logits))
        return np.concatenate(orders)

    def _logits(self, batch: Pixels) -> Iterator[Logits]:
        """The network's answers, chunk by chunk."""
        if len(batch):
            self.checked(batch[0])
        for pictures in self.network.chunks(batch):
            with torch.inference_mode():
                logits: Logits = self.network(self.network.prepare(pictures))
            yield logits


def _likeliest_by_step(logits: Logits) -> Numbers:
    """Each step by itself: int64 (B, T), -1 from the first step on whose likeliest choice is to stop."""
    steps, actions = logits.order.shape[1:]
    if logits.length is not None:
        ended = torch.arange(steps, device=logits.order.device) >= logits.length.argmax(dim=-1, keepdim=True)
        choice = logits.order.argmax(dim=-1)
    else:
        stop = [] if logits.stop is None else [logits.stop[..., None]]
        choice = torch.cat([logits.order, *stop], dim=-1).argmax(dim=-1)
        ended = (choice == actions).cumsum(dim=-1) > 0
    order: Numbers = choice.masked_fill(ended, -1).cpu().numpy()
    return order
