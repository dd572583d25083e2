"""The Soma cube: take a puzzle of polycubes apart, piece by piece, so that nothing collapses.

Source: Burke, Subr, Ramamoorthy, "Action sequencing using visual permutations" (RA-L 2021), Sec. IV-D and
Table II. The rules of collapse are in `domains.collapse`.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from domains.collapse import RULES, check_cubes, check_overlaps, check_standing, keeps_standing
from domains.soma_demonstrations import check_seed, demonstrate, picture_seed
from domains.soma_pieces import LETTERS, Cell, solutions
from neurosym.errors import AssemblyError, InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.language import Action, Domain, Fluent, Problem, Simulation, Type, predicates
from neurosym.language.demonstrations import Demonstrations
from neurosym.language.problem import as_names
from neurosym.language.problem_family import ProblemFamily, Progress, part_to_choose
from neurosym.support.arrays import Pixels

piece = Type("piece")
present = Fluent("present", piece)
_p = piece("p")


def _take_apart(rule: str) -> Domain:
    asked = [predicates.free(present), predicates.stable_without(present)]
    geometry = [predicate(_p) for predicate in (asked if rule == "rigid" else [keeps_standing(present, rule)])]
    remove = Action("remove", _p, pre=[present(_p), *geometry], eff=[~present(_p)], label="{p}", once=True)
    return Domain(f"soma-{rule}", fluents=[present], actions=[remove])


#: One symbolic domain a rule of collapse.
DOMAINS: dict[str, Domain] = {rule: _take_apart(rule) for rule in RULES}

#: Numbers of `problems("train")` in a split: half of the 240, as in the paper.
N_TRAIN = 120

#: Styles of pictures.
STYLES = ("clean", "varied", "cluttered")

#: Kept apart from any user's seed, so that a split never repeats the draws of a search.
_SPLIT_STREAM = 0x50_4D_41


class SomaFamily(ProblemFamily):
    """The 240 Soma cubes, and any polycube puzzle a user brings."""

    name = "soma"
    reference = "Burke, Subr, Ramamoorthy (RA-L 2021), Sec. IV-D, Table II; Berlekamp, Conway, Guy, Winning Ways"
    domain = DOMAINS["cubes"]
    published: ClassVar[Sequence[Mapping[str, Any]]] = tuple(
        {"planner": "swap-repair", "prior": prior, "initial_failures": failures, "iterations": iterations}
        for prior, failures, iterations in (
            ("random", None, (5.35, 4.12)),
            ("tcn-paper", (54.95, 10.99), (1.90, 3.25)),
            ("sinkhorn-paper", (51.55, 6.19), (1.75, 3.19)),
        )
    )
    #: Rules of collapse, for the command line.
    collapses = RULES

    def solutions(self) -> tuple[dict[str, tuple[Cell, ...]], ...]:
        """The 240 cubes, each {letter: cells}."""
        return solutions()

    def problem(
        self,
        number: int = 0,
        *,
        collapse: str = "cubes",
        pictures: str = "clean",
        seed: int = 0,
        removed: Iterable[str] = (),
        before: Iterable[tuple[str, str]] = (),
    ) -> Problem:
        """Cube number 0 to 239.

        Args:
            collapse: ``"cubes"`` (the paper's rule), ``"strict"`` or ``"rigid"``.
            pictures: style of the observation, ``"clean"``, ``"varied"`` or ``"cluttered"``.
            seed: of the pictures.
            removed: letters of pieces that are gone already.
            before: pairs of letters: the first must leave before the second.
        """
        cubes = solutions()
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number < len(cubes):
            raise InputError(f"Expected the number of a Soma cube, 0 to {len(cubes) - 1}; got {number!r}.")
        return self.problem_from_cells(
            cubes[number],
            collapse=collapse,
            pictures=pictures,
            seed=picture_seed(seed, int(number)),
            removed=removed,
            before=before,
            name=f"soma-{number}",
        )

    def problem_from_cells(
        self,
        cells: Mapping[str, Iterable[Sequence[int]]],
        *,
        collapse: str = "cubes",
        pictures: str = "clean",
        seed: int = 0,
        removed: Iterable[str] = (),
        before: Iterable[tuple[str, str]] = (),
        name: str = "puzzle",
    ) -> Problem:
        """Any polycube puzzle, its pieces given as {name: [(x, y, z), ...]}, z up; options as for `problem`.

        Raises AssemblyError: pieces that overlap, repeat a cell, are not connected, float or are empty.
        """
        if not isinstance(cells, Mapping) or not cells:
            raise AssemblyError(f"Expected pieces as {{name: [(x, y, z), ...]}}, at least one; got {cells!r}.")
        assembly = Assembly.from_cells(cells)
        for piece, own in cells.items():
            _check_connected(piece, [tuple(c) for c in own])
        return self.problem_from_assembly(
            assembly, collapse=collapse, pictures=pictures, seed=seed, removed=removed, before=before, name=name
        )

    def problem_from_assembly(
        self,
        assembly: Assembly,
        *,
        collapse: str = "cubes",
        pictures: str = "clean",
        seed: int = 0,
        removed: Iterable[str] = (),
        before: Iterable[tuple[str, str]] = (),
        name: str = "puzzle",
    ) -> Problem:
        """A puzzle given as an assembly: cells or meshes, in any upright pose."""
        if collapse not in DOMAINS:
            raise UnknownNameError("collapse rule", collapse, DOMAINS)
        if not isinstance(assembly, Assembly):
            raise InputError(f"Expected an Assembly; got {assembly!r}. For cells there is problem_from_cells.")
        if pictures not in STYLES:
            raise UnknownNameError("style of pictures", pictures, STYLES)
        check_seed(seed)
        gone = as_names(removed, "removed")
        for letter in gone:
            if letter not in assembly.names:
                raise UnknownNameError("piece", letter, assembly.names)
        check_overlaps(assembly)
        if collapse != "rigid":
            check_cubes(assembly, collapse)
        geometry = AssemblyGeometry(assembly)
        check_standing(geometry, collapse)
        # No simulation judges `strict`: what is left over a removed cube need not move.
        simulation = None
        if collapse != "strict":
            bodies: Literal["cubes", "rigid"] = "rigid" if collapse == "rigid" else "cubes"
            simulation = Simulation(bodies, {n: n for n in assembly.names}, gone)

        return DOMAINS[collapse].problem(
            world=geometry,
            objects={piece: assembly.names},
            init=[present(n) for n in assembly.names if n not in gone],
            goal=[~present(n) for n in assembly.names],
            before=before,
            name=name,
            family=self.name,
            details={"collapse": collapse, "pictures": pictures, "seed": seed},
            simulation=simulation,
            semantics=self,
        )

    def numbers(self, part: str = "test", *, split: int = 0) -> tuple[int, ...]:
        """Numbers of the cubes of a part: a random half each for ``"train"`` and ``"test"``; ``"all"`` is all.

        Of the training half 20 are to ``"choose"`` settings by, 100 to ``"learn"`` from meanwhile.
        """
        total = len(solutions())
        if part == "all":
            return tuple(range(total))
        order = np.random.default_rng([_SPLIT_STREAM, split]).permutation(total)
        train: list[int] = order[:N_TRAIN].tolist()
        halves: dict[str, list[int]] = {"train": train, "test": order[N_TRAIN:].tolist()}
        halves |= {own: [n for n in train if n in part_to_choose(train, own)] for own in ("learn", "choose")}
        if part not in halves:
            raise UnknownNameError("part", part, ["all", *halves])
        return tuple(sorted(halves[part]))

    def problems(self, part: str = "test", *, split: int = 0, **options: Any) -> list[Problem]:
        """The cubes of a part, with the options of `problem`."""
        return [self.problem(n, **options) for n in self.numbers(part, split=split)]

    def pictures(self, problem: Problem, *, style: str = "clean", rng: np.random.Generator | None = None) -> Pixels:
        """Four views, top and three sides: uint8 (4, 64, 64, 3)."""
        from neurosym.simulation.render import render_views  # loads PyBullet

        return render_views(problem.world, style=style, rng=rng or np.random.default_rng(0))

    def take_pictures(
        self, problems: Sequence[Problem], *, style: str, workers: int = 1, progress: Progress | None = None
    ) -> Pixels:
        """Pictures of many problems, from disk where they were taken before."""
        from neurosym.simulation.render import cached_pictures

        jobs = [(p.world, p.details["seed"]) for p in problems]
        return cached_pictures(jobs, style=style, workers=workers, progress=progress)

    def demonstrations(
        self,
        part: str = "train",
        *,
        split: int = 0,
        recipe: str = "full",
        style: str = "clean",
        seed: int = 0,
        progress: Progress | None = None,
    ) -> Demonstrations:
        """Demonstrations for a training recipe: see `domains.soma_demonstrations`."""
        numbers = self.numbers(part, split=split)
        return demonstrate(self, numbers, recipe=recipe, style=style, seed=seed, progress=progress)

    def known_facts(self) -> dict[str, tuple[Any, Callable[[], Any]]]:
        """Published or measured facts, with the functions that recompute them."""
        return {
            "cubes up to rotation and reflection": (240, lambda: len(solutions())),
            "valid strict orders, all cubes; fewest; most": ((10_183, 6, 100), self._strict_orders),
            "pieces": (("V", "L", "T", "Z", "A", "B", "P"), lambda: LETTERS),
        }

    def _strict_orders(self) -> tuple[int, int, int]:
        from neurosym.pipeline import count_plans

        counts = [count_plans(p) for p in self.problems("all", collapse="strict")]
        return sum(counts), min(counts), max(counts)


def _check_connected(name: str, cells: Sequence[tuple[int, ...]]) -> None:
    left = {tuple(map(int, c)) for c in cells}
    reached = [left.pop()]
    while reached:
        x, y, z = reached.pop()
        steps = ((x + 1, y, z), (x - 1, y, z), (x, y + 1, z), (x, y - 1, z), (x, y, z + 1), (x, y, z - 1))
        reached += left.intersection(steps)
        left.difference_update(steps)
    if left:
        raise AssemblyError(
            f"Piece {name!r}: expected cells that hang together face to face; {sorted(left)} are apart from the rest. "
            "Give each piece of the puzzle a name of its own."
        )
