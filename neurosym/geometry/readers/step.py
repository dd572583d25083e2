"""STEP, tessellated by OpenCASCADE (the extra ``cad``). Lengths are metres, whatever the file's unit; z is up.

It runs in a process of its own, for a few lines of a bad STEP file can end a process, or keep it busy for ever.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

from neurosym.errors import AssemblyError, MissingDependencyError
from neurosym.geometry.readers.contents import Contents
from neurosym.geometry.readers.gltf import parse_gltf
from neurosym.geometry.readers.limits import read_bytes

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
    scene = cascadio.load(file.read(), use_parallel=False)
with open(sys.argv[2], "wb") as file:
    file.write(scene)
"""


def read_step(path: Path) -> Contents:
    """The solids of a file, a part each, named after their products.

    Raises:
        MissingDependencyError: cascadio is not installed.
        AssemblyError: the file holds no solids, or reading it failed.
    """
    if importlib.util.find_spec("cascadio") is None:
        raise MissingDependencyError(
            f"Expected cascadio, to read STEP ({path}); it is not installed. Run: pip install 'neurosym-assembly[cad]'."
        )
    data = read_bytes(path)
    with tempfile.TemporaryDirectory(prefix="neurosym-step-") as folder:
        given, made = Path(folder, "given.step"), Path(folder, "made.glb")
        given.write_bytes(data)
        # -P: nothing is imported from the folder that the user happens to be in.
        command = [sys.executable, "-P", "-c", _CONVERT, str(given), str(made), str(MAX_MEMORY)]
        try:
            left = subprocess.run(
                command, capture_output=True, timeout=MAX_SECONDS, cwd=folder, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired:
            raise AssemblyError(f"Expected STEP in {path} that is read in {MAX_SECONDS:g} s; it was not.") from None
        scene = made.read_bytes() if left.returncode == 0 and made.exists() else b""
    if not scene:
        raise AssemblyError(f"Expected STEP in {path}; OpenCASCADE cannot read it. Export it again (AP214 or AP242).")
    contents = parse_gltf(scene, path, up="z")
    if not contents.parts:
        raise AssemblyError(f"Expected STEP with solids in {path}; it has none. Export solids, not surfaces or curves.")
    return Contents(contents.parts, contents.units)
