"""Any assembly: take it apart, part by part or in groups, along straight lines or paths, with or without gravity.

The plan of an assembly is that of its disassembly backwards (`PlanResult.reversed`): for rigid parts a removal
reversed is an insertion.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from domains.assembly_groups import apart_in_groups
from domains.assembly_labels import labelled_problems
from domains.assembly_removal import apart_one_by_one, removal_domain
from domains.assembly_samples import SAMPLES, TRAINING, sample
from domains.structures import SPAN, kind_of, structure, structure_numbers
from neurosym.errors import AssemblyError, InputError, UnknownNameError
from neurosym.geometry.assembly import NO_TABLE, Assembly
from neurosym.geometry.blocking.directions import Directions
from neurosym.geometry.keeping import keep_together
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.language import Problem
from neurosym.language.labelled_problems import LabelledProblems
from neurosym.language.problem import as_names, checked_pairs
from neurosym.language.problem_family import ProblemFamily

#: What `paths` may be.
PATHS = ("straight", "any")


@dataclass(frozen=True)
class Setting:
    """How an assembly may be taken apart: the options of `AssemblyFamily.problem`, checked.

    Attributes:
        directions: unit vectors as tuples, in the order in which they are tried; or "axes", those of any assembly.
        paths: one of `PATHS`.
        groups: whether sub-assemblies may leave together.
        gravity: whether what stays must stand.
        held: how many parts may be held meanwhile.
        pull: whether what stays must stand while the others are drawn out against friction, too.
        targets: names of the parts that are to be out; empty: all that are not fixed.
    """

    directions: tuple[tuple[float, float, float], ...] | str = "axes"
    paths: str = "straight"
    groups: bool = False
    gravity: bool = True
    held: int = 0
    pull: bool = False
    targets: tuple[str, ...] = ()


class AssemblyFamily(ProblemFamily):
    """Assemblies of a user's own: files, cells or meshes; by number also samples, and structures made at random."""

    name = "assembly"
    reference = (
        "Wilson and Latombe, Geometric reasoning about mechanical assembly (Artificial Intelligence 71, 1994): "
        "directional blocking; Livesley (1978): stability by limit analysis; Kao et al. (2022): that forces must arise"
    )
    #: The symbols where no option says otherwise; those of groups are in `domains.assembly_groups`.
    domain = removal_domain(Setting())
    priors = ("graph-sinkhorn",)

    def problem(
        self,
        given: Assembly | str | Path | int = 0,
        *,
        directions: Directions = "axes",
        paths: str = "straight",
        groups: bool = False,
        gravity: bool = True,
        held: int | None = None,
        stability: str = "springs",
        pull: bool = False,
        tilt: float = 0.0,
        fixed: Iterable[str] = (),
        ground: float | bool | None = None,
        before: Iterable[tuple[str, str]] = (),
        keep: Iterable[str | Sequence[str]] = (),
        target: Iterable[str] = (),
        units: str | None = None,
        name: str = "",
    ) -> Problem:
        """Take an assembly apart: all parts that are not fixed are to be out.

        Args:
            given: an assembly, the path of one (`Assembly.load`), or the number of a sample or of a structure made at
                random (`domains.structures`).
            directions: of straight removal: "axes", "contacts", a number of sampled ones, text such as "+z,-x", or
                vectors (k, 3). They are tried in order.
            paths: "straight" lines to infinity only, or "any": where none is free, a path is searched for. On
                assemblies of cells that search is exact for all translations; on others it may end without an answer,
                and a problem that rests on it is given up, never called unsolvable.
            groups: whether parts may leave together, to be taken apart afterwards, in the hand and without gravity.
            gravity: whether what stays must stand by itself, friction included.
            held: how many of the parts that stay may be held meanwhile; any, and others at each step. Without gravity
                it does not matter. Default none; of structures made at random one, where they have fixed parts.
            stability: what standing means: "springs", as a simulation shows it; or "limit", that some forces balance
                the parts, whether or not they would arise. A fall that only springs see promises planners nothing.
            pull: whether what stays must also stand while a part is drawn out along its way, which drags what it
                touches: by friction times the force that presses the two. With springs, under gravity.
            tilt: degrees by which gravity may be tilted, in any of four directions, without anything falling.
            fixed: names of parts that stay and need no support, besides those that the assembly itself fixes.
            ground: height of a plane under the parts (z, world), which nothing goes through; True: under the lowest
                point; False: none; None: under the lowest point (or where the assembly has its table) with gravity,
                none without.
            before: pairs of names of parts: the first must leave before the second.
            keep: groups of names of parts, or names of sub-assemblies, that are one part each, throughout: blocked by
                others only, standing, leaving and counted as one (`neurosym.geometry.keeping`). What a BurrTools file
                or an assembly's JSON calls a piece group is less: its parts move by themselves, and the task is done
                once all that is still together is within one group.
            target: names of the parts that are to be out, with as few others as can be; without any, all are.
            units: of the files' lengths, where the files do not say.
            name: of the problem; default the file's, or the sample's.

        Raises:
            InputError: an option that is not one of those above, or an assembly of fixed parts only.
            AssemblyError: parts that cannot be used, or that reach below the ground.
        """
        assembly, called, hand = self._assembly(given, units)
        held = hand if held is None else held
        _check_options(paths, groups, gravity, held, ground, pull)
        if pull and not (gravity and stability == "springs"):
            raise InputError('Expected pull=True under gravity with stability="springs", which alone knows what drags.')
        assembly = assembly.with_fixed(dict.fromkeys((*assembly.fixed, *as_names(fixed, "fixed"))))
        kept = keep_together(assembly, keep)
        assembly = kept.assembly
        before = [(kept.name(a), kept.name(b)) for a, b in checked_pairs(before, "the domain 'assembly'")]
        assembly = assembly.with_table(_table(assembly, gravity, ground))
        if len(assembly.fixed) == len(assembly):
            raise InputError(f"Expected a part that is not fixed, to take out; all {len(assembly)} are. Fix fewer.")
        geometry = AssemblyGeometry(assembly, rule=stability, tilt=tilt)
        vectors = geometry.directions(directions)
        hands = int(held) if gravity else 0
        targets = _targets(assembly, [kept.name(name) for name in as_names(target, "target")])
        along = tuple(map(tuple, vectors.tolist()))
        setting = Setting(along, paths, bool(groups), bool(gravity), hands, bool(pull), targets)
        details = {
            "directions": directions if isinstance(directions, str | int) else vectors.tolist(),
            "ground": assembly.ground if assembly.has_table else None,
            "fixed": list(assembly.fixed),
            "stability": stability,
            "tilt": geometry.tilt,
            "keep": [list(group) for group in kept.groups],
            "target": list(targets),
            **{key: getattr(setting, key) for key in ("paths", "groups", "gravity", "held", "pull")},
        }
        make = apart_in_groups if groups else apart_one_by_one
        return make(geometry, setting, before=before, name=name or called, family=self.name, details=details)

    def numbers(self, part: str = "test", *, split: int = 0, kind: str | None = None) -> tuple[int, ...]:
        """Numbers of the samples (`domains.assembly_samples`), then of structures made at random; or of one kind."""
        numbers = {"all": range(len(SAMPLES)), "train": range(TRAINING), "test": range(TRAINING, len(SAMPLES))}
        if part not in numbers:
            raise UnknownNameError("part", part, numbers)
        samples = tuple(numbers[part]) if kind in (None, "sample") else ()
        return samples if kind == "sample" else samples + structure_numbers(part, kind)

    def kind(self, number: int) -> str:
        return "sample" if number < SPAN else kind_of(number)

    def problems(self, part: str = "test", *, split: int = 0, **options: Any) -> list[Problem]:
        """The samples of a part, with the options of `problem`; structures are made one by one, by their numbers."""
        return [self.problem(n, **options) for n in self.numbers(part, split=split, kind="sample")]

    def labelled_problems(self, part: str = "train", **options: Any) -> LabelledProblems:
        """Structures made at random, or a folder of assemblies, with shares of their orders.

        See `domains.assembly_labels.labelled_problems` for the options.
        """
        return labelled_problems(self, part, **options)

    def _assembly(self, given: Assembly | str | Path | int, units: str | None) -> tuple[Assembly, str, int]:
        """The assembly, what to call it, and how many parts may be held unless somebody says so."""
        if units is not None and not isinstance(given, str | Path):
            raise InputError("Expected units with the path of files to read; an Assembly has its own. Leave them out.")
        if isinstance(given, Assembly):
            return given, "assembly", 0
        if isinstance(given, str | Path):
            path = Path(given)
            return Assembly.load(path, units=units), path.resolve().name, 0
        if isinstance(given, int | np.integer) and not isinstance(given, bool):
            if given >= SPAN:
                made = structure(self, int(given))
                return made.assembly, f"{kind_of(int(given))} {given}", made.held
            return *sample(int(given)), 0
        raise InputError(f"Expected an Assembly, the path of one, or the number of a sample; got {given!r}.")


