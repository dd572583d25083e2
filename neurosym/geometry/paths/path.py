"""Paths: how parts move out, pose by pose, and a check of them that shares nothing with the searches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.geometry.paths.clearance import Clearance, Floor
from neurosym.geometry.rigid_motions import Interpolation

if TYPE_CHECKING:
    from neurosym.geometry.assembly import Assembly

Array = NDArray[np.float64]

#: How a path was found: a straight line, a lattice of translations, OMPL over translations, OMPL over rigid motions,
#: or moves of groups of voxel parts.
Kind = Literal["straight", "lattice", "translation", "rigid", "moves"]


@dataclass(frozen=True, eq=False)
class Track:
    """Parts that move as one rigid body.

    Attributes:
        parts: their names.
        poses: float64 (k, 4, 4): motions of the world, applied to the parts where they are assembled; the identity
            is the assembled place. Between two of them `centre` goes straight and the rotation turns evenly.
        centre: float64 (3,): a point of the assembled parts, in the world.
    """

    parts: tuple[str, ...]
    poses: Array
    centre: Array

    def at(self, key: float) -> Array:
        """The motion, float64 (4, 4), at a key number from 0 to k - 1, whole or between two."""
        first = min(max(int(np.floor(key)), 0), len(self.poses) - 2)
        return self.motion(first).at(min(max(key - first, 0.0), 1.0))

    def motion(self, key: int) -> Interpolation:
        """The motion from one pose, by its number, to the next."""
        return Interpolation(self.poses[key], self.poses[key + 1], self.centre)


@dataclass(frozen=True)
class PathCheck:
    """What a check of a path found.

    Attributes:
        holds: the path is clear all along, and ends with the leaving parts away from the others.
        parts: where it is not, the two parts that meet; one part that reaches below the ground, or is not out.
        key: where on the path: key number, whole or between two.
        reason: that, in a sentence; empty when it holds.
    """

    holds: bool
    parts: tuple[str, ...] = ()
    key: float = 0.0
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Path:
    """Motions of parts, all tracks from key to key at the same time.

    A removal starts in the assembled place; a path that is `reversed` ends there.

    Attributes:
        kind: how it was found.
        tracks: what moves; other parts rest.
        leaving: names of the parts that are away from all others at the far end; what else moves makes way.
    """

    kind: Kind
    tracks: tuple[Track, ...]
    leaving: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise InputError(f"Expected a kind of path, one of {', '.join(get_args(Kind))}; got {self.kind!r}.")
        if not self.tracks:
            raise InputError("Expected a path with at least one track; got none.")
        for track in self.tracks:
            if track.poses.ndim != 3 or track.poses.shape[1:] != (4, 4) or len(track.poses) < 2:
                raise InputError(f"Expected two or more poses of shape (4, 4); got shape {track.poses.shape}.")
            if len(track.poses) != len(self.tracks[0].poses):
                raise InputError("Expected as many poses in each track of a path; their numbers differ.")
            if track.centre.shape != (3,) or not np.isfinite(track.centre).all():
                raise InputError(f"Expected a track's centre as three finite numbers; got {track.centre!r}.")
            R = track.poses[:, :3, :3]
            turns = np.isfinite(track.poses).all() and np.allclose(R @ R.swapaxes(1, 2), np.eye(3), atol=1e-6)
            if not turns or (np.linalg.det(R) < 0).any() or not np.allclose(track.poses[:, 3], [0, 0, 0, 1]):
                raise InputError("Expected the poses of a path to be rigid motions; one has a scale or a reflection.")
        names = [name for track in self.tracks for name in track.parts]
        if not all(track.parts for track in self.tracks) or len(set(names)) != len(names):
            raise InputError("Expected each moving part in one track, and no track without a part.")
        if not self.leaving or not set(self.leaving) <= set(names):
            raise InputError(f"Expected the parts that leave to be some of those that move; got {self.leaving}.")

    @classmethod
    def of(cls, kind: Kind, parts: Sequence[str], poses: Array, centre: Array) -> Path:
        """A path of parts that move as one: a single track."""
        poses, centre = np.asarray(poses, dtype=np.float64), np.asarray(centre, dtype=np.float64)
        return cls(kind, (Track(tuple(parts), poses, centre),), tuple(parts))

    @classmethod
    def straight(cls, assembly: Assembly, moving: int, direction: Array, among: int) -> Path:
        """The straight way of the parts in a bitset along a direction (3,), as far as they are clear of `among`."""
        unit = np.asarray(direction, dtype=np.float64) / np.linalg.norm(direction)
        own = [i for i, o in enumerate(assembly.owners) if moving >> int(o) & 1]
        others = [i for i, o in enumerate(assembly.owners) if (among & ~moving) >> int(o) & 1]
        distance = assembly.smallest_extent
        if others:
            ahead = max(float((assembly.body_vertices(i) @ unit).max()) for i in others)
            behind = min(float((assembly.body_vertices(i) @ unit).min()) for i in own)
            distance += max(ahead - behind, 0.0)
        poses = np.tile(np.eye(4), (2, 1, 1))
        poses[1, :3, 3] = distance * unit
        return cls.of("straight", assembly.in_mask(moving), poses, centre_of(assembly, moving))

    @property
    def poses(self) -> Array:
        """float64 (k, 4, 4): the motions of the first track, the parts that leave."""
        return self.tracks[0].poses

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of all parts that move."""
        return tuple(name for track in self.tracks for name in track.parts)

    @property
    def length(self) -> float:
        """How far the tracks' centres travel, summed over tracks (length); rotation adds nothing."""
        total = 0.0
        for track in self.tracks:
            at = track.poses[:, :3, :3] @ track.centre + track.poses[:, :3, 3]
            total += float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
        return total

    def reversed(self) -> Path:
        """The same way back: a removal becomes an insertion."""
        return Path(self.kind, tuple(Track(t.parts, t.poses[::-1].copy(), t.centre) for t in self.tracks), self.leaving)

    def check(self, assembly: Assembly, among: int, *, ground: float | None = None) -> PathCheck:
        """Whether the path can be gone, found without anything that the searches know.

        Every pair of parts that move relative to one another is followed along the whole way by `Clearance`, which
        misses no overlap deeper than the touching tolerance (by more than a tenth of it) at any moment.

        Args:
            among: a bitset of the parts that are there; those that move are there in any case.
            ground: height (z, world) of a plane that no part may go below; None: there is none.

        Raises:
            UnknownNameError: a moving part that the assembly does not have.
        """
        return check_path(self, assembly, among, ground)

    def to_json(self) -> dict[str, Any]:
        """Plain lists and numbers; `from_json` reads them."""
        return {
            "kind": self.kind,
            "leaving": list(self.leaving),
            "tracks": [
                {"parts": list(t.parts), "centre": t.centre.tolist(), "poses": t.poses.tolist()} for t in self.tracks
            ],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Path:
        """The path that `to_json` wrote.

        Raises:
            InputError: anything else.
        """
        try:
            tracks = tuple(
                Track(
                    tuple(str(name) for name in t["parts"]),
                    np.array(t["poses"], dtype=np.float64),
                    np.array(t["centre"], dtype=np.float64),
                )
                for t in data["tracks"]
            )
            return cls(data["kind"], tracks, tuple(str(name) for name in data["leaving"]))
        except InputError:
            raise
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(
                f"Expected a path with its kind, leaving, tracks, parts, centre and poses; got {error!r}."
            ) from None


def centre_of(assembly: Assembly, mask: int) -> Array:
    """The middle, float64 (3,), of the bounds of the parts in a bitset, in the world."""
    own = assembly.body_bounds[[mask >> int(o) & 1 == 1 for o in assembly.owners]]
    middle: Array = (own[:, 0].min(axis=0) + own[:, 1].max(axis=0)) / 2
    return middle


def apart(assembly: Assembly, a: Array, b: Array) -> bool:
    """Whether points (n, 3) and others (m, 3) leave a gap, wider than touch, along an axis of the world or assembly."""
    axes = np.concatenate([np.eye(3), assembly.axes]).T
    one, two = a @ axes, b @ axes
    gap = np.maximum(one.min(axis=0) - two.max(axis=0), two.min(axis=0) - one.max(axis=0))
    return bool(gap.max() > assembly.touch)


def bodies_of(assembly: Assembly, mask: int) -> list[int]:
    """Numbers of the bodies of the parts in a bitset."""
    return [i for i, owner in enumerate(assembly.owners) if mask >> int(owner) & 1]


def check_path(path: Path, assembly: Assembly, among: int, ground: float | None) -> PathCheck:
    """See `Path.check`."""
    masks = [sum(1 << assembly.index[assembly[name].name] for name in t.parts) for t in path.tracks]
    bodies = [bodies_of(assembly, mask) for mask in masks]
    resting = bodies_of(assembly, among & ~sum(masks))
    pairs: list[tuple[int, int | None, Clearance]] = []
    for a, own in enumerate(bodies):
        if resting:
            pairs.append((a, None, Clearance(assembly, own, resting)))
        pairs.extend((a, b, Clearance(assembly, own, bodies[b])) for b in range(a))
    floors = [] if ground is None else [Floor(assembly, own, ground) for own in bodies]
    for key in range(len(path.tracks[0].poses) - 1):
        motions = [t.motion(key) for t in path.tracks]
        for a, b, clearance in pairs:
            hit = clearance.first_hit(motions[a], None if b is None else motions[b])
            if hit is not None:
                names = tuple(assembly.names[assembly.owners[i]] for i in hit[1:])
                at = key + hit[0]
                return PathCheck(False, names, at, f"{names[0]} meets {names[1]} at {at:.3f} of the path's keys")
        for track, floor, motion in zip(path.tracks, floors, motions):
            share = floor.first_hit(motion)
            if share is not None:
                reason = f"{', '.join(track.parts)} would go below the ground at {key + share:.3f} of the path's keys"
                return PathCheck(False, track.parts, key + share, reason)
    return _away(path, assembly, among | sum(masks))


def _away(path: Path, assembly: Assembly, among: int) -> PathCheck:
    """Whether the leaving parts are away from all others at one of the two ends."""
    for end in (-1, 0):
        pose = {name: t.poses[end] for t in path.tracks for name in t.parts}
        leaving: list[Array] = []
        others: list[Array] = []
        for i in bodies_of(assembly, among):
            name = assembly.names[assembly.owners[i]]
            X = pose.get(name, np.eye(4))
            points = assembly.body_vertices(i) @ X[:3, :3].T + X[:3, 3]
            (leaving if name in path.leaving else others).append(points)
        if not others or apart(assembly, np.concatenate(leaving), np.concatenate(others)):
            return PathCheck(True)
    return PathCheck(False, path.leaving, len(path.poses) - 1.0, f"{', '.join(path.leaving)} is not out at the end")
