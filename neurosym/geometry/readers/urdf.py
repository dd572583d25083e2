"""URDF: a robot's links as parts, where its joints put them. Lengths are metres, z is up, the base is fixed.

Read here: yourdfpy needs lxml and some fifteen packages more, and opens whatever files a robot names.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from defusedxml.ElementTree import fromstring
from scipy.spatial.transform import Rotation

from neurosym.errors import AssemblyError, InputError, UnknownNameError
from neurosym.geometry.mesh.topology import signed_volume
from neurosym.geometry.notes import Note
from neurosym.geometry.readers.contents import Contents, RawMesh, united
from neurosym.geometry.readers.limits import MAX_TEXT_BYTES, inside, read_bytes, reading, within_limits
from neurosym.support.arrays import Array, Numbers

#: Meshes that a link may have: what it looks like, and what it collides as.
MESHES = ("visual", "collision")

#: What to try where meshes of links are not sound.
HINT = 'What robots collide as is often sound where what they look like is not: meshes="collision", --meshes collision.'

#: Segments of a round shape's circle.
SECTIONS = 48

Piece = tuple[Array, Numbers]


def read_urdf(
    path: Path,
    read_mesh: Callable[[Path], RawMesh],
    *,
    meshes: str = "visual",
    joints: Mapping[str, float] | None = None,
) -> Contents:
    """The links that have a shape, named as they are, at a joint configuration.

    Args:
        read_mesh: reads a file that a link names; it lies in the file's folder, or in its ROS package.
        meshes: which shapes, one of `MESHES`.
        joints: values of joints (radians, metres); those not named are at 0.

    Raises:
        AssemblyError: it is no URDF, no tree, or names files elsewhere or of unknown formats.
        InputError: an unknown joint.
    """
    if meshes not in MESHES:
        raise UnknownNameError("kind of meshes", meshes, MESHES)
    read_mesh = functools.cache(read_mesh)
    with reading("URDF", path):
        robot: Element = fromstring(read_bytes(path, MAX_TEXT_BYTES), forbid_dtd=True)
        if robot.tag != "robot" or robot.find("link") is None:
            raise AssemblyError(f"Expected URDF, a <robot> with links, in {path}; got <{robot.tag}>. Run xacro first.")
        links = {link.attrib["name"]: link for link in robot.findall("link")}
        joined = [joint for joint in robot.findall("joint") if joint.find("parent") is not None]
        values = _values({joint.attrib["name"]: joint for joint in joined}, dict(joints or {}), path)
        children: dict[str, list[Element]] = {name: [] for name in links}
        for joint in joined:
            children[_link(joint, "parent")].append(joint)
        parts: list[RawMesh] = []
        fixed: list[str] = []
        seen = 0
        stack = [(name, np.eye(4), True) for name in links.keys() - {_link(joint, "child") for joint in joined}]
        if len(stack) != 1 or len(joined) != len(links) - 1:
            raise AssemblyError(f"Expected a tree of links in {path}; got {len(links)} links and {len(joined)} joints.")
        while stack:
            name, X, is_base = stack.pop()
            seen += 1
            pieces = [_piece(shape, X, path, name, read_mesh) for shape in links[name].findall(meshes)]
            if pieces:
                parts.append(_part(name, pieces, links[name]))
                within_limits(path, len(parts[-1].faces), sum(len(p.faces) for p in parts), len(parts))
                fixed += [name] if is_base else []
            for joint in reversed(children[name]):
                # A link without a shape, the world, passes on that it is the base.
                base = is_base and not pieces and joint.get("type") == "fixed"
                stack.append((_link(joint, "child"), X @ _origin(joint) @ _motion(joint, values), base))
        if seen != len(links):
            raise AssemblyError(f"Expected a tree of links in {path}; {len(links) - seen} of them hang on no base.")
        bare = [name for name in links if links[name].find(meshes) is None and links[name].find("inertial") is not None]
        sentence = f"{path.name}: {len(bare)} links without a {meshes} shape were left out: {', '.join(bare[:5])}."
        notes = (Note("", "skipped", len(bare), sentence),) if bare else ()
        return Contents(tuple(parts), "m", tuple(fixed), notes=notes, hint=HINT if meshes == "visual" else "")


def _values(joints: Mapping[str, Element], given: dict[str, float], path: Path) -> dict[str, float]:
    """The value of each joint, those that mimic another one included."""
    for name, value in given.items():
        if name not in joints:
            raise UnknownNameError("joint", name, joints)
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InputError(f"Expected a number for the joint {name!r} of {path}; got {value!r}.")
    values = {name: float(given.get(name, 0.0)) for name in joints}
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is not None and name not in given:
            factor, offset = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
            values[name] = factor * values[mimic.attrib["joint"]] + offset
    return values


def _link(joint: Element, end: str) -> str:
    return str(joint.find(end).attrib["link"])  # type: ignore[union-attr]


def _numbers(text: str) -> Array:
    return np.array([float(word) for word in text.split()])


def _origin(element: Element) -> Array:
    """The frame, float64 (4, 4), in which a link, or a shape of it, stands."""
    origin = element.find("origin")
    X = np.eye(4)
    if origin is not None:
        X[:3, :3] = Rotation.from_euler("xyz", _numbers(origin.get("rpy", "0 0 0"))).as_matrix()
        X[:3, 3] = _numbers(origin.get("xyz", "0 0 0"))
    return X


def _motion(joint: Element, values: Mapping[str, float]) -> Array:
    axis = joint.find("axis")
    along = _numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
    along = along / max(float(np.linalg.norm(along)), 1e-300) * values[joint.attrib["name"]]
    X = np.eye(4)
    if joint.get("type") in ("revolute", "continuous"):
        X[:3, :3] = Rotation.from_rotvec(along).as_matrix()
    elif joint.get("type") == "prismatic":
        X[:3, 3] = along
    return X


def _part(name: str, pieces: list[Piece], link: Element) -> RawMesh:
    """The link, as heavy as it says."""
    whole = united(name, pieces)
    mass, volume = (
        link.find("inertial/mass"),
        abs(signed_volume(whole.vertices, whole.faces)) if len(whole.faces) else 0.0,
    )
    heavy = mass is not None and volume > 0 and float(mass.get("value", 0)) > 0
    density = float(mass.attrib["value"]) / volume if mass is not None and heavy else 1.0
    return RawMesh(name, whole.vertices, whole.faces, density=density)


def _piece(shape: Element, X: Array, path: Path, link: str, read_mesh: Callable[[Path], RawMesh]) -> Piece:
    """One shape of a link, in the world."""
    given = shape.find("geometry/*")
    if given is None:
        raise AssemblyError(f"Expected a shape in each <{shape.tag}> of {path}; link {link!r} has none.")
    vertices, faces = _mesh(given, path, read_mesh) if given.tag == "mesh" else _round_or_box(given, path, link)
    Y = X @ _origin(shape)
    return vertices @ Y[:3, :3].T + Y[:3, 3], faces


def _mesh(given: Element, path: Path, read_mesh: Callable[[Path], RawMesh]) -> Piece:
    mesh = read_mesh(_file(given.attrib["filename"], path))
    scale = _numbers(given.get("scale", "1 1 1"))
    return mesh.vertices * scale, mesh.faces if scale.prod() > 0 else mesh.faces[:, ::-1]


def _file(name: str, path: Path) -> Path:
    """The file that a link names, inside the ROS package that the URDF lies in, or else inside its folder."""
    package = next((folder for folder in path.resolve().parents if (folder / "package.xml").is_file()), None)
    root = package or path.parent
    if not name.startswith("package://"):
        return inside(root, os.path.relpath(path.resolve().parent / name.removeprefix("file://"), root.resolve()))
    called, _, rest = name.removeprefix("package://").partition("/")
    whole = inside(root, f"{called}/{rest}")
    return whole if whole.exists() or package is None else inside(root, rest)


def _round_or_box(given: Element, path: Path, link: str) -> Piece:
    from trimesh import creation

    def length(name: str) -> float:
        return float(given.attrib[name])

    make: dict[str, Callable[[], Any]] = {
        "box": lambda: creation.box(_numbers(given.attrib["size"])),
        "cylinder": lambda: creation.cylinder(length("radius"), length("length"), sections=SECTIONS),
        "sphere": lambda: creation.icosphere(subdivisions=3, radius=length("radius")),
        "capsule": lambda: creation.capsule(length("length"), length("radius"), count=[SECTIONS, SECTIONS]),
    }
    if given.tag not in make:
        raise AssemblyError(f"Expected a mesh, {', '.join(make)} in {path}; link {link!r} has a {given.tag!r}.")
    made = make[given.tag]()
    return np.array(made.vertices, dtype=np.float64), np.array(made.faces, dtype=np.int64)
