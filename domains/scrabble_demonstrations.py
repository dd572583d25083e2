"""Words to learn from: pictures with orders, for the two training recipes.

Sequences have 6 steps, -1 after the word's end, and groups hold what shows one word.

``paper``  one demonstration a word: of each letter one of its tiles at random.
``full``   symbolic supervision: also the share of all valid orders that have each tile at each step, which is the
           same for all the tiles of the step's letter.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from domains.scrabble_tiles import COUNTS, LONGEST
from neurosym.errors import UnknownNameError
from neurosym.language.demonstrations import Demonstrations
from neurosym.language.problem_family import Progress
from neurosym.support.arrays import Numbers

RECIPES = ("full", "paper")


def picture_seed(seed: int, number: int) -> int:
    """The seed of the picture of problem `number`."""
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0])


def demonstrate(
    domain: str,
    shown: Sequence[tuple[str, int]],
    names: tuple[str, ...],
    *,
    recipe: str,
    style: str,
    seed: int,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Demonstrations:
    """Demonstrations of words, each with its number, by tiles of these names; pictures come from disk if they can."""
    if recipe not in RECIPES:
        raise UnknownNameError("recipe", recipe, RECIPES)
    from domains.scrabble_pictures import cached_pictures

    jobs = [(word, picture_seed(seed, number)) for word, number in shown]
    groups: dict[str, int] = {}
    letters = sorted({name[0] for name in names})
    return Demonstrations(
        pictures=cached_pictures(jobs, style=style, workers=workers, progress=progress),
        sequences=np.stack([_demonstrated(word, names, [seed, number]) for word, number in shown]),
        actions=names,
        marginals=_shares([word for word, _ in shown], names) if recipe == "full" else None,
        groups=np.array([groups.setdefault(word, len(groups)) for word, _ in shown]),
        domain=domain,
        classes=tuple(letters.index(name[0]) for name in names),
    )


def _demonstrated(word: str, names: Sequence[str], seed: Sequence[int]) -> Numbers:
    """int64 (6,): for each letter one of its tiles, drawn at random, none twice; -1 after the end."""
    order = [int(a) for a in np.random.default_rng(seed).permutation(len(names))]
    sequence = np.full(LONGEST, -1, dtype=np.int64)
    for slot, letter in enumerate(word):
        sequence[slot] = next(a for a in order if names[a][0] == letter)
        order.remove(sequence[slot])
    return sequence


def _shares(words: Sequence[str], names: Sequence[str]) -> NDArray[np.float32]:
    """float32 (M, 6, N): at a letter's slots each of its tiles alike; rows after the end are 0."""
    of_letter = {c: np.array([name[0] == c for name in names], dtype=np.float32) for c in COUNTS}
    of_letter = {c: row / max(float(row.sum()), 1.0) for c, row in of_letter.items()}
    shares = np.zeros((len(words), LONGEST, len(names)), dtype=np.float32)
    for own, word in zip(shares, words):
        for slot, letter in enumerate(word):
            own[slot] = of_letter[letter]
    return shares
