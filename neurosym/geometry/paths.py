"""Paths: how parts move out, pose by pose, and a check of them that shares nothing with the searches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from neurosym.errors import InputError

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
        return between(self.poses[first], self.poses[first + 1], min(max(key - first, 0.0), 1.0), self.centre)


@dataclass(frozen=True, eq=False)
class Path:
    """Motions of parts, all tracks from key to key at the same time.

    A removal starts in the assembled place; a path that is `reversed` ends there.
    """

    kind: Kind
    tracks: tuple[Track, ...]

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

    @classmethod
    def of(cls, kind: Kind, parts: Sequence[str], poses: Array, centre: Array) -> Path:
        """A path of parts that move as one: a single track."""
        poses, centre = np.asarray(poses, dtype=np.float64), np.asarray(centre, dtype=np.float64)
        return cls(kind, (Track(tuple(parts), poses, centre),))

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
        return Path(self.kind, tuple(Track(t.parts, t.poses[::-1].copy(), t.centre) for t in self.tracks))

    def to_json(self) -> dict[str, Any]:
        """Plain lists and numbers; `from_json` reads them."""
        return {
            "kind": self.kind,
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
            return cls(data["kind"], tracks)
        except InputError:
            raise
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"Expected a path with its kind, tracks, parts, centre and poses; {error}.") from None


def between(first: Array, second: Array, share: float, centre: Array) -> Array:
    """The motion (4, 4) between two: `centre` (3,) goes straight, the rotation turns evenly the shorter way."""
    R0, R1 = first[:3, :3], second[:3, :3]
    if np.array_equal(R0, R1):
        R = R0
    else:
        R = R0 @ Rotation.from_rotvec(share * Rotation.from_matrix(R0.T @ R1).as_rotvec()).as_matrix()
    start, end = (X[:3, :3] @ centre + X[:3, 3] for X in (first, second))
    motion = np.eye(4)
    motion[:3, :3] = R
    motion[:3, 3] = (1 - share) * start + share * end - R @ centre
    return motion


def centre_of(assembly: Assembly, mask: int) -> Array:
    """The middle, float64 (3,), of the bounds of the parts in a bitset, in the world."""
    own = assembly.body_bounds[[mask >> int(o) & 1 == 1 for o in assembly.owners]]
    middle: Array = (own[:, 0].min(axis=0) + own[:, 1].max(axis=0)) / 2
    return middle
