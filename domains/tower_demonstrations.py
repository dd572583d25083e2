"""Towers to learn from: pictures with orders, for the two training recipes.

``paper``  one demonstration a picture. Which of two blocks of one colour comes first is chance, as in the paper, where
           that is the difficulty: the picture does not tell.
``full``   besides, the share of all valid orders that have each block at each step: blocks of one colour share equally.
"""

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from domains.tower_blocks import ReferenceTower
from domains.tower_pictures import draw_offsets, picture_seed, take_pictures
from domains.tower_variants import TALLEST, blocks_of, colours_of, sequence_numbers, towers
from neurosym.errors import UnknownNameError
from neurosym.language.demonstrations import Demonstrations
from neurosym.language.problem_family import Progress

RECIPES = ("full", "paper")
#: Apart from the streams of pictures and offsets.
_ORDER_STREAM = 0x0D_E3


def demonstrate(
    variant: str,
    numbers: Sequence[int],
    *,
    recipe: str,
    style: str,
    seed: int,
    domain: str = "",
    workers: int | None = None,
    progress: Progress | None = None,
) -> Demonstrations:
    """Demonstrations of the towers of these numbers; a demonstration's group is its colour sequence.

    Sequences have as many columns as the tallest tower has levels; lower ones end in -1, and their marginals in zeros.
    """
    if recipe not in RECIPES:
        raise UnknownNameError("recipe", recipe, RECIPES)
    blocks = blocks_of(variant)
    sequences = np.full((len(numbers), TALLEST), -1, dtype=np.int64)
    marginals = np.zeros((len(numbers), TALLEST, len(blocks)), dtype=np.float32)
    references, seeds = [], []
    for row, number in enumerate(numbers):
        own = picture_seed(seed, variant, number)
        colours = colours_of(variant, number)
        sequences[row, : len(colours)] = _chance_order(variant, colours, np.random.default_rng([_ORDER_STREAM, own]))
        marginals[row, : len(colours)] = shares(variant, colours)
        levels = [blocks[b].name for b in towers(variant)[number]]
        references.append(ReferenceTower.of(blocks, levels, draw_offsets(style, len(levels), own), frame=TALLEST))
        seeds.append(own)
    pictures = take_pictures(references, seeds, style=style, workers=workers or os.cpu_count() or 1, progress=progress)
    kinds = list(dict.fromkeys((b.colour, b.size) for b in blocks))
    return Demonstrations(
        pictures=pictures,
        sequences=sequences,
        actions=tuple(b.name for b in blocks),
        marginals=marginals if recipe == "full" else None,
        groups=np.array([sequence_numbers(variant)[number] for number in numbers]),
        domain=domain,
        classes=tuple(kinds.index((b.colour, b.size)) for b in blocks),
    )


def shares(variant: str, colours: Sequence[str]) -> NDArray[np.float32]:
    """The share of all valid orders of a colour sequence with each block at each step, float32 (n_levels, n_blocks)."""
    own = np.array([[b.colour == colour for b in blocks_of(variant)] for colour in colours], dtype=np.float32)
    return np.asarray(own / own.sum(axis=1, keepdims=True))


def _chance_order(variant: str, colours: Sequence[str], rng: np.random.Generator) -> list[int]:
    """One valid order, drawn uniformly."""
    waiting = list(rng.permutation(len(blocks_of(variant))))
    order = []
    for colour in colours:
        chosen = next(b for b in waiting if blocks_of(variant)[b].colour == colour)
        waiting.remove(chosen)
        order.append(int(chosen))
    return order
