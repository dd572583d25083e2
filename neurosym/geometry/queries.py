"""Questions about an assembly: the one object that asks contact, blocking and stability, each once, and remembers.

Domains, predicates and validation are given this. A room is imported when it is first asked: FCL, shapely and scipy's
optimizers take their time to load.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar, TypeVarTuple, cast

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.shapes import Part
from neurosym.support.arrays import Array

if TYPE_CHECKING:
    from neurosym.geometry.blocking.directions import Directions
    from neurosym.geometry.blocking.graph import BlockingGraph
    from neurosym.geometry.blocking.sweep import Sweeps
    from neurosym.geometry.contact.contacts import Contact
    from neurosym.geometry.contact.surfaces import BodySurfaces
    from neurosym.geometry.paths.grid import GridCells
    from neurosym.geometry.stability.spring_stability import SpringStability
    from neurosym.geometry.stability.standing import Stability

#: What standing means: "springs": parts on springs come to rest under gravity, as a simulation shows it; "limit": some
#: forces balance (limit analysis), whether or not they would arise.
STABILITY_RULES = ("springs", "limit")

T = TypeVar("T")
Ts = TypeVarTuple("Ts")


class AssemblyGeometry:
    """What is possible with an assembly.

    Args:
        assembly: the data.
        tabulate: whether answers are tabulated and kept. Otherwise whether a part is blocked, and whether a subset
            stands, is asked anew each time: for checks that share no table with what they check.
        rule: what `stability` means by standing, one of `STABILITY_RULES`.
        tilt: degrees, 0 to 90, by which gravity may be tilted in any of four directions; of springs.

    Raises:
        UnknownNameError: another rule.
        InputError: another tilt, or one with another rule than springs.
    """

    def __init__(
        self, assembly: Assembly, *, tabulate: bool = True, rule: str = "springs", tilt: float = 0.0
    ) -> None:
        if rule not in STABILITY_RULES:
            raise UnknownNameError("rule of stability", rule, STABILITY_RULES)
        if not isinstance(tilt, int | float) or not 0 <= tilt < 90 or (tilt and rule != "springs"):
            raise InputError(f"Expected a tilt of 0 to 90 degrees, which springs can judge; got {tilt!r} by {rule}.")
        self.assembly, self.tabulate, self.rule, self.tilt = assembly, tabulate, rule, float(tilt)
        self.names, self.index = assembly.names, assembly.index
        self._graphs: dict[Any, BlockingGraph] = {}
        self._answers: dict[tuple[Any, ...], Any] = {}

    @classmethod
    def of(cls, given: Assembly | AssemblyGeometry) -> AssemblyGeometry:
        """The geometry of an assembly, or what is such an object already."""
        return given if isinstance(given, AssemblyGeometry) else cls(given)

    def anew(self) -> AssemblyGeometry:
        """The same assembly with nothing known and nothing tabulated."""
        return AssemblyGeometry(self.assembly, tabulate=False, rule=self.rule, tilt=self.tilt)

    def __repr__(self) -> str:
        return f"AssemblyGeometry({self.assembly!r}, rule={self.rule!r})"

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, name: str) -> Part:
        return self.assembly[name]

    def mask(self, names: Iterable[str]) -> int:
        """A bitset of parts."""
        return self.assembly.mask(names)

    def in_mask(self, mask: int) -> tuple[str, ...]:
        """Names of the parts in a bitset."""
        return self.assembly.in_mask(mask)

    # -- contact ----------------------------------------------------------------------------------------------

    @cached_property
    def _surfaces(self) -> BodySurfaces:
        from neurosym.geometry.contact.surfaces import BodySurfaces

        return BodySurfaces(self.assembly.bodies)

    @cached_property
    def contacts(self) -> tuple[Contact, ...]:
        """Where bodies touch one another and the table: points, normals, areas."""
        from neurosym.geometry import kept_tables
        from neurosym.geometry.contact.contacts import find_contacts

        def find() -> tuple[Contact, ...]:
            return find_contacts(self.assembly, self._surfaces)

        return kept_tables.contacts(self.assembly, find) if self.tabulate else find()

    # -- blocking ---------------------------------------------------------------------------------------------

    @cached_property
    def contact_directions(self) -> Array:
        """float64 (k, 3): where the contacts let parts slide or lift off, those of most parts first."""
        from neurosym.geometry.blocking.directions import contact_directions

        return contact_directions(self.assembly, self.contacts)

    def directions(self, spec: Directions = None) -> Array:
        """Unit vectors, float64 (k, 3): see `directions_for`."""
        from neurosym.geometry.blocking.directions import directions_for

        return directions_for(self.assembly, spec, from_contacts=lambda: self.contact_directions)

    @cached_property
    def _sweeps(self) -> Sweeps:
        from neurosym.geometry.blocking.sweep import Sweeps

        return Sweeps(self.assembly, self._surfaces)

    def blocking(self, directions: Directions = None) -> BlockingGraph:
        """What stands in the way of what, per direction (see `directions_for`); default `Assembly.axes`."""
        known = None
        if directions is None or isinstance(directions, str | tuple):
            with contextlib.suppress(TypeError):  # tuples of lists
                known = self._graphs.get(directions)
        return known or self._graph(directions)

    def _graph(self, directions: Directions) -> BlockingGraph:
        from neurosym.geometry import kept_tables
        from neurosym.geometry.blocking.graph import BlockingGraph

        vectors = self.directions(directions)
        key = tuple(map(tuple, vectors.tolist()))
        keep = partial(kept_tables.blocking, self.assembly, vectors)
        options: dict[str, Any] = {"tabulate": True, "kept": keep} if self.tabulate else {"tabulate": False}
        graph = self._graphs.get(key) or BlockingGraph(self._sweeps, vectors, **options)
        self._graphs[key] = graph
        if directions is None or isinstance(directions, str):
            self._graphs[directions] = graph
        return graph

    def hits_along(self, part: int, direction: Array, others: int) -> int:
        """Bitset of those of `others` that a part hits along a unit vector (3,), asked of these pairs alone."""
        from neurosym.geometry.blocking.stepping import hits_along

        return hits_along(self._sweeps, part, direction, others)

    # -- stability --------------------------------------------------------------------------------------------

    @property
    def stability(self) -> Stability | SpringStability:
        """Which subsets of the parts stand under gravity, by the rule of this object."""
        return self.limit if self.rule == "limit" else self.springs

    @cached_property
    def limit(self) -> Stability:
        """Which subsets some forces balance."""
        from neurosym.geometry.stability.standing import Stability

        return Stability(self.assembly, self.contacts, remember=self.tabulate)

    @cached_property
    def springs(self) -> SpringStability:
        """Which subsets come to rest on springs, with what moves, forces at contacts, margins and drag."""
        from neurosym.geometry.stability.of_assembly import spring_stability

        return spring_stability(self.assembly, self.contacts, remember=self.tabulate, tilt=self.tilt)

    # -- paths, and whatever else -----------------------------------------------------------------------------

    @cached_property
    def cells(self) -> GridCells | None:
        """The grid that all parts are made of, if there is one."""
        from neurosym.geometry.paths.grid import cells_of

        return cells_of(self.assembly)

    def ask_once(self, question: Callable[[AssemblyGeometry, *Ts], T], *args: *Ts) -> T:
        """``question(self, *args)``, asked once: for searches of paths, and tables that a domain makes for itself."""
        key = (question, *args)
        try:
            return cast(T, self._answers[key])
        except KeyError:
            answer = self._answers[key] = question(self, *args)
            return answer

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies sent to other processes leave the answers behind: FCL's objects cannot travel."""
        return _made, (self.assembly, self.tabulate, self.rule, self.tilt)


def _made(assembly: Assembly, tabulate: bool, rule: str, tilt: float) -> AssemblyGeometry:
    return AssemblyGeometry(assembly, tabulate=tabulate, rule=rule, tilt=tilt)
