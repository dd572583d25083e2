"""Problem families: a symbolic domain with its problems, pictures and known facts. `load_domain` gives one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from neurosym.language.semantics import Semantics
from neurosym.support.arrays import Pixels
from neurosym.support.progress import Progress as Progress

if TYPE_CHECKING:
    from neurosym.language.demonstrations import Demonstrations
    from neurosym.language.domain import Domain
    from neurosym.language.labelled_problems import LabelledProblems
    from neurosym.language.problem import Problem


#: Share of what is to train that is kept for choosing settings.
CHOOSE_SHARE = 1 / 6


def part_to_choose(ids: Sequence[int], part: str) -> set[int]:
    """Of what is to train, in its order: the last sixth is to ``"choose"`` settings by, the others to ``"learn"``."""
    different = list(dict.fromkeys(ids))
    first = len(different) - round(CHOOSE_SHARE * len(different))
    return set(different[first:] if part == "choose" else different[:first])


class ProblemFamily(Semantics, ABC):
    """What an entry point in ``neurosym.domains`` names.

    Attributes:
        reference: where the task and its numbers come from.
        published: rows of published figures, shown beside ours by `compare`.
        priors: names of priors made for this family, which `compare` shows besides the usual ones.
    """

    name: ClassVar[str]
    domain: Domain
    reference: ClassVar[str]
    published: ClassVar[Sequence[Mapping[str, Any]]] = ()
    priors: ClassVar[Sequence[str]] = ()

    @abstractmethod
    def problem(self, *args: Any, **options: Any) -> Problem:
        """One problem, by its number in the family."""

    @abstractmethod
    def problems(self, part: str = "test", *, split: int = 0, **options: Any) -> Sequence[Problem]:
        """The problems of a part, ``"train"``, ``"test"`` or ``"all"``; "train" and "test" never overlap.

        ``"train"`` falls into ``"choose"``, where settings are compared, and ``"learn"``, what is learned from
        meanwhile: nothing needs to be chosen by what is to test.
        """

    def numbers(self, part: str = "test", *, split: int = 0) -> Sequence[int]:
        """Numbers of the problems of a part, as `problem` takes them; benchmarks rebuild problems from these."""
        raise NotImplementedError(f"the domain {self.name!r} does not number its problems")

    def kind(self, number: int) -> str:
        """What kind of problem has a number: tables show each kind by itself. Default: all are of one, without name."""
        return ""

    def labelled_problems(self, part: str = "train", **options: Any) -> LabelledProblems:
        """Problems with orders to learn from, for priors that read the problems themselves."""
        raise NotImplementedError(f"the domain {self.name!r} has no problems with labels")

    def pictures(self, problem: Problem, *, style: str = "clean", rng: np.random.Generator | None = None) -> Pixels:
        """Pictures of the finished work, uint8 (V, H, W, 3)."""
        raise NotImplementedError(f"the domain {self.name!r} has no pictures")

    def observe(self, problem: Problem) -> Pixels | None:
        """The pictures that a problem's details ask for, by their style and seed; None where they ask for none."""
        details = problem.details
        if not {"pictures", "seed"} <= set(details):
            return None
        return self.pictures(problem, style=details["pictures"], rng=np.random.default_rng(details["seed"]))

    def observed(
        self, problems: Sequence[Problem], *, workers: int = 1, progress: Progress | None = None
    ) -> list[Problem]:
        """The same problems with their pictures taken, all of a style in one go (`take_pictures`)."""
        seen = list(problems)
        for style in sorted({str(p.details.get("pictures")) for p in problems}):
            chosen = [i for i, p in enumerate(problems) if str(p.details.get("pictures")) == style]
            own = [problems[i] for i in chosen]
            views = self.take_pictures(own, style=style, workers=workers, progress=progress)
            for i, view in zip(chosen, () if views is None else views):
                seen[i] = problems[i].with_pictures(view)
        return seen

    def take_pictures(
        self, problems: Sequence[Problem], *, style: str, workers: int = 1, progress: Progress | None = None
    ) -> Pixels | None:
        """Pictures of many problems of one style, uint8 (M, V, H, W, 3): those that each would take by itself.

        None, the default, leaves it to the problems.
        """
        return None

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
        """Pictures with orders to learn from, for a training recipe (``"full"`` or ``"paper"``)."""
        raise NotImplementedError(f"the domain {self.name!r} has no demonstrations")

    def known_facts(self) -> dict[str, tuple[Any, Callable[[], Any]]]:
        """Published facts: name -> (published value, function that recomputes it). Tests compare them."""
        return {}
