"""STEP, tessellated by OpenCASCADE (the extra ``cad``). Names and the unit are the file's; z is up.

Facets follow the sizes of edges, so they are the same whatever the unit. OpenCASCADE runs in a process of its own, for
a few lines of a bad STEP file can end a process, or keep it busy for ever.
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from neurosym.errors import AssemblyError, MissingDependencyError
from neurosym.geometry.readers.contents import Contents
from neurosym.geometry.readers.gltf import open_gltf
from neurosym.geometry.readers.limits import read_bytes, reading
from neurosym.geometry.units import METRES, factor

#: How far a facet may lie from its curve, as a share of the edge's size, and the angle (radians) between two facets.
DEFLECTION, ANGLE = 0.002, 0.2

#: Longest time that reading may take (s).
MAX_SECONDS = 600.0

#: Address space that reading may take (bytes), where the system can limit it.
MAX_MEMORY = 16 << 30

_CONVERT = """
import sys
try:
    import resource
    limit = min(int(sys.argv[3]), *(n for n in resource.getrlimit(resource.RLIMIT_AS) if n > 0), int(sys.argv[3]))
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except (ImportError, ValueError, OSError):
    pass
import cascadio
with open(sys.argv[1], "rb") as file:
    facets = {"tol_linear": float(sys.argv[4]), "tol_angular": float(sys.argv[5]), "tol_relative": True}
    scene = cascadio.load(file.read(), use_parallel=False, **facets)
with open(sys.argv[2], "wb") as file:
    file.write(scene)
"""

# Texts are taken whole (possessively): no file can make the search for them slow.
_TEXT = rb"'(?:[^']|'')*+'"
_STATEMENT = re.compile(rb"\s*+(?:#(\d++)\s*+=\s*+([A-Z_]*+))?((?:[^;']|%s)*+)(?:;|'|\Z)" % _TEXT)
_USE = re.compile(
    rb"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\s*\(\s*%s\s*,)\s*%s\s*,\s*(?:%s|\$)\s*(,\s*#\d+\s*,\s*#(\d+))" % ((_TEXT,) * 3)
)
_USED_KINDS = (b"PRODUCT", b"LENGTH_MEASURE_WITH_UNIT")
_SI_PREFIXES = {b"KILO": 1e3, b"DECI": 1e-1, b"CENTI": 1e-2, b"MILLI": 1e-3, b"MICRO": 1e-6}

#: What kind an entity is, empty where it is of several, and what stands in its brackets; by number.
Entities = dict[bytes, tuple[bytes, bytes]]


def read_step(path: Path) -> Contents:
    """A part each solid, named after products, in the file's unit; `MissingDependencyError` without cascadio."""
    if importlib.util.find_spec("cascadio") is None:
        raise MissingDependencyError(
            f"Expected cascadio, to read STEP ({path}); it is not installed. Run: pip install 'neurosym-assembly[cad]'."
        )
    data = read_bytes(path)
    with reading("STEP", path):
        kept = (entity for entity in _STATEMENT.findall(data) if not entity[1] or entity[1].startswith(_USED_KINDS))
        entities = {number: (kind, rest) for number, kind, rest in kept}
        scene = open_gltf(_converted(_with_product_names(data, entities), path), path)
        # Where a product is more than one solid, its name is on the node above.
        nodes = scene.tree.get("nodes", [])
        for node in nodes:
            for child in node.get("children", []):
                if str(nodes[child].get("name", "=>")).startswith("=>"):
                    nodes[child]["name"] = node.get("name", "")
        parts, stated = scene.parts(np.eye(4)), _stated_unit(entities)
    if not parts:
        raise AssemblyError(f"Expected STEP with solids in {path}; it has none. Export solids, not surfaces or curves.")
    # Without a unit, OpenCASCADE takes lengths for millimetres.
    times = factor("m", stated or "mm")
    return Contents(tuple(replace(part, vertices=part.vertices * times) for part in parts), stated, separate=True)


def _converted(data: bytes, path: Path) -> bytes:
    """The facets, in metres, as GLB."""
    with tempfile.TemporaryDirectory(prefix="neurosym-step-") as folder:
        given, made = Path(folder, "given.step"), Path(folder, "made.glb")
        given.write_bytes(data)
        # -P: nothing is imported from the folder that the user happens to be in.
        options = map(str, (given, made, MAX_MEMORY, DEFLECTION, ANGLE))
        command = [sys.executable, "-P", "-c", _CONVERT, *options]
        try:
            left = subprocess.run(
                command, capture_output=True, timeout=MAX_SECONDS, cwd=folder, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired:
            raise AssemblyError(f"Expected STEP in {path} that is read in {MAX_SECONDS:g} s; it was not.") from None
        if left.returncode == 0 and made.exists() and made.stat().st_size:
            return made.read_bytes()
    raise AssemblyError(f"Expected STEP in {path}; OpenCASCADE cannot read it. Export it again (AP214 or AP242).")


def _with_product_names(data: bytes, entities: Entities) -> bytes:
    """The text with each use of a product in an assembly named after the product: OpenCASCADE keeps the use's name."""

    def named(use: re.Match[bytes]) -> bytes:
        before, after, definition = use.groups()
        name = _product_name(definition, entities)
        return use[0] if name is None else b"%s%s,%s%s" % (before, name, name, after)

    return _USE.sub(named, data)


def _product_name(definition: bytes, entities: Entities) -> bytes | None:
    """The quoted name, or else the id, of the product that a definition is of."""
    # A definition refers to its formation, and that to its product.
    number = definition
    for _ in range(3):
        kind, rest = entities.get(number, (b"", b""))
        if kind == b"PRODUCT":
            texts: list[bytes] = re.findall(_TEXT, rest)
            return next((text for text in reversed(texts[:2]) if text.strip(b"' ")), None)
        references = re.findall(rb"#(\d+)", re.sub(_TEXT, b"", rest))
        number = references[0] if references else b""
    return None


def _stated_unit(entities: Entities) -> str | None:
    """The unit of length that most contexts of shapes state, metres where it has no name; None: none states one."""
    stated: Counter[str] = Counter()
    for _, rest in entities.values():
        for assigned in re.findall(rb"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)", rest):
            for number in re.findall(rb"#(\d+)", assigned):
                if b"LENGTH_UNIT" in entities.get(number, (b"", b""))[1]:
                    length = _metres(number, entities)
                    stated[next((name for name, metres in METRES.items() if abs(metres / length - 1) < 1e-6), "m")] += 1
    return max(stated, key=lambda name: stated[name], default=None)


def _metres(number: bytes, entities: Entities, depth: int = 0) -> float:
    """How long a unit is, which may be so many of another one."""
    rest = entities.get(number, (b"", b""))[1]
    based = re.search(rb"CONVERSION_BASED_UNIT\s*\(\s*%s\s*,\s*#(\d+)" % _TEXT, rest)
    measure = re.search(rb"\(\s*([-+.\dE]+)\s*\)\s*,\s*#(\d+)", entities.get(based[1], (b"", b""))[1] if based else b"")
    if measure and depth < 3:
        return float(measure[1]) * _metres(measure[2], entities, depth + 1)
    prefix = re.search(rb"SI_UNIT\s*\(\s*\.(\w+)\.\s*,", rest)
    return _SI_PREFIXES.get(prefix[1], 1.0) if prefix else 1.0
