"""Demonstrations: pictures of finished work with the orders that somebody, or a planner, found for them.

Stored as ``.npz`` without pickle. Shapes: M demonstrations, V views of H x W pixels, T steps, N actions.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from neurosym.errors import DemonstrationError
from neurosym.support.arrays import Numbers, Pixels
from neurosym.support.documents import read_arrays
from neurosym.support.files import replacing

SCHEMA = 1


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Orders to learn from, with the pictures they belong to.

    Attributes:
        pictures: uint8 (M, V, H, W, 3).
        sequences: int64 (M, T): indices of actions, in order; shorter ones are padded with -1 at the end.
        actions: the N action names.
        marginals: float32 (M, T, N) or None: soft targets, the share of all valid orders with each action at each step;
            rows sum to one.
        groups: int64 (M,): demonstrations of one group show one problem (turned, lit anew) and are held out together;
            default: each its own.
        domain: the family's name, or "".
        classes: one integer an action; those of one class are interchangeable. Empty: each is its own.
    """

    pictures: Pixels
    sequences: Numbers
    actions: tuple[str, ...]
    marginals: NDArray[np.float32] | None = None
    groups: Numbers | None = None
    domain: str = ""
    classes: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        pictures = np.asarray(self.pictures)
        if pictures.dtype != np.uint8 or pictures.ndim != 5 or pictures.shape[-1] != 3 or 0 in pictures.shape:
            raise DemonstrationError(
                f"Expected pictures as uint8 (M, V, H, W, 3), none of them 0; got {pictures.dtype} {pictures.shape}."
            )
        actions = tuple(str(a) for a in self.actions)
        m, n = len(pictures), len(actions)
        if n == 0 or len(set(actions)) != n:
            raise DemonstrationError(f"Expected action names, each once; got {actions}.")
        object.__setattr__(self, "pictures", pictures)
        object.__setattr__(self, "actions", actions)
        object.__setattr__(self, "sequences", _checked_sequences(self.sequences, m, actions))
        if self.marginals is not None:
            shape = (m, self.sequences.shape[1], n)
            object.__setattr__(self, "marginals", _checked_marginals(self.marginals, shape))
        groups = np.arange(m) if self.groups is None else np.asarray(self.groups)
        if groups.shape != (m,) or not np.issubdtype(groups.dtype, np.integer):
            raise DemonstrationError(f"Expected groups as integers ({m},); got {groups.dtype} {groups.shape}.")
        object.__setattr__(self, "groups", groups.astype(np.int64))
        classes = np.asarray(self.classes, dtype=np.int64 if len(self.classes) == 0 else None)
        if classes.shape not in ((0,), (n,)) or not np.issubdtype(classes.dtype, np.integer):
            raise DemonstrationError(f"Expected {n} classes, an integer an action, or none; got {self.classes}.")
        object.__setattr__(self, "classes", tuple(int(c) for c in classes))

    def __len__(self) -> int:
        return len(self.pictures)

    @property
    def lengths(self) -> Numbers:
        """int64 (M,): how many steps each order has."""
        lengths: Numbers = (self.sequences >= 0).sum(axis=1)
        return lengths

    def subset(self, index: ArrayLike) -> Demonstrations:
        """Those at `index` (integers or a mask)."""
        i = np.asarray(index)
        marginals = None if self.marginals is None else self.marginals[i]
        assert self.groups is not None
        return Demonstrations(
            self.pictures[i], self.sequences[i], self.actions, marginals, self.groups[i], self.domain, self.classes
        )

    @classmethod
    def joined(cls, parts: Sequence[Demonstrations]) -> Demonstrations:
        """One after the other: other pictures of the same kind of work, with the same actions.

        Raises `DemonstrationError` where actions, classes or shapes differ, or some have shares of valid orders only.
        """
        first = parts[0]
        for other in parts[1:]:
            same = other.actions == first.actions and other.classes == first.classes
            shapes = other.pictures.shape[1:], other.sequences.shape[1:], other.marginals is None
            if not same or shapes != (first.pictures.shape[1:], first.sequences.shape[1:], first.marginals is None):
                raise DemonstrationError("Expected demonstrations of the same actions and shapes to join; got others.")
        arrays = [np.concatenate([getattr(p, name) for p in parts]) for name in ("pictures", "sequences", "groups")]
        shares = [p.marginals for p in parts if p.marginals is not None]
        marginals = np.concatenate(shares) if shares else None
        return cls(arrays[0], arrays[1], first.actions, marginals, arrays[2], first.domain, first.classes)

    def save(self, path: str | Path) -> Path:
        """Write ``.npz``: to a temporary file first, then renamed, so that a kill leaves no half file."""
        path = Path(path)
        if path.suffix != ".npz":
            raise DemonstrationError(f"Expected a file name that ends in .npz; got {path.name!r}.")
        arrays: dict[str, NDArray[np.generic]] = {
            "schema": np.array(SCHEMA),
            "pictures": self.pictures,
            "sequences": self.sequences,
            "actions": np.array(self.actions, dtype=np.str_),
            "groups": np.asarray(self.groups),
            "domain": np.array(self.domain, dtype=np.str_),
        }
        if self.classes:
            arrays["classes"] = np.array(self.classes, dtype=np.int64)
        if self.marginals is not None:
            arrays["marginals"] = self.marginals
        with replacing(path) as temporary:
            np.savez_compressed(temporary, **arrays)  # type: ignore[arg-type]
        return path

    @classmethod
    def load(cls, path: str | Path) -> Demonstrations:
        """Read what `save` wrote, or a user's own ``.npz`` with pictures, sequences and actions."""
        path = Path(path)
        if not os.path.exists(path):
            raise DemonstrationError(f"Expected demonstrations at {path}; there is no such file.")
        data = read_arrays(path, "an .npz file of plain arrays", DemonstrationError)
        missing = [k for k in ("pictures", "sequences", "actions") if k not in data]
        if missing:
            raise DemonstrationError(
                f"Expected the arrays pictures, sequences and actions in {path}; missing: {', '.join(missing)}."
            )
        schema = data.get("schema", np.array(SCHEMA))
        if schema.shape != () or schema.item() != SCHEMA:
            raise DemonstrationError(f"Expected demonstrations of schema {SCHEMA} in {path}; got {schema!s}.")
        names = np.atleast_1d(data.get("actions", np.array([""])))
        if names.dtype.kind != "U" or names.ndim != 1:
            raise DemonstrationError(f"Expected actions in {path} as a list of text; got {names.dtype} {names.shape}.")
        return cls(
            data["pictures"],
            data["sequences"],
            tuple(map(str, np.atleast_1d(data["actions"]))),
            data.get("marginals"),
            data.get("groups"),
            str(data.get("domain", "")),
            tuple(np.atleast_1d(data.get("classes", ())).tolist()),
        )


