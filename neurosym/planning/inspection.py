"""What an assembly is, before any plan: parts, contacts, what is free, what is interlocked and why, if it stands."""

from dataclasses import asdict, dataclass, replace
from typing import Any

from neurosym.errors import InputError
from neurosym.geometry.contact.contacts import TABLE, areas_between
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.stability.holding import all_falling
from neurosym.geometry.step_motion import GROUND
from neurosym.language.explanation import WhyNot
from neurosym.language.problem import Problem


@dataclass(frozen=True)
class PartFacts:
    """One part. ``volume``: length cubed; ``bounds``: lower and upper corner, in the world; ``faces``: triangles."""

    name: str
    volume: float
    mass: float
    bounds: tuple[tuple[float, ...], tuple[float, ...]]
    bodies: int
    faces: int
    fixed: bool


@dataclass(frozen=True)
class Touch:
    """Two parts that touch, or a part and the ground. ``area``: of all patches, length squared."""

    a: str
    b: str
    area: float
    patches: int


@dataclass(frozen=True)
class Inspection:
    """What `inspect` found.

    Attributes:
        free: names of the parts that can leave at once along a straight line, whatever then falls.
        free_along: the same, each with its directions in words.
        interlocked: names of the parts that never come free along straight lines: not alone, or, if groups were asked
            for, not in groups either, whatever left before. Empty when all come apart.
        why: what interlocks them; None when nothing does.
        stands: whether the whole stands by itself, or with parts held; True without gravity.
        balanced: whether some forces balance it, as it is or with parts held (limit analysis); True without gravity.
        falls: names of the parts that would fall.
        movements: sentences on what moves and how, what falls most first; of springs only.
        margin: the largest tilt of gravity (degrees) that it bears; None where it was not asked for.
        held: names of the parts to hold so that it stands.
        notes: what was found while loading, in sentences.
        kept: names of the parts that are one part throughout, group by group.
        piece_groups: names of parts that need not be separated from one another.
        subassemblies: name -> names of its parts, for those that the file has.
    """

    parts: tuple[PartFacts, ...]
    contacts: tuple[Touch, ...]
    free: tuple[str, ...]
    free_along: dict[str, tuple[str, ...]]
    interlocked: tuple[str, ...]
    why: WhyNot | None
    stands: bool
    balanced: bool
    falls: tuple[str, ...]
    movements: tuple[str, ...]
    margin: float | None
    held: tuple[str, ...]
    notes: tuple[str, ...]
    kept: tuple[tuple[str, ...], ...]
    piece_groups: tuple[tuple[str, ...], ...]
    subassemblies: dict[str, tuple[str, ...]]

    def as_json(self) -> dict[str, Any]:
        """For a file."""
        return {**asdict(self), "why": None if self.why is None else self.why.as_json()}


def inspect_problem(problem: Problem, *, margin: bool = False) -> Inspection:
    """Look at the assembly of a problem of the domain "assembly", with straight lines for ways out.

    Args:
        margin: whether to ask how much the standing whole may be tilted.

    Raises:
        InputError: a problem of another kind.
    """
    world = problem.geometry
    if world is None or problem.details.get("paths") != "straight":
        raise InputError(f'Expected a problem of the domain "assembly" with paths="straight"; got {problem!r}.')
    graph = world.blocking(problem.details["directions"])
    everything = (1 << len(world)) - 1
    free = {
        name: tuple(graph.describe(d) for d in directions)
        for i, name in enumerate(world.names)
        if (directions := graph.free_directions(i, everything))
    }
    why = problem.semantics.refute(problem)
    # That the whole does not stand interlocks nothing, and is looked at below.
    why = replace(why, falls=()) if why is not None and why.blocked else None
    held, gravity = problem.details["held"], problem.details["gravity"]
    standing = world.stability.standing_when_held(everything, held)
    stands = standing.stands or not gravity
    # Springs that stand are forces that balance.
    balanced = stands or world.springs.limit.standing_when_held(everything, held).stands
    moves = world.springs.movements(everything) if not stands and world.rule == "springs" else ()
    return Inspection(
        parts=_parts(world),
        contacts=_contacts(world),
        free=tuple(free),
        free_along=free,
        interlocked=() if why is None else tuple(n for n in why.left if n not in world.assembly.fixed),
        why=why,
        stands=stands,
        balanced=balanced,
        movements=tuple(m.sentence(world.names) for m in moves),
        margin=_margin(world, everything, standing.held) if margin and gravity else None,
        falls=() if stands else world.in_mask(all_falling(world.stability.standing, everything, standing.falling)),
        held=world.in_mask(standing.held) if stands else (),
        notes=tuple(map(str, world.assembly.notes)),
        kept=tuple(map(tuple, problem.details["keep"])),
        piece_groups=tuple(group.names for group in world.assembly.piece_groups),
        subassemblies=dict(world.assembly.subassemblies),
    )


def _margin(world: AssemblyGeometry, subset: int, held: int) -> float:
    from neurosym.geometry.stability.spring_loads import margin

    return margin(world.springs, subset, held)


def _parts(world: AssemblyGeometry) -> tuple[PartFacts, ...]:
    facts = []
    for part, bounds, mass in zip(world.assembly.parts, world.assembly.part_bounds.tolist(), world.stability.masses):
        faces = sum(len(body.shape.faces) for body in part.bodies)
        low, high = map(tuple, bounds)
        fixed = part.name in world.assembly.fixed
        sizes = float(mass / part.density), float(mass), (low, high), len(part.bodies), faces
        facts.append(PartFacts(part.name, *sizes, fixed))
    return tuple(facts)


def _contacts(world: AssemblyGeometry) -> tuple[Touch, ...]:
    return tuple(
        Touch(world.names[a], GROUND if b == TABLE else world.names[b], float(sum(areas)), len(areas))
        for (a, b), areas in sorted(areas_between(world.assembly, world.contacts).items())
    )