def _check_options(
    paths: str, groups: bool, gravity: bool, held: int, ground: float | bool | None, pull: bool
) -> None:
    if paths not in PATHS:
        raise UnknownNameError("kind of paths", paths, PATHS)
    for what, value in (("groups", groups), ("gravity", gravity), ("pull", pull)):
        if not isinstance(value, bool | np.bool_):
            raise InputError(f"Expected {what} as True or False; got {value!r}.")
    if isinstance(held, bool) or not isinstance(held, int | np.integer) or held < 0:
        raise InputError(f"Expected held as a number of parts, 0 or more; got {held!r}.")
    if ground is not None and not (isinstance(ground, int | float | np.number) and np.isfinite(ground)):
        raise InputError(f"Expected ground as a height, True, False or None; got {ground!r}.")


def _targets(assembly: Assembly, names: Iterable[str]) -> tuple[str, ...]:
    for name in (chosen := tuple(dict.fromkeys(names))):
        if name not in assembly.index:
            raise UnknownNameError("target", name, assembly.names)
        if name in assembly.fixed:
            raise InputError(f"Expected targets that are not fixed, to take out; {name!r} is.")
    return chosen


def _table(assembly: Assembly, gravity: bool, ground: float | bool | None) -> float | None:
    """Where the plane is, as `Assembly.with_table` takes it."""
    if ground is None:
        return assembly.table if gravity else NO_TABLE
    if isinstance(ground, bool | np.bool_):
        return None if ground else NO_TABLE
    lowest = float(assembly.bounds[0, 2])
    if ground > lowest + assembly.touch:
        lows = zip(assembly.names, assembly.part_bounds[:, 0, 2])
        below = [name for name, low in lows if low < ground - assembly.touch]
        raise AssemblyError(
            f"Expected parts on or above the ground at {ground:g}; {', '.join(below[:8])} reach down to {lowest:g}."
        )
    return float(ground)
