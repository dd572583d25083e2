"""Parts that stay together: each group of them one rigid part, throughout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.mesh.topology import volume_and_centre
from neurosym.geometry.shapes import Body, Part

#: Longer names of parts that are several are cut short.
MAX_NAME = 60


@dataclass(frozen=True, eq=False)
class Kept:
    """An assembly whose groups became parts.

    Attributes:
        assembly: with one part a group, where the first of its parts was.
        groups: names of the parts in each group.
        renamed: name of a part that is in a group -> name of the part that it became.
    """

    assembly: Assembly
    groups: tuple[tuple[str, ...], ...]
    renamed: Mapping[str, str]

    def name(self, part: str) -> str:
        """What a part is called now."""
        return self.renamed.get(part, part)


def keep_together(assembly: Assembly, keep: Iterable[str | Sequence[str]] = ()) -> Kept:
    """The assembly with groups of parts that are one rigid part each, besides those that it has itself (`keep`).

    Each is blocked by others only, leaves and arrives whole, stands as one and counts as one; it is fixed if one of
    its parts is. It is named after its sub-assembly, or else after its parts ("shell+ball").

    Args:
        keep: groups, each the name of a sub-assembly, or names of parts and of sub-assemblies.

    Raises:
        InputError: a group of one part, or a part in two groups.
        UnknownNameError: neither a part nor a sub-assembly.
    """
    wanted = [_Group(_named(group), _parts(assembly, _named(group))) for group in (*assembly.keep, *_listed(keep))]
    inside = [part for group in wanted for part in group.parts]
    if len(set(inside)) < len(inside):
        twice = next(part for part in inside if inside.count(part) > 1)
        raise InputError(f"Expected each part once in the groups to keep together; {twice!r} comes twice.")
    if not wanted:
        return Kept(assembly, (), {})
    names = _names(wanted, {name for name in assembly.names if name not in inside})
    renamed = {part: name for name, group in zip(names, wanted) for part in group.parts}
    made: dict[str, list[Part]] = {}
    for part in assembly.parts:
        made.setdefault(renamed.get(part.name, part.name), []).append(part)

    def now(given: Iterable[str]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(renamed.get(name, name) for name in given))

    subassemblies = {name: now(parts) for name, parts in assembly.subassemblies.items()}
    after = replace(
        assembly,
        parts=tuple(_joined(name, parts) if name in names else parts[0] for name, parts in made.items()),
        fixed=now(assembly.fixed),
        keep=(),
        piece_groups=tuple(group for g in assembly.piece_groups if len((group := g.renamed(renamed)).names) > 1),
        subassemblies={name: parts for name, parts in subassemblies.items() if len(parts) > 1},
    )
    return Kept(after, tuple(group.parts for group in wanted), renamed)


@dataclass(frozen=True)
class _Group:
    """What a group was called by, and names of its parts."""

    called: tuple[str, ...]
    parts: tuple[str, ...]


def _listed(keep: Any) -> list[Any]:
    if isinstance(keep, str | Mapping) or not isinstance(keep, Iterable):
        raise InputError(f"Expected keep as a list of groups, for instance [['shell', 'ball']]; got {keep!r}.")
    return list(keep)


def _named(group: Any) -> tuple[str, ...]:
    names = (group,) if isinstance(group, str) or not isinstance(group, Iterable) else tuple(group)
    if not all(isinstance(name, str) for name in names):
        raise InputError(f"Expected a group to keep together as a list of names; got {group!r}.")
    return names


def _parts(assembly: Assembly, names: Sequence[str]) -> tuple[str, ...]:
    """Names of the parts of a group."""
    subassemblies = assembly.subassemblies
    for name in names:
        if name not in assembly.index and name not in subassemblies:
            raise UnknownNameError("part or sub-assembly", name, (*assembly.names, *subassemblies))
    parts = [part for name in names for part in ((name,) if name in assembly.index else subassemblies[name])]
    if len(parts) < 2:
        other = f"a sub-assembly: {', '.join(subassemblies)}" if subassemblies else "leave it out"
        raise InputError(
            f"Expected two parts or more in each group to keep together; got {', '.join(names) or 'none'}. "
            f"Name its other parts, or {other}."
        )
    return tuple(parts)


def _names(groups: Sequence[_Group], taken: set[str]) -> list[str]:
    """What the groups are called: each as it was, or after its parts."""
    names: list[str] = []
    for group in groups:
        name = "+".join(group.called)
        if len(name) > MAX_NAME:
            name = f"{group.called[0]}+{len(group.parts) - 1} more"
        while name in taken:
            name += "'"
        names.append(name)
        taken.add(name)
    return names


def _joined(name: str, parts: Sequence[Part]) -> Part:
    """One part of several, with their masses where they are."""
    bodies = [(part, body) for part in parts for body in part.bodies]
    volumes = np.array([abs(volume_and_centre(b.shape.vertices, b.shape.faces)[0]) for _, b in bodies])
    densities = np.array([part.density * body.density for part, body in bodies])
    mean = float(densities @ volumes / volumes.sum()) if np.ptp(densities) else float(densities[0])
    X_WP = parts[0].X_WP
    into = {p.name: np.eye(4) if (p.X_WP == X_WP).all() else np.linalg.inv(X_WP) @ p.X_WP for p in parts}
    made = [Body(b.shape, into[p.name] @ b.X_PB, d / mean) for (p, b), d in zip(bodies, densities.tolist())]
    return Part(name, tuple(made), X_WP, mean)
