"""What a picture shows: an assembly as plain arrays, in the cameras' frame, with a colour for each part."""

import colorsys
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.staging import Staging
from neurosym.support.arrays import Array, Numbers

RGB = tuple[float, float, float]
#: Colours of parts in their order, RGB in 0..1: Okabe and Ito's, which people with any colour vision tell apart, black
#: left out as it hides in the shade. Later parts take them again, lighter, then darker.
PALETTE: tuple[RGB, ...] = (
    (0.90, 0.62, 0.00),
    (0.34, 0.71, 0.91),
    (0.00, 0.62, 0.45),
    (0.94, 0.89, 0.26),
    (0.00, 0.45, 0.70),
    (0.84, 0.37, 0.00),
    (0.80, 0.47, 0.65),
)

#: Colour of parts that never move, RGB in 0..1, in films, windows and the page.
FIXED: RGB = (0.55, 0.55, 0.53)


@dataclass(frozen=True)
class Scene:
    """An assembly as arrays, in the cameras' frame: middle at the origin, largest extent from -1 to 1 (see `scene_of`).

    Boxes are given face by face, and faces that lie against another's are left out: what is hidden costs the renderer
    as much as what is seen. An item is one rectangle or one mesh.

    Attributes:
        position: float64 (n_items, 3).
        turn: float64 (n_items, 4), quaternions (x, y, z, w); a rectangle faces along its z axis.
        half: float64 (n_items, 3), half edges of a rectangle (the third is 0), or the scale of a mesh.
        meshes: for items that are meshes, number -> corners (n, 3) and triangles (m, 3), before `half` scales them.
        owner: int64 (n_items,), which part an item belongs to.
        colours: float64 (n_parts, 3), RGB in 0..1.
    """

    position: Array
    turn: Array
    half: Array
    meshes: Mapping[int, tuple[Array, Numbers]]
    owner: Numbers
    colours: Array

    @cached_property
    def shapes(self) -> tuple[tuple[object, ...], ...]:
        """What each item looks like, apart from pose and colour: equal entries share a shape."""
        return tuple(
            (*half, *(m.tobytes() for m in self.meshes.get(i, ())))
            for i, half in enumerate(np.round(self.half, 9).tolist())
        )

    @cached_property
    def digest(self) -> bytes:
        """SHA-256 of everything that decides the pictures."""
        found = hashlib.sha256(repr(sorted(self.meshes)).encode())
        # Rounded, so that poses that differ by what a rotation's arithmetic leaves behind are one.
        for array in (self.position, self.turn, self.half, self.owner, self.colours):
            found.update((np.round(array, 9) + 0.0).tobytes())
        for i in sorted(self.meshes):
            found.update(b"".join(np.ascontiguousarray(m).tobytes() for m in self.meshes[i]))
        return found.digest()


def scene_of(assembly: Assembly, colours: Mapping[str, RGB] | None = None, *, frame: Array | None = None) -> Scene:
    """An assembly as the cameras see it.

    Args:
        assembly: the parts, in the world.
        colours: part name -> RGB in 0..1; parts without one take the palette's, by their place in the assembly.
        frame: float64 (2, 3), the least and the greatest corner of a box in the world: its middle comes to the origin,
            its largest extent to -1 .. 1. None takes the assembly's own bounds; give one where pictures of different
            assemblies are to show where things stand, and how large they are.

    Raises:
        InputError: a colour that is not three numbers in 0..1.
        UnknownNameError: a colour for a part that is not there.
    """
    given = dict(colours or {})
    if unknown := set(given) - set(assembly.names):
        raise UnknownNameError("part", min(unknown), assembly.names)
    chosen = [_checked(name, given.get(name, palette_colour(i))) for i, name in enumerate(assembly.names)]
    bounds = assembly.bounds if frame is None else np.asarray(frame, dtype=np.float64)
    middle, scale = bounds.mean(axis=0), 2 / float(np.ptp(bounds, axis=0).max())
    poses = assembly.X_WB.copy()
    poses[:, :3, 3] = (poses[:, :3, 3] - middle) * scale
    is_box = assembly.bodies.is_box
    others = np.flatnonzero(~is_box)
    frames, half, owner = _faces(assembly, poses, np.flatnonzero(is_box), scale)
    shapes = [assembly.bodies[n].shape for n in others.tolist()]
    meshes = {len(frames) + i: (shape.vertices, shape.faces) for i, shape in enumerate(shapes)}
    frames = np.concatenate([frames, poses[others]])
    half = np.concatenate([half, np.full((len(others), 3), scale)])
    owner = np.concatenate([owner, assembly.owners[others]])
    turn = Rotation.from_matrix(frames[:, :3, :3]).as_quat()
    return Scene(frames[:, :3, 3], turn, half, meshes, owner, np.array(chosen))