def _checked_sequences(given: ArrayLike, m: int, actions: tuple[str, ...]) -> Numbers:
    sequences = np.asarray(given)
    n = len(actions)
    if sequences.ndim != 2 or len(sequences) != m or not np.issubdtype(sequences.dtype, np.integer):
        raise DemonstrationError(
            f"Expected sequences as int64 ({m}, T), a row a picture; got {sequences.dtype} {sequences.shape}."
        )
    sequences = sequences.astype(np.int64)
    if sequences.shape[1] > n or sequences.shape[1] == 0:
        raise DemonstrationError(f"Expected 1 to {n} steps, each action usable once; got {sequences.shape[1]}.")
    wrong = (sequences < -1) | (sequences >= n)
    if wrong.any():
        row = int(np.argwhere(wrong)[0, 0])
        raise DemonstrationError(f"Expected actions 0 to {n - 1}, or -1 as padding; row {row} has {sequences[row]}.")
    used = sequences >= 0
    if not used.any(axis=1).all():
        row = int(np.flatnonzero(~used.any(axis=1))[0])
        raise DemonstrationError(f"Expected at least one action in a sequence; row {row} has {sequences[row]}.")
    gap = (~used[:, :-1] & used[:, 1:]).any(axis=1)
    if gap.any():
        row = int(np.flatnonzero(gap)[0])
        raise DemonstrationError(f"Expected -1 only at the end of a sequence; row {row} has {sequences[row]}.")
    ordered = np.sort(sequences, axis=1)
    twice = ((ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] >= 0)).any(axis=1)
    if twice.any():
        row = int(np.flatnonzero(twice)[0])
        raise DemonstrationError(f"Expected each action at most once in a sequence; row {row} has {sequences[row]}.")
    return sequences


def _checked_marginals(given: ArrayLike, shape: tuple[int, int, int]) -> NDArray[np.float32]:
    try:
        marginals = np.asarray(given, dtype=np.float32)
    except (TypeError, ValueError):
        raise DemonstrationError(f"Expected marginals as numbers {shape}; got {np.asarray(given).dtype}.") from None
    if marginals.shape != shape:
        raise DemonstrationError(f"Expected marginals of shape (M, T, N) = {shape}; got {marginals.shape}.")
    sums = marginals.sum(axis=2)
    bad = ~np.isfinite(marginals).all(axis=2) | (marginals < -1e-6).any(axis=2)
    bad |= (np.abs(sums - 1) > 1e-3) & (np.abs(sums) > 1e-6)
    if bad.any():
        row = int(np.argwhere(bad)[0, 0])
        raise DemonstrationError(
            f"Expected rows of marginals that sum to one (or are all zero, for steps not taken); row {row} does not."
        )
    return marginals
