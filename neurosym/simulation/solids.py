"""From an assembly to what a rigid-body simulator wants: convex pieces, masses, centres and true inertia.

Bullet takes the inertia of a compound from its bounding box unless it is told otherwise, and it trusts bodies of about
one unit more than small ones. So a `RigidBody` carries its own mass properties, its frame lies at the centre of mass
along the principal axes, and the whole scene is scaled until a typical body measures one unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.rigid_motions import posed
from neurosym.geometry.shapes import Body, Box, Part
from neurosym.support.arrays import Array, Numbers

BodiesKind = Literal["parts", "cubes"]
#: What to do with meshes that are not convex: refuse them, or take them apart into convex pieces.
MeshesKind = Literal["refuse", "decompose"]
#: A mesh that fills its convex hull to this share is taken as the hull: CAD facets are rarely exactly convex.
CONVEX_FILL = 1 - 1e-3
#: The same where meshes may be decomposed: facets of a curved face would give hundreds of pieces, for nothing.
NEARLY_CONVEX_FILL = 0.95
#: As long as it has no hole, and no hollow deeper than this share of its smallest extent, in which a part could sit.
SHALLOW = 0.05


@dataclass(frozen=True, slots=True)
class Solid:
    """One convex piece in the scene's frame and scale.

    Attributes:
        X_WB: float64 (4, 4), pose of the piece.
        half: float64 (3,), half edge lengths of a box; None for a convex hull.
        vertices: float64 (n, 3), corners in the piece's own frame.
        volume: its volume. Of the pieces of a decomposed mesh, which only collide, the first has all of the mesh's
            mass properties and the others none: pieces overlap, the mesh's own integrals are exact.
        centre: float64 (3,), centre of mass in the scene.
        inertia: float64 (3, 3), about `centre`, axes of the scene, for density one.
        faces: int64 (m, 3), where it is to collide as the mesh it is, which only a part that never moves can.
    """

    X_WB: Array
    half: Array | None
    vertices: Array
    volume: float
    centre: Array
    inertia: Array
    faces: Numbers | None = None

    @property
    def corners(self) -> Array:
        """float64 (n, 3), corners in the scene."""
        return np.asarray(self.vertices @ self.X_WB[:3, :3].T + self.X_WB[:3, 3])


@dataclass(frozen=True, slots=True)
class RigidBody:
    """What moves as one: a part, or a single piece of it.

    `index`: which piece of the part, 0 where a part is one body. `solids`: its convex pieces. `mass`: in units of the
    scene: the densest part has density one. `X_WC`: float64 (4, 4), frame at the centre of mass along the principal
    axes. `inertia`: float64 (3,), principal moments in that frame.
    """

    part: str
    index: int
    solids: tuple[Solid, ...]
    mass: float
    X_WC: Array
    inertia: Array

    @property
    def corners_C(self) -> Array:
        """float64 (n, 3), corners in the body's own frame."""
        return np.concatenate([(s.corners - self.X_WC[:3, 3]) @ self.X_WC[:3, :3] for s in self.solids])


def typical_extent(assembly: Assembly) -> float:
    """The length that tolerances are counted in: the median edge of the bodies' bounding boxes.

    For a body that is the geometric mean of its three extents, so that for cubes it is the cube's edge, exactly.
    """
    extents = [np.ptp(body.shape.vertices, axis=0) for body in assembly.bodies]
    return float(np.median([np.cbrt(np.prod(e)) for e in extents]))


def rigid_bodies(
    assembly: Assembly, kind: BodiesKind, scale: float, clearance: float = 0.0, meshes: MeshesKind = "refuse"
) -> tuple[RigidBody, ...]:
    """The bodies that a simulation of `assembly` moves, lengths multiplied by `scale`.

    Args:
        kind: ``"parts"``: each part is one rigid compound; ``"cubes"``: each piece of it is a body of its own.
        scale: scene lengths per length unit of the assembly.
        clearance: share of its width that an upright box gives up at its sides (not at its top and bottom).
        meshes: what becomes of meshes that are not convex; those of fixed parts are always kept as they are.

    Raises:
        InputError: `kind` is neither, or a part has a mesh that is not convex and is not to be decomposed.
    """
    if kind not in ("parts", "cubes"):
        raise InputError(f"Expected bodies='parts' or bodies='cubes'; got {kind!r}.")
    heaviest = max(part.density for part in assembly.parts)
    made = []
    for part in assembly.parts:
        static = part.name in assembly.fixed and len(part.bodies) == 1  # a mesh joins no compound
        solids = [
            replace(s, volume=s.volume * body.density, inertia=s.inertia * body.density)
            for body in part.bodies
            for s in _solids(part, body, scale, clearance, meshes, static)
        ]
        groups: Sequence[Sequence[Solid]] = [solids] if kind == "parts" else [[solid] for solid in solids]
        made += [_join(part.name, i, group, part.density / heaviest) for i, group in enumerate(groups)]
    return tuple(made)