#: The six faces of a box: rotations that take z to the face's outward normal, and the axes that then lie along x and y.
_TURNS = np.array(
    [
        [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
        [[0, 0, -1], [1, 0, 0], [0, -1, 0]],
        [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        [[0, -1, 0], [0, 0, -1], [1, 0, 0]],
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    ],
    dtype=np.float64,
)


def _faces(assembly: Assembly, poses: Array, boxes: Numbers, scale: float) -> tuple[Array, Array, Numbers]:
    """Frames (n, 4, 4), half edges (n, 3) and owners (n,) of the boxes' faces, without those that cover each other."""
    half = assembly.bodies.box_sizes[boxes] * scale / 2
    R = poses[boxes, :3, :3]
    frames = np.tile(np.eye(4), (len(boxes), 6, 1, 1))
    frames[:, :, :3, :3] = R[:, None] @ _TURNS
    reach = np.abs(np.einsum("fji,nj->nfi", _TURNS, half))
    frames[:, :, :3, 3] = poses[boxes, None, :3, 3] + frames[:, :, :3, 2] * reach[:, :, 2:]
    owner = np.repeat(assembly.owners[boxes], 6)
    frames, half = frames.reshape(-1, 4, 4), (reach * [1.0, 1.0, 0.0]).reshape(-1, 3)
    seen = np.ones(len(frames), dtype=bool)
    # Only equal cubes on one lattice of directions: there, two faces with one middle cover each other exactly.
    cosines = np.abs(R[0].T @ R) if len(boxes) else R
    if len(boxes) and np.ptp(reach) < 1e-9 and np.allclose(cosines, np.round(cosines), rtol=0, atol=1e-9):
        middles = np.round(frames[:, :3, 3], 6) + 0.0
        _, which, count = np.unique(middles, axis=0, return_inverse=True, return_counts=True)
        seen = count[which.ravel()] == 1
    return frames[seen], half[seen], owner[seen]


def palette_colour(i: int) -> RGB:
    """The colour of part number `i`: the palette's, then lighter, then darker, and so on."""
    base, turn = np.array(PALETTE[i % len(PALETTE)]), i // len(PALETTE)
    amount = 1 - 0.6 ** ((turn + 1) // 2)
    r, g, b = base + (1 - base) * amount if turn % 2 else base * (1 - amount)
    return float(r), float(g), float(b)


def part_colour(i: int, of: int) -> RGB:
    """The colour of part number `i` of so many, RGB in 0..1: as in pictures while the palette has enough of them.

    Lighter and darker turns of the palette end in white and black; many parts go round the colour circle instead, each
    a golden angle from the last.
    """
    if of <= 3 * len(PALETTE):
        return palette_colour(i)
    return colorsys.hsv_to_rgb(0.618034 * i % 1.0, (0.5, 0.62, 0.38)[i % 3], (0.9, 0.74, 0.98)[i % 3])


def part_colours(staging: Staging) -> dict[str, RGB]:
    """A colour for each part of a plan: its own; grey where it is fixed; or by its place in the assembly."""
    names, fixed = staging.assembly.names, staging.assembly.fixed
    own = {name: FIXED if name in fixed else part_colour(i, len(names)) for i, name in enumerate(names)}
    return own | dict(staging.colours)


def _checked(name: str, colour: Sequence[float]) -> RGB:
    if len(colour) != 3 or not all(0.0 <= float(x) <= 1.0 for x in colour):
        raise InputError(f"Expected the colour of {name!r} as RGB, three numbers from 0 to 1; got {colour!r}.")
    r, g, b = (float(x) for x in colour)
    return r, g, b
