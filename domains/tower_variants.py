"""The paper's three sets of towers, numbered, and random splits of them.

``colours``  six blocks, two each in three colours: 720 towers, 90 colour sequences (paper, Sec. IV-A).
``unique``   six blocks of six colours: 720 towers, all different (Sec. IV-B).
``heights``  the six blocks of ``colours`` in towers of two to six levels: 1,950 towers, 267 colour sequences
             (Sec. IV-C).
"""

import itertools
from functools import cache

import numpy as np

from domains.tower_blocks import COLOURS, Block
from neurosym.errors import InputError, UnknownNameError
from neurosym.language.problem_family import part_to_choose
from neurosym.support.arrays import Truths

VARIANTS = ("colours", "unique", "heights")
#: Levels of the tallest tower.
TALLEST = 6
PARTS = ("all", "train", "learn", "choose", "test")
#: What a split divides: towers, or colour sequences (then no sequence is in both parts).
DIVIDED = ("tower", "sequence")
#: Two thirds to train, as in the paper (200 of 300).
TRAIN_SHARE = 2 / 3
#: Kept apart from any user's seed, so that a split never repeats the draws of a search.
_SPLIT_STREAM, _ORDER_STREAM = 0x54_57_52, 0x54_57_53

_PAIRED = tuple(Block(f"{colour}-{i}", colour) for colour in ("red", "yellow", "blue") for i in (1, 2))
_UNIQUE = tuple(Block(colour, colour) for colour in COLOURS)


def blocks_of(variant: str) -> tuple[Block, ...]:
    """The six blocks of a variant. Raises UnknownNameError: no such variant."""
    if variant not in VARIANTS:
        raise UnknownNameError("variant", variant, VARIANTS)
    return _UNIQUE if variant == "unique" else _PAIRED


@cache
def towers(variant: str) -> tuple[tuple[int, ...], ...]:
    """All towers, each as numbers of blocks from the bottom up, the lower towers first."""
    blocks = range(len(blocks_of(variant)))
    heights = range(2, TALLEST + 1) if variant == "heights" else (TALLEST,)
    return tuple(order for height in heights for order in itertools.permutations(blocks, height))


@cache
def sequences(variant: str) -> tuple[tuple[str, ...], ...]:
    """The different colour sequences, from the bottom up, the lower towers first."""
    different = {colours_of(variant, number) for number in range(len(towers(variant)))}
    return tuple(sorted(different, key=lambda colours: (len(colours), colours)))


@cache
def sequence_numbers(variant: str) -> tuple[int, ...]:
    """For each tower the number of its colour sequence in `sequences`."""
    index = {colours: i for i, colours in enumerate(sequences(variant))}
    return tuple(index[colours_of(variant, number)] for number in range(len(towers(variant))))


def colours_of(variant: str, number: int) -> tuple[str, ...]:
    """The colour sequence of a tower, from the bottom up."""
    blocks = blocks_of(variant)
    return tuple(blocks[b].colour for b in towers(variant)[number])


def split_numbers(variant: str, part: str, split: int, by: str) -> tuple[int, ...]:
    """Numbers of the towers of a part, ``"train"``, ``"test"`` or ``"all"``, in random order ("all" in their own).

    ``"train"`` falls into ``"learn"`` and ``"choose"``, see `ProblemFamily.problems`.

    `split`: which random split. A tower of `heights` that is one of `colours` too is in the same part of both. `by`:
    ``"tower"`` deals out towers, ``"sequence"`` colour sequences with all their towers. Raises UnknownNameError: no
    such variant, part or way to divide; InputError: a split below 0.
    """
    if by not in DIVIDED:
        raise UnknownNameError("way to split", by, DIVIDED)
    if part not in PARTS:
        raise UnknownNameError("part", part, PARTS)
    if split < 0:
        raise InputError(f"Expected the number of a split, 0 or more; got {split}.")
    total = len(towers(variant))
    if part == "all":
        return tuple(range(total))
    to_train = _trains(variant, split, by)
    rng = np.random.default_rng([_ORDER_STREAM, VARIANTS.index(variant), DIVIDED.index(by), split])
    order = rng.permutation(total)
    numbers: list[int] = order[to_train[order] == (part != "test")].tolist()
    if part in ("learn", "choose"):
        ids = {n: sequence_numbers(variant)[n] if by == "sequence" else n for n in numbers}
        chosen = part_to_choose(list(ids.values()), part)
        numbers = [n for n in numbers if ids[n] in chosen]
    return tuple(numbers)


@cache
def _trains(variant: str, split: int, by: str) -> Truths:
    """bool (n_towers,): which towers are to train."""
    known = towers(variant)
    ids = np.array(sequence_numbers(variant)) if by == "sequence" else np.arange(len(known))
    divided = np.full(ids.max() + 1, False)
    free = np.arange(len(divided))
    if variant == "heights":
        tall = np.array([len(tower) == TALLEST for tower in known])
        # In the same order: towers and sequences alike are listed lower ones first, then as `colours` lists them.
        like = _trains("colours", split, by)
        divided[ids[tall]] = like
        free = np.unique(ids[~tall])
    rng = np.random.default_rng([_SPLIT_STREAM, VARIANTS.index(variant), DIVIDED.index(by), split])
    divided[rng.permutation(free)[: round(TRAIN_SHARE * len(free))]] = True
    return np.asarray(divided[ids])
