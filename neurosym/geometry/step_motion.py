"""How parts leave, or arrive: along a straight line or along a path, and what is held meanwhile.

A `Way` is the `how` of a step of an assembly plan. As an array it is its direction, float64 (3,), or the poses of the
parts that leave, float64 (k, 4, 4).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.geometry.blocking.directions import in_words

if TYPE_CHECKING:
    from neurosym.geometry.paths.path import Path

#: Stands for the ground where the name of a part is expected.
GROUND = "the ground"

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Way:
    """How parts leave, or arrive.

    Attributes:
        parts: names of the parts that go together; the others stay.
        direction: unit vector of the straight line along which they go to infinity, or come from there; None where
            there is a path.
        path: the motions of all that moves on the way, those of `parts` first; None for a straight line.
        held: names of parts that must be held so that what stays stands.
        moves: of a path that shifts groups one after the other, how many moves it takes until `parts` are out, the last
            one included; else 1.
        arrives: whether the parts come in, as in the plan of an assembly.
    """

    parts: tuple[str, ...] = ()
    direction: Vector | None = None
    path: Path | None = None
    held: tuple[str, ...] = ()
    moves: int = 1
    arrives: bool = False

    @classmethod
    def along(cls, parts: Iterable[str], direction: Sequence[float]) -> Way:
        """A straight way."""
        return cls(tuple(parts), _vector(direction))

    def joined(self, other: Way) -> Way:
        """What two predicates say of one step: the one how it is done, the other what is held meanwhile."""
        held = tuple(dict.fromkeys(self.held + other.held))
        return Way(
            self.parts or other.parts,
            self.direction or other.direction,
            self.path or other.path,
            held,
            max(self.moves, other.moves),
        )

    def reversed(self) -> Way:
        """The same way, gone backwards: what left arrives."""
        return replace(
            self,
            direction=None if self.direction is None else _vector([-v + 0.0 for v in self.direction]),
            path=None if self.path is None else self.path.reversed(),
            arrives=not self.arrives,
        )

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.direction if self.path is None else self.path.poses, dtype=dtype)

    def as_json(self) -> dict[str, Any]:
        """For a file: ``how`` (a direction or poses, as lists), ``parts``, and what else there is to say."""
        said: dict[str, Any] = {"how": np.asarray(self).tolist(), "parts": list(self.parts)}
        if self.path is not None:
            said["path"] = self.path.to_json()
        if self.moves > 1:
            said["moves"] = self.moves
        if self.held:
            said["held"] = list(self.held)
        if self.arrives:
            said["arrives"] = True
        return said

    @classmethod
    def from_json(cls, said: Mapping[str, Any]) -> Way:
        """What `as_json` wrote.

        Raises:
            InputError: something else.
        """
        from neurosym.geometry.paths.path import Path  # loads FCL

        try:
            names, held = tuple(map(str, said["parts"])), tuple(map(str, said.get("held", ())))
            path = None if said.get("path") is None else Path.from_json(said["path"])
            direction = None if path is not None else _vector(said["how"])
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f'Expected a step with "parts" and "how", a direction or a path; got {error}.') from None
        return cls(names, direction, path, held, int(said.get("moves", 1)), bool(said.get("arrives", False)))

    def __str__(self) -> str:
        if self.direction is not None:
            said = f"along {in_words(self.direction)}"
        elif self.path is not None:
            kind = f"{self.moves} moves" if self.path.kind == "moves" else self.path.kind
            said = f"{'in' if self.arrives else 'out'} by a path ({kind})"
        else:
            said = ""
        if len(self.parts) > 1:
            said = f"{', '.join(self.parts)} together, {said}"
        if self.held:
            said = f"{said}, while {', '.join(self.held)} {'is' if len(self.held) == 1 else 'are'} held"
        return said


def _vector(given: Sequence[float]) -> Vector:
    x, y, z = (float(v) for v in given)
    return x, y, z