def _solids(part: Part, body: Body, scale: float, clearance: float, meshes: MeshesKind, static: bool) -> list[Solid]:
    X_WB = np.array(part.X_WP @ body.X_PB, dtype=np.float64)
    X_WB[:3, 3] *= scale
    R, corners = X_WB[:3, :3], body.shape.vertices * scale
    if isinstance(body.shape, Box):
        half = np.round(body.shape.size * scale, 9) / 2
        upright = np.abs(X_WB[2, :3]) > 1 - 1e-6
        if clearance and upright.any():
            half = np.where(upright, half, half * (1 - clearance))
            corners = np.sign(corners) * half
        # Solid cuboid: I_xx = m (b^2 + c^2) / 12 with full edges, so a third of the squared halves.
        volume = float(8 * np.prod(half))
        moments = (np.sum(half**2) - half**2) / 3
        return [Solid(X_WB, half, corners, volume, X_WB[:3, 3].copy(), R @ np.diag(moments) @ R.T * volume)]
    return _mesh_solids(part.name, X_WB, corners, body.shape.faces, meshes, static)


def _mesh_solids(
    name: str, X_WB: Array, corners: Array, faces: Numbers, meshes: MeshesKind, static: bool
) -> list[Solid]:
    import trimesh

    mesh = trimesh.Trimesh(corners, faces, process=True)
    hull = mesh.convex_hull
    fill = abs(mesh.volume) / hull.volume
    convex = fill >= CONVEX_FILL or (meshes == "decompose" and fill >= NEARLY_CONVEX_FILL and _is_shallow(mesh, hull))
    # Bullet would silently fill the hollows: a bowl would become a disc.
    if not convex and not static and meshes == "refuse":
        raise InputError(
            f"Expected part {name!r} as boxes or convex pieces, which is what a simulator can move; got a mesh that "
            f"fills {fill:.0%} of its convex hull. Give the part as several Convex bodies."
        )
    exact = hull if convex else mesh
    R = X_WB[:3, :3]
    volume, centre = float(abs(exact.volume)), R @ np.asarray(exact.center_mass) + X_WB[:3, 3]
    inertia = R @ np.asarray(exact.moment_inertia) @ R.T
    if convex or static:
        return [Solid(X_WB, None, corners, volume, centre, inertia, None if convex else faces)]
    from neurosym.simulation.decomposition import convex_pieces

    first, *rest = convex_pieces(name, corners, faces)
    massless = (0.0, np.zeros(3), np.zeros((3, 3)))
    return [Solid(X_WB, None, first, volume, centre, inertia), *(Solid(X_WB, None, v, *massless) for v in rest)]


def _is_shallow(mesh: Any, hull: Any) -> bool:
    """Whether a mesh has no hole, and no hollow deeper than `SHALLOW`: then nothing can be in it."""
    if mesh.euler_number != 2:
        return False
    offsets = np.einsum("md,md->m", hull.face_normals, hull.triangles[:, 0])
    some = np.array_split(mesh.vertices, len(mesh.vertices) // 500 + 1)
    depth = max(float((offsets - vertices @ hull.face_normals.T).min(axis=1).max()) for vertices in some)
    return depth <= SHALLOW * float(mesh.extents.min())


def _join(name: str, index: int, solids: Sequence[Solid], density: float) -> RigidBody:
    volume = sum(solid.volume for solid in solids)
    centre = sum((solid.volume * solid.centre for solid in solids), np.zeros(3)) / volume
    inertia = np.zeros((3, 3))
    for solid in solids:
        r = solid.centre - centre
        inertia += solid.inertia + solid.volume * (r @ r * np.eye(3) - np.outer(r, r))  # parallel axes
    if len(solids) == 1 and solids[0].half is not None:
        # A box keeps its own axes: eigenvectors of a cube's inertia are arbitrary.
        R = solids[0].X_WB[:3, :3]
        moments = np.diag(R.T @ inertia @ R)
    else:
        moments, R = np.linalg.eigh(inertia)
        R = R * np.sign(np.linalg.det(R))
    return RigidBody(name, index, tuple(solids), density * volume, posed(R, centre), density * moments)


def quaternion(R: Array) -> Array:
    """Rotation matrix (3, 3) to a unit quaternion (x, y, z, w)."""
    return np.asarray(Rotation.from_matrix(R).as_quat())


def matrix(position: Sequence[float] | Array, quaternion_xyzw: Sequence[float] | Array) -> Array:
    """Position and quaternion (x, y, z, w) to a pose, float64 (4, 4)."""
    return posed(Rotation.from_quat(quaternion_xyzw).as_matrix(), position)
