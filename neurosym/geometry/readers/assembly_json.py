"""The library's own format: an assembly as JSON, written exactly as it is, or by hand.

    {"format": "neurosym-assembly", "schema": 1, "units": "mm", "friction": 0.5, "table": 0.0,
     "fixed": ["base"],
     "parts": [
       {"name": "base", "boxes": [{"size": [4, 4, 1], "centre": [2, 2, 0.5]}]},
       {"name": "tee", "cells": [[0, 0, 0], [1, 0, 0]], "cell": 1.0, "pose": [[1, 0, 0, 0], ...]},
       {"name": "gear", "mesh": "gear.stl", "density": 7.8}]}

Besides, `keep` lists groups of names, each one part throughout; `piece_groups` lists groups that need not be separated,
of names or {"of": [names], "most": 1} where only so many of them are in it; `subassemblies` is {name: [names]}.
Of a part only the name and one of `cells`, `boxes`, `mesh` and `bodies` are needed. `pose` is X_WP, 4 x 4. `mesh` is
a path relative to the file, inside its folder. `bodies` is what `write` uses: shapes at poses, number by number.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from neurosym.errors import AssemblyError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.grouping import PieceGroup
from neurosym.geometry.readers.contents import Contents, RawMesh
from neurosym.geometry.readers.limits import MAX_TEXT_BYTES, gunzip, inside, read_bytes, within_limits
from neurosym.geometry.rigid_motions import are_rigid
from neurosym.geometry.shapes import Body, Box, Convex, Mesh, Part, Shape, boxes_part
from neurosym.geometry.tolerances import DEFAULT_TOLERANCES, Tolerances
from neurosym.support.arrays import Array
from neurosym.support.documents import each_once
from neurosym.support.files import write_text

FORMAT = "neurosym-assembly"

#: Raise it when a reader of the old one would go wrong.
SCHEMA = 1

_GROUPS = {"keep", "piece_groups", "subassemblies"}
_TOP = {"format", "schema", "units", "friction", "table", "tolerances", "fixed", "parts", *_GROUPS}
_PART = {"name", "density", "pose", "cells", "cell", "boxes", "mesh", "bodies"}
_BODY = {"box", "convex", "mesh", "pose", "density"}


def write(assembly: Assembly, path: str | Path) -> None:
    """Write an assembly so that reading gives the same one, number by number; whole or not at all."""
    tolerances = assembly.tolerances
    document = {
        "format": FORMAT,
        "schema": SCHEMA,
        "units": assembly.units,
        "friction": assembly.friction,
        "table": assembly.table,
        "tolerances": vars(tolerances),
        "fixed": list(assembly.fixed),
        "parts": [
            {
                "name": part.name,
                "density": part.density,
                "pose": part.X_WP.tolist(),
                "bodies": [
                    {**_shape(body.shape), "pose": body.X_PB.tolist()}
                    | ({} if body.density == 1.0 else {"density": body.density})
                    for body in part.bodies
                ],
            }
            for part in assembly.parts
        ],
    }
    groups = {
        "keep": assembly.keep,
        "piece_groups": [
            [own[0] if (len(own), most) == (1, 1) else {"of": own, "most": most} for own, most in group.members]
            for group in assembly.piece_groups
        ],
        "subassemblies": assembly.subassemblies,
    }
    document |= {name: value for name, value in groups.items() if value}
    write_text(path, json.dumps(document, allow_nan=False, ensure_ascii=True) + "\n")


def _shape(shape: Shape) -> dict[str, Any]:
    if isinstance(shape, Box):
        return {"box": np.asarray(shape.size).tolist()}
    kind = "convex" if isinstance(shape, Convex) else "mesh"
    return {kind: {"vertices": np.asarray(shape.vertices).tolist(), "faces": np.asarray(shape.faces).tolist()}}


def read_json(path: Path, read_mesh: Callable[[Path], RawMesh]) -> Contents:
    """The assembly in a file; `read_mesh` reads a mesh that a part names by its path. Errors name the place."""
    try:
        text = gunzip(read_bytes(path, MAX_TEXT_BYTES), path).decode("utf-8")
        given = json.loads(text, object_pairs_hook=each_once, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        if isinstance(error, AssemblyError):
            raise
        raise AssemblyError(f"Expected an assembly as JSON in {path}; got: {error}.") from None
    try:
        return _contents(given, lambda mesh: read_mesh(inside(path.parent, mesh)), path)
    except _Odd as odd:
        raise AssemblyError(f"Expected an assembly as JSON in {path}; {odd}.") from None


class _Odd(Exception):
    """What is wrong, and where."""


def _contents(given: Any, read_mesh: Callable[[str], RawMesh], path: Path) -> Contents:
    top = _mapping("the file", given, _TOP)
    if top.get("format") != FORMAT:
        raise _Odd(f'its "format" is {_brief(top.get("format"))}, expected "{FORMAT}"')
    if top.get("schema") != SCHEMA:
        raise _Odd(f'its "schema" is {_brief(top.get("schema"))}, this version reads {SCHEMA}')
    parts = _list("parts", top.get("parts"))
    if not parts:
        raise _Odd("it has no parts")
    within_limits(path, 0, parts=len(parts))
    table, tolerances, units, friction = (top.get(k) for k in ("table", "tolerances", "units", "friction"))
    return Contents(
        tuple(_part(f"parts[{i}]", part, read_mesh) for i, part in enumerate(parts)),
        None if units is None else _text("units", units),
        tuple(_text(f"fixed[{i}]", name) for i, name in enumerate(_list("fixed", top.get("fixed", [])))),
        None if table is None else _number("table", table),
        None if friction is None else _number("friction", friction, low=0.0),
        None if tolerances is None else _tolerances(tolerances),
        keep=tuple(_names(f"keep[{i}]", group) for i, group in enumerate(_list("keep", top.get("keep", [])))),
        piece_groups=tuple(
            _piece_group(f"piece_groups[{i}]", group)
            for i, group in enumerate(_list("piece_groups", top.get("piece_groups", [])))
        ),
        subassemblies={
            name: _names(f"subassemblies.{name}", own)
            for name, own in _mapping("subassemblies", top.get("subassemblies", {})).items()
        },
    )


def _names(at: str, given: Any) -> tuple[str, ...]:
    return tuple(_text(f"{at}[{i}]", name) for i, name in enumerate(_list(at, given)))


def _piece_group(at: str, given: Any) -> PieceGroup:
    members: list[tuple[tuple[str, ...], int]] = []
    for i, some in enumerate(_list(at, given)):
        if isinstance(some, str):
            members.append(((some,), 1))
            continue
        member = _mapping(f"{at}[{i}]", some, {"of", "most"})
        most = int(_number(f"{at}[{i}].most", member.get("most", 1), low=1.0))
        members.append((_names(f"{at}[{i}].of", member.get("of")), most))
    return PieceGroup(tuple(members))


def _tolerances(given: Any) -> Tolerances:
    known = vars(DEFAULT_TOLERANCES)
    values = _mapping("tolerances", given, set(known))
    if "play" not in values and "touch" in values:  # written by 0.1, which knew of no play
        values = {**values, "play": values["touch"]}
    return Tolerances(**{k: _number(f"tolerances.{k}", v, low=0.0) for k, v in {**known, **values}.items()})


def _part(at: str, given: Any, read_mesh: Callable[[str], RawMesh]) -> Part | RawMesh:
    part = _mapping(at, given, _PART)
    name = _text(f"{at}.name", part.get("name"))
    if not name:
        raise _Odd(f"{at}.name is empty")
    at = f"{at} ({_brief(name)})"
    pose = _pose(f"{at}.pose", part["pose"]) if "pose" in part else np.eye(4)
    density = _number(f"{at}.density", part.get("density", 1.0), above=0.0)
    made_of = [k for k in ("cells", "boxes", "mesh", "bodies") if k in part]
    if len(made_of) != 1:
        raise _Odd(f"{at} has {' and '.join(made_of) or 'no shape'}, expected one of cells, boxes, mesh and bodies")
    kind = made_of[0]
    if kind == "mesh":
        mesh = read_mesh(_text(f"{at}.mesh", part["mesh"]))
        return replace(mesh, name=name, X_WP=pose if "pose" in part else None, density=density)
    things = _list(f"{at}.{kind}", part[kind])
    if not things:
        raise _Odd(f"{at}.{kind} is empty")
    if kind == "cells":
        size = _number(f"{at}.cell", part.get("cell", 1.0), above=0.0)
        cells = _array(f"{at}.cells", things, (None, 3))
        if (cells != np.round(cells)).any():
            raise _Odd(f"{at}.cells has numbers that are not whole")
        if len(np.unique(cells, axis=0)) != len(cells):
            raise _Odd(f"{at}.cells has a cell twice")
        return boxes_part(name, (cells + 0.5) * size, np.full(3, size), pose, density)
    read_body = _box if kind == "boxes" else _body
    return Part(name, tuple(read_body(f"{at}.{kind}[{i}]", b) for i, b in enumerate(things)), pose, density)


def _box(at: str, given: Any) -> Body:
    box = _mapping(at, given, {"size", "centre", "pose"})
    if "centre" in box and "pose" in box:
        raise _Odd(f"{at} has a centre and a pose, expected one")
    X = _pose(f"{at}.pose", box["pose"]) if "pose" in box else np.eye(4)
    if "centre" in box:
        X[:3, 3] = _array(f"{at}.centre", box["centre"], (3,))
    return Body(Box(_size(f"{at}.size", box.get("size"))), X)


def _body(at: str, given: Any) -> Body:
    body = _mapping(at, given, _BODY)
    density = _number(f"{at}.density", body.get("density", 1.0), above=0.0)
    X = _pose(f"{at}.pose", body["pose"]) if "pose" in body else np.eye(4)
    kinds = [k for k in ("box", "convex", "mesh") if k in body]
    if len(kinds) != 1:
        raise _Odd(f"{at} has {' and '.join(kinds) or 'no shape'}, expected one of box, convex and mesh")
    kind = kinds[0]
    if kind == "box":
        return Body(Box(_size(f"{at}.box", body["box"])), X, density)
    mesh = _mapping(f"{at}.{kind}", body[kind], {"vertices", "faces"})
    vertices = _array(f"{at}.{kind}.vertices", mesh.get("vertices"), (None, 3))
    faces = _array(f"{at}.{kind}.faces", mesh.get("faces"), (None, 3))
    if (faces != np.round(faces)).any() or faces.min() < 0 or faces.max() >= len(vertices):
        raise _Odd(f"{at}.{kind}.faces does not index its {len(vertices)} vertices")
    return Body((Convex if kind == "convex" else Mesh)(vertices, faces.astype(np.int64)), X, density)


# -- values ---------------------------------------------------------------------------------------------------


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _brief(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _mapping(at: str, value: Any, known: set[str] | None = None) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise _Odd(f"{at} is {_brief(value)}, expected an object")
    odd = [] if known is None else sorted(set(value) - known)
    if odd:
        raise _Odd(f"{at} has {_brief(odd[0])}, expected only {', '.join(sorted(known or ()))}")
    return value


def _list(at: str, value: Any) -> Sequence[Any]:
    if not isinstance(value, list):
        raise _Odd(f"{at} is {_brief(value)}, expected a list")
    return value


def _text(at: str, value: Any) -> str:
    if not isinstance(value, str):
        raise _Odd(f"{at} is {_brief(value)}, expected text")
    return value


def _number(at: str, value: Any, *, low: float = -np.inf, above: float = -np.inf) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _Odd(f"{at} is {_brief(value)}, expected a number")
    try:
        number = float(value)
    except OverflowError:
        number = np.inf
    if not np.isfinite(number) or number < low or number <= above:
        expected = f"above {above:g}" if above > -np.inf else f"{low:g} or more" if low > -np.inf else "a finite number"
        raise _Odd(f"{at} is {_brief(value)}, expected {expected}")
    return number


def _array(at: str, value: Any, shape: tuple[int | None, ...]) -> Array:
    expected = f"numbers of shape ({', '.join('n' if n is None else str(n) for n in shape)})"
    try:
        array = np.array(value)
    except (ValueError, TypeError, OverflowError):
        raise _Odd(f"{at} is {_brief(value)}, expected {expected}") from None
    fits = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape)) and array.size > 0
    if not fits or array.dtype.kind not in "if" or not np.isfinite(array).all():
        raise _Odd(f"{at} is {_brief(value)}, expected {expected}")
    return array.astype(np.float64)


def _size(at: str, value: Any) -> Array:
    size = _array(at, value, (3,))
    if size.min() <= 0:
        raise _Odd(f"{at} is {_brief(value)}, expected lengths above 0")
    return size


def _pose(at: str, value: Any) -> Array:
    X = _array(at, value, (4, 4))
    if not are_rigid(X):
        raise _Odd(f"{at} is no rigid motion: a rotation and a shift, last row 0 0 0 1")
    return X
