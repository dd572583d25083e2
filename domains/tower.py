"""Towers: place blocks one on another until the tower of the reference stands.

Source: Burke, Subr, Ramamoorthy, "Action sequencing using visual permutations" (RA-L 2021), Sec. IV-A to IV-C.
``place(b)`` needs a block that is not in the tower, that matches the reference at the next level (colour and size),
and that rests stably on what is there. Which level comes next follows from how many blocks are placed, so N blocks
make N action primitives, whatever the tower.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from domains import tower_rules as rules
from domains.tower_blocks import COLOURS, Block, ReferenceTower
from domains.tower_demonstrations import demonstrate
from domains.tower_pictures import draw_offsets, picture_seed, setting_named, take_picture, take_pictures
from domains.tower_variants import TALLEST, VARIANTS, blocks_of, sequences, split_numbers, towers
from neurosym.errors import AssemblyError, InputError, UnknownNameError
from neurosym.geometry.staging import Staging, building
from neurosym.geometry.step_motion import StepMotion
from neurosym.language import Problem
from neurosym.language.demonstrations import Demonstrations
from neurosym.language.problem_family import ProblemFamily, Progress
from neurosym.support.arrays import Pixels


class TowerFamily(ProblemFamily):
    """The paper's towers in three variants, and any tower of boxes a user brings."""

    name = "tower"
    reference = "Burke, Subr, Ramamoorthy (RA-L 2021), Sec. IV-A to IV-C, Table I"
    domain = rules.TOWER
    #: For the command line.
    variants = VARIANTS

    def problem(
        self,
        number: int = 0,
        *,
        variant: str = "colours",
        pictures: str = "easy",
        seed: int = 0,
        offsets: ArrayLike | None = None,
        placed: Iterable[str] = (),
        before: Iterable[tuple[str, str]] = (),
    ) -> Problem:
        """A tower by its number, as `domains.tower_variants.towers` counts them.

        Args:
            variant: ``"colours"`` (720 towers of 3 x 2 colours), ``"unique"`` (720 of six colours) or ``"heights"``
                (1,950 of two to six levels).
            pictures: ``"easy"``, ``"hard"`` (also ``"clean"``, ``"varied"``) or ``"cluttered"``: how untidily the
                reference is built and pictured, see `domains.tower_pictures`.
            seed: of the pictures and the untidiness.
            offsets: float64 (n_levels, 2), how far off the plumb line each level lies along x and y, in edges of a
                block; None draws them as `pictures` says.
            placed: names of blocks that stand already, from the bottom up.
            before: pairs of blocks: the first must be placed before the second.
        """
        known = towers(variant) if variant in VARIANTS else ()
        blocks = blocks_of(variant)
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number < len(known):
            raise InputError(f"Expected the number of a tower, 0 to {len(known) - 1}; got {number!r}.")
        own = picture_seed(seed, variant, int(number))
        levels = [blocks[b].name for b in known[number]]
        drawn = draw_offsets(pictures, len(levels), own) if offsets is None else offsets
        tower = ReferenceTower.of(blocks, levels, drawn, frame=TALLEST)
        return self.problem_from_tower(
            tower, pictures=pictures, seed=own, placed=placed, before=before, name=f"tower-{variant}-{number}"
        )

    def problem_from_blocks(
        self, blocks: Sequence[Block], levels: Sequence[str], *, offsets: ArrayLike | None = None, **options: Any
    ) -> Problem:
        """A tower of one's own blocks, of any sizes.

        Args:
            blocks: those at hand, more than the tower needs if you like.
            levels: names of blocks that look as the reference does, from the bottom up.
            offsets: float64 (n_levels, 2), off the plumb line along x and y; None stands plumb.
            options: those of `problem_from_tower`.

        Raises:
            AssemblyError: bad names, sizes or offsets, see `ReferenceTower.of`.
        """
        return self.problem_from_tower(ReferenceTower.of(blocks, levels, offsets), **options)

    def problem_from_tower(
        self,
        tower: ReferenceTower,
        *,
        pictures: str = "easy",
        seed: int = 0,
        placed: Iterable[str] = (),
        before: Iterable[tuple[str, str]] = (),
        name: str = "tower",
    ) -> Problem:
        """A reference tower as a problem; the options are those of `problem`."""
        style = setting_named(pictures)
        standing = _standing(tower, placed)
        at_hand = [n for n in tower.names if n not in standing]
        alike: dict[Any, list[str]] = {}
        for n in at_hand:
            alike.setdefault(tower.kinds[n], []).append(n)

        return self.domain.problem(
            world=tower,
            objects={rules.block: tower.names},
            init=[*(rules.stocked(n) for n in at_hand), *(rules.placed(n) for n in standing)],
            goal=[rules.finished()],
            before=before,
            interchangeable=list(alike.values()),
            name=name,
            family=self.name,
            details={"pictures": style, "seed": seed, "colours": tower.colours},
            semantics=self,
        )

    def numbers(
        self, part: str = "test", *, split: int = 0, variant: str = "colours", by: str = "tower"
    ) -> tuple[int, ...]:
        """Numbers of the towers of a part, in random order, so that the first n are a random sample.

        Two thirds are ``"train"``, the others ``"test"``; ``"all"`` is all of the variant, in order. ``"train"`` falls
        into ``"learn"`` and ``"choose"``, what settings are chosen by.

        `by`: ``"tower"``: the parts share no tower; ``"sequence"``: no colour sequence either.
        """
        return split_numbers(variant, part, split, by)

    def problems(
        self, part: str = "test", *, split: int = 0, variant: str = "colours", by: str = "tower", **options: Any
    ) -> list[Problem]:
        """The towers of a part, with the options of `problem`."""
        numbers = self.numbers(part, split=split, variant=variant, by=by)
        return [self.problem(n, variant=variant, **options) for n in numbers]

    def staging(self, problem: Problem, plan: Sequence[str], motions: Sequence[StepMotion | None]) -> Staging:
        tower = problem.world
        standing = tuple(str(atom.args[0]) for atom in problem.init if atom.predicate == rules.placed)
        order = (*standing, *plan)
        return building(tower.built(order), standing, plan, {n: COLOURS[tower.kinds[n][0]] for n in order})

    def pictures(self, problem: Problem, *, style: str = "easy", rng: np.random.Generator | None = None) -> Pixels:
        """One view from the side, uint8 (1, 64, 64, 3), of the tower as it is; `style` says how it is pictured."""
        return take_picture(problem.world, style, rng or np.random.default_rng(0))

    def take_pictures(
        self, problems: Sequence[Problem], *, style: str, workers: int = 1, progress: Progress | None = None
    ) -> Pixels:
        """Pictures of many problems, from disk where they were taken before."""
        worlds, seeds = [p.world for p in problems], [p.details["seed"] for p in problems]
        return take_pictures(worlds, seeds, style=style, workers=workers, progress=progress)

    def demonstrations(
        self,
        part: str = "train",
        *,
        split: int = 0,
        recipe: str = "full",
        style: str = "easy",
        seed: int = 0,
        progress: Progress | None = None,
        variant: str = "colours",
        by: str = "tower",
        count: int | None = None,
    ) -> Demonstrations:
        """Demonstrations for a training recipe, see `domains.tower_demonstrations`.

        `variant`: which towers. `by`: how the parts are split. `count`: only the first so many of the part, a random
        sample of it; None takes all.
        """
        numbers = self.numbers(part, split=split, variant=variant, by=by)
        if count is not None and not 0 < count <= len(numbers):
            raise InputError(f"Expected 1 to {len(numbers)} demonstrations of this part; got count={count}.")
        return demonstrate(
            variant, numbers[:count], recipe=recipe, style=style, seed=seed, domain=self.name, progress=progress
        )

    def known_facts(self) -> dict[str, tuple[Any, Callable[[], Any]]]:
        """Published facts, with the functions that recompute them."""
        return {
            "towers of 3 x 2 colours": (720, lambda: len(towers("colours"))),
            "their colour sequences": (90, lambda: len(sequences("colours"))),
            "towers of six colours": (720, lambda: len(sequences("unique"))),
            "towers of two to six levels": (1950, lambda: len(towers("heights"))),
            "their colour sequences, all heights": (267, lambda: len(sequences("heights"))),
        }


def _standing(tower: ReferenceTower, names: Iterable[str]) -> tuple[str, ...]:
    """The blocks that stand at first, checked: they match the reference and do not fall."""
    standing = tuple(names)
    for name in standing:
        if name not in tower.names:
            raise UnknownNameError("block", name, tower.names)
    if len(set(standing)) != len(standing) or len(standing) > len(tower.levels):
        raise AssemblyError(f"Expected at most {len(tower.levels)} different blocks that stand; got {list(standing)}.")
    for level, (name, kind) in enumerate(zip(standing, tower.reference), 1):
        if tower.kinds[name] != kind:
            raise AssemblyError(
                f"Expected blocks that stand to match the reference from the bottom up; level {level} asks for "
                f"{kind[0]} of size {kind[1]}, and {name!r} is {tower.kinds[name][0]} of size {tower.kinds[name][1]}."
            )
    if standing and (falling := tower.falling(len(standing))):
        raise AssemblyError(f"Expected blocks that stand; {', '.join(standing[i] for i in falling)} would fall.")
    return standing
