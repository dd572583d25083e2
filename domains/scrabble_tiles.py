"""The letter tiles and the words laid with them: counts, values, random words, and what can be laid at all.

Words are random combinations of tiles, as in Burke, Subr, Ramamoorthy (RA-L 2021), Sec. IV-E and appendix, or come
from a list that the user gives. Which word a number stands for depends on nothing but the number.
"""

import functools
import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from neurosym.errors import InputError
from neurosym.language.problem_family import CHOOSE_SHARE


def _each(letters_of: dict[int, str]) -> dict[str, int]:
    return dict(sorted((letter, number) for number, letters in letters_of.items() for letter in letters))


#: How often each letter comes in the standard English set, the two blanks left out.
COUNTS = _each({1: "jkqxz", 2: "bcfhmpvwy", 3: "g", 4: "dlsu", 6: "nrt", 8: "o", 9: "ai", 12: "e"})
#: What a tile is worth; printed on it.
VALUES = _each({1: "aeilnorstu", 2: "dg", 3: "bcmp", 4: "fhvwy", 5: "k", 8: "jx", 10: "qz"})
#: Tiles in a word.
SHORTEST, LONGEST = 3, 6
#: Random problems of one split; the numbers of split s begin at s * (N_TRAIN + N_TEST), the training ones first.
N_TRAIN, N_TEST = 10_000, 5_000
#: The last of those to train, kept for choosing settings.
N_CHOOSE = round(CHOOSE_SHARE * N_TRAIN)
#: One letter sequence in so many belongs to the test part.
_TEST_SHARE = 3
#: Kept apart from any user's seed.
_WORD_STREAM, _LIST_STREAM = 0x5C_4A, 0x5C_4B


def _rounds() -> Iterator[str]:
    for instance in range(1, max(COUNTS.values()) + 1):
        yield from (f"{letter}{instance}" for letter, count in COUNTS.items() if count >= instance)


#: All tiles, a letter and an instance: each letter once, a to z, then the second of each letter that has two, and so
#: on. So the first N differ where they can, and a larger N adds letters up to 26, then repetitions.
TILES: tuple[str, ...] = tuple(_rounds())


def first_tiles(n: int) -> tuple[str, ...]:
    """The first `n` tiles, 6 to 98, in the order of `TILES`."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or not LONGEST <= n <= len(TILES):
        raise InputError(f"Expected the first {LONGEST} to {len(TILES)} tiles; got tiles={n!r}.")
    return TILES[: int(n)]


def checked_word(word: str, n: int) -> str:
    """The word in small letters. Raises InputError: it cannot be laid from the first `n` tiles; says why."""
    found = word.lower() if isinstance(word, str) else ""
    if not found or set(found) - set(COUNTS):
        raise InputError(f"Expected a word of the letters a to z; got {word!r}.")
    if not SHORTEST <= len(found) <= LONGEST:
        raise InputError(f"Expected words of {SHORTEST} to {LONGEST} letters; {found!r} has {len(found)}.")
    there = Counter(tile[0] for tile in first_tiles(n))
    for letter, needed in Counter(found).items():
        if needed > there[letter]:
            raise InputError(
                f"Expected words that the first {n} tiles can lay; {found!r} needs {letter} {needed} times, and there "
                f"{'is' if there[letter] == 1 else 'are'} {there[letter] or 'none'}. Leave it out, or take more tiles."
            )
    return found


def place_of(number: int) -> tuple[int, str, int]:
    """A problem's number as (split, part, number in the part)."""
    if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 0:
        raise InputError(f"Expected the number of a word, 0 or more; got {number!r}.")
    split, rest = divmod(int(number), N_TRAIN + N_TEST)
    return (split, "train", rest) if rest < N_TRAIN else (split, "test", rest - N_TRAIN)


def part_of(word: str, split: int) -> str:
    """Which part a letter sequence belongs to: a hash decides, two in three to train.

    So training and test words never meet, whatever the tiles; where there are few sequences (1,920 of six different
    tiles), words come again within their part.
    """
    digest = hashlib.blake2b(f"{split} {word}".encode(), digest_size=8).digest()
    return "test" if int.from_bytes(digest) % _TEST_SHARE == 0 else "train"


def random_word(number: int, n: int) -> str:
    """The random word of a number: a length, each alike, and as many of the first `n` tiles, without putting back."""
    split, part, _ = place_of(number)
    tiles = first_tiles(n)
    rng = np.random.default_rng([_WORD_STREAM, int(number)])
    while True:
        length = int(rng.integers(SHORTEST, LONGEST + 1))
        word = "".join(tiles[i][0] for i in rng.choice(len(tiles), length, replace=False))
        if part_of(word, split) == part:
            return word


def listed_word(number: int, words: Iterable[str], n: int) -> str:
    """The word of a number from a list: shuffled for each split, two thirds to train, and round again at the end.

    A list of one word has it in both parts.
    """
    split, part, position = place_of(number)
    if isinstance(words, str):
        raise InputError(f"Expected a list of words; got the text {words!r}. Write [{words!r}].")
    own = _parts(tuple(words), int(n), split)[part]
    return own[position % len(own)]


@functools.lru_cache(maxsize=16)
def _parts(words: tuple[str, ...], n: int, split: int) -> dict[str, tuple[str, ...]]:
    known = tuple(dict.fromkeys(checked_word(word, n) for word in words))
    if not known:
        raise InputError("Expected at least one word in the list; got none.")
    order = np.random.default_rng([_LIST_STREAM, split]).permutation(len(known))
    shuffled = tuple(known[i] for i in order)
    n_test = max(1, len(known) // _TEST_SHARE)
    return {"train": shuffled[n_test:] or shuffled, "test": shuffled[:n_test]}
