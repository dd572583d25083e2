"""Scrabble: lay a word, tile by tile, from a set of up to 98 tiles.

Source: Burke, Subr, Ramamoorthy, "Action sequencing using visual permutations" (RA-L 2021), Sec. IV-E and appendix.
Each tile is an action primitive, used at most once; a letter that is needed twice takes two of its tiles, and equal
letters are interchangeable. Words are far shorter than the set: 3 to 6 steps of 98 actions.
"""

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from domains import scrabble_tiles
from domains.scrabble_demonstrations import demonstrate, picture_seed
from domains.scrabble_rules import DOMAIN, Reference, all_slots_filled, laid, tile
from domains.scrabble_tiles import COUNTS, LONGEST, N_CHOOSE, N_TEST, N_TRAIN, SHORTEST, TILES, VALUES
from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.rigid_motions import shifted
from neurosym.geometry.shapes import boxes_part
from neurosym.geometry.staging import Staging, building
from neurosym.geometry.step_motion import StepMotion
from neurosym.language import Atom, Problem
from neurosym.language.demonstrations import Demonstrations
from neurosym.language.problem_family import ProblemFamily, Progress
from neurosym.support.arrays import Pixels

#: How many problems of a part are meant where nobody says how many: enough for `compare`, and for its blind baseline.
DEFAULT_COUNTS = {"train": 50, "learn": 50, "choose": 50, "test": 200}
#: First of each part, counted from the start of the split, and how many there are.
_FIRST, _SIZES = {"test": N_TRAIN, "choose": N_TRAIN - N_CHOOSE}, {"train": N_TRAIN, "learn": N_TRAIN - N_CHOOSE}
_SIZES |= {"choose": N_CHOOSE, "test": N_TEST}
#: A tile: its edges, and from the middle of one slot to that of the next (edges of a tile); wood, RGB in 0..1.
SIZE, PITCH, WOOD = (1.0, 1.0, 0.22), 1.04, (0.87, 0.72, 0.50)


