"""What an assembly is, before any plan: parts, contacts, what is free, what is interlocked and why, if it stands."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.contact.contacts import TABLE
from neurosym.geometry.step_motion import GROUND
from neurosym.language.explanation import WhyNot

if TYPE_CHECKING:
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
        parts: one entry a part.
        contacts: one entry a pair that touches.
        free: names of the parts that can leave at once along a straight line, whatever then falls.
        free_along: the same, each with its directions in words.
        interlocked: names of the parts that never come free along straight lines: not alone, or, if groups were asked
            for, not in groups either, whatever left before. Empty when all come apart.
        why: what interlocks them; None when nothing does.
        stands: whether the whole stands by itself, or with parts held; True without gravity.
        falls: names of the parts that would fall.
        held: names of the parts to hold so that it stands.
        notes: what was found while loading, in sentences.
    """

    parts: tuple[PartFacts, ...]
    contacts: tuple[Touch, ...]
    free: tuple[str, ...]
    free_along: dict[str, tuple[str, ...]]
    interlocked: tuple[str, ...]
    why: WhyNot | None
    stands: bool
    falls: tuple[str, ...]
    held: tuple[str, ...]
    notes: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """For a file."""
        return {**asdict(self), "why": None if self.why is None else self.why.as_json()}


def inspect_problem(problem: Problem) -> Inspection:
    """Look at the assembly of a problem of the domain "assembly", with straight lines for ways out.

    Raises:
        InputError: a problem of another kind.
    """
    world = problem.world
    if not isinstance(world, Assembly) or problem.details.get("paths") != "straight":
        raise InputError(f'Expected a problem of the domain "assembly" with paths="straight"; got {problem!r}.')
    graph = world.blocking(problem.details["directions"])
    everything = (1 << len(world)) - 1
    free = {
        name: tuple(graph.describe(d) for d in directions)
        for i, name in enumerate(world.names)
        if (directions := graph.free_directions(i, everything))
    }
    why = problem.semantics.refute(problem)
    standing = world.stability().standing_when_held(everything, problem.details["held"])
    stands = standing.stands or not problem.details["gravity"]
    return Inspection(
        parts=_parts(world),
        contacts=_contacts(world),
        free=tuple(free),
        free_along=free,
        interlocked=() if why is None else tuple(n for n in why.left if n not in world.fixed),
        why=why,
        stands=stands,
        falls=() if stands else world.in_mask(standing.moving),
        held=world.in_mask(standing.held) if stands else (),
        notes=tuple(map(str, world.notes)),
    )


def _parts(world: Assembly) -> tuple[PartFacts, ...]:
    masses = world.stability().masses
    found = []
    for i, part in enumerate(world.parts):
        own = world.body_bounds[world.owners == i]
        low, high = (tuple(map(float, corner)) for corner in (own[:, 0].min(axis=0), own[:, 1].max(axis=0)))
        mass = float(masses[i])
        faces = sum(len(body.shape.faces) for body in part.bodies)
        volume = mass / part.density
        found.append(PartFacts(part.name, volume, mass, (low, high), len(part.bodies), faces, part.name in world.fixed))
    return tuple(found)


def _contacts(world: Assembly) -> tuple[Touch, ...]:
    pairs: dict[tuple[int, int], list[float]] = {}
    for contact in world.contacts():
        a = int(world.owners[contact.a])
        b = TABLE if contact.b == TABLE else int(world.owners[contact.b])
        pairs.setdefault((a, b) if b == TABLE or a < b else (b, a), []).append(contact.area)
    return tuple(
        Touch(world.names[a], GROUND if b == TABLE else world.names[b], float(sum(areas)), len(areas))
        for (a, b), areas in sorted(pairs.items())
    )
