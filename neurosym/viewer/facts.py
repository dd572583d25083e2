"""What geometry knows of one part: what it touches, what blocks it in each direction, what it stands on and carries."""

from collections.abc import Collection
from dataclasses import dataclass

from neurosym.geometry.assembly import Assembly
from neurosym.geometry.queries import AssemblyGeometry


@dataclass(frozen=True)
class Exit:
    """A direction (in words: ``+z``) in which a part might leave; which parts block it there, and whether the table."""

    direction: str
    blockers: tuple[str, ...]
    into_table: bool

    @property
    def free(self) -> bool:
        return not (self.blockers or self.into_table)


@dataclass(frozen=True)
class PartFacts:
    """Facts about one part, which may be gone itself, and the names of those that it touches, of the parts in place.

    It stands on those that touch it from below, and has one exit for each direction in which its assembly is built.
    """

    name: str
    present: bool
    touches: tuple[str, ...]
    on_table: bool
    stands_on: tuple[str, ...]
    carries: tuple[str, ...]
    exits: tuple[Exit, ...]
    fixed: bool = False


def part_facts(given: Assembly | AssemblyGeometry, name: str, there: Collection[str]) -> PartFacts:
    """The facts about a part while only the parts named in `there` are in place.

    The first call for an `AssemblyGeometry` computes contacts and blocking between all pairs; later ones are bit
    arithmetic. Raises UnknownNameError: no such part.
    """
    geometry = AssemblyGeometry.of(given)
    assembly = geometry.assembly
    assembly[name]  # says which names there are
    number = assembly.index[name]
    among = assembly.mask(there) & ~(1 << number)
    stability, graph = geometry.stability, geometry.blocking()
    carried = sum(1 << i for i in range(len(assembly)) if stability.supports[i] >> number & 1)
    exits = tuple(
        Exit(graph.describe(d), assembly.in_mask(graph.blockers(number, d, among)), bool(graph.into_table[d]))
        for d in range(len(graph.vectors))
    )
    return PartFacts(
        name=name,
        present=name in there,
        touches=assembly.in_mask(stability.touching[number] & among),
        on_table=bool(stability.on_table >> number & 1),
        stands_on=assembly.in_mask(stability.supports[number] & among),
        carries=assembly.in_mask(carried & among),
        exits=exits,
        fixed=name in assembly.fixed,
    )
