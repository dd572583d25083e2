"""What the networks are trained on: log-probabilities by step against demonstrated orders, or shares of valid ones."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import functional

from learned_priors.networks import Logits
from learned_priors.sinkhorn import gumbel_sinkhorn, log_sinkhorn
from learned_priors.train_config import TrainConfig


def targets_of(sequences: Tensor, n_actions: int, marginals: Tensor | None = None) -> Tensor:
    """float32 (M, T, N): the marginals, or one-hot sequences (int64 (M, T), -1 where a step is not taken).

    Steps that are not taken are rows of zeros; the losses below leave them out (the paper's masking, Sec. IV-B).
    """
    taken = sequences >= 0
    target = marginals if marginals is not None else functional.one_hot(sequences.clamp(min=0), n_actions)
    return target.to(torch.float32) * taken[..., None]


def summed_by_class(log_prob: Tensor, classes: Sequence[int]) -> Tensor:
    """Log of each class's probability: (..., N) -> (..., C), classes in increasing order.

    Interchangeable actions (two blocks of one colour) cannot be told apart in a picture; asking for one of them by
    name asks the network to guess.
    """
    ids, column = torch.unique(torch.as_tensor(list(classes), device=log_prob.device), return_inverse=True)
    if len(ids) == log_prob.shape[-1]:
        return log_prob[..., torch.argsort(column)]
    index = column.expand_as(log_prob)
    empty = log_prob.new_full((*log_prob.shape[:-1], len(ids)), -torch.inf)
    # The largest member is taken out first, so that no class underflows; it only shifts, so it needs no gradient.
    top = empty.scatter_reduce(-1, index, log_prob.detach(), "amax")
    share = torch.exp(log_prob - top.gather(-1, index))
    return torch.zeros_like(empty).scatter_add(-1, index, share).log() + top


def cross_entropy(log_prob: Tensor, target: Tensor, classes: Sequence[int] = ()) -> Tensor:
    """Mean over the steps taken of -sum_j target_ij log P_ij (nats). Both (B, T, N); actions summed by class."""
    if classes:
        log_prob = summed_by_class(log_prob, classes)
        ids, column = torch.unique(torch.as_tensor(list(classes), device=target.device), return_inverse=True)
        summed = target.new_zeros((*target.shape[:-1], len(ids)))
        target = summed.scatter_add(-1, column.expand_as(target), target)
    steps = target.sum(dim=-1).sum().clamp(min=1.0)
    return -(target * log_prob).sum() / steps


def squared_error(log_samples: Tensor, target: Tensor) -> Tensor:
    """The paper's loss (eq. 7): mean squared difference of P a_o and a_j, a_o the identity, over steps taken.

    Shapes: samples of log P (K, B, T, N); one-hot demonstrations (B, T, N).
    """
    taken = target.sum(dim=-1, keepdim=True) > 0
    off = (log_samples.exp() - target) ** 2 * taken
    entries = taken.sum().clamp(min=1) * target.shape[-1] * log_samples.shape[0]
    return off.sum() / entries


def squared_error_of_numbers(log_samples: Tensor, target: Tensor, numbers: Sequence[int] = ()) -> Tensor:
    """As the towers' code was published: a_o holds the actions' numbers, so each step's expected number is compared.

    Actions of neighbouring numbers are then nearly alike. Where these are interchangeable blocks, which the picture
    does not tell apart, that is a hint that one-hot vectors do not give. Shapes as for `squared_error`.
    """
    number = torch.arange(target.shape[-1]) if not numbers else torch.as_tensor(list(numbers))
    number = number.to(target)
    off = ((log_samples.exp() @ number - target @ number) ** 2) * (target.sum(dim=-1) > 0)
    return off.sum() / ((target.sum(dim=-1) > 0).sum().clamp(min=1) * log_samples.shape[0])


def loss_of(logits: Logits, target: Tensor, config: TrainConfig) -> Tensor:
    """The training loss of logits against targets (B, T, N), a scalar.

    Where the network answers with a number of steps, that is learned by cross-entropy beside the order, which is
    learned on the steps taken; where stopping is an action, it is the right one at every step not taken.
    """
    if logits.stop is not None:
        joint = torch.cat([logits.order, logits.stop[..., None]], dim=-1)
        target = functional.pad(target, (0, 0, 0, joint.shape[1] - target.shape[1]))
        stopped = torch.cat([target, (target.sum(dim=-1, keepdim=True) == 0).to(target.dtype)], dim=-1)
        classes = (*config.classes, max(config.classes) + 1) if config.classes else ()
        return cross_entropy(_by_row(joint, config), stopped, classes)
    loss = _order_loss(logits.order, target, config)
    if logits.length is not None:
        steps = (target.sum(dim=-1) > 0).sum(dim=-1)
        loss = loss + functional.cross_entropy(logits.length, steps)
    return loss


def _order_loss(order: Tensor, target: Tensor, config: TrainConfig) -> Tensor:
    temperature, iterations = config.temperature, config.iterations
    if config.loss in ("gumbel-sinkhorn", "gumbel-sinkhorn-numbers"):
        samples = gumbel_sinkhorn(
            order, samples=config.samples, temperature=temperature, noise=config.noise, iterations=iterations
        )
        if config.loss == "gumbel-sinkhorn-numbers":
            return squared_error_of_numbers(samples, target, config.numbers)
        return squared_error(samples, target)
    if config.loss == "sinkhorn":
        log_prob = log_sinkhorn(order / temperature, tolerance=None, max_iterations=iterations)
    else:
        log_prob = _by_row(order, config)
    return cross_entropy(log_prob, target, config.classes)


def _by_row(logits: Tensor, config: TrainConfig) -> Tensor:
    """Log-probabilities of a row's entries. A softmax of the softmax is at most e times as sure of one as of another:
    its gradient nearly vanishes long before the network is right."""
    return torch.log_softmax(torch.softmax(logits, dim=-1) if config.loss == "rows-twice" else logits, dim=-1)
