"""How a step of a plan moves parts: together, along a straight line or a path, in or out, others held meanwhile."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from neurosym.errors import InputError
from neurosym.geometry.rigid_motions import Interpolation
from neurosym.support.arrays import Array
from neurosym.support.words import in_words

#: Stands for the ground where the name of a part is expected.
GROUND = "the ground"

Vector = tuple[float, float, float]

#: How a path was found: a straight line, a lattice of translations, OMPL over translations, OMPL over rigid motions,
#: or moves of groups of voxel parts.
Kind = Literal["straight", "lattice", "translation", "rigid", "moves"]


@dataclass(frozen=True, eq=False)
class Track:
    """Parts that move as one rigid body.

    Attributes:
        parts: their names.
        poses: float64 (k, 4, 4), k >= 2: motions of the world, applied to the parts where they are assembled; the
            identity is the assembled place. Between two of them `centre` goes straight and the rotation turns evenly.
        centre: float64 (3,): a point of the assembled parts, in the world.
    """

    parts: tuple[str, ...]
    poses: Array = field(repr=False)
    centre: Array = field(repr=False)

    def at(self, key: float) -> Array:
        """The pose, float64 (4, 4), at a key number from 0 to k - 1, whole or between two."""
        first = min(max(int(key), 0), len(self.poses) - 2)
        return self.between(first).at(min(max(key - first, 0.0), 1.0))

    def between(self, key: int) -> Interpolation:
        """From one pose, by its number, to the next."""
        return Interpolation(self.poses[key], self.poses[key + 1], self.centre)

    def key(self, share: float) -> float:
        """The key number at a share of the way, 0 to 1, at even pace; a turn on the spot takes some time, too."""
        legs = self._legs()
        marks = np.concatenate([[0.0], np.cumsum(np.maximum(legs, max(0.02 * float(legs.sum()), 1e-12)))])
        return float(np.interp(share * marks[-1], marks, np.arange(len(marks))))

    @property
    def length(self) -> float:
        """How far the centre travels; turning counts nothing."""
        return float(self._legs().sum())

    def _legs(self) -> Array:
        """float64 (k - 1,): how far the centre goes from each pose to the next."""
        at = self.poses[:, :3, :3] @ self.centre + self.poses[:, :3, 3]
        return np.asarray(np.linalg.norm(np.diff(at, axis=0), axis=1))


@dataclass(frozen=True)
class StepMotion:
    """How a step moves parts.

    Attributes:
        parts: names of the parts that leave, or arrive, together. Empty in a step that moves nothing, and in what a
            predicate says that does not know them: then they follow from the action's effects.
        direction: unit vector of the straight line along which they go; None where there is none.
        tracks: what moves, pose by pose, with as many poses each, those of `parts` first; what else moves makes way.
            They lead out; what arrives takes them from their end. Empty for a straight line of no given length.
        held: names of parts that are held meanwhile.
        kind: how the path was found.
        moves: of a path that shifts groups one after the other, how many moves it takes until `parts` are out, the last
            one included; else 1.
        arrives: whether the parts come in, as in the plan of an assembly.

    Raises:
        InputError: tracks that do not fit together, or of which `parts` are no part.
    """

    parts: tuple[str, ...] = ()
    direction: Vector | None = None
    tracks: tuple[Track, ...] = ()
    held: tuple[str, ...] = ()
    kind: Kind = "straight"
    moves: int = 1
    arrives: bool = False

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise InputError(f"Expected a kind of path, one of {', '.join(get_args(Kind))}; got {self.kind!r}.")
        for track in self.tracks:
            _check_track(track)
            if len(track.poses) != len(self.tracks[0].poses):
                raise InputError("Expected as many poses in each track of a path; their numbers differ.")
        names = [name for track in self.tracks for name in track.parts]
        if self.parts and (not all(track.parts for track in self.tracks) or len(set(names)) != len(names)):
            raise InputError("Expected each moving part in one track, and no track without a part.")
        if self.tracks and not set(self.parts) <= set(names):
            raise InputError(f"Expected the parts that leave to be some of those that move; got {self.parts}.")

    @classmethod
    def along(cls, parts: Iterable[str], direction: ArrayLike) -> StepMotion:
        """A straight motion out, along a vector of any length.

        Raises:
            InputError: not three numbers, or all of them 0.
        """
        try:
            vector = np.array(direction, dtype=np.float64)
        except (TypeError, ValueError):
            vector = np.zeros(0)
        if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
            raise InputError(f"Expected a direction of three numbers, not all of them 0; got {direction!r}.")
        vector = vector if 1e-150 < np.abs(vector).max() < 1e150 else vector / np.abs(vector).max()
        length = float(np.linalg.norm(vector))
        x, y, z = (vector if abs(length - 1) < 1e-9 else vector / length).tolist()
        return cls(tuple(parts), (x, y, z))

    # -- made of others ---------------------------------------------------------------------------------------

    def joined(self, other: StepMotion) -> StepMotion:
        """What two predicates say of one step: the one how it is done, the other what is held meanwhile."""
        held = tuple(dict.fromkeys(self.held + other.held))
        return replace(self if self.direction or self.tracks else other, parts=self.parts or other.parts, held=held)

    def of_parts(self, parts: tuple[str, ...], *, arrive: bool) -> StepMotion:
        """Where it does not say which parts move: of these, and in if they arrive. Else as it is."""
        if self.parts or not parts:
            return self
        tracks = tuple(replace(track, parts=track.parts or parts) for track in self.tracks)
        whole = replace(self, parts=parts, tracks=tracks)
        return whole.reversed() if arrive and not self.arrives else whole

    def reversed(self) -> StepMotion:
        """The same backwards: what left arrives."""
        return replace(self, direction=self.direction and _opposite(self.direction), arrives=not self.arrives)

    # -- where things are ---------------------------------------------------------------------------------------

    @property
    def outward(self) -> Vector | None:
        """The direction that leads out."""
        return _opposite(self.direction) if self.arrives and self.direction else self.direction

    @property
    def making_way(self) -> tuple[str, ...]:
        """Names of the parts that move, but neither leave nor arrive."""
        return tuple(name for track in self.tracks for name in track.parts if name not in self.parts)

    def out(self, share: float) -> dict[str, Array]:
        """Each part that moves -> its pose, float64 (4, 4), at a share of the way out, 0 to 1, at even pace."""
        if not self.tracks:
            return {}
        key = self.tracks[0].key(min(max(share, 0.0), 1.0))
        return {name: pose for track in self.tracks for pose in [track.at(key)] for name in track.parts}

    def at(self, share: float) -> dict[str, Array]:
        """The same when a share of the step is done."""
        return self.out(1 - share if self.arrives else share)

    # -- for files and people -----------------------------------------------------------------------------------

    def to_json(self) -> dict[str, Any]:
        """For a file: ``how`` (a direction or poses, as lists), ``parts``, and what else there is to say."""
        how: Any = self.direction and list(self.direction)
        path = None
        if self.tracks and not self.direction:
            tracks = [
                {"parts": list(t.parts), "centre": t.centre.tolist(), "poses": _in_time(t.poses, self.arrives).tolist()}
                for t in self.tracks
            ]
            how, path = tracks[0]["poses"], {"kind": self.kind, "leaving": list(self.parts), "tracks": tracks}
        moves = self.moves if self.moves > 1 else None
        rest = {"parts": list(self.parts), "path": path, "moves": moves, "held": list(self.held)}
        return {"how": how, **{k: v for k, v in {**rest, "arrives": self.arrives}.items() if v}}

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> StepMotion:
        """What `to_json` wrote.

        Raises:
            InputError: something else.
        """
        try:
            parts, held = (tuple(map(str, document.get(key, ()))) for key in ("parts", "held"))
            arrives, moves = bool(document.get("arrives", False)), int(document.get("moves", 1))
            how: Any = document.get("how")
            path = document.get("path")
            if path is None and np.ndim(how) == 3:  # a path whose parts are not said
                path = {"kind": "straight", "tracks": [{"parts": (), "poses": how, "centre": (0, 0, 0)}]}
            if path is None:
                straight = cls() if how is None else cls.along((), how)
                return replace(straight, parts=parts, held=held, moves=moves, arrives=arrives)
            if tuple(path.get("leaving", parts)) != parts:
                raise ValueError(f"parts {parts} and a path on which {path['leaving']} leave")
            tracks = []
            for track in path["tracks"]:
                poses, centre = (np.array(track[key], dtype=np.float64) for key in ("poses", "centre"))
                tracks.append(Track(tuple(map(str, track["parts"])), _in_time(poses, arrives), centre))
            if not tracks:
                raise ValueError("a path without tracks")
            return cls(parts, None, tuple(tracks), held, path["kind"], moves, arrives)
        except InputError:
            raise
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InputError(f"Expected a step with a direction, or with a path; got {error}.") from None

    @property
    def course(self) -> str:
        """``along +z``, ``by a path (3 moves)``; nothing where it is not said."""
        if self.direction:
            return f"along {in_words(self.direction)}"
        return f"by a path ({f'{self.moves} moves' if self.kind == 'moves' else self.kind})" if self.tracks else ""

    def __str__(self) -> str:
        together = f"{', '.join(self.parts)} together, " if len(self.parts) > 1 else ""
        way = ("in " if self.arrives else "out ") if self.tracks and not self.direction else ""
        held = f", while {', '.join(self.held)} {'is' if len(self.held) == 1 else 'are'} held" if self.held else ""
        return f"{together}{way}{self.course}{held}"


def check_motions(motions: Sequence[StepMotion | None], count: int) -> None:
    """Refuse all but one motion a step, some of them None, or none at all."""
    if len(motions) not in (0, count) or not all(m is None or isinstance(m, StepMotion) for m in motions):
        raise InputError(f"Expected one motion a step, {count} StepMotions or None, or none at all; got {motions}.")


def _check_track(track: Track) -> None:
    if track.poses.ndim != 3 or track.poses.shape[1:] != (4, 4) or len(track.poses) < 2:
        raise InputError(f"Expected two or more poses of shape (4, 4); got shape {track.poses.shape}.")
    if track.centre.shape != (3,) or not np.isfinite(track.centre).all():
        raise InputError(f"Expected a track's centre as three finite numbers; got {track.centre!r}.")
    R = track.poses[:, :3, :3]
    turns = np.isfinite(track.poses).all() and np.allclose(R @ R.swapaxes(1, 2), np.eye(3), atol=1e-6)
    if not turns or (np.linalg.det(R) < 0).any() or not np.allclose(track.poses[:, 3], [0, 0, 0, 1]):
        raise InputError("Expected the poses of a path to be rigid motions; one has a scale or a reflection.")


def _opposite(direction: Vector) -> Vector:
    x, y, z = direction
    return -x + 0.0, -y + 0.0, -z + 0.0


def _in_time(poses: Array, arrives: bool) -> Array:
    """Poses that lead out in the order in which they are taken, or back: files have them so."""
    return poses[::-1] if arrives else poses