class ScrabbleFamily(ProblemFamily):
    """Words of 3 to 6 tiles from the first N of the standard English set."""

    name = "scrabble"
    reference = "Burke, Subr, Ramamoorthy (RA-L 2021), Sec. IV-E and appendix; the standard English tile set"
    domain = DOMAIN

    def problem(
        self,
        number: int = 0,
        *,
        tiles: int = len(TILES),
        words: Sequence[str] | None = None,
        start: Sequence[str] = (),
        pictures: str = "easy",
        seed: int = 0,
    ) -> Problem:
        """The word of a number: 0 to 9,999 are the training part of split 0, 10,000 to 14,999 its test part.

        Args:
            tiles: how many tiles there are, the first 6 to 98 of `domains.scrabble_tiles.TILES`.
            words: draw from this list, not at random; each of 3 to 6 letters that the tiles can lay.
            start: tiles that lie already, from the first slot on.
            pictures: style of the observation, ``"easy"`` or ``"hard"`` (also ``"clean"`` and ``"varied"``).
            seed: of the pictures.
        """
        word, own, name = self.word(number, tiles=tiles, words=words), picture_seed(seed, number), f"scrabble-{number}"
        return self.problem_from_word(word, tiles=tiles, start=start, pictures=pictures, seed=own, name=name)

    def word(self, number: int, *, tiles: int = len(TILES), words: Sequence[str] | None = None) -> str:
        """The letters of a problem, without the problem."""
        if words is None:
            return scrabble_tiles.random_word(number, tiles)
        return scrabble_tiles.listed_word(number, words, tiles)

    def problem_from_word(
        self,
        word: str,
        *,
        tiles: int = len(TILES),
        start: Sequence[str] = (),
        pictures: str = "easy",
        seed: int = 0,
        name: str = "",
    ) -> Problem:
        """Any word of 3 to 6 letters that the first `tiles` tiles can lay.

        Raises InputError: the word cannot be laid, or does not begin with the tiles that lie already.
        """
        from domains.scrabble_drawing import style_named

        names, letters = scrabble_tiles.first_tiles(tiles), scrabble_tiles.checked_word(word, tiles)
        style, first = style_named(pictures), tuple(start)
        init = _initial(letters, first, names)
        return DOMAIN.problem(
            world=Reference(letters, names, len(init)),
            objects={tile: names},
            init=init,
            goal=[all_slots_filled()],
            interchangeable=[tuple(name for name in names if name[0] == letter) for letter in COUNTS],
            name=name or letters,
            family=self.name,
            details={"word": letters, "tiles": len(names), "pictures": style.name, "seed": seed, "start": first},
            semantics=self,
        )

    def numbers(self, part: str = "test", *, split: int = 0, count: int | None = None) -> range | tuple[int, ...]:
        """Numbers of the first `count` problems of a part: of 5,000 to test (default 200), of 10,000 to train (50)."""
        if part == "all":
            return (*self.numbers("train", split=split, count=count), *self.numbers("test", split=split, count=count))
        if part not in _SIZES:
            raise UnknownNameError("part", part, ["all", *_SIZES])
        wanted = DEFAULT_COUNTS[part] if count is None else count
        if not 1 <= wanted <= _SIZES[part]:
            raise InputError(f"Expected 1 to {_SIZES[part]:,} problems of the part {part!r}; got count={count!r}.")
        if split < 0:
            raise InputError(f"Expected a split of 0 or more; got {split}.")
        start = split * (N_TRAIN + N_TEST) + _FIRST.get(part, 0)
        return range(start, start + wanted)

    def problems(
        self, part: str = "test", *, split: int = 0, count: int | None = None, **options: Any
    ) -> list[Problem]:
        """The first `count` problems of a part (default: see `numbers`), with the options of `problem`."""
        return [self.problem(n, **options) for n in self.numbers(part, split=split, count=count)]

    def staging(self, problem: Problem, plan: Sequence[str], motions: Sequence[StepMotion | None]) -> Staging:
        """Tiles flat on a table, side by side in their slots, each laid from above."""
        from domains.scrabble_drawing import tile_face

        names, parts = (*problem.details["start"], *plan), []
        for slot, name in enumerate(names):
            at = shifted((PITCH * slot, 0.0, SIZE[2] / 2))
            parts.append(boxes_part(name, np.zeros((1, 3)), np.array(SIZE), at))
        work = Assembly(tuple(parts), table=0.0)
        staging = building(work, problem.details["start"], plan, dict.fromkeys(names, WOOD))
        return replace(staging, tops={name: tile_face(name[0]) for name in names})

    def pictures(self, problem: Problem, *, style: str = "easy", rng: np.random.Generator | None = None) -> Pixels:
        """One view of the word, uint8 (1, 32, 192, 3)."""
        from domains.scrabble_drawing import draw_word, style_named

        return draw_word(problem.world.word, style_named(style), rng or np.random.default_rng(0))

    def take_pictures(
        self, problems: Sequence[Problem], *, style: str, workers: int = 1, progress: Progress | None = None
    ) -> Pixels:
        """Pictures of many problems, from disk where they were taken before."""
        from domains.scrabble_pictures import cached_pictures

        jobs = [(str(p.details["word"]), int(p.details["seed"])) for p in problems]
        return cached_pictures(jobs, style=style, workers=workers, progress=progress)

    def demonstrations(
        self,
        part: str = "train",
        *,
        split: int = 0,
        recipe: str = "full",
        style: str = "easy",
        seed: int = 0,
        progress: Progress | None = None,
        count: int | None = None,
        tiles: int = len(TILES),
        words: Sequence[str] | None = None,
        workers: int | None = None,
    ) -> Demonstrations:
        """Pictures of words with orders (see `domains.scrabble_demonstrations`), `count` of them.

        Default: all 10,000 of ``"train"``, or the 5,000 of ``"test"``. The pictures are those of `problem`, by seed.
        """
        everything = _SIZES.get(part)
        numbers = self.numbers(part, split=split, count=everything if count is None else count)
        shown = [(self.word(n, tiles=tiles, words=words), n) for n in numbers]
        names = scrabble_tiles.first_tiles(tiles)
        return demonstrate(
            self.name, shown, names, recipe=recipe, style=style, seed=seed, workers=workers, progress=progress
        )

    def known_facts(self) -> dict[str, tuple[Any, Callable[[], Any]]]:
        """Published facts, with the functions that recompute them."""
        return {
            "tiles": (98, lambda: len(self.problem(0).actions)),
            "tiles of each letter": (_PUBLISHED_COUNTS, self._counts),
            "points of all tiles": (187, lambda: sum(VALUES[name[0]] for name in TILES)),
            "letter sequences of the first 6 tiles": (1_920, _sequences_of_six),
        }

    def _counts(self) -> str:
        counts = sorted(Counter(name[0] for name in self.problem(0).actions).items())
        return " ".join(f"{letter}={count}" for letter, count in counts)


#: As the paper's appendix prints them.
_PUBLISHED_COUNTS = (
    "a=9 b=2 c=2 d=4 e=12 f=2 g=3 h=2 i=9 j=1 k=1 l=4 m=2 n=6 o=8 p=2 q=1 r=6 s=4 t=6 u=4 v=2 w=2 x=1 y=2 z=1"
)


def _sequences_of_six() -> int:
    lengths = range(SHORTEST, LONGEST + 1)
    return len({p for length in lengths for p in itertools.permutations([t[0] for t in TILES[:6]], length)})


def _initial(word: str, start: tuple[str, ...], names: tuple[str, ...]) -> list[Atom]:
    """`laid` of the tiles that lie already, left to right; refused unless the word begins so and goes on."""
    for name in start:
        if name not in names:
            raise UnknownNameError("tile", name, names)
    letters = "".join(name[0] for name in start)
    if len(set(start)) < len(start) or len(start) >= len(word) or not word.startswith(letters):
        raise InputError(
            f"Expected tiles that begin the word {word!r}, each once, and leave a slot to fill; got {', '.join(start)}."
        )
    return [laid(name) for name in start]
