"""Assemblies: named rigid parts at poses, each a union of boxes, convex bodies or closed meshes.

Frames are named as Drake does: ``X_WP`` is the pose of part P in the world W, a 4 x 4 rigid motion;
``X_PB`` that of body B in part P. z points up; lengths are in the user's unit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from neurosym.errors import AssemblyError, UnknownNameError
from neurosym.geometry.notes import Note
from neurosym.geometry.readers.cells import parts_from_cells
from neurosym.geometry.shapes import Array as Array
from neurosym.geometry.shapes import Body as Body
from neurosym.geometry.shapes import Box as Box
from neurosym.geometry.shapes import Convex as Convex
from neurosym.geometry.shapes import Mesh as Mesh
from neurosym.geometry.shapes import Part as Part
from neurosym.geometry.shapes import Shape as Shape
from neurosym.geometry.shapes import boxes_part as boxes_part
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances

if TYPE_CHECKING:
    from pathlib import Path

    from neurosym.geometry.blocking.directions import Directions
    from neurosym.geometry.blocking.graph import BlockingGraph
    from neurosym.geometry.contact.contacts import Contact
    from neurosym.geometry.stability.standing import Stability

T = TypeVar("T")

#: The height of a table that is not there: infinitely far down, where nothing touches it.
NO_TABLE = float("-inf")


@dataclass(frozen=True, eq=False)
class Assembly:
    """Named parts at poses.

    Attributes:
        parts: the parts, each with a name of its own.
        table: height of the table's plane (z, world); None: under the lowest point; `NO_TABLE`: there is none.
        friction: Coulomb's coefficient between any two faces (no unit).
        tolerances: how exact the geometry is taken to be.
        fixed: names of parts that never move and need no support, such as springers and foundations.
        units: what a length of 1 is ("m", "mm", ...), for people and files; None when nobody said.
    """

    parts: tuple[Part, ...]
    table: float | None = None
    friction: float = 0.5
    tolerances: Tolerances = DEFAULT_TOLERANCES
    fixed: tuple[str, ...] = ()
    units: str | None = None
    notes: tuple[Note, ...] = ()
    _cache: dict[str, Any] = field(default_factory=dict, repr=False)
    _keep_answers: bool = field(default=True, repr=False)

    def __post_init__(self) -> None:
        names = [p.name for p in self.parts]
        if not names:
            raise AssemblyError("Expected at least one part; got none.")
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise AssemblyError(f"Expected each part name once; got twice: {', '.join(twice)}. Rename one.")
        if not (isinstance(self.friction, int | float | np.number) and 0.0 <= self.friction < np.inf):
            raise AssemblyError(f"Expected a coefficient of friction of 0 or more; got {self.friction!r}.")
        for name in self.fixed:
            if name not in names:
                raise UnknownNameError("fixed part", name, names)
        for part in self.parts:
            if not part.bodies:
                raise AssemblyError(f"Expected part {part.name!r} to have at least one body; it is empty.")
            for body in part.bodies:
                X = part.X_WP @ body.X_PB
                if not np.isfinite(body.shape.vertices).all() or not np.isfinite(X).all():
                    raise AssemblyError(f"Expected finite coordinates; part {part.name!r} has NaN or infinity.")

    # -- making -----------------------------------------------------------------------------------------------

    @classmethod
    def from_cells(
        cls,
        cells: Mapping[str, Iterable[Sequence[int]]],
        size: float = 1.0,
        *,
        table: float | None = None,
        friction: float = 0.5,
        tolerances: Tolerances = DEFAULT_TOLERANCES,
    ) -> Assembly:
        """Parts made of unit cells, each cell a box of edge `size`; cell (x, y, z) spans size * (x .. x + 1).

        Raises:
            AssemblyError: an empty part, a cell that comes twice or belongs to two parts, or that is no triple
                of integers.
        """
        return cls(parts_from_cells(cells, size), table, friction, tolerances)

    @classmethod
    def from_meshes(
        cls,
        meshes: Mapping[str, Any],
        *,
        table: float | None = None,
        friction: float = 0.5,
        tolerances: Tolerances = DEFAULT_TOLERANCES,
    ) -> Assembly:
        """Parts given as closed meshes in their assembled poses.

        Args:
            meshes: name -> a `trimesh.Trimesh`, or anything with ``vertices`` (n, 3) and ``faces`` (m, 3), or a
                pair of such arrays. A part all of whose faces lie on one cubic grid (in any pose) becomes boxes.
        """
        from neurosym.geometry.readers.meshes import parts_from_meshes

        if not isinstance(meshes, Mapping):
            raise AssemblyError(f"Expected parts as {{name: mesh}}; got {type(meshes).__name__}.")
        return cls(parts_from_meshes(meshes, tolerances), table, friction, tolerances)

    @classmethod
    def load(
        cls,
        path: str | Path,
        *,
        units: str | None = None,
        fixed: Iterable[str] = (),
        tolerances: Tolerances | None = None,
        friction: float | None = None,
        up: str | None = None,
        problem: int = 1,
        solution: int = 1,
    ) -> Assembly:
        """An assembly from a folder of meshes or from a file, looked over.

        Args:
            path: a folder with one mesh a part (OBJ, STL, PLY, OFF; see `neurosym.geometry.readers.folder`), or a file:
                GLB, glTF, 3MF, STEP (extra ``cad``), BurrTools ``.xmpuzzle``, the JSON that `save` writes (see
                `neurosym.geometry.readers.assembly_json`), or one mesh. Parts are named after files or nodes.
            units: the unit of the assembly's lengths ("mm", "m", "in", ...). Of a format that states its own (glTF and
                STEP metres, 3MF and JSON what they say) lengths are converted to it; of others it says what they are.
            fixed: names of parts that never move, besides those that the files name.
            tolerances: kept as they are where given. Otherwise touch is raised, to at most 5% of the smallest extent,
                so that mating faces that overlap a little at rest count as touching; `notes` says by how much.
            friction: Coulomb's coefficient; None: the file's, else 0.5.
            up: "y" or "z", what is up in the files; None: z, but in glTF see `neurosym.geometry.readers.gltf`.
            problem, solution: which of a puzzle file's, counted from 1.

        Returns:
            The assembly; `notes` says what was found and mended.

        Raises:
            FaultyPartsError: parts that cannot be used (open, crossing themselves, not numbers, overlapping deeply);
                all of them, each with the measure and what to do.
            AssemblyError: the file cannot be read, goes beyond a limit, or reaches outside its folder.
            InputError: an unknown unit, part or number of a problem.
            MissingDependencyError: STEP without cascadio.
        """
        from neurosym.geometry.readers.loading import Options, load

        options = Options(up=up, problem=problem, solution=solution)
        return load(path, units=units, fixed=fixed, tolerances=tolerances, friction=friction, options=options)

    def save(self, path: str | Path) -> None:
        """Write the assembly as JSON, whole or not at all; `load` gives the same one back, number by number."""
        from neurosym.geometry.readers.assembly_json import write

        write(self, path)

    def transformed(self, X: ArrayLike) -> Assembly:
        """The assembly moved by a rigid motion of the world, float64 (4, 4).

        A table that was given goes along with an upright motion; one under the lowest point stays there.
        """
        motion = _rigid(X)
        parts = tuple(Part(p.name, p.bodies, motion @ p.X_WP, p.density) for p in self.parts)
        table = self.table
        if table is not None and table != NO_TABLE:
            if not np.isclose(motion[2, 2], 1.0):
                raise AssemblyError("Expected an upright motion: the table of this assembly was given by its height.")
            table = float(table + motion[2, 3])
        return replace(self, parts=parts, table=table, _cache={})

    def with_fixed(self, names: Iterable[str]) -> Assembly:
        """The assembly with these parts fixed, and no others."""
        return replace(self, fixed=tuple(names), _cache={})

    def with_table(self, height: float | None) -> Assembly:
        """The assembly with the table at this height, under its lowest point (None), or nowhere (`NO_TABLE`)."""
        return replace(self, table=height, _cache={})

    def afresh(self) -> Assembly:
        """The same assembly with nothing remembered and nothing tabulated: every question is asked anew."""
        return replace(self, _cache={}, _keep_answers=False)

    # -- asking -----------------------------------------------------------------------------------------------

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parts, in order; masks of parts number their bits so."""
        return tuple(p.name for p in self.parts)

    @cached_property
    def index(self) -> dict[str, int]:
        """Name of a part -> its number."""
        return {name: i for i, name in enumerate(self.names)}

    def __len__(self) -> int:
        return len(self.parts)

    def __getitem__(self, name: str) -> Part:
        try:
            return self.parts[self.index[name]]
        except KeyError:
            raise UnknownNameError("part", name, self.names) from None

    @property
    def keeps_answers(self) -> bool:
        """Whether pairwise answers are tabulated; a copy made by `afresh` asks each question anew."""
        return self._keep_answers

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies, part by part; masks of bodies number their bits so."""
        return tuple(b for p in self.parts for b in p.bodies)

    @cached_property
    def owners(self) -> NDArray[np.int64]:
        """int64 (n_bodies,): the number of the part that each body belongs to."""
        return np.repeat(np.arange(len(self.parts)), [len(p.bodies) for p in self.parts])

    @cached_property
    def X_WB(self) -> Array:
        """float64 (n_bodies, 4, 4): poses of all bodies in the world."""
        return np.array([p.X_WP @ b.X_PB for p in self.parts for b in p.bodies])

    @cached_property
    def all_boxes(self) -> bool:
        """Whether every body is a box."""
        return all(isinstance(b.shape, Box) for b in self.bodies)

    @cached_property
    def is_box(self) -> NDArray[np.bool_]:
        """bool (n_bodies,): which bodies are boxes."""
        return np.array([isinstance(b.shape, Box) for b in self.bodies])

    @cached_property
    def is_convex(self) -> NDArray[np.bool_]:
        """bool (n_bodies,): which bodies are convex by their kind of shape."""
        return np.array([not isinstance(b.shape, Mesh) for b in self.bodies])

    @cached_property
    def box_sizes(self) -> Array:
        """float64 (n_bodies, 3): full edge lengths of the boxes, 0 for other bodies."""
        return np.array([b.shape.size if isinstance(b.shape, Box) else np.zeros(3) for b in self.bodies])

    def body_vertices(self, body: int) -> Array:
        """float64 (n, 3): the vertices of a body, in the world."""
        X = self.X_WB[body]
        vertices: Array = self.bodies[body].shape.vertices @ X[:3, :3].T + X[:3, 3]
        return vertices

    @cached_property
    def body_bounds(self) -> Array:
        """float64 (n_bodies, 2, 3): axis-aligned bounds of the bodies, in the world."""
        half = np.einsum("bij,bj->bi", np.abs(self.X_WB[:, :3, :3]), self.box_sizes / 2)
        centres = self.X_WB[:, :3, 3]
        found: Array = np.stack([centres - half, centres + half], axis=1)
        for i in np.flatnonzero(~self.is_box):
            vertices = self.body_vertices(int(i))
            found[i] = vertices.min(axis=0), vertices.max(axis=0)
        return found

    @cached_property
    def bounds(self) -> Array:
        """float64 (2, 3): axis-aligned bounds of the whole, in the world."""
        return np.array([self.body_bounds[:, 0].min(axis=0), self.body_bounds[:, 1].max(axis=0)])

    @property
    def ground(self) -> float:
        """Height of the table (z, world): as given, else the lowest point; `NO_TABLE` where there is none."""
        return float(self.bounds[0, 2]) if self.table is None else self.table

    @property
    def has_table(self) -> bool:
        """Whether there is a table at all."""
        return self.table != NO_TABLE

    @cached_property
    def smallest_extent(self) -> float:
        """The smallest extent of any body in its own frame: what tolerances are shares of."""
        return float(min(np.ptp(b.shape.vertices, axis=0).min() for b in self.bodies))

    @cached_property
    def touch(self) -> float:
        """The touching tolerance as a length."""
        return self.tolerances.touch * self.smallest_extent

    @cached_property
    def mate(self) -> float:
        """The tolerance for overlaps at rest as a length."""
        return max(self.touch, self.tolerances.mate * self.smallest_extent)

    @cached_property
    def axes(self) -> Array:
        """float64 (k, 3): the directions in which the assembly is built, both ways, the most upward first.

        These are the axes of its boxes, up to sign, and the vertical; without boxes, the world's axes.
        """
        from neurosym.geometry.blocking.directions import built_axes

        return built_axes(self)

    def mask(self, names: Iterable[str]) -> int:
        """A bitset of parts."""
        return sum(1 << self.index[n] for n in names)

    @cached_property
    def fixed_mask(self) -> int:
        """A bitset of the fixed parts."""
        return self.mask(self.fixed)

    def in_mask(self, mask: int) -> tuple[str, ...]:
        """Names of the parts in a bitset."""
        return tuple(n for i, n in enumerate(self.names) if mask >> i & 1)

    # -- facts about pairs, computed once ---------------------------------------------------------------------

    def contacts(self) -> tuple[Contact, ...]:
        """Where bodies touch one another and the table: points, normals, areas."""
        from neurosym.geometry.contact.contacts import find_contacts

        return self.remember("contacts", lambda: find_contacts(self))

    def contact_directions(self) -> Array:
        """float64 (k, 3): where the contacts let parts slide or lift off, those of most parts first."""
        from neurosym.geometry.blocking.directions import contact_directions

        return self.remember("contact directions", lambda: contact_directions(self))

    def blocking(self, directions: Directions = None) -> BlockingGraph:
        """What stands in the way of what, per direction (see `directions_for`); default `axes`."""
        from neurosym.geometry.blocking.directions import directions_for
        from neurosym.geometry.blocking.graph import BlockingGraph

        chosen = directions_for(self, directions)
        return self.remember(f"blocking {chosen.tobytes().hex()}", lambda: BlockingGraph(self, chosen))

    def stability(self) -> Stability:
        """Which subsets of the parts stand still under gravity."""
        from neurosym.geometry.stability.standing import Stability

        return self.remember("stability", lambda: Stability(self))

    def remember(self, key: str, make: Callable[[], T]) -> T:
        """What `make` gives, computed once for this assembly and kept under `key`."""
        if key not in self._cache:
            self._cache[key] = make()
        return cast(T, self._cache[key])

    def __getstate__(self) -> dict[str, Any]:
        """Copies sent to other processes leave the remembered answers behind: FCL's objects cannot travel."""
        state = {k: v for k, v in self.__dict__.items() if k in self.__dataclass_fields__}
        state["_cache"] = {}
        return state


def _rigid(X: ArrayLike) -> Array:
    motion = np.asarray(X, dtype=np.float64)
    if motion.shape != (4, 4) or not np.isfinite(motion).all():
        raise AssemblyError(f"Expected a rigid motion of shape (4, 4); got shape {motion.shape}.")
    R = motion[:3, :3]
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0:
        raise AssemblyError("Expected a rigid motion: a rotation without scale or reflection; this is none.")
    if not np.allclose(motion[3], [0, 0, 0, 1]):
        raise AssemblyError(f"Expected the last row of a rigid motion to be 0 0 0 1; got {motion[3]}.")
    return motion
